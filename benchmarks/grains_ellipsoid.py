"""What grains say of the ellipsoid: random flybys of piles beside the ellipsoid on several yield surfaces.

python benchmarks/grains_ellipsoid.py cases [--cases N] [--grains N] [--minutes M]    table over random flybys
python benchmarks/grains_ellipsoid.py map [--grains N]                               outcomes over periapsis and v_inf

Cases: Earth, Venus or Jupiter; elongation a1/a3 of 1 to 3; spin about the short axis or tumbling; cohesion none or 0
to 50 Pa; friction of 30 to 40 deg; one pile a case. A case is determined by its number: longer runs only add cases.
With ``--minutes`` the run ends in time and says how many cases it has.
"""

from __future__ import annotations

import argparse
import time
from typing import Any, NamedTuple

import astropy.units as u
import numpy as np
from scipy.spatial.transform import Rotation

import flybystab as fs
from flybystab.bench.grains import body, earth
from flybystab.body.pile import make_pile
from flybystab.errors import FlybystabError
from flybystab.flybys.grains_outcome import GrainsRun
from flybystab.flybys.grains_run import one_pile
from flybystab.orbit.planets import PLANETS

#: Change of the long axis above which a body has moved; share of the largest clump below which it is lost.
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
    """A flyby of the comparison."""

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
    # the Roche distance scales with the cube root of the densities: deep and shallow passages for each planet
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


def cases(count: int, grains: int, minutes: float) -> None:
    """The table over random cases."""
    begun, done, refused = time.monotonic(), 0, 0
    pairs: dict[str, list[tuple[int, int, float]]] = {name: [] for name, _, _ in MODELS}
    members: list[tuple[str, ...]] = []
    for number in range(count):
        if time.monotonic() - begun > 60.0 * minutes:
            break
        case = case_of(number)
        if fs.equilibrium(case.body).required_friction_angle > case.body.material.friction_angle and (
            case.body.material.c_pa == 0.0
        ):
            refused += 1
            continue
        try:
            answers = [ellipsoid(case, surface, change) for _, surface, change in MODELS]
            pile = make_pile(case.body, grains, number, keep=False)
            run: GrainsRun = one_pile(
                pile, case.body, case.encounter, case.encounter.periapsis_axes.T @ case.turn, number
            )
        except FlybystabError:
            refused += 1
            continue
        done += 1
        found = outcome(run.largest_fraction, run.stretch)
        members.append(case.groups)
        for (name, _, _), (model, stretch) in zip(MODELS, answers, strict=True):
            both = found == model == 1
            pairs[name].append((found, model, np.log(stretch / run.stretch) if both else np.nan))
        if done % 20 == 0:
            print(f"# {done} cases in {(time.monotonic() - begun) / 60:.1f} min", flush=True)
    counts = np.bincount([p[0] for p in pairs[MODELS[0][0]]], minlength=3)
    print(
        f"{done} flybys of one pile of {grains} grains each ({refused} drawn ones do not stand at rest); "
        f"grains: {counts[0]} kept (a1 within {MOVED:.0%}), {counts[1]} moved, {counts[2]} lost "
        f"(largest clump < {LOST:g})"
    )
    print(
        "surface (phi of the pile)    too safe (lost called moved, moved or lost called kept)   "
        "too careful   rms ln(a1)"
    )
    for name, _, _ in MODELS:
        found, model, ratio = (np.array(x) for x in zip(*pairs[name], strict=True))
        safe, careful = model < found, model > found
        print(
            f"{name:28s} {safe.sum():4d} ({((found == 2) & (model == 1)).sum():3d}, {(safe & (model == 0)).sum():3d}) "
            f"{careful.sum():48d} {np.sqrt(np.nanmean(ratio**2)):12.3f} ({np.isfinite(ratio).sum()})"
        )
    print("\nMohr-Coulomb by kind of case   flybys   too safe   too careful   rms ln(a1)")
    found, model, ratio = (np.array(x) for x in zip(*pairs["mohr-coulomb"], strict=True))
    for group in sorted({g for m in members for g in m}):
        chosen = np.array([group in m for m in members])
        ok = chosen & np.isfinite(ratio)
        rms = np.sqrt(np.mean(ratio[ok] ** 2)) if ok.any() else np.nan
        print(
            f"{group:28s} {chosen.sum():8d} {(chosen & (model < found)).sum():10d} "
            f"{(chosen & (model > found)).sum():13d} {rms:12.3f} ({ok.sum()})"
        )


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
    options: Any = parser.parse_args(arguments)
    if options.what == "cases":
        cases(options.cases, options.grains, options.minutes)
    else:
        outcome_map(options.grains)


if __name__ == "__main__":
    main()
