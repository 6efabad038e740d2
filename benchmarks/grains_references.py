"""Piles of grains against other codes and the literature: outcomes found beside those expected.

python benchmarks/grains_references.py flybys [--seeds N] [--grains N]   138 flybys of an independent soft-sphere code
python benchmarks/grains_references.py yade                              five flybys of Yade (Hertz-Mindlin contacts)
python benchmarks/grains_references.py literature                        published outcomes
python benchmarks/grains_references.py sl9                               Shoemaker-Levy 9
python benchmarks/grains_references.py numbers                           outcome against the number of grains
"""

from __future__ import annotations

import argparse
import csv
from collections import defaultdict
from typing import Any, NamedTuple

import astropy.units as u
import numpy as np
from scipy.spatial.transform import Rotation

import flybystab as fs
from flybystab.bench.grains import REFERENCE, body, earth
from flybystab.body.grain_calibration import Friction, contact_friction
from flybystab.body.pile import make_pile
from flybystab.flybys.grains_outcome import GrainsRun
from flybystab.flybys.grains_run import one_pile
from flybystab.flybys.verdict import classed
from flybystab.orbit.planets import PLANETS

#: Difference of clump masses that a few loose grains make.
LOOSE = 0.03


class Case(NamedTuple):
    """A flyby of the Earth: contact friction, periapsis (R_E), v_inf (km/s), period (h, 0: none), phase (deg)."""

    mu_s: float
    beta: float
    q: float
    v_inf: float
    period: float
    phase: float


def run_of(case: Case, seed: int, grains: int) -> GrainsRun:
    """One pile through a flyby."""
    asteroid = body(case.period)
    pile = make_pile(asteroid, grains, seed, Friction(case.mu_s, case.beta, float("nan")))
    turn = Rotation.from_euler("Z", case.phase, degrees=True).as_matrix()
    return one_pile(pile, asteroid, earth(case.q, case.v_inf), turn, seed)


def letter(clump: float, bound: float) -> str:
    """Class of Richardson et al. (1998); a dash where nothing of note escapes."""
    return "-" if clump > 0.9 and bound > 1.0 - LOOSE else classed(clump)[1] or "M"


def inside(values: np.ndarray, others: np.ndarray, slack: float) -> bool:
    """Whether the median of one sample lies within the range of the other, either way round."""
    return any(
        b.min() - slack <= np.median(a) <= b.max() + slack for a, b in ((values, others), (others, values))
    )


def flybys(seeds: int, grains: int, first: int = 0, cases: int | None = None) -> None:
    """Every flyby of the reference data, or `cases` of them from the number `first` on."""
    known: dict[Case, list[tuple[float, float, float]]] = defaultdict(list)
    with REFERENCE.open() as file:
        for r in csv.DictReader(file):
            case = Case(*(float(r[k]) for k in ("mu", "beta", "q", "v_inf", "P", "phase")))
            known[case].append(
                (float(r["clump"]), float(r["bound"] or r["clump"]), float(r["stretch"] or "nan"))
            )
    print(
        f"{grains} grains, {seeds} piles; median (range) of the largest clump and of its stretch: found | expected"
    )
    print("beta     q v_inf    P phase   largest clump                          classes       stretch")
    counts = np.zeros(5, int)
    ordered = sorted(known, key=lambda c: (c.beta, c.v_inf, -c.period, c.phase, c.q))
    for case in ordered[first : None if cases is None else first + cases]:
        runs = [run_of(case, seed, grains) for seed in range(seeds)]
        clump = np.array([r.largest_fraction for r in runs])
        stretch = np.array([r.stretch for r in runs])
        there = np.array(known[case])
        one = {letter(r.largest_fraction, r.bound_fraction) for r in runs}
        two = {letter(c, b) for c, b, _ in there}
        ok = inside(clump, there[:, 0], LOOSE)
        whole = there[:, 0] > 0.9
        close = True
        if whole.any() and (clump > 0.9).any():
            close = inside(np.log(stretch[clump > 0.9]), np.log(there[whole, 2]), 0.05)
            counts[3] += close * len(there)
            counts[4] += len(there)
        counts[:3] += len(there) * np.array([1, ok, bool(one & two)])
        cells = [
            f"{np.median(x):.2f} ({x.min():.2f}-{x.max():.2f})"
            for x in (clump, there[:, 0], stretch, there[:, 2])
        ]
        marks = ("" if ok else " clump") + ("" if one & two else " class") + ("" if close else " stretch")
        print(
            f"{case.beta:4g} {case.q:5.2f} {case.v_inf:5g} {case.period:4g} {case.phase:5g}   "
            f"{cells[0]:16s} | {cells[1]:16s}  "
            f"{''.join(sorted(one)):4s}| {''.join(sorted(two)):4s}  {cells[2]:16s} | {cells[3]:16s}"
            + (f"  differs:{marks}" if marks else ""),
            flush=True,
        )  # fmt: skip
    n, clumps, classes, stretches, bodies = counts
    print(
        f"rows: {n}; median clump within the scatter (and {LOOSE:g}): {clumps}; a class in common: {classes}; "
        f"stretch of bodies that stay whole, within the scatter (and 5 %): {stretches} of {bodies}"
    )


