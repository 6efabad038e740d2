"""Errors of orbits estimated from printed digits and U, compared with later and better orbits, as tables.

Usage: ``python benchmarks/orbit_errors.py [runoff] [digits] [impacts] [model] [factor] [coverage] [growth]``. Reference
data are read from ``../shared/data`` (or ``$FLYBYSTAB_SHARED/data``); nothing is downloaded.
"""

from __future__ import annotations

import os
import sys
import time
import zlib
from collections.abc import Sequence
from pathlib import Path

import astropy.units as u
import numpy as np
from astropy.coordinates import GCRS, ITRS, CartesianRepresentation
from astropy.table import QTable
from astropy.time import Time
from numpy.typing import NDArray

from flybystab.catalogues import orbit_errors
from flybystab.catalogues.asteroid import Asteroid
from flybystab.catalogues.catalogue import catalogue
from flybystab.catalogues.orbit_errors import FACTOR
from flybystab.catalogues.orbit_errors import runoff as sigma_of_code
from flybystab.constants import AU, YEAR
from flybystab.encounter.encounter import Encounter
from flybystab.orbit.ephemeris import Window, ephemeris
from flybystab.orbit.epochs import later, seconds
from flybystab.orbit.forces import FORCES
from flybystab.orbit.nongravitational import NONE
from flybystab.orbit.orbit import Orbit
from flybystab.orbit.predictability import deviations_of
from flybystab.orbit.search import neighbours
from flybystab.orbit.search.acceleration import field
from flybystab.orbit.search.encounter_finder import find_encounters
from flybystab.orbit.search.neighbours import carry, spread
from flybystab.orbit.search.steps import empty_room
from flybystab.screening.draws import identity

DATA = Path(os.environ.get("FLYBYSTAB_SHARED", Path(__file__).resolve().parents[1] / "../shared")) / "data"
NEW, OLD, MPC = "nea_sbdb_fullprec_2026-07", "nea_sbdb_fullprec_2020-09", "nea_mpc_2026-02"
#: All that were found before they hit the Earth, of those that the table has.
FELL = (
    *(
        "2008 TC3",
        "2014 AA",
        "2018 LA",
        "2019 MO",
        "2022 EB5",
        "2022 WJ1",
        "2023 CX1",
        "2024 BX1",
        "2024 RW1",
    ),
    *("2024 UQ", "2024 XA1"),
)
#: Where orbits are compared: the epoch of JPL's orbits of 2026.
MEETING = Time(2461200.5, format="jd", scale="tdb")


def read(name: str) -> dict[str, Asteroid]:
    """Asteroids of one of the tables."""
    return {identity(a): a for a in catalogue(DATA / f"{name}.csv.gz")}


def places(orbits: Sequence[Orbit], time: Time, window: Window) -> NDArray[np.float64]:
    """Barycentric places, shape (n, 3), m, with all point masses and 1PN."""
    forces = field(window, [n for n in FORCES if n.endswith("point mass") or n == "1PN"])
    room, out = empty_room(), np.full((len(orbits), 1, 6), np.nan)
    for i, orbit in enumerate(orbits):
        push = orbit.nongrav
        law = push.parameters if push.active else NONE
        start = seconds(orbit.epoch, window.epoch)
        carry(
            forces,
            law,
            start,
            orbit.barycentric(window),
            np.array([seconds(time, window.epoch)]),
            1e-13,
            room,
            out[i],
        )
    return out[:, 0, :3]


def displacement(orbit: Orbit, time: Time, window: Window) -> float:
    """1-sigma error of an orbit in the least certain direction at a time, m."""
    forces = field(window, [n for n in FORCES if n.endswith("point mass") or n == "1PN"])
    law = orbit.nongrav.parameters
    times = np.array([seconds(time, window.epoch)])
    return float(spread(deviations_of(orbit), forces, law, window, times, 1e-13).displacement[0])


