"""Step-size control of IAS15, its error, and paths that end at a body."""

import csv
import gzip

import astropy.units as u
import numpy as np
import pytest
from astropy.time import Time
from reference import need_ephemeris, sbdb_orbit

from flybystab.catalogues.asteroid import Asteroid
from flybystab.constants import DAY
from flybystab.encounter.encounter import Encounter
from flybystab.errors import Impact, InaccurateOrbit
from flybystab.orbit.barycentre import barycentre_in
from flybystab.orbit.ephemeris import BELT, BODIES, body_state
from flybystab.orbit.epochs import later
from flybystab.orbit.forces import acceleration, model, with_law
from flybystab.orbit.ias15 import TIGHT
from flybystab.orbit.nongravitational import NonGravitational
from flybystab.orbit.orbit import Orbit
from flybystab.orbit.search.encounter_finder import find_encounters

EPOCH = Time(2458849.5, format="jd", scale="tdb")


def passing(index, distance, speed, days):
    """An orbit `days` before it passes body number `index` at `distance` (m) and `speed` (m/s)."""
    window = need_ephemeris("de421").window(EPOCH, -days * DAY, days * DAY)
    state = np.empty(6)
    body_state(window.head, window.data, window.gm, index, 0.0, state)
    away, along = np.array([0.0, 0.0, 1.0]), state[3:] / np.linalg.norm(state[3:])
    state += np.concatenate([distance * away, speed * along])
    there = Orbit.from_state(EPOCH, state[:3] * u.m, state[3:] * u.m / u.s, "ssb", barycentre="de421")
    # A step short enough to resolve the passage from the start.
    flight = there.flight(window, epsilon=1e-13)
    before = flight.to(-days * DAY)
    after = there.flight(window, epsilon=1e-13).to(days * DAY)
    epoch = later(EPOCH, -days * DAY)
    return Orbit.from_state(epoch, before[:3] * u.m, before[3:] * u.m / u.s, "ssb", barycentre="de421"), after


@pytest.mark.parametrize(
    ("name", "distance"), [("ceres", 2e7), ("pallas", 1e7), ("mercury", 1e7), ("moon", 5e6), ("earth", 5e7)]
)
def test_a_passage_is_not_stepped_over(name, distance):
    """A default step of rebound, chosen before a passage of minutes to hours, skips it and loses the deflection."""
    orbit, after = passing((*BODIES, *BELT).index(name), distance, 12e3, 400.0)
    window = need_ephemeris("de421").window(orbit.epoch, 0.0, 800.0 * DAY)
    assert np.linalg.norm(orbit.flight(window).to(800.0 * DAY)[:3] - after[:3]) < 1e3
    r, _ = orbit.at(later(orbit.epoch, 800.0 * DAY), "ssb", "de421")
    r = r.to_value(u.m) + barycentre_in(window, np.array([800.0 * DAY]))[0, :3]
    assert np.linalg.norm(r - after[:3]) < 100.0


@pytest.fixture(scope="module")
def known(shared):
    out = {}
    with gzip.open(shared / "nea_sbdb_fullprec_2020-09.csv.gz", "rt") as file:
        for row in csv.DictReader(file):
            if row["pdes"] in ("2014 TT35", "2017 UP7", "2013 VY13"):
                out[row["pdes"]] = sbdb_orbit(row)
    return out


@pytest.mark.parametrize("name", ["2014 TT35", "2017 UP7"])
def test_the_way_of_the_search_is_that_of_at(known, name):
    """Independent integrators (IAS15 of rebound, DOP853 of the search) through the Earth's passages of ten years."""
    need_ephemeris("de440")
    orbit = known[name]
    table = find_encounters(
        orbit,
        orbit.epoch,
        later(orbit.epoch, 3652.0 * DAY),
        within=0.3 * u.au,
        ephemeris="de440",
        tolerance=1e-14,
        error=1 * u.m,
    )
    assert len(table) >= 1
    for row in table:
        r, _ = orbit.at(row["time"], "earth", "de440")
        assert np.linalg.norm((r - row["position"]).to_value(u.km)) < 1.0


def test_a_large_numerical_error_is_reported(known):
    """2013 VY13 returns to the Earth again and again: rounding alone moves it by tens of km within ten years."""
    need_ephemeris("de440")
    orbit = known["2013 VY13"]
    with pytest.warns(InaccurateOrbit, match="differ by"):
        orbit.at(later(orbit.epoch, 3652.5 * DAY), "sun", "de440")


def test_a_fall_into_the_sun_has_no_state_beyond():
    need_ephemeris("de421")
    rest = Orbit.from_state(EPOCH, [1.0, 0.0, 0.0] * u.au, [0.0, 0.5, 0.0] * u.km / u.s)
    # Free fall from 1 au takes pi/2 sqrt(r^3 / 2 GM) = 64.6 d.
    r, _ = rest.at(later(EPOCH, 60.0 * DAY), ephemeris="de421")
    assert np.linalg.norm(r.to_value(u.au)) < 0.3
    with pytest.raises(Impact, match="hits sun at 2020-03-0"):
        rest.at(later(EPOCH, 80.0 * DAY), ephemeris="de421")


def test_a_longer_log_keeps_the_tolerance():
    window = need_ephemeris("de421").window(EPOCH, 0.0, 300.0 * DAY)
    orbit = Orbit.from_state(EPOCH, [1.2, 0.1, 0.0] * u.au, [0.0, 25.0, 3.0] * u.km / u.s)
    whole = orbit.flight(window, epsilon=TIGHT).log_to(300.0 * DAY)
    again = orbit.flight(window, epsilon=TIGHT).log_to(300.0 * DAY, rows=8)
    assert len(whole) > 8
    assert np.array_equal(whole, again)


def test_the_length_of_a_search_does_not_move_the_encounter(apophis):
    need_ephemeris("de440")
    near = Time("2029-04-13", scale="tdb")
    short, long = (
        Encounter.from_orbit(apophis, "earth", near, ephemeris="de440", search=span)
        for span in (30 * u.d, 100 * u.yr)
    )
    assert abs((short.distance - long.distance).to_value(u.m)) < 20.0
    assert abs((short.time - long.time).to_value(u.s)) < 0.01


def test_places_of_the_bodies_that_are_kept_change_nothing():
    """The acceleration at times in any order is that of a new model, to the last bit."""
    orbit = Asteroid.from_catalogue("Apophis").orbit
    window = need_ephemeris("de421").window(orbit.epoch, 0.0, 100.0 * DAY)
    names = ("sun point mass", "earth point mass", "ceres point mass", "earth J2")
    flat = model(window, names)
    state = orbit.barycentric(window)
    rng = np.random.default_rng(4)
    times = rng.uniform(0.0, 90.0 * DAY, 12)
    kept, fresh = np.empty(3), np.empty(3)
    for t in (0.0, *rng.choice(times, 200)):
        acceleration(flat, t, state[:3], state[3:], kept)
        acceleration(model(window, names), t, state[:3], state[3:], fresh)
        np.testing.assert_array_equal(kept, fresh)
    # A model with a law in addition needs the velocity of the Sun, which this one does not.
    law = NonGravitational((1e-9, 2e-9, 3e-9)).parameters
    t = 50.0 * DAY
    acceleration(flat, t, state[:3], state[3:], kept)
    acceleration(with_law(flat, law), t, state[:3], state[3:], kept)
    acceleration(with_law(model(window, names), law), t, state[:3], state[3:], fresh)
    np.testing.assert_array_equal(kept, fresh)
