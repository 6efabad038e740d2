"""What an object says of itself fits on a line and names what matters."""

import astropy.units as u
import numpy as np
import pytest
from astropy.time import Time

import flybystab as fs
from flybystab.body.bounds import requirements
from flybystab.flybys.rigid_course import rigid_course


@pytest.fixture(scope="module")
def things():
    pile = fs.Body([1400, 850, 750] * u.m, 2 * u.g / u.cm**3, spin_period=6 * u.h)
    light = fs.Body([1400, 850, 750] * u.m, 100 * u.kg / u.m**3, spin=[0, 0, 1e-3] * u.rad / u.s)
    passage = fs.Encounter.hyperbolic("earth", 2.0 * fs.R_earth, 5 * u.km / u.s)
    apophis = fs.Asteroid.from_catalogue("Apophis")
    real = fs.Encounter.from_orbit(apophis.orbit, "earth", Time("2029-04-13", scale="tdb"))
    clones = fs.encounter_distribution(apophis, "earth", Time("2029-04-13", scale="tdb"), n=4)
    result = fs.flyby(pile, passage, surfaces="drucker-prager")
    return {
        "Material": fs.Material(30 * u.deg, 20 * u.Pa, 0.5, brittle=True, bulk_modulus=3 * u.kPa),
        "Body": pile,
        "Encounter": passage,
        "real": real,
        "FlybyResult": result,
        "FlybyError": result.error,
        "History": result.history,
        "FlybyTable": fs.flyby_many([pile, pile], [passage, passage]),
        "Orbit": apophis.orbit,
        "Covariance": apophis.orbit.covariance,
        "Stability": fs.stability(pile),
        "Equilibrium": fs.equilibrium(pile),
        "tension": fs.equilibrium(light),
        "Requirements": requirements(light, samples=10),
        "SpinSample": fs.spin_sample(apophis, real, n=4),
        "FlybyMargin": fs.flyby_margin(pile, passage),
        "Course": rigid_course(pile, passage),
        "SlopeChange": fs.surface_change(pile, passage),
        "EncounterDistribution": clones,
        "Survival": fs.survival(apophis, clones),
        "Planet": passage.planet,
    }


def test_each_is_one_short_line(things):
    for name, thing in things.items():
        text = repr(thing)
        assert len(text) < 160, text
        assert "\n" not in text
        assert str(thing) == text
        if name[0].isupper():
            assert text.startswith(f"<{name} "), text
            assert text.endswith(">"), text


def test_they_name_what_matters(things):
    for name, words in {
        "Material": ["mohr-coulomb", "30 deg", "20 Pa", "dilatancy 0.5", "brittle", "3 kPa"],
        "Body": ["1400 x 850 x 750 m", "2 g/cm3", "6 h", "35 deg"],
        "Encounter": ["earth", "scripted", "2 radii", "5 km/s"],
        "real": ["2029-04-13 21:46 TDB", "38011 km"],
        "FlybyResult": [
            str(things["FlybyResult"].verdict),
            "35 deg" if np.isfinite(things["FlybyResult"].max_required_friction_angle) else "no friction",
            "yield surface" if not things["FlybyResult"].robust else "robust",
        ],
        "FlybyTable": ["2 rows", f"2 {things['FlybyResult'].verdict}"],
        "Orbit": ["Apophis", "AU from sun", "with covariance"],
        "Stability": ["stable to infinitesimal perturbations"],
        "Equilibrium": ["admissible", "deg"],
        "tension": ["not admissible", "no friction suffices", "tension"],
        "Requirements": ["10 samples", "probability 1"],
        "Planet": ["earth", "6378 km"],
    }.items():
        for word in words:
            assert word in repr(things[name]), (word, repr(things[name]))


def test_one_surface_may_be_given_by_its_name(things):
    """Not read as a sequence of letters."""
    assert set(things["FlybyResult"].verdict_by_surface) == {"drucker-prager", "mohr-coulomb"}
    with pytest.raises(fs.FlybystabError, match="surfaces = mohr:"):
        fs.flyby(things["Body"], things["Encounter"], surfaces="mohr")
