"""Apophis, 13 April 2029, from the elements of JPL 220, against JPL."""

import subprocess
import sys

import astropy.units as u
import numpy as np
import pytest
from astropy.time import Time
from reference import need_ephemeris

from flybystab.core.ellipsoid.tide import tensor, tide_at
from flybystab.encounter.encounter import Encounter
from flybystab.errors import InvalidInput, NoEncounter, OutOfSpan
from flybystab.orbit.ephemeris import BODIES
from flybystab.orbit.epochs import later, seconds
from flybystab.orbit.forces import FORCES
from flybystab.orbit.planets import planet
from flybystab.orbit.search.encounter_finder import find_encounters

JPL_TIME = Time(2462240.5, 0.407091595 - 0.5, format="jd", scale="tdb")
JPL_DISTANCE = 38011.5  # km, solution 220
DAY = Time(2462240.5, format="jd", scale="tdb")


@pytest.fixture(scope="module", params=["de421", "de440"])
def encounter(request, apophis):
    need_ephemeris(request.param)
    return request.param, Encounter.from_orbit(apophis, "earth", DAY, ephemeris=request.param)


def test_closest_approach_is_that_of_jpl(encounter):
    name, enc = encounter
    assert abs(enc.distance.to_value(u.km) - JPL_DISTANCE) < (5.0 if name == "de421" else 1.0)
    assert abs(seconds(enc.time, JPL_TIME)) < 1.0
    assert enc.v_periapsis.to_value(u.km / u.s) == pytest.approx(7.42254, abs=2e-4)
    assert enc.v_inf.to_value(u.km / u.s) == pytest.approx(5.841356, abs=2e-5)
    assert enc.distance_error < 0.01 * u.km
    assert enc.frame == "ICRF"
    assert not enc.impact


def test_closest_approach_is_a_root_and_a_minimum(encounter):
    _, enc = encounter
    t = np.array([-1.0, 0.0, 1.0])
    d = enc.radius(t * u.s).value
    assert d[1] == pytest.approx(enc.distance.to_value(u.m), abs=1e-3)
    assert d[0] > d[1] < d[2]
    r, v = enc.position(0 * u.s).value, enc.velocity(0 * u.s).value
    assert abs(r @ v) < 1e-9 * np.linalg.norm(r) * np.linalg.norm(v)


def test_track_is_the_trajectory_of_rebound(encounter, apophis):
    name, enc = encounter
    for t in (enc.t_start + 1.0, -3000.0, 20000.0, enc.t_stop):
        position, velocity = apophis.at(later(enc.time, t), centre="earth", ephemeris=name)
        gap = np.linalg.norm(enc.position(t * u.s).value - position.to_value(u.m))
        assert gap < 20.0  # the forces left out below 0.1 km
        assert np.linalg.norm(enc.velocity(t * u.s).value - velocity.to_value(u.m / u.s)) < 1e-2


def test_tide_is_the_sum_over_the_bodies_that_matter(encounter):
    name, enc = encounter
    from flybystab.orbit.ephemeris import ephemeris

    t = np.linspace(enc.t_start, enc.t_stop, 7)
    window = ephemeris(name).window(enc.time, enc.t_start - 10, enc.t_stop + 10)
    rel = enc.position(t * u.s).value
    centre = window.states(BODIES.index("earth"), t)[:, :3]
    total = np.zeros((t.size, 3, 3))
    for body in ("earth", "moon", "sun"):
        i = BODIES.index(body)
        r = window.states(i, t)[:, :3] - centre - rel
        d = np.linalg.norm(r, axis=1)[:, None, None]
        total += window.gm[i] / d**3 * (3 * r[:, :, None] * r[:, None, :] / d**2 - np.eye(3))
    out = np.empty((t.size, 6))
    for i, time in enumerate(t):
        tide_at(*enc.tide, time, out[i])
    peak = 2 * planet("earth").gm / enc.distance.to_value(u.m) ** 3
    gap = np.abs(tensor(out) - total).max() / peak
    assert 1e-6 < gap < 3e-4  # the rest is the Earth's J2: 6 J2 (a/q)^2 = 1.8e-4 at most
    assert enc.tide_error < 1e-9
    assert [n for n in enc.forces if n.startswith("tide")] == [
        "tide: sun",
        "tide: earth",
        "tide: moon",
        "tide: earth J2",
    ]


