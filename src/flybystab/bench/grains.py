"""Piles of grains: cost, numerical errors beside the scatter between piles, and an independent soft-sphere code.

Tables: cost of the reference flyby (541 grains, Earth at 2.0 radii, 5 km/s) on one core; change of the outcome with
half the step, half the stiffness and other numerical choices for the same piles at 2.2 radii, beside the scatter
between piles; outcome against the number of grains; and, where the reference data are available, their flybys at 5 km/s
and 6 h as distributions over piles, with the verdicts of the ellipsoid. ``benchmarks/grains_agreement.py`` compares all
of them.
"""

from __future__ import annotations

import csv
import os
import time
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import astropy.units as u
import numpy as np
from scipy.spatial.transform import Rotation

from flybystab.bench.jpl import SHARED
from flybystab.body.body import Body, Material
from flybystab.body.pile import make_pile
from flybystab.core.grains.gravity import direct_sum
from flybystab.core.grains.tree import opening, tree_sum
from flybystab.core.numerics.threads import in_order
from flybystab.encounter.encounter import Encounter
from flybystab.flybys.flyby import flyby
from flybystab.flybys.grains_flyby import grains_flyby
from flybystab.flybys.grains_outcome import GrainsRun
from flybystab.flybys.grains_run import one_pile
from flybystab.typing import Document
from flybystab.units import R_earth

#: Flybys of an independent soft-sphere code (Earth; piles of about 570 grains with a friction angle of 35 deg).
REFERENCE = SHARED / "grains_reference.csv"

#: Selects flybys by periapsis (Earth radii), v_inf (km/s), period (h) and phase (deg).
Filter = Callable[[float, float, float, float], bool]
GRAINS = 541
#: Numerical choices: name, options of the simulation.
VARIANTS: tuple[tuple[str, dict[str, float]], ...] = (
    ("default", {}),
    ("half the step", {"steps_per_contact": 30.0}),
    ("half the stiffness", {"overlap": 0.004}),
    ("twice the stiffness", {"overlap": 0.001}),
    ("gravity at every step", {"gravity_interval": 0.0}),
    ("gravity half as often", {"gravity_interval": 0.015}),
    ("twice the skin", {"skin": 0.3}),
)


def body(period: float = 6.0) -> Body:
    """The pile of the reference flybys; a negative period (h) is retrograde, zero is no spin."""
    rate = 2.0 * np.pi / (3600.0 * period) if period else 0.0
    return Body(
        semi_axes=[1408, 850, 748] * u.m,
        density=2000 * u.kg / u.m**3,
        spin=[0.0, 0.0, rate] * u.rad / u.s,
        material=Material(friction_angle=35.0 * u.deg),
    )


def earth(q: float, v_inf: float = 5.0) -> Encounter:
    """Encounter with the Earth: periapsis in Earth radii, v_inf in km/s."""
    return Encounter.hyperbolic(
        "earth", periapsis=q * R_earth, v_inf=v_inf * u.km / u.s, start_distance=10 * R_earth
    )


def _run(q: float, seed: int, grains: int = GRAINS, **options: Any) -> tuple[GrainsRun, float]:
    """Run of one pile through an encounter with the Earth, and processor time of the thread, s."""
    pile = make_pile(body(), grains, seed, **options)
    begun = time.thread_time()
    run = one_pile(pile, body(), earth(q), np.eye(3), seed)
    return run, time.thread_time() - begun


def _run_of(q: float, grains: int, seed: int) -> tuple[GrainsRun, float]:
    return _run(q, seed, grains)


def _shape(run: GrainsRun) -> dict[str, float]:
    return {
        "largest": run.largest_fraction,
        "bound": run.bound_fraction,
        "stretch": run.stretch,
        "ratio21": float(run.semi_axes[1] / run.semi_axes[0]),
        "period_h": float((2.0 * np.pi * u.rad / run.spin).to_value(u.h)),
    }


def cost(seeds: int = 2) -> list[Document]:
    """Processor time of the reference flyby on one core, for several piles."""
    _run(3.0, 0, 100)  # compiled
    out = []
    for q in (2.0, 5.96):
        for seed in range(seeds):
            run, cpu = _run(q, seed)
            out.append(
                {
                    "table": "cost",
                    "periapsis_R_E": q,
                    "seed": seed,
                    "cpu_s": cpu,
                    "hours": (run.end_time - run.course.time[0]).to_value(u.h),
                    "steps": run.steps,
                    "grain_step_ns": 1e9 * cpu / (GRAINS * run.steps),
                    **_shape(run),
                }
            )
    return out


