"""An asteroid from the user's own orbit and body."""

import pickle

import astropy.units as u
import numpy as np
import pytest

import flybystab as fs
from flybystab.errors import InvalidInput, UnitMismatch, UnknownName
from flybystab.screening.draws import completed, draws

BODY = {"semi_axes": [200, 170, 150] * u.m, "density": 2000 * u.kg / u.m**3, "spin_period": 5 * u.h}


@pytest.fixture(scope="module")
def orbit():
    return fs.Asteroid.from_catalogue("Apophis").orbit


@pytest.fixture(scope="module")
def mine(orbit):
    return fs.Asteroid(
        orbit=orbit,
        body=fs.Body(**BODY, material=fs.Material(friction_angle=30 * u.deg)),
        pole=[100, -40] * u.deg,
        sigmas={"density": 300 * u.kg / u.m**3, "axes": 10 * u.m, "period": 6 * u.min},
        sources={"density": "own estimate"},
        name="mine",
    )


def test_values_come_back(mine, orbit):
    assert mine.orbit is orbit
    assert mine.name == "mine"
    assert mine.body.semi_axes.to_value(u.m) == pytest.approx([200, 170, 150])
    assert mine.body.spin_period.to_value(u.h) == pytest.approx(5.0)
    assert mine.body.material.friction_angle.to_value(u.deg) == pytest.approx(30.0)
    assert mine.sources == {"density": "own estimate"}
    assert mine.quantity("density_sigma_kg_m3").value == 300.0
    assert mine.quantity("spin_period_sigma_h").value == pytest.approx(0.1)
    # The pole against astropy's ecliptic of J2000, which has the obliquity of IAU 2006.
    from astropy.coordinates import SkyCoord

    axis = SkyCoord(100 * u.deg, -40 * u.deg, frame="barycentricmeanecliptic").icrs.cartesian.xyz.value
    assert mine.pole == pytest.approx(axis, abs=1e-5)


def test_the_elements_of_its_row_are_those_of_its_orbit(mine, orbit):
    """The row alone gives the same state."""
    again = fs.Asteroid(dict(mine.row), file="row").orbit
    assert again.position.to_value(u.m) == pytest.approx(orbit.position.to_value(u.m), rel=1e-11)
    assert again.velocity.to_value(u.m / u.s) == pytest.approx(orbit.velocity.to_value(u.m / u.s), rel=1e-11)


def test_copies_keep_the_orbit(mine, orbit):
    assert mine.with_material(fs.Material(friction_angle=20 * u.deg)).orbit is orbit
    other = pickle.loads(pickle.dumps(mine))
    assert np.array_equal(other.orbit.position, orbit.position)
    assert other.orbit.covariance is not None


def test_errors_are_sampled(mine):
    found = draws(mine, 4000, seed=1)
    assert np.std(found.rho) == pytest.approx(300.0, rel=0.05)
    assert np.std(found.period) == pytest.approx(360.0, rel=0.05)
    assert found.drawn == ()


def test_an_encounter_of_ones_own(mine):
    from astropy.time import Time

    encounter = fs.Encounter.from_orbit(mine, "earth", Time("2029-04-13", scale="tdb"))
    assert encounter.distance.to_value(u.km) == pytest.approx(38011.4, abs=1.0)
    assert str(fs.flyby(mine.body, encounter).verdict) == "INTACT"


def test_what_is_missing_is_named(orbit):
    bare = fs.Asteroid(orbit=orbit)
    with pytest.raises(InvalidInput, match=r"density_kg_m3, spin_period_h.*--assume"):
        _ = bare.body
    with pytest.raises(InvalidInput, match=r"--axes"):
        completed(bare)


def test_medians_of_the_population_are_called_that(orbit):
    row = dict(fs.Asteroid(orbit=orbit).row) | {"H_mag": "22.0"}
    whole = completed(fs.Asteroid(row, file="row"))
    assert "median of the population" in whole.assumptions[0]
    assert "density" in whole.assumptions[0]
    assert {"density_kg_m3", "spin_period_h", "semi_axis_a_m"} <= set(whole.assumed)
    assert whole.body.density.value == pytest.approx(2000.0, rel=0.05)


@pytest.mark.parametrize(
    ("changes", "error"),
    [
        ({"orbit": 1}, InvalidInput),
        ({"body": "sphere"}, InvalidInput),
        ({"pole": [10, 20]}, UnitMismatch),
        ({"pole": [10, 120] * u.deg}, InvalidInput),
        ({"sigmas": {"densty": 1 * u.kg / u.m**3}}, UnknownName),
        ({"sigmas": {"density": 1 * u.m}}, UnitMismatch),
        ({"sources": {"mass": "x"}}, UnknownName),
        ({"body": fs.Body(semi_axes=[3, 2, 1] * u.m, density=2000 * u.kg / u.m**3)}, InvalidInput),
    ],
)
def test_bad_values_are_refused(orbit, changes, error):
    with pytest.raises(error):
        fs.Asteroid(**({"orbit": orbit} | changes))
