"""Documents of the commands against the JSON schemas in the package."""

import copy
import json
from pathlib import Path

import jsonschema
import pytest

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


@pytest.mark.parametrize(
    "words",
    [
        ["flyby", "Apophis", "--date", "2029-04-13", "--attitudes", "4"],
        ["flyby", "YORP", "--date", "2005-07-26", "--attitudes", "2"],
        ["scenario", EXAMPLES / "disruption_p2.toml"],
        ["stability", "Toutatis"],
        ["stability", "1950 DA"],
        ["encounters", "Apophis", "--from", "2029-01-01", "--to", "2030-01-01"],
    ],
    ids=lambda w: " ".join(map(str, w[:2])).replace(str(EXAMPLES), ""),
)
def test_documents_follow_their_schema(capsys, words):
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


@pytest.mark.parametrize("name", ["fliby", "flyby/99", ""])
def test_no_such_schema(name):
    with pytest.raises(UnknownName):
        schema(name)
