"""Compiled ephemeris against jplephem's own evaluation of the same files."""

import numpy as np
import pytest
from astropy.time import Time
from jplephem.spk import SPK

from flybystab.errors import MissingExtra, OutOfSpan, UnknownName
from flybystab.orbit.ephemeris import BODIES, ephemeris

CHAINS = {
    "sun": [(0, 10)],
    "earth": [(0, 3), (3, 399)],
    "moon": [(0, 3), (3, 301)],
    "jupiter": [(0, 5)],
    "mercury": [(0, 1)],
}


def load(name):
    try:
        return ephemeris(name)
    except MissingExtra as error:
        pytest.skip(str(error))


@pytest.mark.parametrize("name", ["de421", "de440"])
@pytest.mark.parametrize("body", CHAINS)
def test_states_are_those_of_jplephem(name, body):
    eph = load(name)
    epoch = Time(2462240.5, -0.09, format="jd", scale="tdb")
    window = eph.window(epoch, -4e7, 3e7)
    t = np.array([-4e7, -1234567.8, 0.0, 86400.0, 3e7])
    states = window.states(BODIES.index(body), t)
    spk = SPK.open(str(eph.path))
    position, velocity = np.zeros((3, t.size)), np.zeros((3, t.size))
    for pair in CHAINS[body]:
        p, v = spk[pair].compute_and_differentiate(epoch.jd1, epoch.jd2 + t / 86400)
        position, velocity = position + p * 1e3, velocity + v * 1e3 / 86400
    assert (
        np.abs(states[:, :3] - position.T).max() < 2e-2
    )  # jplephem's time is a Julian date: 20 mm at 30 km/s
    assert np.abs(states[:, 3:] - velocity.T).max() < 1e-6


def test_span_is_named_when_it_is_left():
    eph = load("de421")
    with pytest.raises(OutOfSpan, match=r"2099-.*1899-07-29 to 2053-10-09"):
        eph.window(Time("2099-01-01", scale="tdb"), 0.0, 1.0)
    with pytest.raises(OutOfSpan):
        eph.window(Time("2053-01-01", scale="tdb"), 0.0, 4e7)


def test_outside_its_window_a_body_is_nowhere():
    window = load("de421").window(Time("2029-01-01", scale="tdb"), -1e6, 1e6)
    assert np.isnan(window.states(3, np.array([1e8]))).all()


def test_window_to_the_very_end_of_the_file():
    eph = load("de421")
    end = Time(eph.stop_jd, format="jd", scale="tdb")
    assert np.isfinite(eph.window(end, -1e6, 0.0).states(4, np.array([-1e6, 0.0]))).all()


def test_unknown_ephemeris():
    with pytest.raises(UnknownName, match="de440"):
        ephemeris("de999")
