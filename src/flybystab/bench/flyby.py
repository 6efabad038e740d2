"""Error against time of the flyby integrators, on one case with flow (reference flyby P1) and one without.

The reference solution is the default integrator at a tolerance of 1e-12; errors are the largest relative errors of
the final semi-axes. The methods of SciPy and, if it is installed, LSODA of numbalsoda integrate the same compiled
right-hand side from onset to arrest, without locating these events. The number of steps that implicit methods reject
depends on the last digits of the initial state: each method starts from several of the first states of the flow, and
medians are given, with the least and the most time. SciPy calls the right-hand side from Python; numbalsoda does not,
so that its time is that of the method. The rigid row is a passage at 3 radii; its error is that of the spin.
"""

from __future__ import annotations

import importlib.util
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import astropy.units as u
import numpy as np

from flybystab.body.body import Body, Material
from flybystab.core.dynamics import rates as motion
from flybystab.core.dynamics.moreau import follow_steps
from flybystab.core.dynamics.run import LIMITS, body_state, integrate, parameters
from flybystab.core.dynamics.state import FLOWING, empty_buffers
from flybystab.core.dynamics.workspace import Limits
from flybystab.core.ellipsoid.tide import TidePanels, tensor
from flybystab.encounter.encounter import Encounter
from flybystab.flybys.batch import MAX_STEPS, one_row, output_buffers, verdict_rows
from flybystab.plots.style import new_figure, save, styled
from flybystab.units import R_earth

PHI = np.deg2rad(35.0)

#: Number of initial states of each run of another library.
STARTS = 9
#: Methods of SciPy with their tolerances.
METHODS = {
    "Radau": (1e-4, 1e-6, 1e-8),
    "DOP853": (1e-4, 1e-6, 1e-8),
    "LSODA": (1e-4, 1e-6, 1e-8, 1e-10),
}


def case() -> tuple[Body, Encounter]:
    """The pile and its passage at 2.2 radii: reference flyby P1."""
    cone = Material(yield_surface="drucker-prager")  # reference flyby P1
    body = Body(
        semi_axes=[1400, 850, 750] * u.m, density=2000 * u.kg / u.m**3, spin_period=6 * u.h, material=cone
    )
    encounter = Encounter.hyperbolic(
        "earth", periapsis=2.2 * R_earth, v_inf=5 * u.km / u.s, start_distance=10 * R_earth
    )
    return body, encounter


def _best(run: Any, repeat: int) -> float:
    """Least processor time of several runs on one core, s."""
    times = []
    for _ in range(repeat):
        start = time.process_time()
        run()
        times.append(time.process_time() - start)
    return min(times)


