"""Effect of each force on the 2029 encounter of Apophis, and of two forces on JPL's close approaches of 2020.

Usage: ``python benchmarks/sky.py [apophis | forces | routes]``. Reference data are read from ``../shared/data`` (or
``$FLYBYSTAB_SHARED/data``); nothing is downloaded. Accuracy and speed over many asteroids: ``flybystab bench sky``.

``forces`` integrates the orbits of the list of close approaches of January to June 2020 with ASSIST (extra ``assist``),
with all bodies and with the Sun alone as sources of relativity, with and without the flattening of the Earth.
``routes`` compares the list with ``Orbit.at`` and ``Encounter.from_orbit``, which integrate by IAS15.
"""

from __future__ import annotations

import json
import os
import sys
import time
from pathlib import Path
from typing import Any

import astropy.units as u
import numpy as np
from astropy.time import Time

from flybystab.encounter.encounter import Encounter
from flybystab.errors import MissingExtra
from flybystab.orbit.ephemeris import ephemeris
from flybystab.orbit.epochs import seconds
from flybystab.orbit.forces import FORCES
from flybystab.orbit.orbit import Orbit

DATA = Path(os.environ.get("FLYBYSTAB_SHARED", Path(__file__).resolve().parents[1] / "../shared")) / "data"
UNIT = u.au / u.d**2


def available() -> list[str]:
    """Names of the installed ephemerides."""
    out = []
    for name in ("de421", "de440"):
        try:
            ephemeris(name)
            out.append(name)
        except MissingExtra:
            print(f"{name} is not installed: left out")
    return out


def apophis_orbit(folder: Path = DATA) -> Orbit:
    """JPL solution 220."""
    record = json.loads((folder / "apophis_sbdb_jpl220.json").read_text())["orbit"]
    el = {item["name"]: float(item["value"]) for item in record["elements"]}
    par = {item["name"]: float(item["value"]) for item in record["model_pars"]}
    return Orbit.from_elements(
        Time(float(record["epoch"]), format="jd", scale="tdb"),
        el["a"] * u.au,
        el["e"],
        el["i"] * u.deg,
        el["om"] * u.deg,
        el["w"] * u.deg,
        el["ma"] * u.deg,
        par["A1"] * UNIT,
        par["A2"] * UNIT,
        name="Apophis",
    )


def apophis(folder: Path = DATA) -> list[tuple[str, str, float, float, float]]:
    """Closest approach of 2029 by model: ephemeris, model, km and s from JPL, wall time (s)."""
    orbit = apophis_orbit(folder)
    day = Time(2462240.5, format="jd", scale="tdb")
    jpl = Time(2462240.5, 0.407091595 - 0.5, format="jd", scale="tdb")
    points = tuple(n for n in FORCES if n.endswith("point mass"))
    inner = tuple(n for n in points if n.split()[0] in ("sun", "venus", "earth", "moon", "mars", "jupiter"))
    models: list[tuple[str, tuple[str, ...] | None]] = [
        ("Sun, Venus, Earth, Moon, Mars, Jupiter", inner),
        ("all point masses", points),
        ("... + 1PN", (*points, "1PN")),
        ("... + Earth J2", (*points, "1PN", "earth J2")),
        ("... + Sun J2", (*points, "1PN", "earth J2", "sun J2")),
        ("... + A1, A2", (*points, "1PN", "earth J2", "sun J2", "non-gravitational")),
        ("every known force", FORCES),
        ("default (0.1 km)", None),
    ]
    rows = []
    for name in available():
        for label, forces in models:
            Encounter.from_orbit(orbit, "earth", day, ephemeris=name, forces=forces)
            start = time.perf_counter()
            enc = Encounter.from_orbit(orbit, "earth", day, ephemeris=name, forces=forces)
            wall = time.perf_counter() - start
            rows.append((name, label, enc.distance.to_value(u.km) - 38011.5, seconds(enc.time, jpl), wall))
    print("\nApophis 2029, from JPL 220 (epoch JD 2461000.5): 38011.5 km, JD 2462240.407091595 TDB (JPL 206)")
    print(
        f"{'ephemeris':10} {'model':40} {'distance - JPL (km)':>20} {'time - JPL (s)':>15} {'wall (ms)':>10}"
    )
    for name, label, d, t, wall in rows:
        print(f"{name:10} {label:40} {d:20.3f} {t:15.4f} {1e3 * wall:10.1f}")
    return rows


