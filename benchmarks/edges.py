"""Properties of the search for encounters on random orbits: windows, epochs, directions, impacts on the Sun.

Usage: ``python benchmarks/edges.py [CASES]``, 240 cases without a number. Reads nothing but the installed ephemeris.

- windows: a span of ten years is cut at random times, at periapses, and 1e-9 to 1e-6 s or 0.3 s beside them; the parts
  have to give the encounters of the whole exactly once (to 0.1 km and 0.1 s: the forces left out depend on the span).
- epochs: the orbit is propagated to another epoch inside or outside of the span, or to a periapsis; it has to give the
  same encounters.
- backwards: the orbit is propagated beyond the end of the span and searched backwards; it has to give the same
  encounters.
- sun: orbits with a perihelion inside the Sun give one row with an impact, and ``Orbit.at`` beyond it an error.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from itertools import pairwise

import astropy.units as u
import numpy as np
from astropy.table import QTable
from astropy.time import Time

from flybystab.constants import DAY
from flybystab.errors import Impact
from flybystab.orbit.epochs import later, seconds
from flybystab.orbit.orbit import Orbit
from flybystab.orbit.search.encounter_finder import find_encounters

START, STOP = Time("2025-01-01", scale="tdb"), Time("2035-01-01", scale="tdb")
WITHIN = 0.2 * u.au
PLANETS = ("earth", "venus", "mars", "moon")
#: Distance of a cut or an epoch from a periapsis, s.
BESIDE = (0.0, 1e-9, -1e-9, 1e-8, -1e-8, 1e-7, -1e-7, 1e-6, -1e-6, 1e-3, -1e-3, 0.3, -0.3, 2.0, -2.0)


def random_orbit(rng: np.random.Generator, epoch: Time) -> Orbit:
    """A near-Earth orbit of small inclination, so that encounters are frequent."""
    q, e = rng.uniform(0.6, 1.05), rng.uniform(0.05, 0.7)
    angles = rng.uniform(0.0, 360.0, 3) * u.deg
    return Orbit.from_elements(epoch, q / (1.0 - e) * u.au, e, rng.rayleigh(4.0) * u.deg, *angles)


def found(orbit: Orbit, start: Time, stop: Time) -> QTable:
    """All encounters of a span."""
    return find_encounters(orbit, start, stop, PLANETS, WITHIN, ephemeris="de421", tolerance=1e-14, workers=1)


def same(ours: list[QTable], whole: QTable, late: float = 2.0, far: float = 20.0) -> str:
    """Empty if the parts have the encounters of the whole, else what differs; limits in s and km.

    Encounters within 1e-5 of the largest distance, where either side may count, are left out.
    """

    def rows(tables: list[QTable]) -> list[tuple[str, float, float]]:
        out = []
        for table in tables:
            for row in table:
                if row["distance"] < (1.0 - 1e-5) * WITHIN:
                    out.append((row["planet"], seconds(row["time"], START), row["distance"].to_value(u.km)))
        return sorted(out)

    mine, theirs = rows(ours), rows([whole])
    if len(mine) != len(theirs):
        return f"{len(mine)} instead of {len(theirs)} encounters"
    for a, b in zip(mine, theirs, strict=True):
        if a[0] != b[0] or abs(a[1] - b[1]) > late or abs(a[2] - b[2]) > far:
            return f"{a} instead of {b}"
    return ""


def beside(rng: np.random.Generator, whole: QTable) -> Time:
    """A random time of the span, or in three of four cases a time at or beside a periapsis."""
    if not len(whole) or rng.random() < 0.25:
        return later(START, rng.uniform(0.01, 0.99) * seconds(STOP, START))
    row = whole[int(rng.integers(len(whole)))]
    return later(row["time"], float(rng.choice(BESIDE)))


def carried(orbit: Orbit, time: Time) -> Orbit:
    """The orbit with another epoch."""
    r, v = orbit.at(time, "sun", "de421")
    return Orbit.from_state(time, r, v)


def windows(rng: np.random.Generator) -> tuple[str, int]:
    """Parts of a span, cut once to three times."""
    orbit = random_orbit(rng, later(START, rng.uniform(-1.0, 2.0) * seconds(STOP, START)))
    whole = found(orbit, START, STOP)
    cuts = sorted(
        (beside(rng, whole) for _ in range(int(rng.integers(1, 4)))), key=lambda t: seconds(t, START)
    )
    parts = [found(orbit, a, b) for a, b in pairwise((START, *cuts, STOP)) if seconds(b, a) > 0.0]
    return same(parts, whole, 0.1, 0.1), len(whole)


def epochs(rng: np.random.Generator) -> tuple[str, int]:
    """The same orbit from an epoch inside the span, often at a periapsis."""
    orbit = random_orbit(rng, later(START, rng.uniform(0.0, 1.0) * seconds(STOP, START)))
    whole = found(orbit, START, STOP)
    if any(row["impact"] for row in whole):
        return "", len(whole)
    return same([found(carried(orbit, beside(rng, whole)), START, STOP)], whole), len(whole)


def backwards(rng: np.random.Generator) -> tuple[str, int]:
    """The same orbit from beyond the end of the span."""
    orbit = random_orbit(rng, START)
    whole = found(orbit, START, STOP)
    if any(row["impact"] for row in whole):
        return "", len(whole)
    return same([found(carried(orbit, later(STOP, 10.0 * DAY)), START, STOP)], whole), len(whole)


def sun(rng: np.random.Generator) -> tuple[str, int]:
    """A fall into the Sun: one row, and no place beyond it."""
    r = rng.normal(size=3)
    r *= rng.uniform(0.3, 1.5) / np.linalg.norm(r)
    across = np.cross(r, rng.normal(size=3))
    across *= rng.uniform(0.0, 1.5) / np.linalg.norm(across)
    orbit = Orbit.from_state(
        START, r * u.au, (across - rng.uniform(0.0, 20.0) * r / np.linalg.norm(r)) * u.km / u.s
    )
    table = found(orbit, START, later(START, 300.0 * DAY))
    falls = [row for row in table if row["planet"] == "sun"]
    if len(falls) != 1 or not falls[0]["impact"] or table["planet"][-1] != "sun":
        return f"{len(falls)} falls in {len(table)} rows", len(table)
    hit = falls[0]["time"]
    try:
        orbit.at(later(hit, 3600.0), ephemeris="de421")
    except Impact:
        orbit.at(later(hit, -DAY / 4.0), ephemeris="de421")
        return "", len(table)
    return "a place beyond the fall", len(table)


PROPERTIES: dict[str, Callable[[np.random.Generator], tuple[str, int]]] = {
    "windows": windows,
    "epochs": epochs,
    "backwards": backwards,
    "sun": sun,
}


def run(cases: int) -> dict[str, tuple[int, int, list[str]]]:
    """Cases, encounters and failures by property."""
    out = {}
    for name, check in PROPERTIES.items():
        n, rows, wrong = max(cases // len(PROPERTIES), 1), 0, []
        for k in range(n):
            why, size = check(np.random.default_rng([k, *name.encode()]))
            rows += size
            if why:
                wrong.append(f"{name} {k}: {why}")
        out[name] = n, rows, wrong
    return out


def main(arguments: list[str]) -> None:
    table = run(int(arguments[0]) if arguments else 240)
    print(f"{'property':10} {'cases':>6} {'encounters':>10} {'failures':>8}")
    for name, (n, rows, wrong) in table.items():
        print(f"{name:10} {n:6d} {rows:10d} {len(wrong):8d}")
    for _, _, wrong in table.values():
        for line in wrong:
            print(line)


if __name__ == "__main__":
    main(sys.argv[1:])
