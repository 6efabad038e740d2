"""Comparison of the ellipsoid with grains: random flybys of piles and of the ellipsoid on several yield surfaces.

python benchmarks/grains_ellipsoid.py cases [--cases N] [--grains N] [--minutes M] [--jobs J]   random flybys
python benchmarks/grains_ellipsoid.py map [--grains N]                          outcomes over periapsis and v_inf

Cases: Earth, Venus or Jupiter; elongation a1/a3 of 1 to 3; spin about the short axis or tumbling; cohesion none or 0
to 50 Pa; friction of 30 to 40 deg; one pile a case. A case is determined by its number. Finished cases are kept in
``out/grains_cases_N.csv`` (N grains), so that a run that was stopped, by ``--minutes`` or otherwise, continues with
the next case and the table covers all finished ones.
"""

from __future__ import annotations

import argparse
import time
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

import astropy.units as u
import numpy as np
from scipy.spatial.transform import Rotation
from scipy.stats import binomtest

import flybystab as fs
from flybystab.bench.grains import body, earth
from flybystab.body.pile import make_pile
from flybystab.errors import FlybystabError
from flybystab.flybys.grains_outcome import GrainsRun
from flybystab.flybys.grains_run import one_pile
from flybystab.orbit.planets import PLANETS
from flybystab.typing import Array

#: Change of the long axis above which a body has moved; fraction of the largest clump below which it is lost.
MOVED, LOST = 0.03, 0.9
#: Name, yield surface and change of the friction angle (deg) from that of the pile.
MODELS = (
    ("drucker-prager", "drucker-prager", 0.0),
    ("drucker-prager - 7", "drucker-prager", -7.0),
    ("mohr-coulomb", "mohr-coulomb", 0.0),
    ("mohr-coulomb + 3", "mohr-coulomb", 3.0),
    ("matsuoka-nakai", "matsuoka-nakai", 0.0),
    ("drucker-prager-extension", "drucker-prager-extension", 0.0),
)
OUTCOMES = ("kept", "moved", "lost")


class Case(NamedTuple):
    """A flyby, and the kinds of case it belongs to."""

    body: fs.Body
    encounter: fs.Encounter
    turn: np.ndarray
    groups: tuple[str, ...]


def case_of(number: int) -> Case:
    """The random case of a number."""
    rng = np.random.default_rng([2026, number])
    name, density = "earth", rng.uniform(1200.0, 3000.0)
    groups = []
    if rng.uniform() < 0.4:
        name = str(rng.choice(["venus", "jupiter"]))
    groups.append(name)
    long, flat = rng.uniform(1.0, 3.0), rng.uniform()
    axes = np.array([long, 1.0 + flat * (np.sqrt(long) - 1.0), 1.0])
    axes *= rng.uniform(200.0, 1500.0) / np.cbrt(np.prod(axes))
    groups.append("a1/a3 < 1.5" if long < 1.5 else "a1/a3 1.5-2.2" if long < 2.2 else "a1/a3 > 2.2")
    rate = 2.0 * np.pi / (3600.0 * rng.uniform(4.0, 15.0)) * float(rng.choice([1.0, 1.0, -1.0]))
    tilt = 0.0
    if rng.uniform() < 0.3:
        tilt = rng.uniform(0.2, 1.2)
    groups.append("tumbling" if tilt else "short axis")
    spin = rate * np.array([np.sin(tilt), 0.0, np.cos(tilt)])
    cohesion = rng.uniform(0.0, 50.0) if rng.uniform() < 0.35 else 0.0
    groups.append("cohesive" if cohesion else "no cohesion")
    asteroid = fs.Body(
        semi_axes=axes * u.m,
        density=density * u.kg / u.m**3,
        spin=spin * u.rad / u.s,
        material=fs.Material(friction_angle=rng.uniform(30.0, 40.0) * u.deg, cohesion=cohesion * u.Pa),
    )
    planet = PLANETS[name]
    # the Roche distance scales with the cube root of the densities: deep and shallow encounters for each planet
    roche = planet.radius * np.cbrt(planet.gm / (4.0 / 3.0 * np.pi * 6.6743e-11 * planet.radius**3) / density)
    q = max(1.02 * planet.radius, roche * rng.uniform(0.85, 2.0))
    v = rng.uniform(0.0, 20.0)
    encounter = fs.Encounter.hyperbolic(
        name, q * u.m, v * u.km / u.s, start_distance=max(8.0 * q, 6 * planet.radius) * u.m
    )
    # poles along the orbital angular momentum or anywhere
    turn = Rotation.from_euler("Z", rng.uniform(0.0, 2.0 * np.pi))
    if rng.uniform() < 0.5:
        turn = Rotation.random(random_state=np.random.RandomState(number))
    return Case(asteroid, encounter, turn.as_matrix(), tuple(groups))