def test_finder_and_rebound_agree(encounter, apophis):
    """Two integrators, two ways to the root."""
    name, enc = encounter
    start, stop = Time(2462100.5, format="jd", scale="tdb"), Time(2462400.5, format="jd", scale="tdb")
    table = find_encounters(apophis, start, stop, ["earth", "moon"], ephemeris=name, tolerance=1e-13)
    assert list(table["planet"]) == ["earth", "moon"]
    assert abs(table["distance"][0] - enc.distance) < 0.02 * u.km
    assert abs(seconds(table["time"][0], enc.time)) < 1e-3
    assert table["v_inf"][0].to_value(u.km / u.s) == pytest.approx(enc.v_inf.to_value(u.km / u.s), rel=1e-6)
    assert table["distance"][1].to_value(u.km) == pytest.approx(95968.5, abs=5)


@pytest.mark.parametrize(
    ("left_out", "low", "high"), [("1PN", 100.0, 400.0), ("non-gravitational", 0.1, 10.0)]
)
def test_forces_that_are_off_are_seen_in_the_distance(apophis, left_out, low, high):
    full = Encounter.from_orbit(apophis, "earth", DAY, ephemeris="de421", forces=FORCES)
    less = tuple(n for n in FORCES if n != left_out)
    enc = Encounter.from_orbit(apophis, "earth", DAY, ephemeris="de421", forces=less)
    assert low < abs((enc.distance - full.distance).to_value(u.km)) < high
    assert f"orbit: {left_out}" in dict(enc.left_out)


def test_a_loose_demand_leaves_more_out(apophis):
    rough = Encounter.from_orbit(apophis, "earth", DAY, ephemeris="de421", error=3e4 * u.km)
    assert "orbit: 1PN" not in rough.forces
    assert rough.distance_error > 1 * u.km
    assert abs(rough.distance.to_value(u.km) - JPL_DISTANCE) < 3e4


def test_no_encounter_is_said(apophis):
    with pytest.raises(NoEncounter, match="mars"):
        Encounter.from_orbit(apophis, "mars", DAY, ephemeris="de421")
    with pytest.raises(NoEncounter, match="2028"):
        Encounter.from_orbit(apophis, "earth", Time("2028-06-01", scale="tdb"), ephemeris="de421")


def test_beyond_the_ephemeris_is_an_error(apophis):
    far = Time("2060-01-01", scale="tdb")
    with pytest.raises(OutOfSpan, match="1899-07-29 to 2053-10-09"):
        Encounter.from_orbit(apophis, "earth", far, ephemeris="de421")
    with pytest.raises(OutOfSpan, match="1899-07-29 to 2053-10-09"):
        find_encounters(apophis, DAY, far, ephemeris="de421")


def test_bad_arguments_are_named(apophis):
    with pytest.raises(InvalidInput, match="orbit"):
        Encounter.from_orbit("Apophis", "earth", DAY)
    with pytest.raises(InvalidInput, match="time"):
        Encounter.from_orbit(apophis, "earth", 2462240.5)
    with pytest.raises(InvalidInput, match="planet"):
        Encounter.from_orbit(apophis, "sun", DAY)
    with pytest.raises(InvalidInput, match="stop"):
        find_encounters(apophis, DAY, DAY)
    with pytest.raises(InvalidInput, match=r"objects = Apophis.*from_catalogue\('Apophis'\)"):
        find_encounters("Apophis", DAY, later(DAY, 1e6))
    with pytest.raises(InvalidInput, match=r"objects\[1\]"):
        find_encounters([apophis, 3], DAY, later(DAY, 1e6))


def test_each_force_has_its_share(apophis):
    """A share holds what the force does (1PN: 261 km at the perigee); below a tenth of the error it is left out."""
    found = find_encounters(apophis, DAY - 10 * u.d, DAY + 10 * u.d, within=0.05 * u.au, error=10 * u.km)
    share, left_out = found.meta["share_km"], found.meta["left_out_km"]
    assert 261.0 < share["1PN"] < 50 * 261.0
    assert share["sun point mass"] > share["jupiter point mass"] > share["1PN"]
    assert set(share) <= set(found.meta["forces"])
    assert not set(left_out) & set(found.meta["forces"])
    assert 0.0 < max(left_out.values()) < 1.0


def test_the_file_of_an_ephemeris_is_closed():
    code = "from flybystab.orbit.ephemeris import ephemeris; import gc; ephemeris('de421'); gc.collect()"
    done = subprocess.run(
        [sys.executable, "-W", "error::ResourceWarning", "-c", code], capture_output=True, text=True
    )
    assert (done.returncode, done.stderr) == (0, "")
