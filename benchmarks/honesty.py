"""Tests of the yield bound: no body that it classifies as INTACT may yield in the full dynamics.

python benchmarks/honesty.py scripted [--encounters N] [--bodies N] [--seed N]
    random hyperbolas and parabolas at six planets with J2, from grazing to distant; spheres, spheroids and triaxial
    bodies, exactly and nearly, without spin, slow, beyond the spin limit, and tumbling about any axis; all yield
    surfaces, with and without cohesion, brittle or not. Most friction angles are only just sufficient for the bound.
python benchmarks/honesty.py surfaces [--encounters N] [--bodies N] [--seed N]
    bodies of 35 deg without cohesion at the Earth, at 1.5 to 30 radii: the fraction of the bodies that stay rigid in
    the dynamics for which the bound decides, by yield surface, and its excess over the friction angle mobilised.
python benchmarks/honesty.py real [--every N] [--seed N]
    encounters of catalogued asteroids with six planets: the bound on the tide from distance and speed alone compared
    with the tide of the integrated encounter; samples decided by the bound compared with the dynamics.
"""

from __future__ import annotations

import argparse
import sys
from typing import NamedTuple

import astropy.units as u
import numpy as np
from scipy.spatial.transform import Rotation

from flybystab.body.body import YIELD_SURFACES, Material
from flybystab.catalogues.catalogue import catalogue
from flybystab.constants import G
from flybystab.core.dynamics.run import LIMITS, body_state, integrate
from flybystab.core.ellipsoid.yield_bound import INTACT, NOT_IN_EQUILIBRIUM, quick_margins, tide_size
from flybystab.encounter.encounter import Encounter
from flybystab.errors import FlybystabError
from flybystab.orbit.planets import planet
from flybystab.screening.draws import Attitudes, draws
from flybystab.screening.encounters import close_approaches
from flybystab.screening.sample_verdicts import sample_verdicts
from flybystab.screening.settings import settings

PLANETS = ("earth", "moon", "venus", "mars", "mercury", "jupiter")
Sample = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def bodies(n: int, rng: np.random.Generator) -> Sample:
    """Semi-axes (m), density, angular velocity along the axes (rad/s), friction (rad), cohesion (Pa)."""
    ratio = np.sort(rng.uniform(0.17, 1.0, (n, 2)), axis=1)[:, ::-1].copy()
    kind = rng.integers(0, 8, n)
    nearly = 1.0 - 10.0 ** rng.uniform(-8, -1.5, n)
    ratio[kind == 0] = 1.0
    ratio[kind == 1] = np.column_stack([nearly, nearly**2])[kind == 1]
    ratio[kind == 2, 0] = 1.0
    ratio[kind == 3, 0] = nearly[kind == 3]
    ratio[kind == 4, 1] = ratio[kind == 4, 0]
    ratio[kind == 5, 1] = (ratio[:, 0] * nearly)[kind == 5]
    ratio[:, 1] = np.minimum(ratio[:, 0], ratio[:, 1])
    axes = 10.0 ** rng.uniform(1, 3.7, (n, 1)) * np.column_stack([np.ones(n), ratio])
    rho = rng.uniform(800, 5000, n)
    # Up to 1.26 sqrt(pi G rho): beyond the limit of every cohesionless body.
    rate = np.sqrt(np.pi * G * rho) * rng.choice([0.0, 1.0, 1.0, 1.0], n) * 10.0 ** rng.uniform(-3, 0.1, n)
    wobble = 10.0 ** rng.uniform(-4, 1, n) * rng.choice([0, 1, 1], n)
    axis = rng.normal(size=(n, 3)) * wobble[:, None] + [0.0, 0.0, 1.0]
    axis[rng.random(n) < 0.1] = [1.0, 0.0, 0.0]
    axis[rng.random(n) < 0.05] = [0.0, 1.0, 0.0]
    omega = (rate / np.linalg.norm(axis, axis=1))[:, None] * axis
    cohesion = rng.choice([0, 0, 1], n) * 10.0 ** rng.uniform(-1, 3, n)
    return axes, rho, omega, np.radians(rng.uniform(5, 60, n)), cohesion


