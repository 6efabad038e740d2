"""``flybystab encounters``: the table for people, the document, the files."""

import json
from importlib import resources
from pathlib import Path

import astropy.units as u
import numpy as np
import pytest

from flybystab.cli.main import main
from flybystab.screening.results import read_results

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"

YEAR = ("--from", "2029-01-01", "--to", "2030-01-01")


def run(capsys, *words):
    status = main(["encounters", *map(str, words)])
    return status, *capsys.readouterr()


def test_document_has_units_in_its_keys(capsys):
    status, out, _ = run(capsys, "Apophis", *YEAR, "--json", "--clones", 60, "--seed", 2)
    assert status == 0
    document = json.loads(out)
    (row,) = document["rows"]
    assert np.hypot(row["b_t_km"], row["b_r_km"]) > row["distance_km"] == pytest.approx(38011.4, abs=1)
    assert row["predictability"] == "determined"
    assert row["displacement_km"] == pytest.approx(1.1, abs=0.3)
    assert row["distance_sigma_km"] == pytest.approx(1.1, rel=4 / np.sqrt(120))
    assert row["p_impact"] == 0.0
    assert row["p_impact_high"] == pytest.approx(1 - 0.025 ** (1 / 60))
    assert document["meta"]["covariances"] == ["JPL SBDB, solution 220 (99942.json)"]
    assert "1PN" in document["meta"]["forces"]
    again = json.loads(run(capsys, "Apophis", *YEAR, "--json", "--clones", 60, "--seed", 2)[1])
    assert again == document


def test_table_for_people(capsys):
    status, out, _ = run(capsys, "Apophis", *YEAR, "--planet", "earth", "--planet", "moon")
    assert status == 0
    assert "(99942) Apophis: 2 encounters" in out
    assert "determined" in out
    assert "one sigma in the direction least known" in out
    status, out, _ = run(capsys, "Eros", *YEAR)
    assert (status, out.strip()) == (0, "(433) Eros: 0 encounters within 0.05 au")


@pytest.mark.parametrize("ending", ["ecsv", "parquet"])
def test_files_keep_units_and_provenance(capsys, tmp_path, ending):
    if ending == "parquet":
        pytest.importorskip("pyarrow")
    path = tmp_path / f"found.{ending}"
    status, out, _ = run(capsys, "Apophis", *YEAR, "--output", path)
    assert status == 0
    assert str(path) in out
    table = read_results(path)
    assert table["distance"].to_value(u.km)[0] == pytest.approx(38011.4, abs=1)
    assert table["displacement"].unit == u.km
    assert table["predictability"][0] == "determined"
    assert table.meta["neighbours"]
    time = table["time"].isot[0] if ending == "ecsv" else table["time_tdb"][0]
    assert time.startswith("2029-04-13T21:46")
    assert ("position" in table.colnames) == (ending == "ecsv")
    assert ("position_x" in table.colnames) == (ending == "parquet")


def test_orbits_from_files(capsys, tmp_path):
    one = tmp_path / "apophis.json"
    one.write_text(resources.files("flybystab.data").joinpath("covariances", "99942.json").read_text())
    status, out, _ = run(capsys, one, *YEAR, "--clones", 5)
    assert status == 0
    assert "of 5 clones" in out
    many = tmp_path / "two.csv"
    many.write_text(
        "name,epoch_jd_tdb,a_au,e,i_deg,node_deg,peri_deg,M_deg\n"
        "A,2461000.5,.9223803173917017,.1911663355386932,3.340958441017069,203.8996515621043,126.6728325163065,"
        "312.8054663584516\nB,2461000.5,3,.1,1,2,3,4\n"
    )
    status, out, _ = run(capsys, many, *YEAR)
    assert status == 0
    assert "2 asteroids): 1 encounter within" in out
    status, _, err = run(capsys, "Toro", *YEAR, "--clones", -1)
    assert status == 2
    assert "--clones" in err
    single = tmp_path / "one.csv"
    single.write_text("\n".join(many.read_text().splitlines()[:2]) + "\n")
    status, _, err = run(capsys, single, *YEAR, "--clones", 5)
    assert status == 1
    assert "covariance" in err


def test_a_whole_catalogue(capsys, tmp_path):
    path = tmp_path / "found.ecsv"
    status, out, err = run(capsys, "--all", "--from", "2028-01-01", "--to", "2031-01-01", "--output", path)
    assert status == 0
    table = read_results(path)
    assert "embedded catalogue" in out
    assert f"): {len(table)} encounters" in out
    assert "determined" not in out  # neighbours are not followed
    assert f"{len(table)} encounters" in err  # the last line of progress
    (apophis,) = table[table["asteroid"] == "Apophis"]
    assert apophis["distance"].to_value(u.km) == pytest.approx(38011.4, abs=1)
    assert "growth" not in table.colnames


def test_what_was_not_asked_for(capsys):
    for words, says in (
        ((), "--all"),
        (("Eros", "--error", 0), "--error"),
        (("Eros", "--all", "--clones", 3), "--clones"),
    ):
        status, out, err = run(capsys, *words)
        assert (status, out) == (2, "")
        assert says in err


def test_many_encounters_are_cut_to_the_closest(capsys):
    status, out, _ = run(capsys, "--all", "--from", "2020-01-01", "--to", "2040-01-01", "--within", 0.2)
    assert status == 0
    lines = out.splitlines()
    assert lines[-1].startswith("the closest 100 of ")
    assert len(lines) == 103


def test_several_names_and_files(capsys, tmp_path):
    span = ["--from", "2029-01-01", "--to", "2030-01-01", "--json"]
    file = str(EXAMPLES / "2024YR4.ke1")
    assert main(["encounters", "Apophis", file, "YORP", *span]) == 0
    found = json.loads(capsys.readouterr().out)
    assert "Apophis" in {row["asteroid"] for row in found["rows"]}
    assert main(["encounters", "Apophis", "YORP", "--from", "2029-01-01", "--to", "2030-01-01"]) == 0
    assert capsys.readouterr().out.startswith("Apophis, YORP (2 asteroids): ")


def test_an_asteroid_of_a_catalogue_file(capsys):
    file = str(EXAMPLES / "2024YR4.ke1")
    span = ["--from", "2032-12-01", "--to", "2033-01-01", "--planet", "moon", "--planet", "earth"]
    assert main(["encounters", "2024 YR4", "--catalogue", file, *span, "--json"]) == 0
    alone = json.loads(capsys.readouterr().out)["rows"]
    assert main(["encounters", file, *span, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["rows"] == alone
    assert len(alone) >= 1
    assert main(["encounters", "Apophis", "--catalogue", file, *span]) == 1
    assert "unknown asteroid 'Apophis'" in capsys.readouterr().err
    assert main(["encounters", "--all", "--catalogue", file, *span]) == 0
    assert "determined" not in capsys.readouterr().out
