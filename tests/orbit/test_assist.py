"""ASSIST as an oracle: the same passages from the same elements. Needs the extra ``assist`` (rebound 4)."""

import astropy.units as u
import numpy as np
import pytest
from astropy.time import Time

import flybystab as fs
from flybystab.bench import oracle
from flybystab.constants import AU
from flybystab.orbit.search.encounter_finder import find_encounters

pytestmark = pytest.mark.skipif(bool(oracle.missing()), reason=oracle.missing() or "ASSIST is there")

SPAN = Time("2022-01-01", scale="tdb"), Time("2032-01-01", scale="tdb")
NAMES = (
    "Apophis",
    "Eros",
    "Toutatis",
    "Anteros",
    "Phaethon",
    "Toro",
    "Ganymed",
    "Bennu",
    "Didymos",
    "Geographos",
)


@pytest.fixture(scope="module")
def orbits():
    return [fs.Asteroid.from_catalogue(name).orbit for name in NAMES]


@pytest.fixture(scope="module")
def theirs(orbits):
    there = oracle.Oracle(SPAN[0])
    return [there.encounters(o, *SPAN, 0.5 * AU, 1e-9) for o in orbits]


def test_the_same_passages(orbits, theirs):
    table = find_encounters(orbits, *SPAN, within=0.5 * u.au, ephemeris="de440")
    assert len(table) == sum(map(len, theirs)) > 10
    for i, (name, found) in enumerate(zip(NAMES, theirs, strict=True)):
        mine = table[table["index"] == i]
        days = (mine["time"] - SPAN[0]).jd
        # before the passage of 2029 nothing is amplified; ASSIST has the Earth's pole of J2000
        early = (
            found[:, 0] < (Time("2029-04-14", scale="tdb") - SPAN[0]).jd if name == "Apophis" else slice(None)
        )
        assert days[early] == pytest.approx(found[early, 0], abs=1e-4), name
        gap = np.abs(mine["distance"].to_value(u.km)[early] - found[early, 1] / 1e3)
        assert np.all(gap < 0.3), name


def test_apophis_2029(theirs):
    """Two codes, two integrators: 0.2 km from each other at the perigee."""
    enc = fs.Encounter.from_orbit(
        fs.Asteroid.from_catalogue("Apophis").orbit,
        "earth",
        Time("2029-04-13", scale="tdb"),
        ephemeris="de440",
    )
    t, d = theirs[0][np.argmin(theirs[0][:, 1])]
    assert enc.distance.to_value(u.km) == pytest.approx(d / 1e3, abs=0.2)
    assert (enc.time - SPAN[0]).jd == pytest.approx(t, abs=2e-6)


def test_a_forward_and_a_backward_leg(orbits):
    """The epoch inside the span: both sides are searched, each passage once."""
    there = oracle.Oracle(orbits[0].epoch)
    span = orbits[0].epoch - 2000 * u.d, orbits[0].epoch + 1200 * u.d
    found = there.encounters(orbits[0], *span, 0.5 * AU, 1e-9)
    table = find_encounters(orbits[0], *span, within=0.5 * u.au, ephemeris="de440")
    assert len(found) == len(table) >= 2
    assert found[0, 0] < 0.0 < found[-1, 0]
    assert table["distance"].to_value(u.m) == pytest.approx(found[:, 1], abs=500.0)
