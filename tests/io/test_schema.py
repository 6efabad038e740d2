"""Documents of the commands against the JSON schemas in the package."""

import copy
import json
from importlib import resources
from pathlib import Path

import jsonschema
import pytest

from flybystab.cli import COMMANDS
from flybystab.cli.main import main
from flybystab.errors import UnknownName
from flybystab.io.schema import NAMES, schema

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def document(capsys, *words):
    assert main([str(w) for w in words] + ["--json"]) == 0
    return json.loads(capsys.readouterr().out)


@pytest.mark.parametrize("name", NAMES)
def test_the_schemas_are_valid(name):
    jsonschema.Draft202012Validator.check_schema(schema(name))
    assert schema(schema(name)["properties"]["schema"]["const"]) == schema(name)


SPAN = ["--from", "2029-04-01", "--to", "2029-05-01"]
#: Documents of every command; OUT is a file in a temporary folder, TABLE a finished screening.
DOCUMENTS = [
    ["flyby", "Apophis", "--date", "2029-04-13", "--attitudes", "4"],
    ["flyby", "YORP", "--date", "2005-07-26", "--attitudes", "2"],
    [
        "report",
        "Apophis",
        "--date",
        "2029-04-13",
        "--attitudes",
        "2",
        "--samples",
        "2",
        "--output",
        "OUT.html",
    ],
    ["scenario", EXAMPLES / "disruption_p2.toml"],
    ["stability", "Toutatis"],
    ["stability", "1950 DA"],
    ["stability", "TWO", "--all"],
    ["encounters", "Apophis", *SPAN],
    ["impacts", "Apophis", "--from", "2029-01-01", "--to", "2030-01-01", "--orbits", "21"],
    ["ephemeris", "Apophis", "--from", "2029-04-12", "--to", "2029-04-14"],
    ["figure", "barrier", "Apophis", "--output", "OUT.png"],
    ["screen", "Apophis", "YORP", *SPAN, "--output", "OUT.ecsv"],
    ["show", "TABLE"],
    ["atlas", "TABLE", "--output", "OUT"],
    ["infer", "Apophis", *SPAN, "--attitudes", "2"],
    ["rates", "--limit", "15", "--planet", "earth"],
    ["rates", "--limit", "15", "--planet", "earth", "--planet", "mars", "--verdicts", "--samples", "16"],
    ["bench", "many"],
    ["cite"],
    ["completion", "bash"],
]


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("documents")
    table, two = folder / "table.ecsv", folder / "two.csv"
    assert main(["screen", "Apophis", *SPAN, "--output", str(table)]) == 0
    lines = files_of_package("asteroids.csv").splitlines()
    head = next(i for i, line in enumerate(lines) if not line.startswith("#"))
    two.write_text("\n".join(lines[: head + 3]) + "\n")
    return {"TABLE": str(table), "TWO": str(two)}


def files_of_package(name):
    return resources.files("flybystab.data").joinpath(name).read_text(encoding="utf-8")


def test_every_command_has_a_case():
    assert {words[0] for words in DOCUMENTS} == set(COMMANDS)


@pytest.mark.parametrize(
    "words", DOCUMENTS, ids=lambda w: " ".join(map(str, w[:2])).replace(str(EXAMPLES), "")
)
def test_documents_follow_their_schema(capsys, words, files, tmp_path):
    words = [files.get(w, str(w).replace("OUT", str(tmp_path / "x"))) for w in words]
    found = document(capsys, *words)
    jsonschema.validate(found, schema(found["schema"]), jsonschema.Draft202012Validator)


def test_a_screening_follows_its_schema(capsys, tmp_path):
    found = document(
        capsys,
        "screen",
        "Apophis",
        "YORP",
        "--from",
        "2029-04-01",
        "--to",
        "2029-05-01",
        "--output",
        tmp_path / "x.ecsv",
    )
    jsonschema.validate(found, schema("table/1"), jsonschema.Draft202012Validator)
    assert {"distance_km", "v_inf_km_s"} <= found["rows"][0].keys()  # as of encounters and flyby


@pytest.mark.parametrize(
    ("key", "value"),
    [("margin_deg", "-inf"), ("verdict", "FINE"), ("semi_axes_m", [1.0, 2.0]), ("schema", "flyby/2")],
)
def test_a_wrong_document_is_refused(capsys, key, value):
    found = document(capsys, "scenario", EXAMPLES / "disruption_p2.toml")
    for wrong in (found | {key: value}, {k: v for k, v in copy.deepcopy(found).items() if k != key}):
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(wrong, schema("flyby"), jsonschema.Draft202012Validator)


@pytest.mark.parametrize(
    "change", [{"rate_per_yr": -1.0}, {"rate_per_yr": "1e-8"}, {"planet": None}, {"verdicts": "INTACT"}]
)
def test_wrong_rates_are_refused(capsys, change):
    found = document(capsys, "rates", "--limit", "13", "--planet", "earth")
    found["rows"][0] |= change
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(found, schema("rates/1"), jsonschema.Draft202012Validator)


@pytest.mark.parametrize("name", ["fliby", "flyby/99", ""])
def test_no_such_schema(name):
    with pytest.raises(UnknownName):
        schema(name)
