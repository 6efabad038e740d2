"""Barycentres of DE421 and DE440: the polynomial against the files, and states given relative to either."""

from pathlib import Path

import astropy.units as u
import numpy as np
import pytest
from astropy.time import Time
from reference import need_ephemeris

from flybystab.constants import DAY, YEAR
from flybystab.encounter.encounter import Encounter
from flybystab.errors import InvalidInput, UnknownName
from flybystab.orbit.barycentre import barycentre_of_de440
from flybystab.orbit.ephemeris import ephemeris
from flybystab.orbit.orbit import Orbit
from flybystab.orbit.search.encounter_finder import find_encounters

J2000 = Time(2451545.0, format="jd", scale="tdb")


def mjd(day):
    return Time(day, format="mjd", scale="tdb")


def apophis(centre="ssb", **more):
    """State of Horizons relative to the barycentre of DE441 (published with the program grss, apophis.ipynb)."""
    a = u.au / u.d**2
    return Orbit.from_state(
        mjd(62130.0),
        [-0.4430312741660833, 0.8965062452933791, 0.3218771965080118] * u.au,
        [-0.0148212842112486, -0.0042500259738234, -0.0019519585329488] * u.au / u.d,
        centre=centre,
        A1=5e-13 * a,
        A2=-2.901085583204654e-14 * a,
        **more,
    )


@pytest.mark.parametrize("year", [1901.0, 1930.3, 1967.1, 2000.0, 2029.3, 2051.5])
def test_difference_of_the_two_suns(year):
    """A straight line would be 3 to 8 km off, at most."""
    need_ephemeris("de440")
    t = np.array([(year - 2000.0) * YEAR])
    suns = [ephemeris(n).window(J2000, t[0] - DAY, t[0] + DAY).states(0, t) for n in ("de440", "de421")]
    found = barycentre_of_de440("de421", J2000, t) + (suns[0] - suns[1])
    assert np.abs(found[:, :3]).max() < 100.0
    assert np.abs(found[:, 3:]).max() < 3e-6
    assert np.linalg.norm(suns[0][0, :3] - suns[1][0, :3]) > 1.1e5
    assert not barycentre_of_de440("de440", J2000, t).any()


def sun_of(kernel, jd):
    """Sun relative to the barycentre of an ephemeris file, m and m/s, shape (6,)."""
    from jplephem.spk import SPK

    with SPK.open(kernel) as spk:
        position, rate = spk[0, 10].compute_and_differentiate(jd)
    return np.concatenate([1e3 * np.asarray(position), 1e3 * np.asarray(rate) / DAY])


@pytest.mark.parametrize(
    ("excerpt", "jd", "old"),
    [("de430-2015-03-02.bsp", 2457083.75, True), ("de441-1969.bsp", 2440438.5, False)],
)
def test_de430_has_the_barycentre_of_de421_and_de441_that_of_de440(excerpt, jd, old):
    """Excerpts of the two ephemerides among the tests of skyfield: within 0.4 km of one, 100 km from the other."""
    skyfield = pytest.importorskip("skyfield")
    kernel = Path(skyfield.__file__).parent / "tests" / "data" / excerpt
    if not kernel.exists():
        pytest.skip(f"this version of skyfield has no {excerpt}")
    need_ephemeris("de440")
    t = np.array([(jd - 2451545.0) * DAY])
    suns = {n: ephemeris(n).window(J2000, t[0] - DAY, t[0] + DAY).states(0, t)[0] for n in ("de440", "de421")}
    same, other = ("de421", "de440") if old else ("de440", "de421")
    sun = sun_of(kernel, jd)
    assert np.linalg.norm((sun - suns[same])[:3]) < 400.0
    assert np.linalg.norm((sun - suns[other])[:3]) > 1e5
    converted = sun - barycentre_of_de440("de430" if old else "de441", J2000, t)[0]
    assert np.linalg.norm((converted - suns["de440"])[:3]) < 400.0


def test_a_barycentric_state_gives_the_same_encounter_with_both_ephemerides():
    """38,011.5 km at 21:46:12.7 TDB, and the state of JPL at the end of 2029, beyond the passage."""
    need_ephemeris("de440")
    end = [0.1194303822347949, 1.2110683438150556, 0.4767184664960469]
    for name, late in (("de440", 50.0), ("de421", 1500.0)):
        t = find_encounters(apophis(), mjd(62200), mjd(62300), within=0.01 * u.au, ephemeris=name)
        assert t["distance"][0].to_value(u.km) == pytest.approx(38011.5, abs=0.3)
        assert abs((t["time"][0] - Time("2029-04-13T21:46:12.7", scale="tdb")).to_value(u.s)) < 0.2
        r, _ = apophis().at(mjd(62495.0), "ssb", name)
        # Not converted, DE421 is 684,672 km off.
        assert np.linalg.norm(r.to_value(u.au) - end) * 149597870.7 < late
    one = Encounter.from_orbit(apophis(), "earth", mjd(62239.9), ephemeris="de421")
    assert one.distance.to_value(u.km) == pytest.approx(38011.5, abs=0.3)


def test_a_state_of_the_barycentre_of_de421_is_converted():
    t = np.zeros(1)
    sun = need_ephemeris("de421").window(mjd(62130.0), -DAY, DAY).states(0, t)[0]
    helio = Orbit.from_state(mjd(62130.0), [1.1, 0.3, 0.0] * u.au, [-5.0, 25.0, 3.0] * u.km / u.s)
    r = helio.position.to_value(u.m) + sun[:3]
    v = helio.velocity.to_value(u.m / u.s) + sun[3:]
    same = Orbit.from_state(mjd(62130.0), r * u.m, v * u.m / u.s, centre="ssb", barycentre="DE421")
    (x, w), (y, z) = (o.at(mjd(62131.0), ephemeris="de421") for o in (helio, same))
    assert np.linalg.norm((x - y).to_value(u.m)) < 1.0
    assert np.linalg.norm((w - z).to_value(u.m / u.s)) < 1e-6


def test_positions_relative_to_the_barycentre_do_not_depend_on_the_ephemeris():
    need_ephemeris("de440")
    one, other = (apophis().at(mjd(62140.0), "ssb", name)[0].to_value(u.m) for name in ("de440", "de421"))
    assert np.linalg.norm(one - other) < 300.0


def test_unknown_barycentres_and_times_are_refused():
    with pytest.raises(UnknownName, match="de441"):
        apophis(barycentre="inpop21a")
    with pytest.raises(InvalidInput, match="1900 to 2052"):
        Orbit.from_state(mjd(1e5), [1, 0, 0] * u.au, [0, 3e4, 0] * u.m / u.s, "ssb", barycentre="de431")