def runoff() -> list[str]:
    """JPL's orbits of 2020 against those of 2026, by the code that JPL gave them in 2020 (that of the MPC, U)."""
    old, new = read(OLD), read(NEW)
    keys = [
        k
        for k, a in old.items()
        if k in new
        and a.row.get("condition_code", "").isdigit()
        and abs(seconds(a.epoch, MEETING)) < 7.0 * YEAR
    ]
    keys = [k for k in keys if abs(seconds(new[k].epoch, MEETING)) < 2.0 * YEAR]
    # code 0 has most of the rows: one in ten of them
    well = [k for k in keys if old[k].row["condition_code"] == "0"][::10]
    keys = [k for k in keys if old[k].row["condition_code"] != "0"] + well
    window = ephemeris("de440").window(MEETING, -8.0 * YEAR, 2.0 * YEAR)
    gap = places([old[k].orbit for k in keys], later(MEETING, 1.0), window)
    gap -= places([new[k].orbit for k in keys], later(MEETING, 1.0), window)
    axes = np.array([float(old[k].row["a_au"]) * AU for k in keys])
    spans = np.array([-seconds(old[k].epoch, MEETING) for k in keys])
    rate = np.linalg.norm(gap, axis=1) / axes / spans
    code = np.array([int(old[k].row["condition_code"]) for k in keys])
    unit = np.degrees(1.0) * 3600.0 * 10.0 * YEAR
    out = [
        "JPL's orbits of 2020-09 at the epoch of those of 2026-07: distance over semi-major axis, arcsec in ten years",
        "code orbits    sigma   median     68 %     95 %  within sigma  2 sigma",
    ]
    ratio = np.array([r / (sigma_of_code(int(c)) * FACTOR) for r, c in zip(rate, code, strict=True)])
    for c in [*range(10), None]:
        here = np.isfinite(rate) & (code == c if c is not None else code >= 0)
        shares = f"{100 * np.mean(ratio[here] < 1.0):11.0f} % {100 * np.mean(ratio[here] < 2.0):6.0f} %"
        if c is None:
            out.append(f" all {here.sum():6d} {'':35s} {shares}")
        elif here.any():
            measured = np.percentile(rate[here] * unit, [50, 68, 95])
            numbers = " ".join(f"{x:8.3g}" for x in (sigma_of_code(c) * FACTOR * unit, *measured))
            out.append(f"{c:4d} {here.sum():6d} {numbers} {shares}")
    return out


def digits() -> list[str]:
    """Orbits of the MPC compared with JPL's, by U, in sigma by digits and U in the least certain direction."""
    mpc, new = read(MPC), read(NEW)
    keys = [k for k in mpc if k in new and mpc[k].orbit.covariance is not None]
    keys = [k for k in keys if abs(seconds(new[k].epoch, MEETING)) < 2.0 * YEAR]
    well = [k for k in keys if mpc[k].row["condition_code"] == "0"][::6]
    keys = [k for k in keys if mpc[k].row["condition_code"] != "0"] + well
    code = np.array([int(mpc[k].row["condition_code"] or 9) for k in keys])
    window = ephemeris("de440").window(MEETING, -11.0 * YEAR, 11.0 * YEAR)
    out = [
        "Orbits of the MPC of 2026-02 against JPL's of 2026-07 (km), and what digits and U say (one sigma)",
        "  years  U    orbits      sigma     median       95 %  within sigma  2 sigma  3 sigma",
    ]
    for years in (0.0, 10.0, -10.0):
        time = later(MEETING, years * YEAR + 1.0)
        ours = places([mpc[k].orbit for k in keys], time, window)
        gap = np.linalg.norm(places([new[k].orbit for k in keys], time, window) - ours, axis=1)
        sigma = np.array([displacement(mpc[k].orbit, time, window) for k in keys])
        for label, some in (("0", [0]), ("1-2", [1, 2]), ("3-5", [3, 4, 5]), ("6-9", [6, 7, 8, 9])):
            here = np.isin(code, some) & np.isfinite(gap) & np.isfinite(sigma)
            r = gap[here] / sigma[here]
            shares = " ".join(f"{100 * np.mean(r < n):6.0f} %" for n in (1, 2, 3))
            sizes = np.median(sigma[here]), np.median(gap[here]), np.percentile(gap[here], 95)
            typical = " ".join(f"{x / 1e3:10.4g}" for x in sizes)
            out.append(f"{years:7.0f}  {label:4s} {here.sum():6d} {typical} {shares}")
    return out


