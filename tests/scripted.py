"""Passages at fixed times on two-body orbits, for tests without an ephemeris; workers import this module."""

import os
import signal
import sys
import time

import astropy.units as u
import numpy as np
from astropy.time import Time

from flybystab.catalogues.catalogue import Asteroid
from flybystab.constants import AU, R_EARTH
from flybystab.encounter.encounter import Encounter
from flybystab.errors import NotConverged
from flybystab.screening import table_files
from flybystab.screening.encounters import CloseApproach
from flybystab.screening.executors import open_executor
from flybystab.screening.screening import Screening
from flybystab.screening.settings import settings

NAMES = ["Apophis", "Anteros", "Toutatis", "1950 DA", "Bennu", "Duende"]
SPAN = ("2026-01-01", "2036-01-01")
NEAR = Encounter.hyperbolic("earth", periapsis=2.1 * R_EARTH * u.m, v_inf=6 * u.km / u.s)
FAR = Encounter.hyperbolic("earth", periapsis=0.02 * u.au, v_inf=6 * u.km / u.s)
MIDDLE = Encounter.hyperbolic("earth", periapsis=6 * R_EARTH * u.m, v_inf=6 * u.km / u.s)


def same(a, b):
    assert a.colnames == b.colnames
    assert len(a) == len(b)
    for name in a.colnames:
        x, y = (np.asarray(t[name].value if t[name].unit else t[name]) for t in (a, b))
        assert np.array_equal(x, y, equal_nan=x.dtype.kind == "f"), name


def day(jd):
    return Time(jd, format="jd", scale="tdb")


def three(asteroid, settings):
    """Far, at 6 and at 2.1 radii of the Earth; Bennu cannot be followed."""
    if asteroid.name == "Bennu":
        raise NotConverged("lost")
    v = 6000.0
    far = CloseApproach(asteroid, "earth", day(2461000.5), 0.02 * AU, v, FAR)
    rest = [
        CloseApproach(asteroid, "earth", day(2462000.5 + k), e.distance.to_value(u.m), v, e)
        for k, e in enumerate((MIDDLE, NEAR))
    ]
    return [far, *rest]


def slow(asteroid, settings):
    """The same; leaves a mark in the directory MARKS, and from the eleventh asteroid on waits for the file HOLD.

    A run is thus in its middle when a test stops it, however slow the machine is.
    """
    if "MARKS" in os.environ:
        with open(os.path.join(os.environ["MARKS"], str(os.getpid())), "a") as stream:
            stream.write(asteroid.name + "\n")
    if "HOLD" in os.environ and asteroid.name in [f"copy {k}" for k in range(10, 16)]:
        while not os.path.exists(os.environ["HOLD"]):
            time.sleep(0.01)
    return three(asteroid, settings)


def greedy(asteroid, settings):
    """The same, but the eleventh asteroid takes memory until its process is ended, as by a limit on memory."""
    held = []
    while asteroid.name == "copy 10":
        held.append(np.ones(2**22))
    return three(asteroid, settings)


def screening(n=6, finder=three, **options):
    """A screening of the first `n` names, or of copies of Anteros under other names."""
    asteroids = [Asteroid.from_catalogue(x) for x in NAMES[:n]]
    base = dict(Asteroid.from_catalogue("Anteros").row)
    while len(asteroids) < n:
        row = base | {"number": str(10**6 + len(asteroids)), "name": f"copy {len(asteroids)}"}
        asteroids.append(Asteroid(row))
    return Screening(asteroids, settings(*SPAN, **options), finder)


if __name__ == "__main__":
    # Tests may themselves run in the background, where a shell has interrupts ignored.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    table_files.ROW_GROUP = int(os.environ.get("ROW_GROUP", table_files.ROW_GROUP))
    with open_executor(int([*sys.argv, "1"][2])) as pool:
        screening(16, slow, samples=3, seed=4).run(sys.argv[1], executor=pool, chunk=1)