def numerics(q: float = 2.2, seeds: int = 4, grains: int = 300) -> list[Document]:
    """Change of stretch and spin of the same piles with other numerical choices, and scatter between piles."""
    out = []
    jobs = [(name, options, seed) for name, options in VARIANTS for seed in range(seeds)]
    found = list(
        in_order(lambda job: _run(q, job[2], grains, **job[1]), jobs, os.cpu_count() or 1),
    )
    stretch = np.array([run.stretch for run, _ in found]).reshape(len(VARIANTS), seeds)
    rate = np.array([run.spin.to_value(u.rad / u.s) for run, _ in found]).reshape(len(VARIANTS), seeds)
    cpu = np.array([t for _, t in found]).reshape(len(VARIANTS), seeds)
    for k, (name, _) in enumerate(VARIANTS):
        out.append(
            {
                "table": "numerics",
                "variant": name,
                "stretch_median": float(np.median(stretch[k])),
                "stretch_change_rms": float(np.sqrt(np.mean(np.log(stretch[k] / stretch[0]) ** 2))),
                "stretch_scatter_of_piles": float(np.std(np.log(stretch[k]), ddof=1)),
                "spin_change_rms": float(np.sqrt(np.mean(np.log(rate[k] / rate[0]) ** 2))),
                "spin_scatter_of_piles": float(np.std(np.log(rate[k]), ddof=1)),
                "cpu_s": float(cpu[k].mean()),
            }
        )
    return out


def resolution(
    q: float = 2.2, counts: tuple[int, ...] = (150, 300, 600, 1200), seeds: int = 4
) -> list[Document]:
    """Outcome against the number of grains; the change is that of the mean of ln(stretch) from the second number."""
    out = []
    jobs = [list(in_order(partial(_run_of, q, n), range(seeds), os.cpu_count() or 1)) for n in counts]
    logs = [np.log([r.stretch for r, _ in found]) for found in jobs]
    base = logs[min(1, len(logs) - 1)]
    for count, found, log in zip(counts, jobs, logs, strict=True):
        stretch = [r.stretch for r, _ in found]
        error = (
            np.sqrt((log.var(ddof=1) + base.var(ddof=1)) / seeds) if seeds > 1 and log is not base else 0.0
        )
        out.append(
            {
                "table": "grains",
                "grains": count,
                "stretch_change": float(log.mean() - base.mean()),
                "stretch_change_error": float(error),
                "stretch_median": float(np.median(stretch)),
                "stretch_low": min(stretch),
                "stretch_high": max(stretch),
                "largest_median": float(np.median([r.largest_fraction for r, _ in found])),
                "cpu_s": float(np.mean([t for _, t in found])),
                "grain_step_ns": float(np.mean([1e9 * t / (count * r.steps) for r, t in found])),
            }
        )
    return out


def gravity_cost(
    counts: tuple[int, ...] = (500, 1000, 2000, 5000, 20000), errors: tuple[float, ...] = (1e-2, 1e-3, 1e-4)
) -> list[Document]:
    """Processor time of gravity by direct sum and by tree, and error of the tree, for random grains in an ellipsoid."""
    generator = np.random.default_rng(0)

    def best(call: Callable[[], object]) -> float:
        times = []
        for _ in range(4):
            begun = time.thread_time()
            call()
            times.append(time.thread_time() - begun)
        return min(times)

    out = []
    for n in counts:
        x = generator.normal(size=(3, n))
        x *= generator.uniform(size=n) ** (1 / 3) / np.linalg.norm(x, axis=0)
        place, mass = np.ascontiguousarray(x * [[1.5], [0.9], [0.75]]), generator.uniform(0.2, 2.7, n) / n
        true, found = np.empty((3, n)), np.empty((3, n))
        direct = best(partial(direct_sum, place, mass, true))
        for asked in errors:
            theta = opening(asked)
            cpu = best(partial(tree_sum, place, mass, theta, found))
            error = np.sqrt(((true - found) ** 2).sum() / (true**2).sum())
            out.append(
                {
                    "table": "gravity", "grains": n, "direct_ms": 1e3 * direct, "error_asked": asked,
                    "tree_ms": 1e3 * cpu, "error": float(error),
                }
            )  # fmt: skip
    return out


