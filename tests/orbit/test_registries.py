"""A body and an ephemeris are one new entry each, without any other change."""

import os
import subprocess
import sys

import astropy.units as u
import numpy as np
import pytest
from astropy.time import Time
from jplephem.excerpter import write_excerpt
from jplephem.spk import SPK
from reference import need_ephemeris

from flybystab.encounter.encounter import Encounter
from flybystab.errors import InvalidInput, OutOfSpan
from flybystab.orbit import ephemeris as registry
from flybystab.orbit import planets
from flybystab.orbit.orbit import Orbit
from flybystab.orbit.search.encounter_finder import find_encounters

EPOCH = Time(2459000.5, format="jd", scale="tdb")


@pytest.fixture
def fresh():
    registry.ephemeris.cache_clear()
    yield
    registry.ephemeris.cache_clear()


def excerpt(path, pairs=None):
    """Eighty days of DE421 in a separate file."""
    source = SPK.open(str(need_ephemeris("de421").path))
    summaries = [
        (name, values)
        for name, values in source.daf.summaries()
        if pairs is None or (values[3], values[2]) in pairs
    ]
    with path.open("w+b") as file:
        write_excerpt(source, file, EPOCH.jd - 40.0, EPOCH.jd + 40.0, summaries)
    source.close()


def test_an_ephemeris(tmp_path, monkeypatch, fresh):
    excerpt(tmp_path / "small.bsp")
    gm = registry.EPHEMERIDES["de421"].gm
    monkeypatch.setitem(registry.EPHEMERIDES, "small", registry.Source("", str(tmp_path / "small.bsp"), gm))
    orbit = Orbit.from_state(EPOCH, [-0.2, -1.0, -0.35] * u.au, [25.0, -5.0, -2.0] * u.km / u.s, name="a")
    tables = [
        find_encounters(orbit, EPOCH, EPOCH + 20 * u.d, within=1 * u.au, ephemeris=name)
        for name in ("small", "de421")
    ]
    assert tables[0].meta["ephemeris"] == "small"
    assert len(tables[0]) == len(tables[1])
    places = [orbit.at(EPOCH + 20 * u.d, "earth", name)[0].to_value(u.m) for name in ("small", "de421")]
    assert np.linalg.norm(places[0] - places[1]) < 1e-3
    with pytest.raises(OutOfSpan, match="SMALL"):
        orbit.at(EPOCH + 200 * u.d, "earth", "small")


def test_an_ephemeris_that_lacks_a_body_is_refused(tmp_path, monkeypatch, fresh):
    excerpt(tmp_path / "poor.bsp", {(0, 10), (0, 3), (3, 301)})
    source = registry.Source("", str(tmp_path / "poor.bsp"), {})
    monkeypatch.setitem(registry.EPHEMERIDES, "poor", source)
    with pytest.raises(InvalidInput, match=r"series of mercury, venus.*pluto"):
        registry.ephemeris("poor")
    monkeypatch.setitem(registry.EPHEMERIDES, "gone", registry.Source("", str(tmp_path / "gone.bsp"), {}))
    with pytest.raises(InvalidInput, match="the path of an SPK file"):
        registry.ephemeris("gone")


def test_a_body_without_an_ephemeris(monkeypatch):
    """Sufficient for a hyperbolic encounter; one on a real orbit raises an error, since the position is not known."""
    body = planets.Planet("eris", 1.108e12, 1.163e6, 0.0, (0.0, 0.0, 1.0), 0.0, 136199, 1e13)
    monkeypatch.setitem(planets.PLANETS, "eris", body)
    encounter = Encounter.hyperbolic("eris", 2e6 * u.m, 3 * u.km / u.s)
    assert encounter.planet is body
    orbit = Orbit.from_state(EPOCH, [-0.2, -1.0, -0.35] * u.au, [25.0, -5.0, -2.0] * u.km / u.s)
    with pytest.raises(InvalidInput, match="planet"):
        Encounter.from_orbit(orbit, "eris", EPOCH)


SCRIPT = """
import dataclasses
from flybystab.orbit import planets
# The entry: a small body at the place of Mars.
planets.PLANETS["vulcan"] = dataclasses.replace(planets.PLANETS["mars"], name="vulcan", gm=1e9, radius=1e4, j2=0.0)
import astropy.units as u
import numpy as np
from astropy.time import Time
import flybystab as fs
from flybystab.orbit.ephemeris import BODIES, ephemeris
from flybystab.orbit.forces import FORCES
epoch = Time(2459000.5, format="jd", scale="tdb")
window = ephemeris("de421").window(epoch, 0.0, 1e6)
mars = window.states(BODIES.index("mars"), np.array([2.5 * 86400.0]))[0]
assert np.array_equal(mars, window.states(BODIES.index("vulcan"), np.array([2.5 * 86400.0]))[0])
assert "vulcan point mass" in FORCES and window.gm[BODIES.index("vulcan")] == 1e9
away = mars[:3] + [0.0, 0.0, 5e7] - mars[3:] * 2.5 * 86400.0
orbit = fs.Orbit.from_state(epoch, (away - 2.5 * 86400.0 * np.array([5e3, 0.0, 0.0])) * u.m,
                            (mars[3:] + [5e3, 0.0, 0.0]) * u.m / u.s, centre="ssb")
table = fs.find_encounters(orbit, epoch, epoch + 5 * u.d, ["mars", "vulcan"], 0.01 * u.au, ephemeris="de421", workers=1)
assert sorted(table["planet"]) == ["mars", "vulcan"], table
assert abs(table["distance"][0] - table["distance"][1]) < 1e-6 * u.km
assert table["distance"][0] < 1e6 * u.km
"""


def test_a_body_with_an_ephemeris():
    """An entry made before the package is imported; kernels run as Python, so that none has to be compiled."""
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT], env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr[-2000:]
