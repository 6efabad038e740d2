"""Accuracy and speed of the sky, as tables.

Usage: ``python benchmarks/sky.py [apophis] [cad] [speed]``. Reference data are read from ``../shared/data``
(or ``$FLYBYSTAB_SHARED/data``); nothing is downloaded.
"""

from __future__ import annotations

import csv
import gzip
import json
import os
import sys
import time
from pathlib import Path

import astropy.units as u
import numpy as np
from astropy.time import Time

from flybystab.errors import MissingExtra
from flybystab.sky.encounter import Encounter
from flybystab.sky.ephemeris import ephemeris
from flybystab.sky.finder import find_encounters
from flybystab.sky.forces import FORCES
from flybystab.sky.orbit import Orbit, seconds

DATA = Path(os.environ.get("FLYBYSTAB_SHARED", Path(__file__).resolve().parents[1] / "../shared")) / "data"
UNIT = u.au / u.d**2
COMETS = ("CometA", "COM", "ETc", "HTC", "JFc", "JFC", "HYP", "PAR")


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
        ("... + Sun 1PN", (*points, "sun 1PN")),
        ("... + Earth J2", (*points, "sun 1PN", "earth J2")),
        ("... + Sun J2", (*points, "sun 1PN", "earth J2", "sun J2")),
        ("... + A1, A2", (*points, "sun 1PN", "earth J2", "sun J2", "non-gravitational")),
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


def _number(text: str) -> float:
    return float(text) if text else 0.0


def orbits_2020(folder: Path = DATA) -> dict[str, tuple[Orbit, str]]:
    """Orbits of SBDB 2020-09 by primary designation, with the solution."""
    out = {}
    with gzip.open(folder / "nea_sbdb_fullprec_2020-09.csv.gz", "rt") as file:
        for row in csv.DictReader(file):
            if not row["a"] or row["class"] in COMETS:
                continue
            orbit = Orbit.from_elements(
                Time(float(row["epoch"]), format="jd", scale="tdb"),
                float(row["a"]) * u.au,
                float(row["e"]),
                float(row["i"]) * u.deg,
                float(row["om"]) * u.deg,
                float(row["w"]) * u.deg,
                float(row["ma"]) * u.deg,
                _number(row["A1"]) * UNIT,
                _number(row["A2"]) * UNIT,
                _number(row["A3"]) * UNIT,
                name=row["pdes"],
            )
            out[row["pdes"]] = orbit, row["orbit_id"].replace("JPL", "").strip()
    return out


def cad(folder: Path = DATA, tolerance: float = 1e-12) -> dict[str, np.ndarray]:
    """Close approaches of Jan-Jun 2020 against JPL's, per ephemeris: distance errors, km (nan: missed)."""
    with gzip.open(folder / "cad_earth_2020_jan_jun.csv.gz", "rt") as file:
        events = list(csv.DictReader(file))
    orbits = orbits_2020(folder)
    known = [e for e in events if e["des"] in orbits]
    names = sorted({e["des"] for e in known})
    place = {n: i for i, n in enumerate(names)}
    span = Time(2458840.5, format="jd", scale="tdb"), Time(2459040.5, format="jd", scale="tdb")
    result = {}
    print(
        f"\nJPL close approaches of 2020 Jan-Jun: {len(events)} events, {len(known)} of objects with elements"
    )
    print(
        f"{'ephemeris':10} {'events':>7} {'missed (< 0.2 au)':>8} {'median':>8} {'p90':>8} {'p99':>8} "
        f"{'max (km)':>9} {'wall (s)':>9}"
    )
    for name in available():
        begin = time.perf_counter()
        table = find_encounters(
            [orbits[n][0] for n in names], *span, within=0.6 * u.au, ephemeris=name, tolerance=tolerance
        )
        wall = time.perf_counter() - begin
        index, jd = np.array(table["index"]), np.array(table["time"].jd)
        distance = table["distance"].to_value(u.km)
        error = np.full(len(known), np.nan)
        gap = np.full(len(known), np.nan)
        for k, event in enumerate(known):
            rows = np.flatnonzero(index == place[event["des"]])
            if rows.size:
                best = rows[np.argmin(np.abs(jd[rows] - float(event["jd"])))]
                if abs(jd[best] - float(event["jd"])) < 1.0:
                    error[k] = distance[best] - float(event["dist"]) * u.au.to(u.km)
                    gap[k] = (jd[best] - float(event["jd"])) * 86400
        near = np.array([float(e["dist"]) < 0.2 for e in known])
        lost = np.isnan(error)
        size = np.abs(error[~lost])
        q = np.percentile(size, [50, 90, 99])
        print(
            f"{name:10} {len(known):7d} {lost.sum():4d} ({(lost & near).sum()}) {q[0]:8.4f} {q[1]:8.4f} {q[2]:8.4f} "
            f"{size.max():10.3f} {wall:9.1f}"
        )
        for k in np.argsort(-np.where(np.isnan(error), np.inf, np.abs(error))):
            if not abs(error[k]) <= 1.0 and float(known[k]["dist"]) < 0.2:
                e = known[k]
                print(
                    f"    {e['des']:12} {e['cd']}  {float(e['dist']):.5f} au  {error[k]:10.3f} km  {gap[k]:9.2f} s  "
                    f"solution {e['orbit_id']} here {orbits[e['des']][1]}, 3-sigma "
                    f"{(float(e['dist_max']) - float(e['dist'])) * u.au.to(u.km):.1f} km"
                )
        result[name] = error
    return result


def speed(folder: Path = DATA, count: int = 200) -> list[tuple[str, float, float, float]]:
    """Object-years per second and distance error by tolerance, one thread, over 0.6 and 10 years."""
    orbits = [o for o, _ in list(orbits_2020(folder).values())[:count]]
    rows = []
    print(f"\nSearch for Earth encounters within 0.05 au, {count} asteroids, one thread, {available()[-1]}")
    print(
        f"{'years':>6} {'tolerance':>10} {'object-years/s':>15} {'events':>7} {'median (km)':>12} {'p99 (km)':>10}"
    )
    start = Time(2459000.5, format="jd", scale="tdb")
    for years in (0.6, 10.0):
        stop = Time(2459000.5 + 365.25 * years, format="jd", scale="tdb")
        best = find_encounters(orbits, start, stop, tolerance=1e-14, threads=1)
        for tolerance in (1e-9, 1e-10, 1e-11, 1e-12, 1e-13):
            begin = time.perf_counter()
            table = find_encounters(orbits, start, stop, tolerance=tolerance, threads=1)
            wall = time.perf_counter() - begin
            rate = count * years / wall
            if len(table) == len(best):
                gap = np.abs((table["distance"] - best["distance"]).to_value(u.km))
                q = np.percentile(gap, [50, 99])
            else:
                q = np.array([np.nan, np.nan])
            rows.append((f"{years}", tolerance, rate, float(q[0])))
            print(f"{years:6.1f} {tolerance:10.0e} {rate:15.0f} {len(table):7d} {q[0]:12.5f} {q[1]:10.4f}")
    return rows


def main(arguments: list[str]) -> int:
    known = {"apophis": apophis, "cad": cad, "speed": speed}
    for name in arguments or list(known):
        if name not in known:
            print(f"unknown table {name!r}; known: {', '.join(known)}", file=sys.stderr)
            return 2
        known[name]()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