def encounter(rng: np.random.Generator) -> Encounter:
    """A hyperbolic encounter at 1.02 to 100 radii and 0 to 30 km/s, with or without J2."""
    body = planet(rng.choice(PLANETS))
    q = 1.01 * body.impact_distance + body.radius * 10.0 ** rng.uniform(-2, 2)
    v = rng.choice([0.0, 10.0 ** rng.uniform(-2, 1.5)])
    return Encounter.hyperbolic(
        body.name,
        periapsis=q * u.m,
        v_inf=v * u.km / u.s,
        start_distance=max(10 * body.radius, q * rng.uniform(1.5, 12)) * u.m,
        j2=bool(rng.integers(2)),
        pole=tuple(rng.normal(size=3)),
    )


class Count(NamedTuple):
    """Counts of a campaign; `used` is the friction rise in the dynamics over that of the bound, per sample."""

    samples: int
    intact: int
    not_in_equilibrium: int
    false: int
    used: np.ndarray


def campaign(seed: int, encounters: int, each: int) -> Count:
    """Verdicts of the bound and of the dynamics for random bodies in random encounters."""
    rng = np.random.default_rng(seed)
    intact = standing = false = 0
    used: list[float] = []
    for _ in range(encounters):
        enc = encounter(rng)
        axes, rho, omega, phi, cohesion = bodies(each, rng)
        code = int(rng.integers(4))
        size = tide_size(enc.tide, enc.t_start, enc.t_stop)
        friction, verdict = np.empty((each, 2)), np.empty(each, dtype=np.int64)
        for angle in (np.full(each, np.radians(60)), phi):
            quick_margins(axes, rho, omega, angle, cohesion, code, *size, friction, verdict)
            # A friction angle that is only just sufficient, for most bodies for which there is one.
            tight = (rng.random(each) < 0.7) & (friction[:, 1] < np.radians(65))
            if angle is not phi:
                phi[tight] = np.maximum(friction[tight, 1], 1e-3) + 1e-9
        standing += int(np.sum(verdict == NOT_IN_EQUILIBRIUM))
        for i in np.flatnonzero(verdict == INTACT):
            turn = Rotation.random(random_state=int(rng.integers(2**31))).as_matrix()
            body = body_state(axes[i], rho[i], omega[i], turn, phi[i], cohesion[i], surface=code)
            way = (enc.t_start, enc.t_stop), enc.tide
            limits = LIMITS._replace(tolerance=1e-8, axis_ratio=8.0)
            run = integrate(body._replace(brittle=bool(rng.integers(2))), *way, limits=limits)
            yielded = any(name == "onset" for name, _, _ in run.events) or run.reason != "done"
            intact += 1
            most = integrate(body, *way, limits=limits, unyielding=True).max_friction
            false += yielded or most > friction[i, 1] + 1e-9
            rest, bound = friction[i]
            if np.isfinite(rest) and bound - rest > 1e-3:
                used.append((most - rest) / (bound - rest))
    return Count(encounters * each, intact, standing, false, np.array(used))


def scripted(args: argparse.Namespace) -> int:
    c = campaign(args.seed, args.encounters, args.bodies)
    print(f"{c.samples} samples in {args.encounters} encounters")
    print(f"decided by the bound: {c.intact} INTACT, {c.not_in_equilibrium} NOT IN EQUILIBRIUM")
    print(f"INTACT by the bound, with another verdict in the dynamics: {c.false}")
    q = np.quantile(c.used, [0.5, 0.9, 1.0])
    print(
        f"fraction of the bound that the dynamics reaches: median {q[0]:.3f}, 90 % {q[1]:.3f}, largest {q[2]:.4f}"
    )
    return int(c.false > 0)


