"""Effect of each force on the 2029 encounter of Apophis, as a table.

Usage: ``python benchmarks/sky.py apophis``. Reference data are read from ``../shared/data`` (or
``$FLYBYSTAB_SHARED/data``); nothing is downloaded. Accuracy and speed over many asteroids: ``flybystab bench sky``.
"""

from __future__ import annotations

import json
import os
import sys
import time
from pathlib import Path

import astropy.units as u
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


def main(arguments: list[str]) -> int:
    known = {"apophis": apophis}
    for name in arguments or list(known):
        if name not in known:
            print(f"unknown table {name!r}; known: {', '.join(known)}", file=sys.stderr)
            return 2
        known[name]()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