def rows(figure: str | Path | None = None, repeat: int = 5) -> list[dict[str, Any]]:
    """Rows of method, setting, relative error, processor time (s) and time over that of the default at 1e-6."""
    body, e = case()
    t0 = body.dynamical_time
    a0 = float(np.cbrt(np.prod(body.axes)))
    tide = TidePanels(e.tide.tau / t0, e.tide.start, e.tide.width, e.tide.coefficients * t0**2)

    start = body_state(body.axes, body.rho, body.omega, np.eye(3), PHI)

    def default(tolerance: float, keep: int = 0) -> Any:
        limits = LIMITS._replace(tolerance=tolerance)
        return integrate(start, (e.t_start, e.t_stop), e.tide, limits=limits, keep=keep)

    def kernel(tolerance: float, encounter: Encounter) -> Callable[[], None]:
        """The compiled run alone, as `flyby` and `flyby_many` call it for each row."""
        arguments = one_row(body, encounter)
        limits = Limits(tolerance, 6.0, MAX_STEPS)
        return lambda: verdict_rows(*arguments, limits, False, output_buffers(1, 0))

    def axes(shape: Any) -> Any:
        return np.sqrt(np.linalg.eigvalsh(shape)[::-1])

    exact = default(1e-12, keep=200_000)
    truth = axes(exact.shape)
    out: list[dict[str, Any]] = []

    def add(method: str, setting: str, shape: Any, cpu: float) -> None:
        error = float(np.abs(axes(shape) / truth - 1.0).max())
        out.append({"method": method, "setting": setting, "error_relative": error, "cpu_s": cpu})

    for tolerance in (1e-3, 3e-4, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10):
        run = default(tolerance)
        add("default", f"tol {tolerance:.0e}", run.shape, _best(kernel(tolerance, e), repeat))

    far = Encounter.hyperbolic(
        "earth", periapsis=3.0 * R_earth, v_inf=5 * u.km / u.s, start_distance=10 * R_earth
    )

    def rigid(tolerance: float) -> Any:
        limits = LIMITS._replace(tolerance=tolerance)
        return integrate(start, (far.t_start, far.t_stop), far.tide, limits=limits)

    gradients = [rigid(tolerance).velocity_gradient for tolerance in (1e-8, 1e-12)]
    out.append(
        {
            "method": "default, rigid",
            "setting": "no yield, tol 1e-08",
            "error_relative": float(
                np.linalg.norm(gradients[0] - gradients[1]) / np.linalg.norm(gradients[1])
            ),
            "cpu_s": _best(kernel(1e-8, far), 20),
        }
    )
    par = parameters(body.axes, body.rho, PHI, 0.0, 0.0, 0)

    def stepping(n: int) -> Any:
        y = np.zeros(15)
        y[:3] = (body.axes / a0) ** 2
        y[12:15] = body.omega * t0
        follow_steps(e.t_start / t0, e.t_stop / t0, n, y, par.material, tide, False)
        return tensor(y[:6]) * a0**2

    for n in (2000, 8000, 32000):
        coarse, fine = stepping(n), stepping(2 * n)
        cpu = _best(lambda n=n: (stepping(n), stepping(2 * n)), 2)
        add("stepping", f"{n} and {2 * n} steps", 2.0 * fine - coarse, cpu)

    # SciPy: from just after onset, where the flow is started as the default starts it, to just before arrest.
    history = exact.history
    flowing = np.flatnonzero(history["regime"] == FLOWING)
    last = flowing[-1]
    work = empty_buffers()

    def numbers(i: int) -> Any:
        gradient = history["velocity_gradient"][i] * t0
        d, w = 0.5 * (gradient + gradient.T), 0.5 * (gradient - gradient.T)
        shape = history["shape"][i] / a0**2
        pick = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]
        return np.array([shape[p] for p in pick] + [d[p] for p in pick] + [w[2, 1], w[0, 2], w[1, 0]])

    def derivative(t: float, y: Any) -> Any:
        dy = np.zeros(15)
        motion.rate(FLOWING, t, y, dy, par, tide, work)
        return dy

    target = axes(history["shape"][last])
    span = history["time"][last] / t0

    def others(method: str, tolerance: float, solve: Callable[[float, Any], Any]) -> None:
        """Row of a method that integrates a state from a time to `span`."""
        found = []
        for first in flowing[:STARTS]:
            state = numbers(first)
            clock = time.process_time()
            y = solve(history["time"][first] / t0, state)
            clock = time.process_time() - clock
            found.append((clock, float(np.abs(axes(tensor(y[:6]) * a0**2) / target - 1.0).max())))
        cpu, error = np.median(found, axis=0)
        out.append(
            {
                "method": method,
                "setting": f"rtol {tolerance:.0e}",
                "error_relative": float(error),
                "cpu_s": float(cpu),
                "cpu_least_s": min(c for c, _ in found),
                "cpu_most_s": max(c for c, _ in found),
            }
        )

    from scipy.integrate import solve_ivp

    # |D| starts at 1e-10: its absolute tolerance must be below it
    for method, tolerances in METHODS.items():
        for tolerance in tolerances:

            def by_scipy(t: float, y: Any, method: str = method, tolerance: float = tolerance) -> Any:
                return solve_ivp(
                    derivative, (t, span), y, method=method, rtol=tolerance, atol=tolerance * 1e-4
                ).y[:, -1]

            others(f"SciPy {method}", tolerance, by_scipy)
    if compiled := compiled_lsoda(par, tide):
        compiled(history["time"][flowing[0]] / t0, span, numbers(flowing[0]), 1e-4)  # compiles
        for tolerance in METHODS["LSODA"]:

            def by_lsoda(t: float, y: Any, tolerance: float = tolerance) -> Any:
                return compiled(t, span, y, tolerance)

            others("numbalsoda", tolerance, by_lsoda)
    reached = [r["cpu_s"] for r in out if r["method"] == "default" and r["error_relative"] <= 1e-6]
    for row in out:
        row["cpu_over_default_at_1e-6"] = row["cpu_s"] / min(reached)
    if figure is not None:
        _plot(out, figure)
    return out


