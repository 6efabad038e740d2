"""Search of the whole MPC catalogue compared with lists of CNEOS: recall and precision at 0.05 au, by decade.

Usage: ``python benchmarks/completeness.py [FOUND.ecsv]``. The search (40,874 orbits, 1950 to 2050, 4.1 million
object-years) takes some two minutes on two idle cores; its table is read from FOUND if that exists, otherwise written
there. ``python benchmarks/completeness.py stages`` measures on 1,000 orbits the gain and the losses of a cheaper first
pass. The lists are read from ``../shared/data`` (or ``$FLYBYSTAB_SHARED/data``); nothing is downloaded.

The list of 2021 contains encounters below 0.05 au from 1950 to 2040. Recall is the fraction of its rows that are found
within a day and three of its sigmas; it is also given for the rows whose time is known to a minute (3 sigma). Precision
is the fraction of the encounters found that are in the list, for asteroids whose orbits were well known at that time
(condition code 0 in September 2020); the list omits encounters whose time is not known to ten days.
"""

from __future__ import annotations

import argparse
import csv
import gzip
import os
import sys
import time
from pathlib import Path

import astropy.units as u
import numpy as np
from astropy.table import QTable
from astropy.time import Time

from flybystab.catalogues.asteroid import Asteroid
from flybystab.catalogues.catalogue import catalogue, key_of
from flybystab.orbit.search.encounter_finder import find_encounters

DATA = Path(os.environ.get("FLYBYSTAB_SHARED", Path(__file__).resolve().parents[1] / "../shared")) / "data"
SPAN = Time("1950-01-01", scale="tdb"), Time("2050-01-01", scale="tdb")
LIMIT = 0.05


def search(asteroids: tuple[Asteroid, ...], path: Path | None) -> QTable:
    """All encounters of the catalogue with the Earth, from an earlier run if there is one."""
    if path is not None and path.exists():
        table = QTable.read(path)
        print(table.meta["search"])
        return table
    begin, used, load = time.perf_counter(), time.process_time(), os.getloadavg()[0]
    table = find_encounters(asteroids, *SPAN, within=LIMIT * u.au)
    wall, used = time.perf_counter() - begin, time.process_time() - used
    years = 100.0 * len(asteroids)
    table.meta["search"] = (
        f"{len(table)} encounters of {len(asteroids)} asteroids below {LIMIT} au: {wall:.0f} s on {os.cpu_count()} "
        f"cores with a load of {load:.1f} to {os.getloadavg()[0]:.1f}, {used:.0f} s of processor time, "
        f"{years / used:.0f} object-years a second and core"
    )
    print(table.meta["search"])
    if path is not None:
        path.parent.mkdir(exist_ok=True)
        table["index", "time", "distance"].write(path, format="ascii.ecsv")
    return table


def rows_of_cneos(asteroids: tuple[Asteroid, ...], folder: Path = DATA) -> dict[str, np.ndarray]:
    """Rows of the list of 2021: number in the catalogue (-1: not there), JD, 3 sigma (min), distance (au)."""
    place = {key_of(name): i for i, a in reversed(list(enumerate(asteroids))) for name in a.names}
    with gzip.open(folder / "cneos_earth_1950_2040_lt0.05au.csv.gz", "rt") as file:
        rows = list(csv.DictReader(file))
    index = [place.get(key_of(r["des"]), place.get(key_of(r["prov_desig"]), -1)) for r in rows]
    return {
        "index": np.array(index),
        "des": np.array([r["des"] for r in rows]),
        "jd": np.array([float(r["jd_tdb_rounded_min"]) for r in rows]),
        # "<1" is less than a minute
        "sigma": np.array([0.5 if r["t_sigma3_min"][0] == "<" else float(r["t_sigma3_min"]) for r in rows]),
        "au": np.array([float(r["dist_au"]) for r in rows]),
    }


def certain(asteroids: tuple[Asteroid, ...], folder: Path = DATA) -> np.ndarray:
    """Numbers in the catalogue of the asteroids with condition code 0 in JPL's database of September 2020."""
    place = {key_of(name): i for i, a in reversed(list(enumerate(asteroids))) for name in a.names}
    with gzip.open(folder / "nea_sbdb_fullprec_2020-09.csv.gz", "rt") as file:
        names = [r["pdes"] for r in csv.DictReader(file) if r["condition_code"] == "0"]
    return np.array([place[key_of(n)] for n in names if key_of(n) in place])


def matches(listed: dict[str, np.ndarray], index: np.ndarray, jd: np.ndarray) -> np.ndarray:
    """Encounter found nearest in time to each row of the list (-1: none within a day and three sigmas)."""
    order = np.argsort(index, kind="stable")
    first = np.searchsorted(index[order], listed["index"], "left")
    last = np.searchsorted(index[order], listed["index"], "right")
    out = np.full(len(listed["jd"]), -1)
    for i, (a, b) in enumerate(zip(first, last, strict=True)):
        if b > a and listed["index"][i] >= 0:
            gap = np.abs(jd[order[a:b]] - listed["jd"][i])
            if gap.min() < 1.0 + listed["sigma"][i] / 1440.0:
                out[i] = order[a + int(np.argmin(gap))]
    return out


