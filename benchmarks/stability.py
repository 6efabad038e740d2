"""Throughput of the stability test: a catalogue of 4,000 bodies by depth, and a 200 x 200 map of shapes.

Run as ``python benchmarks/stability.py``. Times are after compilation.
"""

from __future__ import annotations

import time

import astropy.units as u
import numpy as np

from flybystab.aggregate.body import Body
from flybystab.aggregate.regions import DEPTHS, stability_many, stability_map

COUNT = 4000


def bodies(n: int) -> list[Body]:
    rng = np.random.default_rng(0)
    axes = -np.sort(-rng.uniform(0.35, 1.0, (n, 3)), axis=1) * 10 ** rng.uniform(2, 3.5, (n, 1))
    density, period = rng.uniform(1200, 3000, n), rng.lognormal(1.6, 0.8, n) + 2.0
    return [Body(a * u.m, d * u.kg / u.m**3, p * u.h) for a, d, p in zip(axes, density, period, strict=True)]


def main() -> None:
    pile = bodies(COUNT)
    stability_many(pile[:8])
    print(f"{'depth':>14} {'s for ' + str(COUNT):>12} {'us/body':>10}")
    for depth in DEPTHS:
        start = time.perf_counter()
        stability_many(pile, depth=depth)
        wall = time.perf_counter() - start
        print(f"{depth:>14} {wall:12.2f} {wall / COUNT * 1e6:10.1f}")
    ratio = np.linspace(0.05, 1.0, 200)
    for depth in ("friction", "infinitesimal", "second"):
        start = time.perf_counter()
        stability_map(ratio[None, :], ratio[:, None], 0.3, 30 * u.deg, depth=depth)
        print(f"200 x 200 map, {depth:>14}: {time.perf_counter() - start:6.2f} s")


if __name__ == "__main__":
    main()
