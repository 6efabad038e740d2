"""Flybys with the set-up of the early hard-sphere simulations: smooth equal spheres in a crystal.

Richardson, Bottke & Love (1998) and Walsh & Richardson (2006) computed tidal disruptions by the Earth with identical
hard spheres without friction, with a coefficient of restitution of 0.8. Here the same encounters are computed with
smooth spheres in hexagonal close packing and in random packing, and with the default grains of this package (35 deg).
Compared are the ellipticity ``1 - (a2 + a3)/(2 a1)`` of the largest remnant in each class, and the spin period of the
largest remnant where satellites of at least 1 % of the mass remain bound to it.

python benchmarks/grains_smooth.py [--grains 247] [--seeds 2] [--set-ups crystal,random,default]
python benchmarks/grains_smooth.py --sl9 [--grains 1000] [--set-ups random,default]    Shoemaker-Levy 9
"""

from __future__ import annotations

import argparse
from collections import defaultdict

import astropy.units as u
import numpy as np
from grains_references import letter
from scipy.spatial.transform import Rotation

import flybystab as fs
from flybystab.bench.grains import earth
from flybystab.body.grain_calibration import Friction
from flybystab.body.packing import settled_pile
from flybystab.body.pile import PileState, make_pile, spun
from flybystab.core.grains.clumps import LINK, friends_of_friends, moments, semi_axes
from flybystab.core.grains.simulation import Simulation
from flybystab.core.grains.state import Grains, contact_parameters
from flybystab.flybys.grains_run import one_pile
from flybystab.orbit.planets import PLANETS
from flybystab.typing import Array

#: Their coefficient of restitution, and no friction.
RESTITUTION = 0.8
SMOOTH = Friction(0.0, 0.0, float("nan"))
#: Periapsides (Earth radii) and speeds at infinity (km/s).
PERIAPSIDES = (1.1, 1.4, 1.7, 2.0, 2.3)
SPEEDS = (3.0, 6.0, 9.0, 12.0)


def progenitor() -> fs.Body:
    """Their body: 2.8 x 1.7 x 1.5 km, 2000 kg/m3, 6 h prograde."""
    return fs.Body(
        semi_axes=[1400, 850, 750] * u.m,
        density=2000 * u.kg / u.m**3,
        spin_period=6 * u.h,
        material=fs.Material(friction_angle=35 * u.deg),
    )


def crystal(axes: Array, grains: int, seed: int) -> Grains:
    """Equal spheres in hexagonal close packing, cut to an ellipsoid; the lattice is turned and shifted at random."""
    generator = np.random.default_rng([seed, grains])
    # unit distance between neighbours: layers of triangles, every other one shifted
    k = np.arange(-15, 16)
    i, j, layer = (a.ravel() for a in np.meshgrid(k, k, k, indexing="ij"))
    odd = np.abs(layer) % 2
    points = np.stack(
        [i + 0.5 * j + 0.5 * odd, np.sqrt(0.75) * j + odd / np.sqrt(12.0), np.sqrt(2 / 3) * layer], axis=1
    )
    points = (points + generator.uniform(size=3)) @ Rotation.random(random_state=seed).as_matrix()
    chosen = points[np.argsort(((points / axes) ** 2).sum(axis=1), kind="stable")[:grains]]
    chosen = chosen - chosen.mean(axis=0)
    radius, mass = np.full(grains, 0.5), np.full(grains, 1.0 / grains)
    g = Grains(chosen, np.zeros_like(chosen), np.zeros_like(chosen), radius, mass)
    found, turn = semi_axes(1.0, moments(g, mass > 0.0)[3])
    size = np.cbrt(np.prod(found))
    return g._replace(x=np.ascontiguousarray(chosen @ turn / size), radius=radius / size)


def pile_of(set_up: str, body: fs.Body, grains: int, seed: int) -> PileState:
    """A pile of smooth spheres, in a crystal or packed at random, or of the default grains of this package."""
    if set_up == "default":
        return make_pile(body, grains, seed)
    ordered = set_up == "crystal"
    axes = body.axes / np.cbrt(np.prod(body.axes))
    # a random pile of smooth grains would flow while it is made
    g = crystal(axes, grains, seed) if ordered else settled_pile(axes, grains, seed, 0.6, 0.3).grains
    contact = contact_parameters(float(g.radius.mean()), mu_s=0.0, beta=0.0, restitution=RESTITUTION)
    sim = Simulation.of(g, contact)
    if ordered:
        sim.advance(1.9, drag=3.0)
        sim.centre()
    return spun(sim, body, SMOOTH)


