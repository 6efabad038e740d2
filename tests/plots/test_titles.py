"""Titles of figures whose results hold neither body nor planet; old files have none."""

import json

import astropy.units as u
import pytest

import flybystab as fs

BODY = fs.Body([700, 425, 375] * u.m, 2000 * u.kg / u.m**3, 6 * u.h)


def passage(radii=3.0):
    return fs.Encounter.hyperbolic("venus", radii * fs.R_earth, 5 * u.km / u.s)


RESULTS = {
    "critical": lambda: fs.critical(BODY, passage(), "density", phases=1, tolerance=0.1),
    "binary": lambda: fs.binary_flyby(BODY, passage(9.0), 4 * u.km, samples=4),
    "forecast": lambda: fs.spin_forecast(BODY, passage(), n=3),
    "sample": lambda: fs.spin_sample(BODY, passage(), n=3),
}


@pytest.mark.parametrize("name", RESULTS)
def test_the_title_names_planet_encounter_and_body(name, tmp_path):
    result = RESULTS[name]()
    title = result.plot().get_title()
    assert "Venus, periapsis " in title
    assert "v_inf 5 km/s" in title
    assert "1400 x 850 x 750 m" in title
    assert ("2000 kg/m3" in title) is (name != "critical")  # the density is what varies there
    again = type(result).read(result.save(tmp_path / "x.json"))
    assert again.subject == result.subject
    old = json.loads((tmp_path / "x.json").read_text())
    del old["meta"]["subject"]
    (tmp_path / "old.json").write_text(json.dumps(old))
    assert type(result).read(tmp_path / "old.json").subject == ""


def test_the_varied_periapsis_and_friction_angle_are_left_out_of_the_title():
    radii = fs.critical(BODY, passage(), "periapsis", phases=1, tolerance=0.1).plot().get_title()
    assert radii.startswith("Venus, v_inf 5 km/s")
    assert "periapsis" not in radii
    angle = fs.critical(BODY, passage(), "friction_angle", phases=1, tolerance=0.1).plot().get_title()
    assert "35 deg" not in angle


def test_an_asteroid_is_named_with_the_date_of_its_encounter():
    apophis = fs.Asteroid.from_catalogue("Apophis")
    encounter = fs.Encounter.from_orbit(apophis.orbit, "earth", "2029-04-13")
    title = fs.spin_sample(apophis, encounter, n=2).plot().get_title()
    assert title.startswith("Earth, 2029-04-13, 38,011 km\n(99942) Apophis\n2 attitudes")


def test_phases_without_a_sufficient_value_are_counted_in_the_title():
    near = fs.Encounter.hyperbolic("earth", 2.2 * fs.R_earth, 5 * u.km / u.s)
    found = fs.critical(BODY, near, "friction_angle", phases=4, tolerance=0.1, high=50 * u.deg)
    failing = int((found.value.value == float("inf")).sum())
    assert 0 < failing < 4
    assert f"no value of the range suffices at {failing} of 4 phases" in found.plot().get_title()