def impacts() -> list[str]:
    """Asteroids discovered before their impact: entry on the orbit of the MPC, and its predictability."""
    mpc = read(MPC)
    out = [
        "Asteroids seen before they fell, on orbits of the MPC: where they reach 100 km",
        "asteroid   U  time (UTC)             lat (deg) lon (deg)  km/s  one sigma (km)",
    ]
    for name in FELL:
        rock = mpc[name]
        passage = Encounter.from_orbit(rock.orbit, "earth", rock.epoch, search=3 * u.d, ephemeris="de440")
        if passage.impact_time is None or passage.displacement is None:
            out.append(f"{name:9s} {rock.row['condition_code']:>2s}  no impact")
            continue
        when = later(passage.time, passage.impact_time).utc
        place = GCRS(CartesianRepresentation(passage.position(passage.impact_time * u.s)), obstime=when)
        at = place.transform_to(ITRS(obstime=when)).earth_location.to_geodetic()
        speed = np.linalg.norm(passage.velocity(passage.impact_time * u.s).value) / 1e3
        known = f"{passage.displacement.to_value(u.km):15.3g}  {passage.predictability}"
        code = rock.row["condition_code"]
        out.append(
            f"{name:9s} {code:>2s}  {when.iso[:19]} {at.lat.deg:11.2f} {at.lon.deg:9.2f} {speed:5.1f} {known}"
        )
    return out


def deviation(orbit: Orbit, truth: Orbit, time: Time, window: Window) -> float:
    """Error of an orbit at a time in the least certain direction, in units of its sigma."""
    pairs = orbit.sigma_points("de440")
    points = places([x for pair in pairs for x in pair] + [orbit, truth], time, window)
    columns = 0.5 * (points[0:-2:2] - points[1:-2:2])
    values, axes = np.linalg.eigh(columns.T @ columns)
    return float((points[-1] - points[-2]) @ axes[:, -1] / np.sqrt(values[-1]))


def _reliable(orbit: Orbit) -> bool:
    return orbit.covariance is not None and orbit.covariance.reliable


def pairs(size: int = 200) -> dict[str, list[tuple[Orbit, Orbit]]]:
    """Orbits with their stated errors, and later or better orbits of the same asteroids, by source of the errors."""
    old, new, mpc = read(OLD), read(NEW), read(MPC)
    late = {k: a.orbit for k, a in new.items() if abs(seconds(a.epoch, MEETING)) < 2.0 * YEAR}
    rng = np.random.default_rng(2)

    def some(keys: Sequence[str]) -> list[str]:
        return [keys[i] for i in rng.permutation(len(keys))[:size]]

    def plain(asteroid: Asteroid) -> Orbit:
        """The orbit by its digits and U alone."""
        row = {c: v for c, v in asteroid.row.items() if not c.startswith("sigma")}
        return Asteroid(row, file=asteroid.file).orbit

    near = [k for k, a in old.items() if k in late and abs(seconds(a.epoch, MEETING)) < 7.0 * YEAR]
    given = [k for k in near if old[k].orbit.covariance is not None]
    out = {}
    for label, low, high in (("0", 0, 0), ("1 to 9", 1, 9)):
        code = [
            k
            for k in given
            if old[k].row["condition_code"] and low <= int(old[k].row["condition_code"]) <= high
        ]
        chosen = some(code)
        out[f"JPL 2020, 1-sigmas, code {label}"] = [(old[k].orbit, late[k]) for k in chosen]
        out[f"JPL 2020, code {label} alone"] = [(plain(old[k]), late[k]) for k in chosen]
    keys = [k for k in mpc if k in late and mpc[k].row["condition_code"].isdigit()]
    reliable = {k for k in keys if _reliable(mpc[k].orbit)}
    for which, group in (("", reliable), ("weak, old, ", set(keys) - reliable)):
        for low, high in ((0, 0), (1, 2), (3, 5), (6, 9)):
            among = [k for k in keys if k in group and low <= int(mpc[k].row["condition_code"]) <= high]
            label = f"U {low}" if low == high else f"U {low}-{high}"
            out[f"MPC 2026, {which}{label}"] = [(mpc[k].orbit, late[k]) for k in some(among)]
    files = sorted((DATA / "neocc").glob("*.ke1"))
    own = [catalogue(f)[0] for f in files]
    out["NEOCC, covariances"] = [(a.orbit, late[identity(a)]) for a in own if identity(a) in late]
    return out


