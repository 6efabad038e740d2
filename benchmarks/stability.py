"""Energy criterion of stability: throughput, and comparison with exhaustive searches and the full dynamics.

    python benchmarks/stability.py [speed | minima | push | kappa]

speed   a catalogue of 4,000 bodies by depth, and a 200 x 200 map of shapes (times after compilation)
minima  least critical energies against 100,000 random directions, the best of them polished by SciPy's simplex:
        four yield surfaces, three dilatancies
push    second order, third order and barrier compared with the full dynamics of perturbed bodies
kappa   plastic bulk modulus, friction and dilatancy over decades, with kappa_crit where it exists
"""

from __future__ import annotations

import sys
import time

import astropy.units as u
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from flybystab.body.body import YIELD_SURFACES, Body, Material
from flybystab.body.recovery import recovery_energy
from flybystab.body.stability import stability
from flybystab.body.stability_regions import DEPTHS, stability_many, stability_map
from flybystab.constants import G
from flybystab.core.energy import stability_row as columns
from flybystab.core.energy.direction_search import BARRIER, SECOND, THIRD, level
from flybystab.core.energy.perturbation import (
    LONGEST,
    Ellipsoid,
    barrier,
    ellipsoid,
    powers,
    second_order,
    third_order,
)
from flybystab.core.energy.stability_row import classify
from flybystab.core.numerics.jit import kernel

Array = NDArray[np.float64]

COUNT = 4000
SAMPLES = 100_000
RHO = 2000.0

#: Axes and omega^2/(pi G rho).
SHAPES = {
    "pile 1.4:.85:.75, 6 h": ((1.4, 0.85, 0.75), (2 * np.pi / 21600) ** 2 / (np.pi * G * RHO)),
    "1:.8:.7, w2 .7": ((1, 0.8, 0.7), 0.7),
    "1:.6:.6, w2 .3": ((1, 0.6, 0.6), 0.3),
    "1:1:.6, w2 .8": ((1, 1, 0.6), 0.8),
    "1:.45:.4, w2 .4": ((1, 0.45, 0.4), 0.4),
}


def body(name: str, friction: float, **material: object) -> Body:
    axes, w2 = SHAPES[name]
    spin = [0, 0, np.sqrt(w2 * np.pi * G * RHO)] * u.rad / u.s
    made = Material(friction_angle=friction * u.deg, **material)
    return Body(np.array(axes) * u.km, RHO * u.kg / u.m**3, spin=spin, material=made)


def random_bodies(n: int) -> list[Body]:
    rng = np.random.default_rng(0)
    axes = -np.sort(-rng.uniform(0.35, 1.0, (n, 3)), axis=1) * 10 ** rng.uniform(2, 3.5, (n, 1))
    density, period = rng.uniform(1200, 3000, n), rng.lognormal(1.6, 0.8, n) + 2.0
    return [Body(a * u.m, d * u.kg / u.m**3, p * u.h) for a, d, p in zip(axes, density, period, strict=True)]


def speed() -> None:
    bodies = random_bodies(COUNT)
    ratio = np.linspace(0.05, 1.0, 200)
    stability_many(bodies[:8])
    stability_map([1.0], [0.8], 0.3, 30 * u.deg)
    print(f"{'depth':>14} {'s for ' + str(COUNT):>12} {'us/body':>10}")
    for depth in DEPTHS:
        start = time.perf_counter()
        stability_many(bodies, depth=depth)
        wall = time.perf_counter() - start
        print(f"{depth:>14} {wall:12.2f} {wall / COUNT * 1e6:10.1f}")
    for depth in ("friction", "infinitesimal", "second"):
        start = time.perf_counter()
        stability_map(ratio[None, :], ratio[:, None], 0.3, 30 * u.deg, depth=depth)
        print(f"200 x 200 map, {depth:>14}: {time.perf_counter() - start:6.2f} s")


@kernel
def brute(b, x, enough, out):  # type: ignore[no-untyped-def]
    """Second order, third order and barrier (exact up to `enough`) of the directions ``x[n, 5]``."""
    for i in range(x.shape[0]):
        p1, p2, p3 = powers(b, x[i])
        out[0, i] = second_order(p1, p2)[0]
        out[1, i] = third_order(p1, p2, p3)[0]
        out[2, i] = barrier(b, x[i], LONGEST, enough)[0]


