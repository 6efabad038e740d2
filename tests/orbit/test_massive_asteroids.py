"""A massive asteroid does not pull itself; a barycentric state belongs to its ephemeris."""

import astropy.units as u
import numpy as np
import pytest
from astropy.time import Time
from reference import need_ephemeris

import flybystab as fs
from flybystab.constants import DAY
from flybystab.errors import InaccurateOrbit
from flybystab.orbit.default_forces import without_itself
from flybystab.orbit.ephemeris import BELT, N_BODIES
from flybystab.orbit.epochs import later
from flybystab.orbit.orbit import Orbit
from flybystab.orbit.search.encounter_finder import find_encounters

EPOCH = Time(2460000.5, format="jd", scale="tdb")


def itself(name, moved=2e7):
    """The orbit of a massive asteroid from the table, `moved` m beside it as elements of another source are."""
    window = need_ephemeris("de421").window(EPOCH, -DAY, DAY)
    state = window.states(N_BODIES + BELT.index(name), np.zeros(1))[0] - window.states(0, np.zeros(1))[0]
    return Orbit.from_state(
        EPOCH, (state[:3] + moved * np.array([0.0, 1.0, 0.0])) * u.m, state[3:] * u.m / u.s, name=name
    )


@pytest.mark.parametrize("name", ["ceres", "pallas", "vesta"])
def test_the_orbit_stays_with_its_table(name):
    """Two years on: within 1e6 km of its table, whose velocity is that of a coarse fit, by both integrators."""
    orbit, end = itself(name), later(EPOCH, 700 * DAY)
    window = need_ephemeris("de421").window(end, -DAY, DAY)
    table = window.states(N_BODIES + BELT.index(name), np.zeros(1))[0] - window.states(0, np.zeros(1))[0]
    place, _ = orbit.at(end, ephemeris="de421")
    assert np.linalg.norm(place.to_value(u.m) - table[:3]) < 1e9
    found = find_encounters(orbit, EPOCH, end, within=5 * u.au, ephemeris="de421")
    other = fs.Asteroid.from_catalogue("Eros").orbit
    several = find_encounters([other, orbit, other], EPOCH, end, within=5 * u.au, ephemeris="de421")
    assert len(found) > 0
    mine = several[several["index"] == 1]
    assert np.array_equal(mine["distance"], found["distance"])
    for row in found:
        place, _ = orbit.at(row["time"], "earth", "de421")
        assert np.linalg.norm((place - row["position"]).to_value(u.km)) < 1.0
    assert not several.meta["failed"]


def test_others_feel_all_of_them():
    window = need_ephemeris("de421").window(EPOCH, -DAY, DAY)
    names = [f"{name} point mass" for name in BELT]
    assert without_itself(names, itself("vesta"), window) == tuple(
        n for n in names if n != "vesta point mass"
    )
    assert without_itself(names, itself("vesta", 1e9), window) == tuple(names)


@pytest.mark.parametrize("name", ["de421", "de440"])
def test_a_barycentric_state_is_not_called_inaccurate(recwarn, name):
    """It is converted to the barycentre of the ephemeris in use (``test_barycentre.py``)."""
    need_ephemeris(name)
    orbit = Orbit.from_state(EPOCH, [1.1, 0.3, 0.0] * u.au, [-5.0, 25.0, 3.0] * u.km / u.s, centre="ssb")
    orbit.at(later(EPOCH, DAY), ephemeris=name)
    find_encounters(orbit, EPOCH, later(EPOCH, 10 * DAY), ephemeris=name)
    assert not [w for w in recwarn if w.category is InaccurateOrbit]