def forces() -> None:
    """Distances of the list by ASSIST, with and without two forces."""
    from flybystab.bench import jpl, oracle

    if reason := oracle.missing():
        raise SystemExit(reason)
    known = jpl.orbits()
    events = [e for e in jpl.read(jpl.APPROACHES) if e["des"] in known]
    there = oracle.Oracle(jpl.SPAN[0])
    variants = {
        "all, J2": (oracle.ALL_SOURCES, True),
        "Sun, J2": (oracle.SUN_ALONE, True),
        "all, no J2": (oracle.ALL_SOURCES, False),
    }
    off = {
        label: np.array([_off(there, known[e["des"]][0], e, *how) for e in events])
        for label, how in variants.items()
    }
    print(
        "JPL close approaches of 2020 January to June by ASSIST; sources of relativity, J2 to J4 of the Earth"
    )
    print(f"{'model':12} {'events':>6} {'median (km)':>11} {'p99 (km)':>9} {'off by > 1 km':>13}")
    for label, km in off.items():
        size = np.abs(km)
        median, p99 = np.percentile(size, [50, 99])
        print(f"{label:12} {size.size:6d} {median:11.4f} {p99:9.4f} {(size > 1.0).sum():13d}")
    full = off["all, J2"]
    for label in ("Sun, J2", "all, no J2"):
        moved = full - off[label]
        some = np.flatnonzero((np.abs(moved) > 0.15) & (np.abs(full) < 20.0))
        print(f"\nevents that change by more than 0.15 km between 'all, J2' and '{label}'")
        print(f"{'asteroid':12} {'time (TDB)':18} {'off, all, J2 (km)':>18} {'off, ' + label + ' (km)':>22}")
        for k in some[np.argsort(-np.abs(moved[some]))]:
            event = events[k]
            print(f"{event['des']:12} {event['cd']:18} {full[k]:18.3f} {off[label][k]:22.3f}")
        print(
            f"{'median size':31} {np.median(abs(full[some])):18.3f} {np.median(abs(off[label][some])):22.3f}"
        )


def routes() -> None:
    """Distances of the list by ``Orbit.at`` and by ``Encounter.from_orbit``."""
    from flybystab.bench import jpl

    known = jpl.orbits()
    events = [e for e in jpl.read(jpl.APPROACHES) if e["des"] in known]
    unit = u.au.to(u.km)
    off = np.full((2, len(events)), np.nan)
    used = np.zeros(2)
    for k, event in enumerate(events):
        orbit, near = known[event["des"]][0], Time(float(event["jd"]), format="jd", scale="tdb")
        begin = time.process_time()
        r, v = (x.to_value(w) for x, w in zip(orbit.at(near, "earth"), (u.km, u.km / u.s), strict=True))
        off[0, k] = np.linalg.norm(r - (r @ v) / (v @ v) * v) - float(event["dist"]) * unit
        used[0] += time.process_time() - begin
        begin = time.process_time()
        found = Encounter.from_orbit(orbit, "earth", near, search=1 * u.d, within=0.6 * u.au)
        off[1, k] = found.distance.to_value(u.km) - float(event["dist"]) * unit
        used[1] += time.process_time() - begin
    print(
        "JPL close approaches of 2020 January to June by the integrations with IAS15, best ephemeris installed"
    )
    print(
        f"{'route':22} {'events':>6} {'median (km)':>11} {'p99 (km)':>9} {'off by > 1 km':>13} {'ms each':>8}"
    )
    for label, km, cost in zip(("Orbit.at", "Encounter.from_orbit"), off, used, strict=True):
        size = np.abs(km)
        median, p99 = np.percentile(size, [50, 99])
        far = int((size > 1.0).sum())
        print(f"{label:22} {size.size:6d} {median:11.4f} {p99:9.4f} {far:13d} {1e3 * cost / size.size:8.1f}")
    print(f"\n{'asteroid':12} {'time (TDB)':18} {'at (km)':>9} {'from_orbit (km)':>15}")
    for k in np.flatnonzero((np.abs(off) > 1.0).any(axis=0)):
        print(f"{events[k]['des']:12} {events[k]['cd']:18} {off[0, k]:9.3f} {off[1, k]:15.3f}")


def _off(there: Any, orbit: Orbit, event: dict[str, str], sources: int, flattening: bool) -> float:
    """Least distance by ASSIST less that of the list, km; the path is straight from the listed time on."""
    time_listed = Time(float(event["jd"]), format="jd", scale="tdb")
    sim, extras = there.simulation(orbit, time_listed, 1e-9)
    extras.gr_eih_sources = sources
    if not flattening:
        extras.forces = [name for name in extras.forces if name != "EARTH_HARMONICS"]
    t = there.days(time_listed)
    sim.integrate(t)
    earth, p = there.ephem.get_particle("earth", t), sim.particles[0]
    r = np.array([p.x - earth.x, p.y - earth.y, p.z - earth.z])
    v = np.array([p.vx - earth.vx, p.vy - earth.vy, p.vz - earth.vz])
    least = np.linalg.norm(r - (r @ v) / (v @ v) * v)
    return float(least - float(event["dist"])) * u.au.to(u.km)


def main(arguments: list[str]) -> int:
    known = {"apophis": apophis, "forces": forces, "routes": routes}
    for name in arguments or ["apophis"]:
        if name not in known:
            print(f"unknown table {name!r}; known: {', '.join(known)}", file=sys.stderr)
            return 2
        known[name]()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