def stages(count: int = 1000) -> None:
    """Print speed and missed encounters of the search by the allowed error, on random orbits.

    A first pass with a large error would flag asteroids for the full search, from the epoch to the last one flagged.
    """
    asteroids = catalogue(DATA / "nea_mpc_2026-02.csv.gz")
    some = [asteroids[i] for i in np.random.default_rng(1).permutation(len(asteroids))[:count]]
    find_encounters(some[:2], *SPAN, workers=1)
    print(f"{count} orbits of the MPC, 1950 to 2050, Earth, {LIMIT} au, one thread, processor time")
    print(
        f"{'error (km)':>10} {'tolerance':>9} {'object-years/s':>14} {'found':>8} {'lost':>5} {'asteroids':>9} "
        f"{'median (km)':>11} {'p99 (km)':>9} {'largest (km)':>12}"
    )
    truth = None
    for error in (0.1, 1.0, 1e2, 1e4, 1e5):
        used = time.process_time()
        table = find_encounters(some, *SPAN, within=LIMIT * u.au, error=error * u.km, workers=1)
        used = time.process_time() - used
        index, jd, km = np.array(table["index"]), np.array(table["time"].jd), table["distance"].to_value(u.km)
        truth = truth or (index, jd, km)
        listed = {"index": truth[0], "jd": truth[1], "sigma": np.zeros(len(truth[1]))}
        match = matches(listed, index, jd)
        gap = np.abs(km[match[match >= 0]] - truth[2][match >= 0])
        q = np.percentile(gap, [50, 99, 100])
        print(
            f"{error:10g} {table.meta['tolerance']:9.1e} {100.0 * count / used:14.0f} {len(table):8d} "
            f"{(match < 0).sum():5d} {np.unique(index).size:9d} {q[0]:11.3g} {q[1]:9.3g} {q[2]:12.3g}"
        )


def main(arguments: list[str]) -> int:
    """Print the tables."""
    if arguments == ["stages"]:
        stages()
        return 0
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("found", nargs="?", type=Path, help="table of the search")
    parser.add_argument("--every", type=int, default=1, metavar="N", help="every Nth orbit of the catalogue")
    options = parser.parse_args(arguments)
    asteroids = catalogue(DATA / "nea_mpc_2026-02.csv.gz")[:: options.every]
    table = search(asteroids, options.found)
    index, jd, au = np.array(table["index"]), np.array(table["time"].jd), table["distance"].to_value(u.au)
    listed = rows_of_cneos(asteroids)
    there = listed["index"] >= 0
    found = matches(listed, index, jd)
    good = listed["sigma"] < 1.0
    print(f"CNEOS 2021: {there.size} rows, {there.sum()} of asteroids that the catalogue has")
    well = certain(asteroids)
    stop = Time("2040-01-01", scale="tdb").jd
    mine = np.isin(index, well) & (jd < stop)
    known = np.isin(np.arange(index.size), found[found >= 0])
    year, year_listed = (2000.0 + (days - 2451545.0) / 365.25 for days in (jd, listed["jd"]))
    print(
        f"{'decade':8} {'rows':>6} {'found':>6} {'recall':>8}   {'3 sigma < 1 min':>15} {'found':>6} {'recall':>8}   "
        f"{'all found':>14} {'listed':>6} {'precision':>9} {'|dt| median (s)':>15}"
    )
    for decade in (*range(1950, 2040, 10), None):
        low, high = (1950, 2040) if decade is None else (decade, decade + 10)
        all_rows = there & (year_listed >= low) & (year_listed < high)
        these, some = all_rows & good, mine & (year >= low) & (year < high)
        hit = these & (found >= 0)
        late = np.median(np.abs(jd[found[hit]] - listed["jd"][hit])) * 86400.0
        got, best = (all_rows & (found >= 0)).sum(), (some & known).sum()
        print(
            f"{decade or 'all'!s:8} {all_rows.sum():6d} {got:6d} {got / all_rows.sum():8.2%}   "
            f"{these.sum():15d} {hit.sum():6d} {hit.sum() / these.sum():8.2%}   "
            f"{some.sum():14d} {best:6d} {best / some.sum():9.2%} {late:15.1f}"
        )
    _causes(asteroids, listed, there & good & (found < 0))
    print("\nencounters found of asteroids with well-known orbits (JPL) that are missing in the list")
    for k in np.flatnonzero(mine & ~known)[:40]:
        day = Time(jd[k], format="jd", scale="tdb").iso[:16]
        print(f"  {asteroids[index[k]].name:14} {day} {au[k]:.6f} au")
    return 0


def _causes(asteroids: tuple[Asteroid, ...], listed: dict[str, np.ndarray], missed: np.ndarray) -> None:
    """Print each row that was not found with the encounter of the same orbit nearest in time, within 0.3 au."""
    print("\nrows known to a minute that were not found, and the encounter of the same orbit nearest in time")
    for k in np.flatnonzero(missed):
        asteroid = asteroids[listed["index"][k]]
        day = Time(listed["jd"][k], format="jd", scale="tdb")
        near = find_encounters(asteroid, day - 100 * u.d, day + 100 * u.d, within=0.3 * u.au, growth=True)
        text = "none within 0.3 au"
        if len(near):
            row = near[int(np.argmin(np.abs((near["time"] - day).to_value(u.d))))]
            text = (
                f"{row['distance'].to_value(u.au):.6f} au, {(row['time'] - day).to_value(u.h):+.2f} h, "
                f"growth {row['growth']:.3g}, {row['predictability']}"
            )
        uncertain = asteroid.row.get("condition_code", "") or "-"
        print(
            f"  {listed['des'][k]:12} {day.iso[:16]} {listed['au'][k]:.5f} au; U {uncertain}, epoch "
            f"{asteroid.epoch.iso[:10]}: {text}"
        )


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
