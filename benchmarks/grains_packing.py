"""Effect of the preparation of a pile on its outcome, in flybys that scatter little from pile to pile.

The piles of the other code of ``grains_agreement.py`` were prepared differently: a random cloud collapses under its own
gravity into a sphere (sliding friction 0.2, drag 2e-4 /s, 12,000 s), from which the ellipsoid is carved. Piles of this
package collapse in a central field whose level surfaces are ellipsoids. Here both are computed with the same contact
law (Earth, 1.6 radii, 5 km/s, without spin and 6 h retrograde, friction 0.6, patch 0.3), with and without twisting
resistance, which the other code need not have.

python benchmarks/grains_packing.py [--seeds 2] [--grains 575]
"""

from __future__ import annotations

import argparse
import copy

import astropy.units as u
import numpy as np

from flybystab.bench.grains import body, earth
from flybystab.body.grain_calibration import Friction
from flybystab.body.grain_sizes import GrainSizes
from flybystab.body.packing import _carved, _scattered, settled, settled_pile
from flybystab.body.pile import spun
from flybystab.core.grains.simulation import Simulation
from flybystab.core.grains.state import Grains, contact_parameters
from flybystab.flybys.grains_run import one_pile
from flybystab.typing import Array

FRICTION = Friction(0.6, 0.3, float("nan"))
#: Duration and drag of the collapse, scaled: 12,000 s and 2e-4 /s at 2000 kg/m3.
COLLAPSE, DRAG = 8.95, 0.268


def collapsed_pile(axes: Array, grains: int, seed: int) -> Simulation:
    """A pile carved from a sphere that has collapsed under its own gravity."""
    generator = np.random.default_rng([seed, grains, 7])
    cloud = int(1.25 * grains * axes[0] ** 3)
    radius = GrainSizes().draw(cloud, generator)
    radius *= np.cbrt(0.6 / (grains * np.mean(radius**3)))
    x = _scattered(np.full(3, 1.9 * axes[0]), radius, generator)
    mass = radius**3 / (grains * np.mean(radius**3))
    sim = Simulation.of(
        Grains(x, np.zeros_like(x), np.zeros_like(x), radius, mass),
        contact_parameters(float(radius.mean()), mu_s=0.2, beta=0.0),
    )
    sim.advance(COLLAPSE, drag=DRAG)
    chosen = _carved(sim.grains, axes, grains)
    g = Grains(*(a[chosen].copy() for a in sim.grains))
    return settled(g, FRICTION.mu_s, FRICTION.beta)


def main(arguments: list[str] | None = None) -> None:
    """Run the flybys."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--grains", type=int, default=575)
    options = parser.parse_args(arguments)
    shape = body().axes / np.cbrt(np.prod(body().axes))
    print("the other code (four piles): stretch 2.21 to 2.35, period 8.6 to 9.3 h without spin;")
    print("1.77 to 1.88, 16.5 to 19.8 h retrograde")
    print("preparation    twisting  spin        porosity  stretch       period (h)")
    for name in ("own gravity", "central field"):
        piles = [
            collapsed_pile(shape, options.grains, seed)
            if name == "own gravity"
            else settled_pile(shape, options.grains, seed, FRICTION.mu_s, FRICTION.beta)
            for seed in range(options.seeds)
        ]
        for twisting in (1.3, 0.0):
            for period, spin in ((0.0, "none"), (-6.0, "retrograde")):
                rows = []
                for sim in map(copy.deepcopy, piles):
                    sim.contact = sim.contact._replace(mu_t=twisting)
                    pile = spun(sim, body(period), FRICTION)
                    filled = 4.0 / 3.0 * np.pi * (pile.simulation.grains.radius**3).sum()
                    bulk = 4.0 / 3.0 * np.pi * np.prod(pile.axes) / pile.length**3
                    r = one_pile(pile, body(period), earth(1.6), np.eye(3))
                    hours = 2.0 * np.pi / r.spin.to_value(u.rad / u.h)
                    rows.append((1.0 - filled / bulk, r.stretch, hours))
                a, b, c = (
                    "/".join(f"{x:.{d}f}" for x in column)
                    for column, d in zip(zip(*rows, strict=True), (3, 2, 1), strict=True)
                )
                print(f"{name:14s} {twisting:7.1f}   {spin:10s}  {a}  {b}  {c}", flush=True)


if __name__ == "__main__":
    main()