def outcome(largest: float, stretch: float) -> int:
    """Kept, moved or lost."""
    return 2 if largest < LOST else 1 if abs(stretch - 1.0) > MOVED else 0


def ellipsoid(case: Case, surface: str, change: float) -> tuple[int, float]:
    """Outcome and stretch of the ellipsoid."""
    material = case.body.material
    given = material.with_(yield_surface=surface, friction_angle=material.friction_angle + change * u.deg)
    r = fs.flyby(case.body.with_(material=given), case.encounter, case.turn, error=False, history=False)
    stretch = float(r.semi_axes[0] / case.body.semi_axes[0])
    lost = r.verdict in ("MASS LOSS", "DISRUPTED", "BEYOND MODEL")
    return 2 if lost else outcome(1.0, stretch), stretch


def answers_of(number: int, grains: int) -> list[Any]:
    """Row of a case: number, largest clump and stretch of the pile, outcome and stretch of each model.

    The largest clump is nan for a case that is not run: a body that does not stand at rest, or no pile of it.
    """
    case = case_of(number)
    empty = [number, np.nan, np.nan, *[np.nan] * (2 * len(MODELS))]
    friction = fs.equilibrium(case.body).required_friction_angle
    if friction > case.body.material.friction_angle and case.body.material.c_pa == 0.0:
        return empty
    try:
        models = [ellipsoid(case, surface, change) for _, surface, change in MODELS]
        pile = make_pile(case.body, grains, number, keep=False)
        axes = case.encounter.periapsis_axes.T @ case.turn
        run: GrainsRun = one_pile(pile, case.body, case.encounter, axes, number)
    except FlybystabError:
        return empty
    return [number, run.largest_fraction, run.stretch, *(x for pair in models for x in pair)]


def finished(file: Path) -> dict[int, list[float]]:
    """Finished cases of a file by their numbers; a last line that was cut off is dropped."""
    width = 3 + 2 * len(MODELS)
    lines = file.read_text().splitlines(keepends=True) if file.exists() else []
    rows = [[float(x) for x in line.split(",")] for line in lines if line.endswith("\n")]
    return {int(row[0]): row for row in rows if len(row) == width}


def cases(count: int, grains: int, minutes: float, jobs: int) -> None:
    """Run the cases that are not in the file yet, and print the table over all of them."""
    end = time.monotonic() + 60.0 * minutes
    file = Path("out") / f"grains_cases_{grains}.csv"
    file.parent.mkdir(exist_ok=True)
    known = finished(file)
    if file.exists() and not file.read_text().endswith("\n"):
        file.write_text("".join(",".join(map(repr, row)) + "\n" for row in known.values()))
    missing = (n for n in range(count) if n not in known)
    with ProcessPoolExecutor(jobs) as pool, file.open("a") as out:
        running = {pool.submit(answers_of, n, grains) for n in islice(missing, jobs)}
        while running:
            done, running = wait(running, return_when=FIRST_COMPLETED)
            for future in done:
                row = future.result()
                known[row[0]] = row
                out.write(",".join(map(repr, map(float, row))) + "\n")
                out.flush()
            if time.monotonic() < end:
                running |= {pool.submit(answers_of, n, grains) for n in islice(missing, len(done))}
    table([known[n] for n in sorted(known) if n < count], grains)


def interval(k: int, n: int) -> str:
    """Percentage with its 95 % interval (Wilson)."""
    if n == 0:
        return "-"
    found = binomtest(k, n).proportion_ci(0.95, method="wilson")
    return f"{100 * k / n:.1f} ({100 * found.low:.1f}-{100 * found.high:.1f})"