def sl9(grains: int, seeds: int, set_ups: list[str]) -> None:
    """Clumps of a sphere without spin on the orbit of Shoemaker-Levy 9 in 1992, which had about 20 fragments."""
    radius = PLANETS["jupiter"].radius * u.m
    passage = fs.Encounter.hyperbolic("jupiter", 1.31 * radius, 0 * u.km / u.s, start_distance=12 * radius)
    print(f"{grains} grains; number of clumps of at least")
    print("set-up    density (kg/m3)  0.3 %  0.5 %  1 %  largest")
    for name in set_ups:
        for density in (400, 500, 600, 700):
            comet = fs.Body([750, 750, 750] * u.m, density * u.kg / u.m**3)
            for seed in range(seeds):
                pile = pile_of(name, comet, grains, seed)
                r = one_pile(pile, comet, passage, np.eye(3), seed)
                x = r.course.positions[-1].to_value(u.m) / pile.length
                g = pile.simulation.grains._replace(x=np.ascontiguousarray(x))
                label = np.empty(grains, np.int64)
                friends_of_friends(g, LINK, label)
                sizes = np.bincount(label, weights=g.mass)
                counts = [int((sizes >= least).sum()) for least in (0.003, 0.005, 0.01)]
                print(
                    f"{name:8s} {density:16d}  {counts[0]:5d}  {counts[1]:5d}  {counts[2]:3d}  {sizes.max():.2f}",
                    flush=True,
                )


def main(arguments: list[str] | None = None) -> None:
    """Run all encounters with each set-up."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--sl9", action="store_true")
    parser.add_argument("--grains", type=int)
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--set-ups", default="crystal,random,default")
    options = parser.parse_args(arguments)
    if options.sl9:
        sl9(options.grains or 1000, options.seeds, options.set_ups.split(","))
        return
    body, grains = progenitor(), options.grains or 247
    print(f"{grains} grains, {options.seeds} piles; q {PERIAPSIDES} R_E, v_inf {SPEEDS} km/s")
    print(
        "Richardson et al. (1998): ellipticity 0.22 +- 0.14 after S, 0.45 after B events (0.43 at the start)"
    )
    print("Walsh & Richardson (2006): primaries of binaries spin in 3.5 to 6 h")
    for name in options.set_ups.split(","):
        ellipticity: dict[str, list[float]] = defaultdict(list)
        periods: dict[str, list[float]] = defaultdict(list)
        start = []
        for q in PERIAPSIDES:
            for v in SPEEDS:
                for seed in range(options.seeds):
                    pile = pile_of(name, body, grains, seed)
                    start.append(1.0 - 0.5 * (pile.axes[1] + pile.axes[2]) / pile.axes[0])
                    phase = 360.0 * np.random.default_rng([seed, int(10 * q), int(v)]).uniform()
                    turn = Rotation.from_euler("Z", phase, degrees=True).as_matrix()
                    r = one_pile(pile, body, earth(q, v), turn, seed)
                    a = r.semi_axes.to_value(u.m)
                    kind = letter(r.largest_fraction, r.bound_fraction)
                    ellipticity[kind].append(1.0 - 0.5 * (a[1] + a[2]) / a[0])
                    period = 2.0 * np.pi / r.spin.to_value(u.rad / u.h)
                    if (np.asarray(r.fragments["bound_to"]) == 0).any():
                        periods["of binaries"].append(period)
                    if kind != "-":
                        periods["after S, B, M"].append(period)
        print(f"\n{name}: ellipticity at the start {np.mean(start):.2f} +- {np.std(start):.2f}")
        for kind in "SBM-":
            x = np.array(ellipticity[kind])
            if len(x):
                print(f"  {kind}: {np.mean(x):.2f} +- {np.std(x):.2f} ({len(x)} runs)")
        for which, values in periods.items():
            low, middle, high = np.percentile(values, (25, 50, 75))
            print(
                f"  period of the largest remnant, {which}: median {middle:.1f} h, quartiles {low:.1f} to "
                f"{high:.1f} h ({len(values)} runs)",
                flush=True,
            )


if __name__ == "__main__":
    main()
