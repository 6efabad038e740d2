"""Orbits that are used far from their epoch, in other frames, or that end in a planet."""

from pathlib import Path

import astropy.units as u
import numpy as np
import pytest
from astropy.time import Time
from reference import need_ephemeris

import flybystab as fs
from flybystab.catalogues.catalogue import catalogue
from flybystab.io.text import encounter_lines

FILES = Path(__file__).parent / "files"


def tdb(text):
    return Time(text, scale="tdb")


def test_a_massive_asteroid_is_not_its_own_perturber():
    """Right ascension and declination of Horizons, quoted in an issue of sorcha (1148)."""
    orbit = catalogue(FILES / "vesta.json")[0].orbit
    x, y, z = orbit.at(tdb("2025-05-15"), "earth")[0].to_value(u.km)
    assert np.degrees(np.arctan2(y, x)) % 360.0 == pytest.approx(219.87, abs=0.03)
    assert np.degrees(np.arctan2(z, np.hypot(x, y))) == pytest.approx(-3.87, abs=0.03)
    assert np.linalg.norm(orbit.at(tdb("2025-05-15"))[0].to_value(u.au)) == pytest.approx(2.172, abs=1e-3)


@pytest.fixture(scope="module")
def beyond():
    """The passages of 2023 BU before its deep one, from an orbit with its epoch after it, by start of the search."""
    need_ephemeris("de440")
    orbit = catalogue(FILES / "2023BU.ke1")[0].orbit
    return [
        fs.find_encounters(
            orbit, tdb(start), tdb("2020-12-01"), within=0.025 * u.au, growth=True, ephemeris="de440"
        )
        for start in ("2020-08-01", "2019-01-01", "1990-01-01", "1950-01-01")
    ]


def test_beyond_a_deep_passage_the_start_of_a_search_does_not_count(beyond):
    rows = [table[-1] for table in beyond]
    distances = [row["distance"].to_value(u.km) for row in rows]
    assert np.ptp(distances) < 5.0
    for row in rows:
        assert row["displacement"].to_value(u.km) == pytest.approx(73.2, abs=4.0)
        off = row["distance"].to_value(u.km) - 2993367.0  # JPL
        assert abs(off) < 2.0 * np.hypot(row["displacement"].value, row["model_error"].value)


def test_the_error_beyond_a_deep_passage_covers_another_ephemeris(beyond):
    orbit = catalogue(FILES / "2023BU.ke1")[0].orbit
    other = fs.find_encounters(
        orbit, tdb("2020-08-01"), tdb("2020-12-01"), within=0.025 * u.au, ephemeris="de421"
    )
    gap = abs((other["distance"][0] - beyond[0]["distance"][0]).to_value(u.km))
    assert 0.2 * gap < beyond[0]["model_error"][0].to_value(u.km) < 5.0 * gap
    encounter = fs.Encounter.from_orbit(orbit, "earth", tdb("2020-08-21"), ephemeris="de440")
    assert encounter.distance_error.to_value(u.km) == pytest.approx(
        beyond[0]["model_error"][0].value, rel=0.5
    )
    assert encounter.displacement.to_value(u.km) == pytest.approx(73.2, abs=1.0)
    assert encounter.distance.to_value(u.km) == pytest.approx(beyond[0]["distance"][0].value, abs=5.0)


def test_a_second_passage_on_the_far_side(beyond):
    """JPL: 2,645,439 km in 1968."""
    row = beyond[3][0]
    off = row["distance"].to_value(u.km) - 2645439.0
    assert abs(off) < 2.0 * np.hypot(row["displacement"].value, row["model_error"].value)
    assert row["displacement"].to_value(u.km) > 2000.0


def test_the_error_of_the_model_does_not_depend_on_the_span(beyond):
    errors = [table[-1]["model_error"].to_value(u.km) for table in beyond]
    assert max(errors) < 1.5 * min(errors)


def test_an_orbit_from_before_the_passage_agrees():
    orbit = catalogue(FILES / "2023BU_middle.ke1")[0].orbit
    row = fs.find_encounters(orbit, tdb("2020-08-01"), tdb("2020-12-01"), within=0.025 * u.au, growth=True)[0]
    assert row["displacement"].to_value(u.km) == pytest.approx(75.4, abs=0.5)
    assert row["distance"].to_value(u.km) == pytest.approx(2993432.0, abs=10.0)


def test_an_impact_has_time_and_place_of_its_entry():
    """2024 BX1 was seen west of Berlin at 00:32 to 00:33 UTC."""
    orbit = catalogue(FILES / "2024BX1.ke1")[0].orbit
    (row,) = fs.find_encounters(orbit, tdb("2024-01-01"), tdb("2024-02-01"), growth=True)
    assert row["impact"]
    entry = tdb(row["entry_time"])
    assert Time("2024-01-21T00:32") < entry.utc < Time("2024-01-21T00:33")
    assert np.linalg.norm(row["position"].to_value(u.km)) == pytest.approx(6478.137, abs=1e-3)
    assert row["distance"].to_value(u.km) == pytest.approx(777.6, abs=1.0)
    assert row["displacement"].to_value(u.km) < 5.0
    assert row["entry_latitude"].to_value(u.deg) == pytest.approx(52.6, abs=0.1)
    assert row["entry_longitude"].to_value(u.deg) == pytest.approx(12.4, abs=0.3)

    encounter = fs.Encounter.from_orbit(orbit, "earth", row["time"])
    assert abs((encounter.entry_time - entry).to_value(u.s)) < 0.1
    longitude, latitude = encounter.entry_place
    assert latitude.to_value(u.deg) == pytest.approx(row["entry_latitude"].value, abs=0.01)
    assert longitude.to_value(u.deg) == pytest.approx(row["entry_longitude"].value, abs=0.01)
    assert any("enters the atmosphere on 2024-01-21 00:33" in line for line in encounter_lines(encounter))


def test_a_bound_passage_is_called_bound():
    orbit = fs.Orbit.from_state(
        tdb("2027-03-01"), [2e5, 0, 0] * u.km, [0.3, 1.0, 0.0] * u.km / u.s, centre="earth"
    )
    encounter = fs.Encounter.from_orbit(orbit, "earth", tdb("2027-03-02"))
    assert encounter.bound
    assert "bound to the planet" in "\n".join(encounter_lines(encounter))
    assert "v_inf" not in "\n".join(encounter_lines(encounter))