def polished(b: Ellipsoid, starts: Array, order: int, ball: bool) -> float:
    """Least critical energy at an order that SciPy's simplex reaches from the starts."""

    def energy(x: Array) -> float:
        r = np.linalg.norm(x)
        return float(level(b, x / r if r > 1.0 or not ball else x, order, np.inf)[0])

    least = np.inf
    for x in starts:
        for _ in range(3):
            end = minimize(
                energy, x, method="Nelder-Mead", options={"xatol": 1e-6, "fatol": 1e-9, "maxfev": 600}
            )
            x = end.x
        least = min(least, end.fun)
    return least


def minima() -> None:
    print(
        f"least critical energy / the one found (1 or more: none was missed): over {SAMPLES} random directions,"
    )
    print("and after SciPy's simplex from the best four of them; -: no critical energy at that order")
    print(
        f"{'':>58} {'random directions':^27} {'and simplex':^29}\n"
        f"{'body':>22} {'surface':>25} {'dilatancy':>9} {'second':>8} {'third':>8} {'barrier':>8}"
        f"   {'second':>8} {'third':>8} {'barrier':>8}"
    )
    rng = np.random.default_rng(0)
    x = rng.standard_normal((SAMPLES, 5))
    x /= np.linalg.norm(x, axis=1)[:, None]
    # the ball: half of the directions at the apex, where it is admissible
    ball = x.copy()
    ball[::2] *= rng.uniform(0, 1, (SAMPLES // 2, 1)) ** 0.2
    row, found = np.empty(columns.COLUMNS), np.empty((columns.DIRECTIONS, 5))
    worst = np.full(6, np.inf)
    for name, (axes, w2) in SHAPES.items():
        for code, surface in enumerate(YIELD_SURFACES):
            for dilatancy in (0.0, 0.5, 1.0):
                spin = np.array([0.0, 0.0, np.sqrt(w2)])
                given = (*np.square(axes), spin, code, np.deg2rad(40.0), 0.0, dilatancy, 0.0)
                b = ellipsoid(*given)
                classify(*given[:7], *given[6:], 5, row, found)
                ours = row[[columns.ENERGY_2, columns.ENERGY_3, columns.ENERGY_B]]
                if row[columns.LEVEL] < 1:
                    print(
                        f"{name:>22} {surface:>25} {dilatancy:9.1f}   not in equilibrium at this friction angle"
                    )
                    continue
                where = ball if dilatancy == 1.0 else x
                values = np.empty((3, SAMPLES))
                brute(b, where, 1.2 * ours[2], values)
                ratio = np.full(6, np.nan)
                for i, order in enumerate((SECOND, THIRD, BARRIER)):
                    if np.isfinite(ours[i]) or np.isfinite(values[i].min()):
                        best = np.argsort(values[i])[:4]
                        ratio[i] = values[i, best[0]] / ours[i]
                        ratio[3 + i] = polished(b, where[best], order, dilatancy == 1.0) / ours[i]
                worst = np.fmin(worst, ratio)
                _print_ratios(f"{name:>22} {surface:>25} {dilatancy:9.1f}", ratio)
    _print_ratios(f"{'least ratio':>58}", worst)


def _print_ratios(head: str, ratio: Array) -> None:
    cells = ["       -" if np.isnan(v) else f"{v:8.5f}" for v in ratio]
    print(head, " ".join(cells[:3]), " ", " ".join(cells[3:]), flush=True)


def push() -> None:
    print(
        "critical energies / binding energy; dynamics: least and median over 16 directions of the energy from"
    )
    print(
        "which the body does not come to rest inside the model (flybystab.body.recovery.recovery_energy); nan: friction"
    )
    print("does not stop a perturbation of fixed direction, so that the series along it is undefined")
    print(
        f"{'body':>22} {'friction':>8} {'cohesion':>12} {'required':>8} {'dilatancy':>9} | {'second':>7} "
        f"{'third':>7} {'barrier':>7}"
        f" {'kind':>8} | {'least':>7} {'median':>7} | {'least/barrier':>13}"
    )
    ratios = []
    for name, friction, cohesion, brittle in (
        ("pile 1.4:.85:.75, 6 h", 35, 0, False),
        ("pile 1.4:.85:.75, 6 h", 35, 200, False),
        ("pile 1.4:.85:.75, 6 h", 35, 200, True),
        ("pile 1.4:.85:.75, 6 h", 8, 0, False),
        ("pile 1.4:.85:.75, 6 h", 8, 200, False),
        ("1:.8:.7, w2 .7", 30, 0, False),
        ("1:.8:.7, w2 .7", 30, 100, False),
        ("1:.8:.7, w2 .7", 24, 0, False),
        ("1:.6:.6, w2 .3", 20, 0, False),
        ("1:.6:.6, w2 .3", 20, 100, False),
        ("1:1:.6, w2 .8", 40, 0, False),
        ("1:1:.6, w2 .8", 28.2, 0, False),
        ("1:1:.6, w2 .8", 28.2, 100, False),
        ("1:1:.6, w2 .8", 28.2, 100, True),
        ("1:.45:.4, w2 .4", 35, 0, False),
        ("1:.45:.4, w2 .4", 14.6, 0, False),
    ):
        b = body(name, friction, cohesion=cohesion * u.Pa, brittle=brittle)
        strength = f"{cohesion} Pa{' brittle' if brittle else ''}" if cohesion else "0"
        for dilatancy in (0.0, 0.5, 1.0):
            s = stability(b, dilatancy=dilatancy)
            rng = np.random.default_rng(0)
            ways = [
                d
                for d in s.directions
                if np.all(np.isfinite(d)) and np.linalg.norm(d - np.trace(d) / 3 * np.eye(3)) > 0.1
            ]
            ways += [v + v.T for v in rng.standard_normal((16 - len(ways), 3, 3))]
            found = [
                recovery_energy(b, d, dilatancy=dilatancy, precision=0.02) / s.binding_energy for d in ways
            ]
            energies = [(e / s.binding_energy).value for e in s.critical_energy]
            ratio = min(found).value / energies[2] if energies[2] > 0.0 else np.nan
            ratios.append(ratio)
            print(
                f"{name:>22} {friction:8.1f} {strength:>12} {s.equilibrium.required_friction_angle.value:8.1f} "
                f"{dilatancy:9.1f} | "
                + " ".join(f"{e:7.4f}" for e in energies)
                + f" {s.barrier_kind:>8} | {min(found).value:7.4f} {np.median(found):7.4f} | {ratio:13.2f}",
                flush=True,
            )
    print(
        f"least of the dynamics / barrier: {np.nanmin(ratios):.2f} to {np.nanmax(ratios):.2f}, "
        f"median {np.nanmedian(ratios):.2f}"
    )


def kappa() -> None:
    print(
        "plastic bulk modulus kappa over the pressure p: least critical energy / binding energy at second order, and"
    )
    print(
        "from the barrier; kappa_crit of a body at yield; stable: to infinitesimal perturbations at mobilised friction"
    )
    ratios = (0.0, 1e-1, 1.0, 1e1, 1e2, 1e3, 1e4)
    print(
        f"{'body':>22} {'friction':>8} {'dilatancy':>9} {'kappa_crit/p':>12} | "
        + " ".join(f"{'kappa/p ' + format(r, 'g'):>15}" for r in ratios)
    )
    for name in ("pile 1.4:.85:.75, 6 h", "1:.8:.7, w2 .7", "1:1:.6, w2 .8"):
        for friction in (30.0, 35.0, 40.0):
            for dilatancy in (0.0, 0.01, 0.1, 0.5, 0.9, 1.0):
                b = body(name, friction)
                p = stability(b).equilibrium.mean_pressure
                cells, critical = [], ""
                for r in ratios:
                    s = stability(body(name, friction, bulk_modulus=r * p), dilatancy=dilatancy)
                    second, _, whole = (float(e / s.binding_energy) for e in s.critical_energy)
                    cells.append(f"{second:7.4f} {whole:7.4f}")
                    critical = "-" if s.kappa_crit is None else f"{(s.kappa_crit / p).value:.3f}"
                print(f"{name:>22} {friction:8.1f} {dilatancy:9.2f} {critical:>12} | " + " ".join(cells))


COMMANDS = {"speed": speed, "minima": minima, "push": push, "kappa": kappa}

if __name__ == "__main__":
    what = sys.argv[1] if len(sys.argv) > 1 else "speed"
    if what not in COMMANDS:
        sys.exit(f"no benchmark {what!r}: {', '.join(COMMANDS)}")
    COMMANDS[what]()
