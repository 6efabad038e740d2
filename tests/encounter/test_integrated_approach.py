"""Closest approaches by two integrators, and the error estimated from their difference."""

import astropy.units as u
import numpy as np
import pytest
from astropy.time import Time

from flybystab.catalogues.asteroid import Asteroid
from flybystab.constants import DAY
from flybystab.encounter.encounter import Encounter
from flybystab.encounter.integrated_approach import (
    approach_near,
    by_rebound,
    by_search,
    ends_of_encounter,
    independent_approach,
)
from flybystab.errors import NoEncounter, NotConverged
from flybystab.orbit.closest_approach import TIME
from flybystab.orbit.default_forces import default_forces
from flybystab.orbit.ephemeris import BODIES, ephemeris
from flybystab.orbit.epochs import seconds
from flybystab.orbit.forces import FORCES, model
from flybystab.orbit.ias15 import TIGHT, Flight
from flybystab.orbit.orbit import Orbit

CASES = [("Apophis", "2029-04-13"), ("2012 TC4", "2017-10-12"), ("2005 YU55", "2011-11-08")]


def located(name, day):
    """Orbit, window around the encounter and time of the epoch in it."""
    orbit, near = Asteroid.from_catalogue(name).orbit, Time(day, scale="tdb")
    epoch = seconds(orbit.epoch, near)
    window = ephemeris().window(near, min(epoch, -20.0 * DAY), max(epoch, 20.0 * DAY))
    return orbit, near, window


@pytest.mark.parametrize("error", [0.1, 1e4])
@pytest.mark.parametrize(("name", "day"), CASES)
def test_the_error_covers_the_difference_from_a_tight_integration(name, day, error):
    """With all forces and a hundredth of the tolerance, by rebound."""
    orbit, near, window = located(name, day)
    flat = model(window, FORCES, orbit.nongrav)
    truth = approach_near(
        orbit, window, BODIES.index("earth"), FORCES, 5.0 * DAY, lambda t, y: Flight(flat, t, y, TIGHT)
    )
    found = Encounter.from_orbit(orbit, "earth", near, error=error * u.km)
    off = abs(found.distance.to_value(u.m) - truth.distance)
    late = abs(seconds(found.time, near) - truth.t)
    assert off < found.distance_error.to_value(u.m) + 0.2
    assert late < found.time_error.to_value(u.s) + 2e-5
    assert (found.distance_error > 0.1 * u.km) == (error > 1.0)


@pytest.mark.parametrize(("name", "day"), CASES)
def test_both_integrators_have_the_same_approach(name, day):
    orbit, _, window = located(name, day)
    names, index = default_forces(orbit, *BODIES), BODIES.index("earth")
    one, other = (
        approach_near(orbit, window, index, names, 5.0 * DAY, fly)
        for fly in (by_rebound(orbit, window, names), by_search(orbit, window, names, 5.0 * DAY))
    )
    assert abs(one.distance - other.distance) < 5.0
    assert abs(one.t - other.t) < 1e-3
    assert one.distance != other.distance


def test_a_path_through_the_sun_is_left_to_rebound():
    """The integrator of the search gives up there."""
    near = Time("2029-04-13", scale="tdb")
    orbit = Orbit.from_state(near, [2e8, 1e5, 100.0] * u.km, [-7.0, 0.0, 0.0] * u.km / u.s)
    window = ephemeris().window(near, -110.0 * DAY, 110.0 * DAY)
    given = orbit, window, BODIES.index("earth"), default_forces(orbit, *BODIES), 100.0 * DAY
    with pytest.raises(NotConverged):
        approach_near(*given, by_search(*given[:2], *given[3:]))
    found = independent_approach(*given)
    truth = approach_near(*given, by_rebound(*given[:2], given[3]))
    assert abs(found.t - truth.t) < 10.0
    with pytest.raises(NoEncounter, match=r"1\.0054 au at the closest"):
        Encounter.from_orbit(orbit, "earth", near, search=100 * u.d)


def test_ends_of_an_encounter_do_not_depend_on_the_length_of_the_log():
    orbit, _, window = located("Apophis", "2029-04-13")
    names, index = default_forces(orbit, *BODIES), BODIES.index("earth")
    found = approach_near(orbit, window, index, names, 15.0 * DAY, by_rebound(orbit, window, names))
    near = np.abs(found.log[:, TIME] - found.t) < 10.0 * DAY
    assert 70 < near.sum() < len(found.log)  # more than are searched at first
    for level in (4e8, 4e9, 1e11):
        whole = ends_of_encounter(found.log, window, index, level, found.t)
        assert whole[0] < found.t < whole[1]
        if level < 1e10:  # of the crossings that are outside of the shorter log
            part = np.ascontiguousarray(found.log[near])
            assert ends_of_encounter(part, window, index, level, found.t) == whole
        else:
            assert whole[1] == found.log[-1, TIME]