def surfaces(args: argparse.Namespace) -> int:
    rng = np.random.default_rng(args.seed)
    scenes = []
    for _ in range(args.encounters):
        q, v = 1.5 * 20.0 ** rng.random(), rng.uniform(0.0, 20.0)
        enc = Encounter.hyperbolic("earth", q * planet("earth").radius * u.m, v * u.km / u.s)
        axes = -np.sort(-rng.uniform(0.45, 1.0, (args.bodies, 3)), axis=1) * 1e3
        omega = np.zeros((args.bodies, 3))
        omega[:, 2] = 2.0 * np.pi / (3600.0 * rng.uniform(4.0, 12.0, args.bodies))
        scenes.append((enc, axes, rng.uniform(1500, 2500, args.bodies), omega))
    print(
        "yield surface              in equilibrium  rigid  by the bound  excess of the bound: median, 90 % (deg)"
    )
    false = 0
    for code, name in enumerate(YIELD_SURFACES):
        counts, excess = np.zeros(3, dtype=int), []
        for enc, axes, rho, omega in scenes:
            n = len(rho)
            phi, friction, verdict = (
                np.full(n, np.radians(35.0)),
                np.empty((n, 2)),
                np.empty(n, dtype=np.int64),
            )
            size = tide_size(enc.tide, enc.t_start, enc.t_stop)
            quick_margins(axes, rho, omega, phi, np.zeros(n), code, *size, friction, verdict)
            for i in np.flatnonzero(verdict != NOT_IN_EQUILIBRIUM):
                body = body_state(axes[i], rho[i], omega[i], np.eye(3), phi[i], surface=code)
                limits = LIMITS._replace(tolerance=1e-8)
                run = integrate(body, (enc.t_start, enc.t_stop), enc.tide, limits=limits, unyielding=True)
                rigid = run.max_friction <= phi[i]
                counts += 1, rigid, verdict[i] == INTACT
                false += bool(verdict[i] == INTACT and not rigid)
                if rigid and np.isfinite(friction[i, 1]):
                    excess.append(np.degrees(friction[i, 1] - run.max_friction))
        mid, most = np.quantile(excess, [0.5, 0.9])
        print(
            f"{name:26s} {counts[0]:14d} {counts[1]:6d} {counts[2]:6d} {counts[2] / counts[1]:6.1%} {mid:17.2f} "
            f"{most:8.2f}",
            flush=True,
        )
    print(f"INTACT by the bound, not rigid in the dynamics: {false}")
    return int(false > 0)


def real(args: argparse.Namespace) -> int:
    wanted = settings("2026-01-01", "2050-01-01", planets=PLANETS, within=0.1 * u.au, samples=20)
    ratios, false, samples, dynamic = [], 0, 0, 0
    for asteroid in catalogue()[:: args.every]:
        d = draws(asteroid, wanted.samples, args.seed)
        for p in close_approaches(asteroid, wanted):
            blind = p.bounds()
            try:
                size = p.close_bounds()
                where = Attitudes.at(asteroid, d, args.seed, p.planet, p.time.jd)
                fast = sample_verdicts(p, d, where, Material())
                full = sample_verdicts(p, d, where, Material(), quick=False)
            except FlybystabError as reason:
                print(f"{asteroid.name} {p.planet} {p.time.isot}: {reason}")
                continue
            if np.isfinite(blind[0]):
                ratios.append([b / x for b, x in zip(blind, size, strict=True)])
            samples += wanted.samples
            dynamic += int(fast.dynamic.sum())
            false += sum(a != b for a, b in zip(fast.verdict, full.verdict, strict=True))
    least = np.min(ratios, axis=0)
    print(f"{samples} samples, {dynamic} of them integrated; decided otherwise by the dynamics: {false}")
    print(
        f"tide bound from distance and speed over the tide of the integrated encounter, smallest of {len(ratios)}:"
    )
    print(f"peak {least[0]:.3f}, integral {least[1]:.3f} (below 1 the bound would be wrong)")
    return int(false > 0 or bool(np.any(least < 1.0)))


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("what", choices=("scripted", "surfaces", "real"))
    parser.add_argument("--encounters", type=int, default=200)
    parser.add_argument("--bodies", type=int, default=80)
    parser.add_argument("--every", type=int, default=4, help="every Nth asteroid of the catalogue")
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    return {"scripted": scripted, "surfaces": surfaces, "real": real}[args.what](args)


if __name__ == "__main__":
    sys.exit(main())