def factor(size: int = 500) -> list[str]:
    """Fractions of errors within 1 and 3 sigma for several factors of the runoff, for two halves of the asteroids.

    The first half is that used to choose ``orbit_errors.FACTOR``; `size` limits the asteroids with U = 0.
    """
    new, mpc = read(NEW), read(MPC)
    late = {k: a.orbit for k, a in new.items() if abs(seconds(a.epoch, MEETING)) < 2.0 * YEAR}
    keys = [k for k in mpc if k in late and mpc[k].row["condition_code"].isdigit()]
    best = [k for k in keys if mpc[k].row["condition_code"] == "0"]
    kept = {best[i] for i in np.random.default_rng(0).permutation(len(best))[:size]}
    keys = [k for k in keys if mpc[k].row["condition_code"] != "0" or k in kept]
    window = ephemeris("de440").window(MEETING, -8.0 * YEAR, 2.0 * YEAR)
    known = {k: _reliable(mpc[k].orbit) for k in keys}
    out = [
        "Orbits of the MPC of 2026-02 against JPL's of 2026-07, by the part of the runoff that is one sigma",
        "                         choice, half of the asteroids          the other half",
        "orbits      sigma/runoff   number  1 sigma       3 sigma   number  1 sigma       3 sigma",
    ]
    for label, reliable in (("others", True), ("weak, old", False)):
        for share in (1.0 / 3.0, 0.5, 2.0 / 3.0, 1.0):
            orbit_errors.FACTOR = orbit_errors.FACTOR_UNRELIABLE = share
            cells = []
            for half in (0, 1):
                some = [k for k in keys if known[k] is reliable and zlib.crc32(k.encode()) % 2 == half]
                found = [Asteroid(mpc[k].row, file=mpc[k].file).orbit for k in some]
                z = [
                    abs(deviation(o, late[k], later(MEETING, 1.0), window))
                    for o, k in zip(found, some, strict=True)
                ]
                shares = [float(np.nanmean(np.array(z) < n)) for n in (1.0, 3.0)]
                error = np.sqrt(0.99 * 0.01 / len(z))
                cells.append(
                    f"{len(z):6d} {100 * shares[0]:6.0f} % {100 * shares[1]:6.1f} +- {100 * error:3.1f} %"
                )
            out.append(f"{label:11s} {share:12.2f}   " + "   ".join(cells))
    orbit_errors.FACTOR, orbit_errors.FACTOR_UNRELIABLE = FACTOR, 1.0
    return out


def coverage() -> list[str]:
    """Stated errors of orbits compared with later orbits: fractions within 1 and 3 sigma, least certain direction."""
    window = ephemeris("de440").window(MEETING, -8.0 * YEAR, 2.0 * YEAR)
    out = [
        "Stated errors against JPL's orbits of 2026-07 at their epoch, along the direction least known",
        "(weak, old: one opposition or U of 3 and more, observed more than four years before; never called determined)",
        "source                          orbits  median |z|  within 1 sigma  within 3 sigma",
        "normal distribution                          0.67            68 %            99.7 %",
    ]
    for label, found in pairs().items():
        z = np.array([abs(deviation(a, b, later(MEETING, 1.0), window)) for a, b in found])
        z = z[np.isfinite(z)]
        if not len(z):
            continue
        shares = [np.mean(z < n) for n in (1.0, 3.0)]
        spreads = [np.sqrt(max(p * (1.0 - p), 0.25 / len(z)) / len(z)) for p in shares]
        cells = "   ".join(
            f"{100 * p:5.0f} +- {100 * s:3.0f} %" for p, s in zip(shares, spreads, strict=True)
        )
        out.append(f"{label:31s} {len(z):6d} {np.median(z):11.2f} {cells}")
    return out


