"""Tables of the commands as CSV."""

import csv
import json

import astropy.units as u
import pytest

from flybystab.cli.main import main
from flybystab.screening.results import Column, read_results
from flybystab.screening.table_files import write_rows


def rows_of(path):
    with path.open(newline="") as stream:
        return list(csv.DictReader(stream))


def test_encounters(capsys, tmp_path):
    path = tmp_path / "found.csv"
    words = ["encounters", "Apophis", "--from", "2029-01-01", "--to", "2030-01-01"]
    assert main([*words, "--output", str(path), "--json"]) == 0
    (found,) = json.loads(capsys.readouterr().out)["rows"]
    (row,) = rows_of(path)
    for key in ("distance_km", "v_inf_km_s"):
        assert float(row[key]) == found[key]
    assert row["time_tdb"].startswith("2029-04-13T21:46")
    assert row["planet"] == "earth"


def test_a_screening_as_csv(capsys, tmp_path):
    table = tmp_path / "s.ecsv"
    words = ["screen", "Apophis", "--from", "2029-04-01", "--to", "2029-05-01", "--output", str(table)]
    assert main([*words, "--json"]) == 0
    (shown,) = json.loads(capsys.readouterr().out)["rows"]
    assert main(["show", str(table), "--output", str(tmp_path / "s.csv")]) == 0
    (row,) = rows_of(tmp_path / "s.csv")
    found = read_results(table)
    for given in (float(row["distance_km"]), shown["distance_km"]):
        assert given == pytest.approx(found["distance"][0].to_value(u.km), rel=1e-15)
    assert row["verdict"] == found["verdict"][0]
    assert len(row) == len(found.colnames)
    assert main([*words[:-1], str(tmp_path / "x.csv")]) == 2
    assert "ends in .ecsv or .parquet" in capsys.readouterr().err


@pytest.mark.parametrize("text", ["=1+1", "+1", "-1", "@x", 'a,"b"', "two\nlines", "plain"])
def test_cells_that_look_like_formulas_are_quoted(tmp_path, text):
    path = tmp_path / "x.csv"
    columns = {"asteroid": Column(str, None, ""), "distance": Column(float, u.km, "")}
    write_rows([{"asteroid": text, "distance": -1.5}], path, columns, {})
    assert rows_of(path) == [{"asteroid": text, "distance_km": "-1.5"}]
    assert ('"' in path.read_text()) == (text != "plain")
