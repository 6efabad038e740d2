"""Close approaches: errors against JPL's list, and object-years per second beside ASSIST in one run.

Accuracy: every approach of January to June 2020 from the orbits of the same solutions, by ephemeris. Each event off
by more than a kilometre is listed with the growth of errors from its epoch, the displacement at the epoch that would
explain it, its error without J2 of the Earth and, where ASSIST is installed, that of ASSIST from the same elements.

Speed: a search for minima of the distance from the Earth below 0.5 au, one thread, processor time. Errors are against
ASSIST at its tightest with all sources of relativity (its default is the Sun alone); without ASSIST against this search
with every force at the least tolerance.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING

import astropy.units as u
import numpy as np
from astropy.time import Time
from astropy.units import Quantity

from flybystab.bench import oracle
from flybystab.bench.jpl import SPAN, approaches, orbits
from flybystab.constants import AU
from flybystab.errors import MissingExtra
from flybystab.orbit.ephemeris import ephemeris
from flybystab.orbit.forces import FORCES
from flybystab.orbit.orbit import Orbit
from flybystab.orbit.search.encounter_finder import find_encounters
from flybystab.plots.style import save
from flybystab.typing import Array, Document

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WITHIN = 0.5
#: Target errors of the search, km (default 0.1), and tolerances of ASSIST.
ERRORS = (0.01, 0.1, 1.0, 10.0)
EPSILONS = (1e-6, 1e-4, 1e-3)
TIGHT = 1e-9
YEARS = (0.6, 10.0)


def rows(figure: str | Path | None = None, asteroids: int = 500) -> list[Document]:
    """Rows of three tables, named in the column ``table``: ``accuracy``, ``outlier``, ``speed``."""
    known = orbits()
    out: list[Document] = []
    for name in ("de421", "de440"):
        try:
            ephemeris(name)
        except MissingExtra:
            continue
        out += _accuracy(known, name)
    some = [orbit for orbit, _ in known.values()]
    chosen = [some[i] for i in np.linspace(0, len(some) - 1, asteroids).astype(int)]
    for years in YEARS:
        out += _speed(chosen, years)
    if figure is not None:
        _plot(out, figure)
    return out


def _accuracy(known: dict[str, tuple[Orbit, str]], name: str) -> list[Document]:
    found = approaches(known, name, growth=True)
    au = np.array([float(e["dist"]) for e in found.events])
    lost = np.isnan(found.distance)
    size = np.abs(found.distance[~lost])
    median, p90, p99 = np.percentile(size, [50, 90, 99])
    out: list[Document] = [
        {
            "table": "accuracy",
            "ephemeris": name,
            "events": len(found.events),
            "missed": int(lost.sum()),
            "missed_below_0.2_au": int((lost & (au < 0.2)).sum()),
            "distance_error_median_km": float(median),
            "distance_error_p90_km": float(p90),
            "distance_error_p99_km": float(p99),
            "off_by_more_than_1_km": int((size > 1.0).sum()),
        }
    ]
    for k in np.argsort(-np.abs(np.nan_to_num(found.distance))):
        event = found.events[k]
        if abs(found.distance[k]) > 1.0:
            orbit, solution = known[event["des"]]
            out.append(
                {
                    "table": "outlier",
                    "ephemeris": name,
                    "asteroid": event["des"],
                    "time_tdb": event["cd"],
                    "distance_au": float(event["dist"]),
                    "distance_error_km": float(found.distance[k]),
                    "time_error_s": float(found.time[k]),
                    "error_of_assist_km": _by_assist(orbit, event),
                    "error_without_earth_j2_km": _without_earth_j2(orbit, event, name),
                    "growth": float(found.growth[k]),
                    "displacement_at_epoch_km": float(abs(found.distance[k]) / found.growth[k]),
                    "days_from_epoch": float(event["jd"]) - orbit.epoch.jd,
                    "solution": solution,
                    "solution_of_list": event["orbit_id"],
                }
            )
    return out


def _by_assist(orbit: Orbit, event: dict[str, str]) -> float | None:
    """Distance by ASSIST minus that of the list, km; None without ASSIST."""
    if oracle.missing():
        return None
    there = oracle.Oracle(Time(float(event["jd"]), format="jd", scale="tdb"))
    found = there.encounters(orbit, *SPAN, 0.6 * AU, TIGHT)
    nearest = found[np.argmin(np.abs(found[:, 0])), 1]
    return float(nearest / 1e3 - float(event["dist"]) * AU / 1e3)


def _without_earth_j2(orbit: Orbit, event: dict[str, str], name: str) -> float:
    """Distance by the search with all forces except J2 of the Earth minus that of the list, km."""
    forces = tuple(force for force in FORCES if force != "earth J2")
    table = find_encounters(orbit, *SPAN, within=0.6 * u.au, ephemeris=name, forces=forces)
    nearest = table[np.argmin(np.abs(table["time"].jd - float(event["jd"])))]
    return float((nearest["distance"] - float(event["dist"]) * u.au).to_value(u.km))


def _speed(chosen: list[Orbit], years: float) -> list[Document]:
    start = SPAN[0]
    stop = Time(start.jd + 365.25 * years, format="jd", scale="tdb")
    span = len(chosen) * years
    out: list[Document] = []

    def ours(
        error: Quantity = 0.1 * u.km, forces: tuple[str, ...] | None = None, tolerance: float | None = None
    ) -> tuple[list[Array], float]:
        begin = time.process_time()
        table = find_encounters(
            chosen,
            start,
            stop,
            within=WITHIN * u.au,
            workers=1,
            error=error,
            forces=forces,
            tolerance=tolerance,
        )
        used = time.process_time() - begin
        flat = np.column_stack([table["time"].jd - start.jd, table["distance"].to_value(u.m)])
        index = np.array(table["index"])
        return [flat[index == i] for i in range(len(chosen))], used

    def row(code: str, setting: str, found: list[Array], used: float, truth: list[Array] | None) -> None:
        gaps, missed = differences(found, truth) if truth is not None else (np.zeros(0), 0)
        q = np.percentile(gaps, [50, 99]) if gaps.size else [None, None]
        out.append(
            {
                "table": "speed",
                "years": years,
                "asteroids": len(chosen),
                "code": code,
                "setting": setting,
                "object_years_per_s": span / used,
                "encounters": sum(map(len, found)),
                "missed": missed,
                "distance_error_median_km": None if q[0] is None else float(q[0]) / 1e3,
                "distance_error_p99_km": None if q[1] is None else float(q[1]) / 1e3,
            }
        )

    ours()  # compiled, and the ephemeris read
    if oracle.missing():
        truth, _ = ours(forces=FORCES, tolerance=1e-14)
    else:
        everything, usual = (oracle.Oracle(start, n) for n in (oracle.ALL_SOURCES, oracle.SUN_ALONE))

        def assist(
            epsilon: float, there: oracle.Oracle = usual, search: bool = True
        ) -> tuple[list[Array], float]:
            begin = time.process_time()
            found = [there.encounters(o, start, stop, WITHIN * AU, epsilon, search) for o in chosen]
            return found, time.process_time() - begin

        truth, used = assist(TIGHT, everything)
        row("ASSIST", f"epsilon {TIGHT:.0e}, all sources of 1PN", truth, used, truth)
        for epsilon in EPSILONS[:1]:
            row("ASSIST", f"epsilon {epsilon:.0e}, all sources of 1PN", *assist(epsilon, everything), truth)
        for epsilon in EPSILONS:
            row("ASSIST", f"epsilon {epsilon:.0e}", *assist(epsilon), truth)
            row("ASSIST", f"epsilon {epsilon:.0e}, integration only", *assist(epsilon, search=False), None)
    for error in ERRORS:
        row("flybystab", f"error {error:g} km", *ours(error=error * u.km), truth)
    return out


def differences(found: list[Array], truth: list[Array]) -> tuple[Array, int]:
    """Differences of distance (m) of encounters less than a day apart, and the number of `truth` that are missed.

    Encounters within 1e-3 of the largest distance of a search may be on either side of it: they never count as missed.
    """
    gaps, missed = [], 0
    for mine, theirs in zip(found, truth, strict=True):
        for t, d in theirs:
            late = np.abs(mine[:, 0] - t)
            if late.size and late.min() < 1.0:
                gaps.append(abs(mine[np.argmin(late), 1] - d))
            elif d < 0.999 * WITHIN * AU:
                missed += 1
    return np.array(gaps), missed


def lines(rows: list[Document]) -> list[str]:
    """The tables as text."""
    out = [
        "JPL close approaches of 2020 January to June, from the orbits of the same solutions",
        f"{'ephemeris':10s} {'events':>6s} {'missed':>6s} {'below 0.2 au':>12s} {'median (km)':>11s} {'p90 (km)':>9s} "
        f"{'p99 (km)':>9s} {'off by > 1 km':>13s}",
    ]
    out += [
        f"{r['ephemeris']:10s} {r['events']:6d} {r['missed']:6d} {r['missed_below_0.2_au']:12d} "
        f"{r['distance_error_median_km']:11.4f} {r['distance_error_p90_km']:9.4f} {r['distance_error_p99_km']:9.4f} "
        f"{r['off_by_more_than_1_km']:13d}"
        for r in rows
        if r["table"] == "accuracy"
    ]
    out += [
        "",
        "events off by more than 1 km; ASSIST: the same elements with DE440; at epoch: off/growth",
        f"{'ephemeris':10s} {'asteroid':10s} {'time (TDB)':17s} {'(au)':>7s} {'off (km)':>9s} {'(s)':>9s} "
        f"{'ASSIST (km)':>11s} {'without Earth J2':>16s} {'growth':>7s} {'at epoch (km)':>13s} {'epoch (d)':>9s}",
    ]
    for r in rows:
        if r["table"] == "outlier":
            other = "-" if r["error_of_assist_km"] is None else f"{r['error_of_assist_km']:.3f}"
            out.append(
                f"{r['ephemeris']:10s} {r['asteroid']:10s} {r['time_tdb']:17s} {r['distance_au']:7.4f} "
                f"{r['distance_error_km']:9.3f} {r['time_error_s']:9.2f} {other:>11s} "
                f"{r['error_without_earth_j2_km']:16.3f} {r['growth']:7.1f} {r['displacement_at_epoch_km']:13.3f} "
                f"{r['days_from_epoch']:9.1f}"
            )
    speed = [r for r in rows if r["table"] == "speed"]
    reason = oracle.missing()
    out += [
        "",
        f"Encounters with the Earth below {WITHIN:g} au, {speed[0]['asteroids']} asteroids, one thread, processor time"
        + (f"; no ASSIST: {reason}" if reason else "; errors against the first row of ASSIST"),
        f"{'years':>6s} {'code':10s} {'setting':34s} {'object-years/s':>14s} {'found':>8} {'missed':>6s} "
        f"{'median (km)':>11s} {'p99 (km)':>9s}",
    ]
    for r in speed:
        q = [
            "-" if r[f"distance_error_{k}_km"] is None else f"{r[f'distance_error_{k}_km']:.3g}"
            for k in ("median", "p99")
        ]
        out.append(
            f"{r['years']:6.1f} {r['code']:10s} {r['setting']:34s} {r['object_years_per_s']:14.0f} "
            f"{r['encounters']:8d} {r['missed']:6d} {q[0]:>11s} {q[1]:>9s}"
        )
    return out


def _plot(rows: list[Document], path: str | Path) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    figure = Figure(figsize=(6.0, 4.2), layout="constrained")
    FigureCanvasAgg(figure)
    panel: Axes = figure.subplots()
    speed = [r for r in rows if r["table"] == "speed" and r["distance_error_median_km"]]
    for (code, years), marker in zip(
        dict.fromkeys((r["code"], r["years"]) for r in speed), "oxs^", strict=False
    ):
        points = [
            (r["object_years_per_s"], r["distance_error_median_km"])
            for r in speed
            if (r["code"], r["years"]) == (code, years)
        ]
        panel.loglog(*zip(*points, strict=True), marker=marker, label=f"{code}, {years:g} years")
    panel.set(
        xlabel="object-years per second, one thread",
        ylabel="median distance error (km)",
        title="Search for encounters",
    )
    panel.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    panel.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
    panel.xaxis.set_minor_formatter(NullFormatter())
    panel.legend(frameon=False)
    save(figure, path)