def against_reference(
    seeds: int = 4,
    path: Path = REFERENCE,
    *,
    only: Filter | None = None,
) -> list[Document]:
    """Flybys of the reference data as distributions over piles; no rows if the file does not exist."""
    if not path.is_file():
        return []
    cases: dict[tuple[float, ...], list[tuple[float, float, float]]] = {}
    with path.open() as file:
        for r in csv.DictReader(file):
            if (r["mu"], r["beta"]) == ("0.6", "0.3"):
                key = tuple(float(r[k]) for k in ("q", "v_inf", "P", "phase"))
                cases.setdefault(key, []).append(
                    (float(r["clump"]), float(r["bound"] or 1.0), float(r["stretch"]))
                )
    out = []
    for (q, v, period, phase), known in sorted(
        cases.items(), key=lambda c: (c[0][1], c[0][2], c[0][3], c[0][0])
    ):
        if only is not None and not only(q, v, period, phase):
            continue
        asteroid, encounter = body(period), earth(q, v)
        turn = Rotation.from_euler("Z", phase, degrees=True).as_matrix()
        outcome = grains_flyby(asteroid, encounter, turn, grains=GRAINS, seeds=seeds)
        found = np.array([[r.largest_fraction, r.bound_fraction, r.stretch] for r in outcome.runs])
        row: Document = {
            "table": "reference",
            "periapsis_R_E": q,
            "v_inf_km_s": v,
            "period_h": period,
            "phase_deg": phase,
            "verdict": str(outcome.verdict),
            "piles": len(found),
            "reference_piles": len(known),
        }
        for k, name in enumerate(("largest", "bound", "stretch")):
            for source, values in (("", found[:, k]), ("reference_", np.array(known)[:, k])):
                row[f"{source}{name}_low"] = float(values.min())
                row[f"{source}{name}_median"] = float(np.median(values))
                row[f"{source}{name}_high"] = float(values.max())
        for surface in ("drucker-prager", "mohr-coulomb"):
            same = asteroid.with_(material=asteroid.material.with_(yield_surface=surface))
            answer = flyby(same, encounter, turn, error=False, history=False)
            row[surface] = str(answer.verdict)
            row[f"{surface}_stretch"] = float(answer.semi_axes[0] / same.semi_axes[0])
        out.append(row)
    return out


def rows(figure: str | Path | None = None, seeds: int = 4) -> list[Document]:
    """All tables; the figure shows the largest clump and the stretch against periapsis."""

    def prograde(q: float, v_inf: float, period: float, phase: float) -> bool:
        return (v_inf, period, phase) == (5, 6, 0)

    reference = against_reference(seeds, only=prograde)
    found = cost() + gravity_cost() + numerics(seeds=seeds) + resolution(seeds=seeds) + reference
    if figure is not None:
        draw([r for r in found if r["table"] == "reference"], figure)
    return found