def table(rows: list[list[float]], grains: int) -> None:
    """Print how often each model errs, and how far its stretch is off."""
    run = np.array([row for row in rows if np.isfinite(row[1])])
    numbers, stretch = run[:, 0].astype(int), run[:, 2]
    found = np.array([outcome(*row) for row in run[:, 1:3]])
    counts = np.bincount(found, minlength=3)
    n = len(run)
    print(
        f"{n} flybys of one pile of {grains} grains each ({len(rows) - n} drawn ones are not in equilibrium at rest); "
        f"grains: {counts[0]} kept\n(a1 within {MOVED:.0%}), {counts[1]} moved, {counts[2]} lost "
        f"(largest clump < {LOST:g}). Optimistic: lost called moved + moved or lost\n"
        "called kept. In % of all flybys, with 95 % intervals; "
        "rms of ln(a1 of the model/of grains) where both moved.\n"
    )
    head = f"{'optimistic':>10s} {'%':>16s} {'pessimistic':>12s} {'%':>16s} {'rms ln(a1)':>11s}"
    print(f"{'surface (phi of the pile)':26s} {head}")
    for k, (name, _, _) in enumerate(MODELS):
        model, ratio = errors(run, found, stretch, k)
        optimistic, pessimistic = (model < found).sum(), (model > found).sum()
        lost = ((found == 2) & (model == 1)).sum()
        print(
            f"{name:26s} {f'{lost}+{optimistic - lost}':>10s} {interval(optimistic, n):>16s} {pessimistic:12d} "
            f"{interval(pessimistic, n):>16s} {spread(ratio):>11s}"
        )
    print(f"\n{'Mohr-Coulomb by kind':20s} {'flybys':>6s} {head}")
    model, ratio = errors(run, found, stretch, [name for name, _, _ in MODELS].index("mohr-coulomb"))
    groups = [case_of(number).groups for number in numbers]
    for group in sorted({g for m in groups for g in m}):
        chosen = np.array([group in m for m in groups])
        size, optimistic, pessimistic = (
            chosen.sum(),
            (chosen & (model < found)).sum(),
            (chosen & (model > found)).sum(),
        )
        print(
            f"{group:20s} {size:6d} {optimistic:10d} {interval(optimistic, size):>16s} {pessimistic:12d} "
            f"{interval(pessimistic, size):>16s} {spread(ratio[chosen]):>11s}"
        )


def errors(run: Array, found: Array, stretch: Array, k: int) -> tuple[Array, Array]:
    """Outcomes of a model, and ln of its stretch over that of grains where both moved (else nan)."""
    model, its = run[:, 3 + 2 * k].astype(int), run[:, 4 + 2 * k]
    return model, np.where((found == 1) & (model == 1), np.log(its / stretch), np.nan)


def spread(ratio: Array) -> str:
    """Rms and number of what is finite."""
    ratio = ratio[np.isfinite(ratio)]
    return f"{np.sqrt(np.mean(ratio**2)):.3f} ({len(ratio)})" if len(ratio) else "-"


def outcome_map(grains: int) -> None:
    """Outcomes of one pile and of the ellipsoid at the Earth, 6 h prograde, phase 0."""
    q_grid = np.arange(1.2, 2.61, 0.2)
    asteroid = body(6.0)
    letters = {
        "INTACT": ".",
        "RESHAPED": "r",
        "MASS LOSS": "m",
        "DISRUPTED": "S",
        "BEYOND MODEL": ">",
        "IMPACT": "i",
    }
    print(". intact, r reshaped, m mass loss (10 to 50 % of the largest clump: B), S disrupted, > beyond 6:1")
    print(
        f"q (R_E) {q_grid[0]:.1f} to {q_grid[-1]:.1f} in steps of 0.2; {grains} grains | Mohr-Coulomb, 35 deg"
    )
    for v in (0.0, 2.0, 5.0, 8.0, 12.0, 16.0):
        left, right = "", ""
        for q in q_grid:
            passage = earth(float(q), v)
            run = one_pile(make_pile(asteroid, grains, 0), asteroid, passage, np.eye(3), 0)
            left += letters[str(run.verdict)]
            right += letters[str(fs.flyby(asteroid, passage, error=False, history=False).verdict)]
        print(f"v_inf {v:4g} km/s   {left}   {right}", flush=True)


def main(arguments: list[str] | None = None) -> None:
    """Run one table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("what", choices=("cases", "map"))
    parser.add_argument("--cases", type=int, default=500)
    parser.add_argument("--grains", type=int, default=200)
    parser.add_argument("--minutes", type=float, default=np.inf)
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    options: Any = parser.parse_args(arguments)
    if options.what == "cases":
        cases(options.cases, options.grains, options.minutes, options.jobs)
    else:
        outcome_map(options.grains)


if __name__ == "__main__":
    main()
