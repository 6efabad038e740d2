"""Steps of the search: errors that follow the tolerance, and orbits that return."""

import astropy.units as u
import numpy as np
import pytest

import flybystab as fs
from flybystab.constants import YEAR
from flybystab.orbit.default_forces import default_forces
from flybystab.orbit.ephemeris import ephemeris
from flybystab.orbit.search.acceleration import field
from flybystab.orbit.search.neighbours import carry
from flybystab.orbit.search.steps import empty_room

SPAN = 15.0 * YEAR


@pytest.fixture(scope="module", params=["Apophis", "Phaethon", "Eros"])
def motion(request):
    """A function that gives the state (m, m/s) after `t` s from a state at `t0`, at a tolerance."""
    orbit = fs.Asteroid.from_catalogue(request.param).orbit
    window = ephemeris().window(orbit.epoch, -1.0, SPAN + 1.0)
    forces = field(window, [name for name in default_forces(orbit) if name != "non-gravitational"])

    def after(t0, state, t, tolerance):
        out = np.empty((1, 6))
        assert carry(forces, orbit.nongrav.parameters, t0, state, np.array([t]), tolerance, empty_room(), out)
        return out[0]

    return orbit.barycentric(window), after


def test_the_error_follows_the_tolerance(motion):
    """The position after 15 years, through the encounter of Apophis in 2029, which amplifies errors."""
    start, after = motion
    best = after(0.0, start, SPAN, 1e-14)
    # Errors of single runs scatter by a factor of a few, since those of the steps have either sign.
    errors = [
        np.exp(
            np.mean(
                [
                    np.log(np.linalg.norm((after(0.0, start, SPAN, factor * tol) - best)[:3]))
                    for factor in np.geomspace(0.5, 2.0, 9)
                ]
            )
        )
        for tol in (1e-8, 1e-10, 1e-12)
    ]
    assert errors[0] > 5.0 * errors[1] > 25.0 * errors[2]
    assert errors[2] < 1e5


def test_an_orbit_returns(motion):
    start, after = motion
    there = after(0.0, start, 0.2 * SPAN, 1e-14)
    assert np.linalg.norm((there - start)[:3]) > 1e9
    assert np.linalg.norm((after(0.2 * SPAN, there, 0.0, 1e-14) - start)[:3]) < 0.5


def test_tolerances_below_the_rounding_error_are_raised():
    table = fs.find_encounters(
        fs.Asteroid.from_catalogue("Apophis"), "2029-04-01", "2029-05-01", within=0.01 * u.au, tolerance=1e-16
    )
    assert table.meta["tolerance"] == 1e-14
    assert len(table) == 1
