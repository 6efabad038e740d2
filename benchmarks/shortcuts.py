"""Possible savings by two simplifications of a flyby: no steps on the distant orbit, and motion in its plane only.

python benchmarks/shortcuts.py distant   fraction of the time on stretches where the tide is below the target error
python benchmarks/shortcuts.py planar    cost of the parts of a step of plastic flow, with 15 and with 9 variables

Times are processor times, least of several runs.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

import astropy.units as u
import numpy as np
from astropy.time import Time
from numba import njit

import flybystab as fs
from flybystab.core.dynamics import rates as motion
from flybystab.core.dynamics import state
from flybystab.core.dynamics.jacobian import flow_jacobian
from flybystab.core.dynamics.run import parameters
from flybystab.core.dynamics.steppers import implicit_step
from flybystab.core.dynamics.workspace import Limits, workspace
from flybystab.core.ellipsoid.tide import TidePanels, components
from flybystab.core.numerics.lu import factorise, solve
from flybystab.flybys.batch import MAX_STEPS, one_row, output_buffers, verdict_rows

PILE = fs.Body(semi_axes=[1400, 850, 750] * u.m, density=2000 * u.kg / u.m**3, spin_period=6 * u.h)


def least(run: Callable[[], object], repeat: int = 20) -> float:
    """Least processor time of several runs, s."""
    times = []
    for _ in range(repeat):
        start = time.process_time()
        run()
        times.append(time.process_time() - start)
    return min(times)


def scenes() -> list[tuple[str, fs.Body, fs.Encounter]]:
    """Scripted from 10 radii, rigid and with flow, and the real encounters of Apophis and of a fast rotator."""

    def earth(q: float) -> fs.Encounter:
        return fs.Encounter.hyperbolic(
            "earth", q * fs.R_earth, 5 * u.km / u.s, start_distance=10 * fs.R_earth
        )

    apophis = fs.Asteroid.from_catalogue("Apophis")
    real = fs.Encounter.from_orbit(apophis.orbit, "earth", Time("2029-04-13", scale="tdb"))
    fast = PILE.with_(
        semi_axes=[15, 12, 11] * u.m,
        spin_period=0.2 * u.h,
        material=fs.Material(cohesion=100 * u.Pa),
    )
    return [
        ("scripted, 3 R_E, rigid", PILE, earth(3.0)),
        ("scripted, 2.2 R_E, flow", PILE, earth(2.2)),
        ("Apophis 2029", apophis.body, real),
        ("30 m, 12 min, as Apophis", fast, real),
    ]


def distant() -> None:
    """Spin that the tide can add on the outer stretches, ``int |K| dt`` over it, below the tolerance: skipped."""
    print(
        f"{'scene':26s} {'tolerance':>9s} {'steps':>6s} {'time (ms)':>10s} {'skipped (h)':>12s} {'saved':>7s}"
    )
    for name, body, e in scenes():
        for tolerance in (1e-3, 1e-6, 1e-8):
            arguments = one_row(body, e)
            output = output_buffers(1, 0)

            def run(span: np.ndarray, arguments=arguments, tolerance=tolerance, output=output) -> None:
                encounters = arguments.encounters._replace(rows=span)
                limits = Limits(tolerance, 6.0, MAX_STEPS)
                verdict_rows(arguments.rows, arguments.bodies, encounters, limits, False, output)

            span = arguments.encounters.rows.copy()
            t = np.linspace(e.t_start, e.t_stop, 20001)
            size = 2.0 * e.planet.gm / e.distances(t) ** 3
            added = np.cumsum(size) * (t[1] - t[0])
            allowed = tolerance * np.linalg.norm(body.omega)
            first = t[np.searchsorted(added, allowed)]
            last = t[min(len(t) - 1, np.searchsorted(added, added[-1] - allowed))]
            full = least(lambda span=span, run=run: run(span))
            steps = output.outcomes[0]["steps"]
            inner = span.copy()
            inner["start"] = first
            inner["rest"] = inner["stop"] = last
            short = least(lambda inner=inner, run=run: run(inner))
            skipped = (first - e.t_start + e.t_stop - last) / 3600.0
            print(
                f"{name:26s} {tolerance:9.0e} {steps:6.0f} {1e3 * full:10.3f} {skipped:12.4f} "
                f"{max(0.0, 1.0 - short / full):6.1%}"
            )


@njit
def _rates(n, t, y, dy, par, tide, work):
    for _ in range(n):
        motion.rate(state.FLOWING, t, y, dy, par, tide, work)


@njit
def _cheap_rates(n, y, dy, par, work):
    for _ in range(n):
        motion.deformation_rate(state.FLOWING, y, dy, par.material, work)


@njit
def _jacobians(n, t, y, dy, par, tide, work, jac, lu):
    for _ in range(n):
        flow_jacobian(t, y, dy, 1e-6, par.material, tide, work, jac, lu)


@njit
def _factors(n, size, a, b, pivots):
    for _ in range(n):
        b[:] = a
        factorise(b, size, pivots)


@njit
def _solutions(n, size, b, pivots, x):
    for _ in range(n):
        x[:] = 1.0
        solve(b, size, pivots, x)


@njit
def _steps(n, t, par, tide, ws):
    for _ in range(n):
        implicit_step(t, 1e-3, par, tide, ws)


def planar() -> None:
    """In the plane 15 numbers become 9 (S and D 4 each, w 1): 6 fewer Jacobian columns, a smaller linear system."""
    n = 2000
    par = parameters(PILE.axes.copy(), PILE.rho, np.deg2rad(35.0), 0.0, 0.0, 0)
    e = scenes()[1][2]
    t0 = PILE.dynamical_time
    tide = TidePanels(e.tide.tau / t0, e.tide.start, e.tide.width, e.tide.coefficients * t0**2)
    work = state.empty_buffers()
    y, dy, s = (np.zeros(15) for _ in range(3))
    y[:3] = (PILE.axes / np.cbrt(np.prod(PILE.axes))) ** 2
    y[6:12] = components(0.05 * np.array([[1.0, 0.3, 0.0], [0.3, -0.4, 0.0], [0.0, 0.0, -0.6]]))
    y[14] = PILE.omega[2] * t0
    jac, lu = np.zeros((15, 16)), np.zeros((15, 15))
    pivots = np.zeros(15, dtype=np.int64)
    motion.rate(state.FLOWING, 0.0, y, dy, par, tide, work)
    system = np.eye(15) / 1e-3

    def cost(run: Callable[..., object], *arguments: object) -> float:
        run(1, *arguments)
        return 1e6 * least(lambda: run(n, *arguments), 7) / n

    rate = cost(_rates, 0.0, y, dy, par, tide, work)
    cheap = cost(_cheap_rates, y, dy, par, work)
    jacobian = cost(_jacobians, 0.0, y, dy, par, tide, work, jac, lu)
    factors = [cost(_factors, m, system, lu, pivots) for m in (15, 9)]
    system -= jac[:, :15]
    solutions = [cost(_solutions, m, lu, pivots, s) for m in (15, 9)]
    ws = workspace()
    ws.y[:], ws.jac[:], ws.scale[:] = y, jac, 1e-8
    step = cost(_steps, 0.0, par, tide, ws)
    rows = [
        ("right-hand side", rate, rate),
        ("the same without self-gravity and tide", cheap, cheap),
        ("Jacobian, 16 or 10 columns", jacobian, jacobian * 10.0 / 16.0),
        ("LU factors", *factors),
        ("eight solutions", 8.0 * solutions[0], 8.0 * solutions[1]),
        (
            "step with given Jacobian",
            step,
            step - factors[0] + factors[1] - 8.0 * (solutions[0] - solutions[1]),
        ),
    ]
    print(f"{'part of a step of plastic flow':42s} {'15 numbers (us)':>16s} {'9 numbers (us)':>15s}")
    for name, full, less in rows:
        print(f"{name:42s} {full:16.2f} {less:15.2f}")
    whole = [jacobian + step, rows[2][2] + rows[5][2]]
    print(f"{'Jacobian and step':42s} {whole[0]:16.2f} {whole[1]:15.2f}   ratio {whole[0] / whole[1]:.2f}")


if __name__ == "__main__":
    commands = {"distant": distant, "planar": planar}
    if len(sys.argv) != 2 or sys.argv[1] not in commands:
        raise SystemExit(__doc__)
    commands[sys.argv[1]]()
