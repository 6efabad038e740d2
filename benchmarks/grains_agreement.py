"""Agreement of two soft-sphere codes, with what two independent samples of the same size would give.

python benchmarks/grains_agreement.py runs FILE [--seeds N]      66 flybys of the reference data, up to N piles each
python benchmarks/grains_agreement.py compare FILE [--figure F]  compare them with the 138 runs of the reference data
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Callable
from itertools import combinations
from pathlib import Path
from typing import Any

import astropy.units as u
import numpy as np
from grains_references import YADE, Case, letter, run_of
from numpy.typing import NDArray

from flybystab.bench.grains import REFERENCE

Row = dict[str, Any]
Cases = dict[Case, list[Row]]
Scores = NDArray[np.float64]
#: Grains of a pile, as most of the reference runs have.
GRAINS = 575
FIELDS = ("mu", "beta", "q", "v_inf", "P", "phase", "grains", "seed", "clump", "bound", "ratio21", "ratio31",
          "P_after", "stretch", "settled")  # fmt: skip


def read(path: Path) -> list[Row]:
    """Rows of a file of runs, numbers as floats; empty where there is no file."""
    if not path.is_file():
        return []
    with path.open() as file:
        return [
            {k: float(v) if v else np.nan for k, v in row.items() if k != "body"}
            for row in csv.DictReader(file)
        ]


def case_of(row: Row) -> Case:
    """The flyby of a row."""
    return Case(*(float(row[k]) for k in ("mu", "beta", "q", "v_inf", "P", "phase")))


def repeated(case: Case) -> bool:
    """Whether a flyby is run with several piles: where the reference has several and the outcome is not trivial."""
    return case.v_inf == 5 and case.q < 2.5


def runs(path: Path, seeds: int) -> None:
    """Append to the file the runs that it does not hold yet, one seed after the other."""
    cases = sorted({case_of(r) for r in read(REFERENCE)}, key=lambda c: (c.v_inf, c))
    done = {(case_of(r), int(r["seed"])) for r in read(path)}
    new = not path.exists()
    with path.open("a", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        if new:
            writer.writerow(FIELDS)
        for seed in range(seeds):
            for case in cases:
                if (case, seed) in done or (seed > 0 and not repeated(case)):
                    continue
                r = run_of(case, seed, GRAINS)
                a = r.semi_axes.to_value(u.m)
                period = 2.0 * np.pi / r.spin.to_value(u.rad / u.h)
                found = (r.largest_fraction, r.bound_fraction, a[1] / a[0], a[2] / a[0], period, r.stretch)
                writer.writerow(
                    [*(f"{x:g}" for x in case), GRAINS, seed, *(f"{x:.4f}" for x in found), int(r.settled)]
                )
                file.flush()


#: What is compared: column of the runs, whether as a logarithm, and whether only of bodies that stay whole.
QUANTITIES = (("clump", False, False), ("stretch", True, True), ("P_after", True, True))


def by_case(rows: list[Row]) -> Cases:
    """Runs of each flyby."""
    out: Cases = {}
    for row in rows:
        out.setdefault(case_of(row), []).append(row)
    return out


def kind(row: Row) -> str:
    """Class of a run."""
    return letter(row["clump"], row["bound"])


def agrees(row: Row, sample: list[Row]) -> NDArray[np.bool_]:
    """Whether a run has a class that occurs in a sample, and its largest clump lies within that of the sample; both."""
    values = [other["clump"] for other in sample]
    same = kind(row) in {kind(other) for other in sample}
    inside = min(values) <= row["clump"] <= max(values)
    return np.array([same, inside, same and inside])


def left_out(rows: list[Row], sample: list[Row], size: int) -> list[NDArray[np.float64]]:
    """Fraction of the samples of `size` runs with which each row agrees; a row is never in its own sample."""
    out = []
    for row in rows:
        others = [other for other in sample if other is not row]
        if len(others) >= size:
            out.append(np.mean([agrees(row, list(s)) for s in combinations(others, size)], axis=0))
    return out


def rates(found: Cases, known: Cases) -> list[str]:
    """Agreement of single runs with samples of a few piles: measured, and expected of samples of one code."""
    size = min(len(found.get(c, ())) for c in known if repeated(c)) - 1
    cases = [c for c in known if len(found.get(c, ())) > size]
    measured = [x for c in cases for x in left_out(known[c], found[c], size)]
    # a case counts as often as it has runs in the reference
    own = [x for c in cases for x in len(known[c]) * [np.mean(left_out(found[c], found[c], size), axis=0)]]
    theirs = [x for c in known if len(known[c]) > size for x in left_out(known[c], known[c], size)]
    again = [x for c in known if len(known[c]) > size for x in left_out(known[c], found.get(c, []), size)]
    names = (
        ("runs of the other code in samples of this one", measured),
        ("expected: runs of this code in samples of this one", own),
        ("runs of the other code in samples of the other, where it has four piles", theirs),
        ("the same runs in samples of this code", again),
    )
    out = [f"fraction of runs that agree with {size} piles     rows  class  clump in range  both"]
    for name, values in names:
        if values:
            a, b, c = np.mean(values, axis=0)
            out.append(f"{name:73s} {len(values):4d}   {a:.2f}   {b:.2f}   {c:.2f}")
    return out


def pile_scores(found: Cases, known: Cases, name: str, log: bool, whole: bool) -> tuple[Scores, Scores]:
    """Mean deviation of each pile from the mean of both codes, in units of their common scatter.

    Piles are the independent units: the flybys of one pile are correlated. Flybys without scatter are left out, and the
    reference piles of 1,161 grains. With `whole` only the runs that keep more than 0.9 of the mass.
    """
    scores: dict[tuple[str, float], list[float]] = {}
    for case in known:
        both = [
            (source, row["seed"], np.log(row[name]) if log else row[name])
            for source, rows in (("here", found.get(case, [])), ("there", known[case]))
            for row in rows
            if row["grains"] < 1000 and (row["clump"] > 0.9 or not whole) and np.isfinite(row[name])
        ]
        if not {"here", "there"} <= {source for source, _, _ in both}:
            continue
        values = np.array([v for _, _, v in both])
        # variance about the mean of each code, so that a difference of the codes does not enter
        groups = [values[[s == source for s, _, _ in both]] for source in ("here", "there")]
        freedom = sum(len(g) - 1 for g in groups)
        scatter = np.sqrt(sum(((g - g.mean()) ** 2).sum() for g in groups) / max(freedom, 1))
        if freedom < 2 or scatter < 1e-3:
            continue
        middle = 0.5 * (groups[0].mean() + groups[1].mean())
        for source, seed, value in both:
            scores.setdefault((source, seed), []).append((value - middle) / scatter)
    here, there = (
        np.array([np.mean(v) for (source, _), v in sorted(scores.items()) if source == which])
        for which in ("here", "there")
    )
    return here, there


def difference(here: Scores, there: Scores) -> tuple[float, float, float]:
    """Difference of the means of two sets of piles, its standard error, and the fraction of larger exchanges."""
    gap = here.mean() - there.mean()
    error = np.sqrt(here.var(ddof=1) / len(here) + there.var(ddof=1) / len(there))
    pool = np.concatenate([here, there])
    indices = set(range(len(pool)))
    exceed = [
        abs(pool[list(chosen)].mean() - pool[list(indices - set(chosen))].mean()) >= abs(gap) - 1e-12
        for chosen in combinations(range(len(pool)), len(here))
    ]
    return float(gap), float(error), float(np.mean(exceed))


#: Groups of flybys: name, condition.
GROUPS: tuple[tuple[str, Callable[[Case], bool]], ...] = (
    ("all", lambda c: True),
    ("patch 0.1", lambda c: c.beta == 0.1),
    ("patch 0.3", lambda c: c.beta == 0.3),
    ("patch 0.5", lambda c: c.beta == 0.5),
    ("5 km/s, prograde", lambda c: c.v_inf == 5 and c.period == 6),
    ("5 km/s, q < 1.8 R_E, prograde", lambda c: c.v_inf == 5 and c.period == 6 and c.q < 1.8),
    ("5 km/s, q > 1.8 R_E, prograde", lambda c: c.v_inf == 5 and c.period == 6 and c.q > 1.8),
    ("5 km/s, no spin", lambda c: c.period == 0),
    ("5 km/s, retrograde", lambda c: c.period < 0),
    ("8 km/s", lambda c: c.v_inf == 8),
    ("20 km/s", lambda c: c.v_inf == 20),
)


def compare(path: Path, figure: Path | None) -> None:
    """Print the comparison; draw it."""
    found, known = by_case(read(path)), by_case(read(REFERENCE))
    piles = sorted({len(rows) for rows in found.values()})
    print(
        f"{sum(map(len, known.values()))} runs of the other code, {sum(map(len, found.values()))} of this one"
    )
    print(f"({piles[0]} to {piles[-1]} piles of {GRAINS} grains a flyby)\n")
    print("\n".join(rates(found, known)))
    print(
        "\ndifference of the codes in units of the scatter between piles, its standard error over the piles, and the"
    )
    print("fraction of the exchanges of piles between the codes that give a larger one")
    print("                                 largest clump           stretch (whole)         period (whole)")
    for label, chosen in GROUPS:
        some = {c: rows for c, rows in known.items() if chosen(c)}
        cells = []
        for name, log, whole in QUANTITIES:
            here, there = pile_scores(found, some, name, log, whole)
            cell = "-"
            if len(here) > 1 and len(there) > 1:
                gap, error, share = difference(here, there)
                cell = f"{gap:+.2f} +- {error:.2f} ({share:.2f})"
            cells.append(cell)
        print(f"{label:32s} " + "  ".join(f"{c:22s}" for c in cells))
    print("\ncodes at 5 km/s, 6 h prograde, patch 0.3: this one | soft spheres | Yade")
    for q, clump, _, ratio, _, period in YADE:
        rows = [found.get(Case(0.6, 0.3, q, 5, 6, 0), []), known.get(Case(0.6, 0.3, q, 5, 6, 0), [])]
        cells = [
            " | ".join(
                f"{min(r[n] for r in some):.3g} to {max(r[n] for r in some):.3g}" for some in rows if some
            )
            for n in ("clump", "ratio21", "P_after")
        ]
        yade = "/".join(f"{x:g}" for x in clump), f"{ratio:g}", f"{period:g}"
        both = "   ".join(
            f"{n} {c} | {y}" for n, c, y in zip(("clump", "a2/a1", "P"), cells, yade, strict=True)
        )
        print(f"q {q:4g}   {both}")
    if figure is not None:
        draw(found, known, figure)


def draw(found: Cases, known: Cases, target: Path) -> None:
    """Mean and range of the largest clump and of the stretch: this code against the other one."""
    from matplotlib.figure import Figure

    picture = Figure(figsize=(8.0, 4.3), layout="constrained")
    for axes, (name, _, whole), limits, label in zip(
        picture.subplots(1, 2),
        QUANTITIES,
        ((0.08, 1.1), (0.9, 2.8)),
        ("largest clump over the mass", "stretch of bodies that stay whole"),
        strict=False,
    ):
        axes.plot(limits, limits, color="0.7", lw=0.8, zorder=1)
        for case, rows in known.items():
            pair = [
                np.array([r[name] for r in some if r["clump"] > 0.9 or not whole])
                for some in (found.get(case, []), rows)
            ]
            if not all(len(p) for p in pair):
                continue
            (x, y), colour = pair, {5.0: "#0072b2", 8.0: "#d55e00", 20.0: "#009e73"}[case.v_inf]
            axes.errorbar(
                np.median(x), np.median(y), [[np.median(y) - y.min()], [y.max() - np.median(y)]],
                [[np.median(x) - x.min()], [x.max() - np.median(x)]], fmt="o", ms=3, lw=0.7, color=colour,
            )  # fmt: skip
        axes.set(xscale="log", yscale="log", xlim=limits, ylim=limits, aspect="equal", title=label)
        axes.set(xlabel="this package", ylabel="the other code")
        ticks = (0.1, 0.2, 0.3, 0.5, 1.0) if not whole else (1.0, 1.5, 2.0, 2.5)
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_ticks(ticks, [f"{t:g}" for t in ticks])
            axis.set_ticks([], minor=True)
    for speed, colour in ((5, "#0072b2"), (8, "#d55e00"), (20, "#009e73")):
        picture.axes[0].plot([], [], "o", ms=3, color=colour, label=f"{speed} km/s")
    picture.axes[0].legend()
    picture.savefig(target, dpi=150)


def main(arguments: list[str] | None = None) -> None:
    """Run the flybys or compare them."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("what", choices=("runs", "compare"))
    parser.add_argument("file", type=Path)
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--figure", type=Path)
    options = parser.parse_args(arguments)
    if options.what == "runs":
        runs(options.file, options.seeds)
    else:
        compare(options.file, options.figure)


if __name__ == "__main__":
    main()
