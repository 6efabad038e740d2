"""State transition matrices against two-body motion, differences of orbits, and the structure of the equations."""

from dataclasses import replace

import astropy.units as u
import numpy as np
import pytest
from astropy.time import Time
from reference import need_ephemeris

import flybystab as fs
from flybystab.constants import DAY, YEAR
from flybystab.errors import InvalidInput, NotConverged
from flybystab.orbit.covariance import NONGRAV_PARAMETERS
from flybystab.orbit.default_forces import default_forces
from flybystab.orbit.elements import GM_SUN
from flybystab.orbit.ephemeris import BODIES, SUN, ephemeris
from flybystab.orbit.epochs import seconds
from flybystab.orbit.forces import NonGravitational, model
from flybystab.orbit.ias15 import TIGHT, Flight
from flybystab.orbit.kepler import two_body
from flybystab.orbit.orbit import Orbit
from flybystab.orbit.state_transition import derivatives

EPOCH = Time("2027-01-01", scale="tdb")
AFTER = Time("2029-06-01", scale="tdb")


def apophis() -> Orbit:
    orbit = fs.Asteroid.from_catalogue("Apophis").orbit
    position, velocity = orbit.at(EPOCH)
    return replace(orbit, epoch=EPOCH, position=position, velocity=velocity)


def flown(orbit, window, t, change, law=None):
    """State at t s of the orbit with a changed state or law."""
    forces = {*default_forces(orbit, *BODIES), "non-gravitational"}
    its = model(window, forces, law or orbit.nongrav)
    return Flight(its, 0.0, orbit.barycentric(window) + change, TIGHT).to(t)


def units(orbit, window):
    """Heliocentric distance and speed at the epoch, each three times."""
    away = orbit.barycentric(window) - window.states(SUN, np.zeros(1))[0]
    return np.repeat([np.linalg.norm(away[:3]), np.linalg.norm(away[3:])], 3)


def test_two_body_motion_is_the_limit():
    """With the Sun alone and far fewer forces the matrix is that of Kepler's equation (universal variables)."""
    orbit = apophis()
    window = ephemeris(None).window(EPOCH, 0.0, YEAR)
    state, sun = orbit.barycentric(window), window.states(SUN, np.zeros(1))[0]
    # a Sun at rest: the difference of two paths about the moving one is that about a fixed one to 1e-3
    found, error = derivatives(
        model(window, ("sun point mass",)), orbit.nongrav.parameters, 0.0, state, sun, 30.0 * DAY
    )
    size = units(orbit, window)
    expected = np.empty((6, 6))
    for j in range(6):
        step = np.zeros(6)
        step[j] = 1e-5 * size[j]
        ahead, behind = (two_body(GM_SUN, state - sun + s * step, 30.0 * DAY) for s in (1.0, -1.0))
        expected[:, j] = (np.array(ahead) - behind) / (2.0 * step[j])
    scaled = size / size[:, None]
    assert np.abs((found[:, :6] - expected) * scaled).max() < 1e-5 * np.abs(expected * scaled).max()
    assert error < 1e-11


@pytest.mark.parametrize(("date", "growth"), [("2028-01-01", 1e1), ("2029-06-01", 1e4)])
def test_differences_of_orbits_give_the_same(date, growth):
    """Through the encounter of 2029, too, where deviations grow by 10,000."""
    need_ephemeris("de440")
    orbit, time = apophis(), Time(date, scale="tdb")
    found = orbit.state_transition(time)
    t = seconds(time, EPOCH)
    window = ephemeris(None).window(EPOCH, 0.0, t)
    size = units(orbit, window)
    scaled = size / size[:, None]
    expected = np.empty((6, 6))
    for j in range(6):
        step = np.zeros(6)
        step[j] = 1e-9 * size[j]  # truncation and rounding, each some 1e-7
        expected[:, j] = flown(orbit, window, t, step) - flown(orbit, window, t, -step)
        expected[:, j] /= 2.0 * step[j]
    largest = np.linalg.norm(expected * scaled)
    assert largest > growth
    assert np.linalg.norm((found.matrix - expected) * scaled) < 1e-6 * largest
    assert found.error < 1e-9