def compiled_lsoda(par: Any, tide: TidePanels) -> Callable[[float, float, Any, float], Any] | None:
    """LSODA of numbalsoda as a function of both times, state and tolerance; None if it is not installed."""
    if importlib.util.find_spec("numbalsoda") is None:
        return None
    import numba
    from numbalsoda import lsoda, lsoda_sig

    shape, (tau, start, width) = tide.coefficients.shape, tide[:3]

    @numba.cfunc(lsoda_sig)
    def derivative(t: float, y: Any, dy: Any, data: Any) -> None:
        panels = TidePanels(tau, start, width, numba.carray(data, shape))
        state, out = numba.carray(y, (15,)), numba.carray(dy, (15,))
        motion.rate(FLOWING, t, state, out, par, panels, empty_buffers())

    def solve(t: float, stop: float, y: Any, tolerance: float) -> Any:
        found, good = lsoda(
            derivative.address, y, np.array([t, stop]), tide.coefficients, rtol=tolerance, atol=tolerance * 1e-4,
            mxstep=100_000,
        )  # fmt: skip
        return found[-1] if good else np.full(15, np.nan)

    return solve


def lines(rows: list[dict[str, Any]]) -> list[str]:
    """The table as text."""
    head = (
        f"{'method':14s} {'setting':24s} {'rel. error':>10s} {'cpu (ms)':>10s} {'least to most':>16s} "
        f"{'over default at 1e-6':>21s}"
    )
    out = [head]
    for r in rows:
        ends = f"{1e3 * r['cpu_least_s']:.1f} to {1e3 * r['cpu_most_s']:.1f}" if "cpu_least_s" in r else ""
        out.append(
            f"{r['method']:14s} {r['setting']:24s} {r['error_relative']:10.1e} {1e3 * r['cpu_s']:10.2f} {ends:>16s} "
            f"{r['cpu_over_default_at_1e-6']:21.1f}"
        )
    if not any(r["method"] == "numbalsoda" for r in rows):
        out.append("numbalsoda: not installed (pip install numbalsoda; it needs a Fortran compiler)")
    return out


@styled
def _plot(rows: list[dict[str, Any]], path: str | Path) -> None:
    """Error against time; bars are the least and the most time over the initial states."""
    figure = new_figure(7.4, 4.2)
    panel: Any = figure.subplots()
    colours = [
        "#0072B2",
        "#E69F00",
        "#000000",
        "#009E73",
        "#56B4E9",
        "#D55E00",
        "#CC79A7",
    ]  # Okabe & Ito (2008)
    methods = dict.fromkeys(r["method"] for r in rows)
    for method, marker, colour in zip(methods, "oxs^Dv*", colours, strict=False):
        chosen = [r for r in rows if r["method"] == method]
        time = np.array(
            [[r.get(f"cpu{end}_s", r["cpu_s"]) for r in chosen] for end in ("_least", "", "_most")]
        )
        spread = 1e3 * np.abs(time[[0, 2]] - time[1])
        error = [r["error_relative"] for r in chosen]
        panel.errorbar(
            1e3 * time[1], error, xerr=spread, marker=marker, color=colour, ms=5, lw=1, elinewidth=0.7, capsize=2,
            label=method,
        )  # fmt: skip
    panel.set(
        xscale="log",
        yscale="log",
        xlabel="processor time (ms)",
        ylabel="relative error of the semi-axes",
        title="Flyby P1, with flow",
    )
    figure.legend(loc="outside right upper", frameon=False)
    save(figure, path)