#: Yade, 541 grains: periapsis, largest clump and bound mass (each seed), a2/a1, a3/a1, period (h).
YADE: tuple[tuple[float, tuple[float, ...], tuple[float, ...], float, float, float], ...] = (
    (1.9, (0.56, 0.49), (0.68, 0.79), 0.25, 0.22, np.nan),
    (2.1, (0.967, 0.94, 0.98), (0.996, 0.93, 0.99), 0.22, 0.17, 11.7),
    (2.3, (1.0,), (1.0,), 0.412, 0.360, 5.25),
    (2.6, (1.0,), (1.0,), 0.585, 0.513, 4.50),
    (5.96, (1.0,), (1.0,), 0.603, 0.531, 5.591),
)


def yade(seeds: int, grains: int) -> None:
    """Flybys of Yade, of piles with a friction angle of 35 to 36 deg."""
    friction = contact_friction(np.deg2rad(35.5))
    print(f"{grains} grains, {seeds} piles: median (range); Yade: its seeds")
    print(
        "    q   largest clump             bound                     a2/a1             a3/a1             period (h)"
    )
    for q, clump, bound, ratio2, ratio3, period in YADE:
        runs = [
            run_of(Case(friction.mu_s, friction.beta, q, 5.0, 6.0, 0.0), seed, grains)
            for seed in range(seeds)
        ]
        axes = np.array([r.semi_axes.to_value(u.m) for r in runs])
        found = (
            np.array([r.largest_fraction for r in runs]),
            np.array([r.bound_fraction for r in runs]),
            axes[:, 1] / axes[:, 0],
            axes[:, 2] / axes[:, 0],
            np.array([2.0 * np.pi / r.spin.to_value(u.rad / u.h) for r in runs]),
        )
        cells = [f"{np.median(x):.3g} ({x.min():.3g}-{x.max():.3g})" for x in found]
        print(f"{q:5.2f}   " + "  ".join(f"{c:18s}" for c in cells), flush=True)
        there = (
            "/".join(f"{x:g}" for x in clump), "/".join(f"{x:g}" for x in bound),
            f"{ratio2:g}", f"{ratio3:g}", f"{period:g}",
        )  # fmt: skip
        print(" Yade   " + "  ".join(f"{c:18s}" for c in there))


def literature(seeds: int, grains: int) -> None:
    """Outcomes of published simulations of the same body (2.8 x 1.7 x 1.5 km, 2000 kg/m3, 6 h prograde).

    Zhang & Michel (2020): deformation, shedding and disruption of three flybys. Richardson, Bottke & Love (1998):
    ellipticity ``1 - (a2 + a3)/(2 a1)`` of the largest remnant, 0.22 +- 0.14 after S events, 0.45 after B events.
    Walsh & Richardson (2006): primaries of binaries spin in 3.5 to 6 h.
    """
    friction = contact_friction(np.deg2rad(35.0))
    print(
        "Zhang & Michel (2020): class, largest clump/bound mass/stretch; their shape and spin are not known here"
    )
    bodies = (
        ("6 h", body(6.0)),
        ("sphere, 4.3 h", body(4.3).with_(semi_axes=[1000, 1000, 1000] * u.m)),
        ("sphere, no spin", body(0.0).with_(semi_axes=[1000, 1000, 1000] * u.m)),
    )
    for q, v, expected in ((1.9, 10.0, "deformation"), (1.6, 6.0, "shedding"), (1.3, 2.0, "disruption")):
        for name, asteroid in bodies:
            runs = [
                one_pile(make_pile(asteroid, grains, seed, friction), asteroid, earth(q, v), np.eye(3), seed)
                for seed in range(seeds)
            ]
            shares = ", ".join(
                f"{letter(r.largest_fraction, r.bound_fraction)} {r.largest_fraction:.2f}/{r.bound_fraction:.2f}"
                f"/{r.stretch:.2f}"
                for r in runs
            )
            print(f"q {q}, v_inf {v:2g}: {expected:12s} {name:16s} {shares}", flush=True)
    ellipticity: dict[str, list[float]] = defaultdict(list)
    periods, binaries = [], 0
    for q in (1.2, 1.4, 1.6, 1.8, 2.0, 2.2):
        for v in (2.0, 6.0, 10.0):
            for seed in range(seeds):
                turn = 360.0 * np.random.default_rng([seed, int(10 * q), int(v)]).uniform()
                r = run_of(Case(friction.mu_s, friction.beta, q, v, 6.0, turn), seed, grains)
                a = r.semi_axes.to_value(u.m)
                ellipticity[letter(r.largest_fraction, r.bound_fraction)].append(
                    1.0 - 0.5 * (a[1] + a[2]) / a[0]
                )
                if (np.asarray(r.fragments["bound_to"]) == 0).any():
                    binaries += 1
                    periods.append(2.0 * np.pi / r.spin.to_value(u.rad / u.h))
    print("\nellipticity of the largest remnant: Richardson et al. (1998) 0.22 +- 0.14 after S, 0.45 after B")
    for name in "SBM-":
        x = np.array(ellipticity[name])
        if len(x):
            print(f"  {name}: {np.mean(x):.2f} +- {np.std(x):.2f} ({len(x)} runs)")
    x = np.array(periods)
    if len(x):
        print(
            f"\nsatellites of at least 1 % bound to the largest clump after {binaries} of "
            f"{sum(map(len, ellipticity.values()))} flybys; period of the primary, Walsh & Richardson (2006) 3.5-6 h: "
            f"median {np.median(x):.1f} h, quartiles {np.percentile(x, 25):.1f} to {np.percentile(x, 75):.1f} h"
        )