def model() -> list[str]:
    """Closest approaches of 400 asteroids with DE421 and DE440: how far apart they are, by the time from the epoch."""
    asteroids = list(catalogue(DATA / f"{NEW}.csv.gz"))
    orbits = [asteroids[i].orbit for i in np.random.default_rng(1).permutation(len(asteroids))[:400]]
    span = Time("1950-01-01", scale="tdb"), Time("2049-01-01", scale="tdb")
    ours, other = (
        find_encounters(orbits, *span, within=0.05 * u.au, ephemeris=name, growth=True)
        for name in ("de440", "de421")
    )
    found = []
    for row in ours:
        if row["model_error"].to_value(u.km) > 5.0:  # beyond an earlier encounter
            continue
        near = other[other["index"] == row["index"]]
        late = np.abs((near["time"] - row["time"]).to_value(u.s))
        if not len(near) or late.min() > 3.0 * 86400.0:
            continue
        beside = near[int(np.argmin(late))]
        gap = np.linalg.norm((beside["position"] - row["position"]).to_value(u.km))
        along = late.min() * row["v_rel"].to_value(u.km / u.s)
        epoch = orbits[int(row["index"])].epoch
        found.append((abs((row["time"] - epoch).to_value(u.yr)), np.hypot(gap, along)))
    years, gaps = np.array(found).T
    out = [
        "Closest approaches with DE421 and DE440: distance of the asteroids, km",
        "  years   rows   median     68 %     95 %",
    ]
    for low, high in ((0, 5), (5, 10), (10, 20), (20, 40), (40, 80)):
        here = gaps[(years >= low) & (years < high)]
        out.append(
            f"{low:3d}-{high:<3d} {here.size:6d} "
            + " ".join(f"{x:8.3g}" for x in np.percentile(here, [50, 68, 95]))
        )
    return out


def growth() -> list[str]:
    """``find_encounters(growth=True)`` by state transition matrices against sigma points; time over a plain search."""
    asteroids = [a for a in catalogue() if a.orbit.covariance is not None][::3]
    span = Time("1960-01-01", scale="tdb"), Time("2080-01-01", scale="tdb")

    def run(asteroid: Asteroid, how: bool, linear: float) -> tuple[QTable, float]:
        neighbours._LINEAR, begin = linear, time.process_time()
        found = find_encounters(asteroid, *span, within=0.1 * u.au, growth=how, workers=1)
        return found, time.process_time() - begin

    used = neighbours._LINEAR
    for linear in (used, -1.0):  # compilation
        run(next(a for a in asteroids if a.name == "Apophis"), True, linear)
    seconds_used, gaps, classes = np.zeros(3), [], 0
    for asteroid in asteroids:
        runs = [run(asteroid, False, used), run(asteroid, True, used), run(asteroid, True, -1.0)]
        seconds_used += [r[1] for r in runs]
        ours, points = (r[0] for r in runs[1:])
        if len(ours):
            gaps += list(np.abs((ours["displacement"] / points["displacement"]).to_value(u.one) - 1.0))
            classes += int(np.sum(ours["predictability"] != points["predictability"]))
    neighbours._LINEAR = used
    plain, ours_s, points_s = seconds_used
    return [
        f"{len(asteroids)} asteroids, {len(gaps)} encounters within 0.1 au of the Earth, 1960 to 2080, one thread",
        f"plain search {plain:.1f} s, growth=True {ours_s:.1f} s ({ours_s / plain:.1f} times as long), "
        f"with sigma points for all {points_s:.1f} s ({points_s / plain:.1f})",
        f"displacement: relative difference {np.median(gaps):.1e} (median), {np.max(gaps):.1e} (largest); "
        f"{classes} of other predictability",
    ]


def main(arguments: list[str]) -> int:
    """Print the tables that were asked for, by default all."""
    known = {
        "runoff": runoff,
        "digits": digits,
        "impacts": impacts,
        "model": model,
        "factor": factor,
        "coverage": coverage,
        "growth": growth,
    }
    for name in arguments or list(known):
        if name not in known:
            print(f"no table {name!r}: there are {', '.join(known)}", file=sys.stderr)
            return 2
        print("\n".join(known[name]()) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
