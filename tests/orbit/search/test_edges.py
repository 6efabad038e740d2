"""Passages at the ends of a search and at the epoch of an orbit: each is found once; impacts before a search."""

import astropy.units as u
import numpy as np
import pytest
from astropy.time import Time
from reference import need_ephemeris

import flybystab as fs
from flybystab.constants import AU, DAY
from flybystab.errors import Impact
from flybystab.orbit.epochs import later, seconds
from flybystab.orbit.orbit import Orbit
from flybystab.orbit.planets import PLANETS
from flybystab.orbit.search.encounter_finder import find_encounters

SPAN = Time("2020-01-01", scale="tdb"), Time("2040-01-01", scale="tdb")
NAMES = ("Ganymed", "Toutatis", "Eros", "Bennu", "Geographos", "Phaethon", "Toro", "Didymos")


@pytest.fixture(scope="module")
def found():
    need_ephemeris("de421")
    orbits = [fs.Asteroid.from_catalogue(name).orbit for name in NAMES]
    return orbits, find_encounters(orbits, *SPAN, within=0.4 * u.au, ephemeris="de421")


@pytest.mark.parametrize("shift", [0.0, 1e-7, -1e-4, 0.3, -0.3])
def test_spans_side_by_side_have_each_passage_once(found, shift):
    orbits, whole = found
    assert len(whole) > 15
    for row in whole[:: max(1, len(whole) // 6)]:
        cut = later(row["time"], shift)
        orbit = orbits[row["index"]]
        parts = [
            find_encounters(orbit, *ends, within=0.4 * u.au, ephemeris="de421")
            for ends in ((SPAN[0], cut), (cut, SPAN[1]))
        ]
        times = np.concatenate([part["time"].jd for part in parts])
        want = whole["time"].jd[whole["index"] == row["index"]]
        assert len(times) == len(want), (NAMES[row["index"]], row["time"].iso)
        assert np.abs(times - want).max() < 1e-5


@pytest.mark.parametrize("after", [-1e-6, -1e-9, 0.0, 1e-9, 1e-8, 1e-7, 1e-6, 1e-3])
def test_an_epoch_at_the_passage_gives_one_row(found, after):
    _, whole = found
    row = whole[int(np.argmin(whole["distance"]))]
    near = row["time"]
    state = Orbit.from_state(near, row["position"], row["velocity"], centre="earth")
    r, v = state.position.to_value(u.m), state.velocity.to_value(u.m / u.s)
    moved = Orbit.from_state(later(near, after), (r + after * v) * u.m, v * u.m / u.s, centre="earth")
    table = find_encounters(
        moved, later(near, -5 * DAY), later(near, 5 * DAY), within=0.1 * u.au, ephemeris="de421"
    )
    assert len(table) == 1
    assert abs((table["time"][0] - near).to_value(u.s)) < 1.0


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_nothing_is_found_beyond_an_impact(sign):
    """A vertical fall on the Earth; a search that begins after the impact raises an error, forward and backward."""
    need_ephemeris("de421")
    epoch = Time("2026-01-01", scale="tdb")
    down = Orbit.from_state(epoch, [1e9, 0.0, 0.0] * u.m, [-sign * 1e4, 0.0, 0.0] * u.m / u.s, centre="earth")
    near, far = sorted([later(epoch, sign * 10 * DAY), later(epoch, sign * 3000 * DAY)])
    with pytest.raises(Impact, match="earth"):
        find_encounters(down, near, far, ephemeris="de421", within=0.5 * u.au)
    other = fs.Asteroid.from_catalogue("Apophis").orbit
    table = find_encounters([down, other], near, far, ephemeris="de421", within=0.1 * u.au)
    assert [one["asteroid"] for one in table.meta["failed"]] == ["0"]
    hit = find_encounters(down, *sorted([epoch, later(epoch, sign * 3 * DAY)]), ephemeris="de421")
    assert list(hit["impact"]) == [True]


def test_a_fall_into_the_sun_is_a_row():
    """Free fall from 1 au to 1 solar radius takes pi/2 sqrt(r^3 / 2 GM) less the last 0.6 h."""
    need_ephemeris("de421")
    epoch = Time("2020-01-01", scale="tdb")
    falling = Orbit.from_state(epoch, [1.0, 0.0, 0.0] * u.au, [0.0, 0.5, 0.0] * u.km / u.s)
    table = find_encounters(falling, epoch, later(epoch, 100.0 * DAY), ephemeris="de421")
    assert list(table["planet"]) == ["sun"]
    assert list(table["impact"]) == [True]
    fall = 0.5 * np.pi * np.sqrt(AU**3 / (2.0 * PLANETS["sun"].gm))
    assert seconds(table["time"][0], epoch) == pytest.approx(fall, rel=2e-3)
    quiet = Orbit.from_state(epoch, [1.0, 0.0, 0.0] * u.au, [0.0, 10.0, 0.0] * u.km / u.s)
    rows = find_encounters(
        quiet, epoch, later(epoch, 300.0 * DAY), ["mercury", "sun"], 0.01 * u.au, ephemeris="de421"
    )
    assert "sun" not in rows["planet"]  # perihelion at 0.06 au