def sl9(seeds: int, grains: int) -> None:
    """Clumps of a sphere without spin on the orbit of 1992, against density; about 20 were seen."""
    radius = PLANETS["jupiter"].radius * u.m
    passage = fs.Encounter.hyperbolic("jupiter", 1.31 * radius, 0 * u.km / u.s, start_distance=12 * radius)
    print("about 20 fragments were seen; published simulations give them for 500 to 600 kg/m3")
    print("friction (deg)  density (kg/m3)  clumps of at least 1 %  largest  settled")
    for angle in (18.0, 35.0):
        for density in (400, 500, 600, 800):
            comet = fs.Body(
                semi_axes=[750, 750, 750] * u.m,
                density=density * u.kg / u.m**3,
                material=fs.Material(friction_angle=angle * u.deg),
            )
            runs = [
                one_pile(make_pile(comet, grains, seed), comet, passage, np.eye(3), seed)
                for seed in range(seeds)
            ]
            counts = "/".join(str(len(r.fragments)) for r in runs)
            largest = "/".join(f"{r.largest_fraction:.2f}" for r in runs)
            print(
                f"{angle:14g} {density:16d}  {counts:22s}  {largest}  {sum(r.settled for r in runs)} of {seeds}",
                flush=True,
            )


def numbers(seeds: int, grains: int) -> None:
    """Outcome of three flybys (Earth, 5 km/s, 6 h prograde) against the number of grains, up to `grains`.

    Mean over the piles with its standard error. Piles of 1,000 grains are half as many, of more a quarter (half at 2.2
    radii, for the stretch).
    """
    friction = contact_friction(np.deg2rad(35.0))
    print("    q  grains  piles  classes   largest clump     bound             stretch (whole ones)   steps")
    for count in (250, 500, 1000, 2000, 4000):
        if count > grains:
            break
        for q in (1.6, 2.0, 2.2):
            piles = max(2, seeds // (1 if count < 1000 else 2 if count < 2000 or q == 2.2 else 4))
            case = Case(friction.mu_s, friction.beta, q, 5.0, 6.0, 0.0)
            runs = [run_of(case, seed, count) for seed in range(piles)]
            classes = "".join(sorted(letter(r.largest_fraction, r.bound_fraction) for r in runs))
            columns = [
                np.array([r.largest_fraction for r in runs]),
                np.array([r.bound_fraction for r in runs]),
                np.array([r.stretch for r in runs if r.largest_fraction > 0.9]),
            ]
            cells = [
                f"{x.mean():.3f} +- {x.std(ddof=1) / np.sqrt(len(x)):.3f}" if len(x) > 1 else "-"
                for x in columns
            ]
            steps = int(np.mean([r.steps for r in runs]))
            found = "  ".join(f"{cell:16s}" for cell in cells)
            print(f"{q:5.1f} {count:7d} {piles:6d}  {classes:8s}  {found} {steps:11d}", flush=True)


def main(arguments: list[str] | None = None) -> None:
    """Run one comparison."""
    commands: dict[str, tuple[Any, int, int]] = {
        "flybys": (flybys, 4, 575),
        "yade": (yade, 4, 541),
        "literature": (literature, 3, 400),
        "sl9": (sl9, 2, 1000),
        "numbers": (numbers, 8, 2000),
    }
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("what", choices=commands)
    parser.add_argument("--seeds", type=int)
    parser.add_argument("--grains", type=int)
    parser.add_argument("--first", type=int, default=0, help="first case of the flybys (0)")
    parser.add_argument("--cases", type=int, help="number of cases of the flybys (all 66)")
    options = parser.parse_args(arguments)
    command, seeds, grains = commands[options.what]
    more = {"first": options.first, "cases": options.cases} if options.what == "flybys" else {}
    command(options.seeds or seeds, options.grains or grains, **more)


if __name__ == "__main__":
    main()
