"""The recorded integration by RKN12(10) against that by rebound."""

import numpy as np
import pytest
from astropy.time import Time
from reference import need_ephemeris

from flybystab.catalogues.asteroid import Asteroid
from flybystab.constants import DAY
from flybystab.errors import NotConverged
from flybystab.orbit.closest_approach import TIME, between
from flybystab.orbit.default_forces import default_forces
from flybystab.orbit.ephemeris import BODIES
from flybystab.orbit.search.acceleration import field
from flybystab.orbit.search.flight import SearchFlight

EPOCH = Time(2461000.5, format="jd", scale="tdb")


@pytest.fixture(scope="module")
def motion():
    """Window, forces and start of Apophis, and its integration by rebound."""
    orbit = Asteroid.from_catalogue("Apophis").orbit
    window = need_ephemeris("de421").window(orbit.epoch, -900.0 * DAY, 900.0 * DAY)
    names = default_forces(orbit, *BODIES)
    acting = field(window, [n for n in names if n != "non-gravitational"])
    return window, (acting, orbit.nongrav.parameters), orbit.barycentric(window), orbit.flight(window, names)


@pytest.mark.parametrize("days", [800.0, -800.0])
def test_two_integrators_agree(motion, days):
    _, forces, start, _ = motion
    orbit = Asteroid.from_catalogue("Apophis").orbit
    rebound = orbit.flight(motion[0], default_forces(orbit, *BODIES)).to(days * DAY)
    ours = SearchFlight(*forces, 0.0, start, 1e-14)
    log = ours.log_to(days * DAY)
    assert np.linalg.norm(ours.state[:3] - rebound[:3]) < 0.1
    np.testing.assert_array_equal(log[0, 1:7], start)
    assert log[-1, TIME] == ours.t == days * DAY
    assert (np.diff(log[:, TIME]) * days > 0.0).all()


def test_rows_of_a_log_belong_together(motion):
    """Position, velocity and acceleration of the rows: the quintic through two of them meets a third one."""
    _, forces, start, _ = motion
    fine = SearchFlight(*forces, 0.0, start, 1e-14, (10.0 * DAY, 50.0 * DAY)).log_to(80.0 * DAY)
    steps, begin = np.diff(fine[:, TIME]), fine[:-1, TIME]
    inside = (begin >= 10.0 * DAY) & (begin <= 50.0 * DAY)
    assert steps[inside].max() <= 2.0 * DAY < steps[~inside].max()
    out = np.empty(6)
    some = np.flatnonzero(inside)[3:18:3]
    for k in some:
        between(fine[[k - 1, k + 1]], 0, fine[k, TIME], out)
        assert np.linalg.norm(out[:3] - fine[k, 1:4]) < 100.0  # without the acceleration 1e8
        assert np.linalg.norm(out[3:] - fine[k, 4:7]) < 0.01


def test_a_short_log_is_made_longer(motion):
    _, forces, start, _ = motion
    logs = [SearchFlight(*forces, 0.0, start, 1e-14).log_to(400.0 * DAY, rows) for rows in (2, 1024)]
    np.testing.assert_array_equal(*logs)


def test_an_integration_that_continues_starts_at_its_end(motion):
    _, forces, start, _ = motion
    flight = SearchFlight(*forces, 0.0, start, 1e-14)
    first = flight.log_to(100.0 * DAY)
    second = flight.log_to(200.0 * DAY)
    np.testing.assert_array_equal(first[-1, :7], second[0, :7])
    np.testing.assert_array_equal(flight.to(200.0 * DAY), second[-1, 1:7])
    whole = SearchFlight(*forces, 0.0, start, 1e-14).to(200.0 * DAY)
    assert np.linalg.norm(flight.state[:3] - whole[:3]) < 0.01


def test_a_state_that_is_not_finite_is_an_error(motion):
    _, forces, start, _ = motion
    with pytest.raises(NotConverged, match="not finite"):
        SearchFlight(*forces, 0.0, start * np.nan, 1e-14).to(DAY)
