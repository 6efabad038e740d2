"""The whole chain on real orbits: known encounters are found, at the known distances, with sane verdicts."""

import csv
import gzip
import io

import astropy.units as u
import numpy as np
import pytest
import reference

from flybystab.catalogues.catalogue import Asteroid, catalogue, key_of
from flybystab.screening.screening import Screening, screen
from flybystab.screening.settings import settings

SHARED = reference.SHARED / "data"


def test_apophis_2029():
    table = screen(["Apophis"], "2029-01-01", "2030-01-01", samples=20, seed=1)
    (row,) = table
    assert row["time_tdb"].startswith("2029-04-13T21:46:1")
    assert row["distance"].to_value(u.km) == pytest.approx(38011.5, abs=5)
    assert row["v_inf"].to_value(u.km / u.s) == pytest.approx(5.841, abs=0.002)
    assert row["verdict"] == "INTACT"
    assert row["decided_by"] == "dynamics"
    assert 20 < row["margin"].value < 30
    assert row["p_yield"] == 0
    assert row["orbit"] == "JPL 220"
    assert "earth J2" in row["forces"]
    assert "density" in row["assumed"]


def test_past_passages_are_followed_backwards():
    # Toutatis 2004: 1.549e6 km (JPL CAD). Duende (2012 DA14) on 2013-02-15: 34,050 km from the centre.
    table = screen(["Toutatis", "Duende"], "2004-01-01", "2013-06-01")
    toutatis = table[(table["asteroid"] == "Toutatis") & (table["distance"] < 0.02 * u.au)]
    assert toutatis["distance"].to_value(u.km) == pytest.approx([1.5496e6], rel=1e-3)
    duende = table[(table["asteroid"] == "Duende") & (table["distance"] < 0.001 * u.au)]
    assert duende["time_tdb"][0].startswith("2013-02-15T19:2")
    assert duende["distance"].to_value(u.km)[0] == pytest.approx(34050, rel=0.02)
    assert np.all(table["error"] == "")


@pytest.mark.skipif(not SHARED.is_dir(), reason="the source tables are not here")
def test_encounters_are_those_of_cneos():
    start, stop = 2461041.5, 2464693.5  # 2026 to 2036
    chosen = [a for a in catalogue() if a.row["pha"] == "Y"]
    names = {key_of(n): a.name for a in chosen for n in a.names}
    with gzip.open(SHARED / "cneos_earth_1950_2040_lt0.05au.csv.gz") as raw:
        rows = [r for r in csv.DictReader(io.TextIOWrapper(raw)) if key_of(r["des"]) in names]
    known = sorted(
        (names[key_of(r["des"])], float(r["jd_tdb_rounded_min"]), float(r["dist_au"]))
        for r in rows
        if start <= float(r["jd_tdb_rounded_min"]) < stop
    )
    run = Screening(chosen, settings("2026-01-01", "2036-01-01"))
    found = sorted(
        (r["asteroid"], r["jd_tdb"], r["distance"]) for _, result in run.results() for r in result["rows"]
    )
    assert [f[0] for f in found] == [k[0] for k in known]
    assert len(found) >= 9
    for f, k in zip(found, known, strict=True):
        assert f[1] == pytest.approx(k[1], abs=3e-3)  # rounded to minutes; a solution of 2021
        assert f[2] == pytest.approx(k[2], abs=3e-5)


def test_an_orbit_out_of_reach_is_a_row_that_says_so():
    row = dict(Asteroid.from_catalogue("Anteros").row) | {"number": "", "designation": "9999 ZZ", "name": ""}
    broken = Asteroid(row | {"e": "1.2"})
    table = screen([broken, "Apophis"], "2029-01-01", "2030-01-01")
    assert list(table["verdict"]) == ["", "INTACT"]
    assert table["error"][0].startswith("InvalidInput")
