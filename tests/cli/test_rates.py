"""``flybystab rates``: the document says what `encounter_rates` and `disruption_rates` compute."""

import json

import astropy.units as u
import pytest

import flybystab as fs
from flybystab.cli.main import main


def document(capsys, *words):
    assert main(["rates", *words, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def test_rates_of_the_known_asteroids(capsys):
    out = document(capsys, "--planet", "venus", "--within", "0.05")
    (row,) = out["rows"]
    rates = fs.encounter_rates(fs.known_population(), "venus", 0.05 * u.au)
    assert row["rate_per_yr"] == pytest.approx(rates.total.value, rel=1e-12)
    assert out["orbits"] == 875
    assert main(["rates", "--planet", "venus", "--within", "0.05"]) == 0
    assert "one in" in capsys.readouterr().out


def test_a_model_population_from_a_table(capsys, tmp_path):
    path = tmp_path / "model.csv"
    path.write_text("a,e,i,H\n1.3,0.4,10,18\n3.0,0.1,5,19\n")
    out = document(capsys, str(path), "--planet", "earth")
    assert out["orbits"] == 2
    assert out["rows"][0]["orbits_that_meet"] == 1
    verdicts = document(capsys, str(path), "--planet", "earth", "--verdicts", "--samples", "8")
    total = sum(r["rate_per_yr"] for r in verdicts["rows"])
    near = fs.encounter_rates(_table(), "earth", 5 * _radius()).total
    assert total == pytest.approx(near.value, rel=1e-9)


def _table():
    from astropy.table import QTable

    return QTable({"a": [1.3, 3.0], "e": [0.4, 0.1], "i": [10.0, 5.0]})


def _radius():
    return fs.encounter_rates(_table(), "earth").planet.radius * u.m


def test_no_encounter_is_null(capsys, tmp_path):
    path = tmp_path / "far.csv"
    path.write_text("a,e,i\n3.0,0.1,5\n")
    (row,) = document(capsys, str(path), "--planet", "earth")["rows"]
    assert row["rate_per_yr"] == 0.0
    assert row["v_inf_km_s"] is None


def test_a_missing_file_is_named(capsys):
    assert main(["rates", "nowhere.csv"]) == 1
    assert "nowhere.csv" in capsys.readouterr().err


def test_samples_and_figure_are_written(capsys, tmp_path):
    from astropy.table import QTable

    path, table, figure = tmp_path / "model.csv", tmp_path / "samples.ecsv", tmp_path / "rates.png"
    path.write_text("18,1.3,0.4,10\n19,2.0,0.6,5\n")
    words = (
        str(path),
        "--columns",
        "H,a,e,i",
        "--planet",
        "earth",
        "--verdicts",
        "--samples",
        "16",
        "--diameter",
        "H",
    )
    out = document(capsys, *words, "--output", str(table))
    assert len(QTable.read(table)) == 16
    assert {r["planet"] for r in out["rows"]} == {"earth"}
    assert not (tmp_path / "samples.ecsv.journal").exists()
    cells = tmp_path / "samples.csv"
    document(capsys, *words, "--output", str(cells))
    head, *rows = cells.read_text().splitlines()
    assert len(rows) == 16
    assert {"fragment_fractions_1", "fragment_fractions_12"} <= set(head.split(","))
    document(capsys, *words, "--output", str(figure))
    assert figure.read_bytes()[:4] == b"\x89PNG"


def test_a_law_is_read_and_options_that_need_verdicts_say_so(capsys, tmp_path):
    law = tmp_path / "law.toml"
    law.write_text(
        "count = 10\n"
        'a = {kind = "fixed", value = 1.3}\n'
        'e = {kind = "fixed", value = 0.4}\n'
        'i = {kind = "fixed", value = 10}'
    )
    (row,) = document(capsys, str(law), "--planet", "earth")["rows"]
    assert row["rate_per_yr"] == pytest.approx(
        10 * fs.encounter_rates(_table()[:1], "earth").total.value, rel=1e-12
    )
    assert main(["rates", str(law), "--output", "x.png"]) == 1
    assert "--verdicts" in capsys.readouterr().err
    assert main(["rates", str(law), "--verdicts", "--diameter", "big"]) == 1
    assert "number of km" in capsys.readouterr().err