def draw(reference: list[Document], target: str | Path) -> None:
    """Largest clump and stretch against periapsis, at 5 km/s and 6 h, with those of the reference data."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 3.6), layout="constrained")
    chosen = [r for r in reference if (r["v_inf_km_s"], r["period_h"], r["phase_deg"]) == (5, 6, 0)]
    for axes, name in zip(figure.subplots(1, 2), ("largest", "stretch"), strict=True):
        for source, label, shift in (("", "this package", -0.012), ("reference_", "reference data", 0.012)):
            middle = np.array([r[f"{source}{name}_median"] for r in chosen])
            low = np.array([r[f"{source}{name}_low"] for r in chosen])
            high = np.array([r[f"{source}{name}_high"] for r in chosen])
            q = np.array([r["periapsis_R_E"] for r in chosen]) + shift
            axes.errorbar(q, middle, [middle - low, high - middle], fmt="o", ms=4, capsize=3, label=label)
        axes.set(xlabel="periapsis (Earth radii)", xlim=(1.2, 2.7))
    figure.axes[0].set_ylabel("mass fraction of the largest clump")
    figure.axes[1].set_ylabel("its long axis over the initial one")
    figure.axes[0].legend()
    figure.savefig(target)


def lines(rows: list[Document]) -> list[str]:
    """The tables as text."""
    out = []
    for name, text in _TEXTS.items():
        if table := [r for r in rows if r["table"] == name]:
            out += text(table)
    if not any(r["table"] == "reference" for r in rows):
        out += ["", f"no reference data at {REFERENCE}: not compared"]
    return out


def _cost_text(table: list[Document]) -> list[str]:
    out = [
        f"{GRAINS} grains, one core",
        "q (R_E)  seed  cpu (s)     h   steps  ns/grain/step  largest  bound  stretch",
    ]
    return out + [
        f"{r['periapsis_R_E']:7.2f} {r['seed']:5d} {r['cpu_s']:8.2f} {r['hours']:5.1f} {r['steps']:7d} "
        f"{r['grain_step_ns']:14.0f} {r['largest']:8.3f} {r['bound']:6.3f} {r['stretch']:8.3f}"
        for r in table
    ]


def _gravity_text(table: list[Document]) -> list[str]:
    out = [
        "",
        "gravity: processor time (ms) of the direct sum and of the tree, rms error",
        "grains   direct",
    ]
    for n in dict.fromkeys(r["grains"] for r in table):
        some = [r for r in table if r["grains"] == n]
        out.append(
            f"{n:6d} {some[0]['direct_ms']:8.2f}   "
            + "   ".join(f"{r['error_asked']:.0e}: {r['tree_ms']:.2f} ({r['error']:.1e})" for r in some)
        )
    return out


def _numerics_text(table: list[Document]) -> list[str]:
    out = [
        "",
        "change of stretch and spin rate (rms of ln) for the same piles of 300 grains, and scatter between piles",
        "variant                  stretch  change  scatter  spin: change  scatter  cpu (s)",
    ]
    return out + [
        f"{r['variant']:24s} {r['stretch_median']:7.3f} {r['stretch_change_rms']:7.3f} "
        f"{r['stretch_scatter_of_piles']:8.3f} {r['spin_change_rms']:13.3f} {r['spin_scatter_of_piles']:8.3f} "
        f"{r['cpu_s']:8.2f}"
        for r in table
    ]


def _resolution_text(table: list[Document]) -> list[str]:
    out = ["", "grains  stretch (range)           change of ln stretch  largest  cpu (s)  ns/grain/step"]
    return out + [
        f"{r['grains']:6d} {r['stretch_median']:8.3f} ({r['stretch_low']:.3f} to {r['stretch_high']:.3f}) "
        f"{r['stretch_change']:+9.3f} +- {r['stretch_change_error']:.3f} {r['largest_median']:12.3f} "
        f"{r['cpu_s']:8.2f} {r['grain_step_ns']:14.0f}"
        for r in table
    ]


def _reference_text(table: list[Document]) -> list[str]:
    out = [
        "",
        "median (range) over piles: this package | reference data; ellipsoid with two yield surfaces",
        "q (R_E) v_inf  P (h) phase   largest clump                         stretch",
    ]
    for r in table:
        cells = [
            f"{r[f'{s}{k}_median']:.3g} ({r[f'{s}{k}_low']:.3g}-{r[f'{s}{k}_high']:.3g})"
            for k in ("largest", "stretch")
            for s in ("", "reference_")
        ]
        out.append(
            f"{r['periapsis_R_E']:7.2f} {r['v_inf_km_s']:5g} {r['period_h']:6g} {r['phase_deg']:5g}   "
            f"{cells[0]:18s} | {cells[1]:18s} {cells[2]:18s} | {cells[3]:18s} {r['verdict']}; "
            f"DP {r['drucker-prager']} {r['drucker-prager_stretch']:.2f}, "
            f"MC {r['mohr-coulomb']} {r['mohr-coulomb_stretch']:.2f}"
        )
    return out


#: Texts of the tables, in the order in which they are printed.
_TEXTS: Mapping[str, Callable[[list[Document]], list[str]]] = {
    "cost": _cost_text,
    "gravity": _gravity_text,
    "numerics": _numerics_text,
    "grains": _resolution_text,
    "reference": _reference_text,
}