def test_transitions_compose_and_invert():
    orbit = apophis()
    middle = Time("2028-03-01", scale="tdb")
    position, velocity = orbit.at(middle)
    later = replace(orbit, epoch=middle, position=position, velocity=velocity)
    whole, first, second = (
        orbit.state_transition(Time("2029-01-01", scale="tdb")).matrix,
        orbit.state_transition(middle).matrix,
        later.state_transition(Time("2029-01-01", scale="tdb")).matrix,
    )
    # the position at the middle is rounded to 1e-4 m of 1e11 m
    assert np.linalg.norm(second @ first - whole) < 1e-9 * np.linalg.norm(whole)
    back = later.state_transition(EPOCH).matrix
    size = units(orbit, ephemeris(None).window(EPOCH, 0.0, DAY))
    assert np.abs((back @ first - np.eye(6)) * size / size[:, None]).max() < 1e-7
    assert np.linalg.det(first) == pytest.approx(1.0, abs=1e-6)
    assert np.array_equal(orbit.state_transition(EPOCH).matrix, np.eye(6))


def test_derivatives_by_parameters_are_differences_of_orbits():
    """A comet with all parameters: A1, A2, A3, DT and radiation pressure."""
    base = apophis()
    law = NonGravitational((3e-9, -5e-9, 2e-9), "comet", 40.0 * DAY, 0.3)
    orbit = replace(base, nongrav=law)
    time = Time("2028-06-01", scale="tdb")
    found = orbit.state_transition(time).parameters
    t = seconds(time, EPOCH)
    window = ephemeris(None).window(EPOCH, 0.0, t)
    values = np.array([*law.a, law.delay, law.area_to_mass])
    steps = np.array([1e-9, 1e-9, 1e-9, 0.1 * DAY, 0.2])
    for k, name in enumerate(NONGRAV_PARAMETERS):
        ends = []
        for side in (1.0, -1.0):
            a1, a2, a3, delay, area = values + side * steps[k] * (np.arange(5) == k)
            other = NonGravitational((a1, a2, a3), law.law, delay, area)
            ends.append(flown(orbit, window, t, np.zeros(6), other))
        expected = (ends[0] - ends[1]) / (2.0 * steps[k])
        assert np.linalg.norm(found[:3, k] - expected[:3]) < 1e-4 * np.linalg.norm(expected[:3]), name
        assert np.linalg.norm(found[3:, k] - expected[3:]) < 1e-4 * np.linalg.norm(expected[3:]), name


def test_covariance_at_another_time_is_that_of_sigma_points_and_clones():
    need_ephemeris("de440")
    orbit = fs.Asteroid.from_catalogue("Apophis").orbit
    time = Time("2027-01-01", scale="tdb")
    found = orbit.covariance_at(time)
    assert found.names[:6] == ("x", "y", "z", "vx", "vy", "vz")
    assert found.frame == "ICRF"
    pairs = orbit.sigma_points()
    ends = np.array([[_state(o, time) for o in pair] for pair in pairs])
    factor = 0.5 * (ends[:, 0] - ends[:, 1]).T
    sigma = np.sqrt(np.diag(factor @ factor.T))
    assert found.sigma[:6] == pytest.approx(sigma, rel=1e-4)
    assert found.values[:6] == pytest.approx(_state(orbit, time), rel=1e-9)


def _state(orbit, time):
    r, v = orbit.at(time)
    return np.concatenate([r.to_value(u.m), v.to_value(u.m / u.s)])


def test_an_orbit_without_covariance_has_none_later():
    with pytest.raises(InvalidInput, match="a Covariance"):
        replace(apophis(), covariance=None).covariance_at(AFTER)


@pytest.mark.parametrize(("days", "side"), [(100.0, "after"), (-20.0, "before")])
def test_a_fall_into_the_centre_of_the_sun_has_no_derivatives(days, side):
    orbit = apophis()
    window = ephemeris(None).window(EPOCH, -YEAR, YEAR)
    sun = window.states(SUN, np.zeros(1))[0]
    forces = model(window, ("sun point mass",))
    with pytest.raises(NotConverged, match=rf"to {abs(days):g} d {side} the epoch .* not finite"):
        derivatives(forces, orbit.nongrav.parameters, 0.0, sun + 1e10 * np.eye(6)[0], sun, days * DAY)


def test_a_state_out_of_range_ends_the_integration():
    window = ephemeris(None).window(EPOCH, 0.0, YEAR)
    state = apophis().barycentric(window)
    state[3] = 1e308
    flight = Flight(model(window, ("sun point mass",)), 0.0, state, TIGHT)
    with pytest.raises(NotConverged, match=r"to 1 d after the epoch .* out of range"):
        flight.to(DAY)
