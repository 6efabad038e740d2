"""Error against time of the flyby integrators, on one case with flow (reference flyby P1) and one without.

The reference solution is the default integrator at a tolerance of 1e-12; errors are the largest relative errors of
the final semi-axes. The methods of SciPy and, if it is installed, LSODA of numbalsoda integrate the same compiled
right-hand side from onset to arrest, without locating these events. The number of steps that implicit methods reject
depends on the last digits of the initial state: each method starts from several of the first states of the flow, and
medians are given, with the least and the most time. SciPy calls the right-hand side from Python; numbalsoda does not,
so that its time is that of the method. The rigid row is an encounter at 3 radii; its error is that of the spin.
"""

from __future__ import annotations

import importlib.util
import time
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import astropy.units as u
import numpy as np

from flybystab.body.body import Body, Material
from flybystab.core.dynamics import rates as motion
from flybystab.core.dynamics.moreau import follow_steps
from flybystab.core.dynamics.run import LIMITS, BodyState, Run, body_state, integrate, parameters
from flybystab.core.dynamics.state import FLOWING, Parameters, empty_buffers
from flybystab.core.dynamics.workspace import Limits
from flybystab.core.ellipsoid.tide import TidePanels, tensor
from flybystab.encounter.encounter import Encounter
from flybystab.flybys.batch import MAX_STEPS, one_row, output_buffers, verdict_rows
from flybystab.plots.style import new_figure, save, styled
from flybystab.typing import Array, Document
from flybystab.units import R_earth

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PHI = np.deg2rad(35.0)

#: Number of initial states of each run of another library.
STARTS = 9
#: Largest number of steps of such a run; single runs of LSODA at 1e-6 to 1e-8 may need many more.
MOST_STEPS = 100_000
#: Methods of SciPy with their tolerances.
METHODS = {
    "Radau": (1e-4, 1e-6, 1e-8),
    "DOP853": (1e-4, 1e-6, 1e-8),
    "LSODA": (1e-4, 1e-6, 1e-8, 1e-10),
}
#: Integrates a state (15,) of the flow between two times (units of the right-hand side) with a relative tolerance:
#: start, end, state, tolerance -> state at the end.
Solver = Callable[[float, float, Array, float], Array]


def case() -> tuple[Body, Encounter]:
    """Body and encounter of reference flyby P1: periapsis at 2.2 Earth radii."""
    cone = Material(yield_surface="drucker-prager")
    body = Body(
        semi_axes=[1400, 850, 750] * u.m, density=2000 * u.kg / u.m**3, spin_period=6 * u.h, material=cone
    )
    encounter = Encounter.hyperbolic(
        "earth", periapsis=2.2 * R_earth, v_inf=5 * u.km / u.s, start_distance=10 * R_earth
    )
    return body, encounter


def _best(run: Callable[[], object], repeat: int) -> float:
    """Least processor time of several runs on one core, s."""
    times = []
    for _ in range(repeat):
        start = time.process_time()
        run()
        times.append(time.process_time() - start)
    return min(times)


class Problem(NamedTuple):
    """The reference flyby for the kernels.

    Attributes
    ----------
    body, encounter : Body, Encounter
    start : BodyState
        Initial state, SI.
    t0, a0 : float
        Units of the right-hand side: dynamical time, s, and geometric mean of the semi-axes, m.
    parameters, tide : Parameters, TidePanels
        Of the right-hand side, in these units.
    """

    body: Body
    encounter: Encounter
    start: BodyState
    t0: float
    a0: float
    parameters: Parameters
    tide: TidePanels

    def run(self, tolerance: float, keep: int = 0, encounter: Encounter | None = None) -> Run:
        """Run of the default integrator, with `keep` rows of history; by default through the reference encounter."""
        through = encounter or self.encounter
        limits = LIMITS._replace(tolerance=tolerance)
        return integrate(
            self.start, (through.t_start, through.t_stop), through.tide, limits=limits, keep=keep
        )

    def kernel(self, tolerance: float, encounter: Encounter | None = None) -> Callable[[], object]:
        """The compiled run alone, as `flyby` and `flyby_many` call it for each row."""
        arguments = one_row(self.body, encounter or self.encounter)
        limits = Limits(tolerance, 6.0, MAX_STEPS)
        return lambda: verdict_rows(*arguments, limits, False, output_buffers(1, 0))


def _problem() -> Problem:
    body, e = case()
    t0 = body.dynamical_time
    tide = TidePanels(e.tide.tau / t0, e.tide.start, e.tide.width, e.tide.coefficients * t0**2)
    return Problem(
        body,
        e,
        body_state(body.axes, body.rho, body.omega, np.eye(3), PHI),
        t0,
        float(np.cbrt(np.prod(body.axes))),
        parameters(body.axes, body.rho, PHI, 0.0, 0.0, 0),
        tide,
    )


def _semi_axes(shape: Array) -> Array:
    """Semi-axes, the longest first, of a shape tensor (3, 3)."""
    return np.asarray(np.sqrt(np.linalg.eigvalsh(shape)[::-1]))


def _error(shape: Array, exact: Array) -> float:
    """Largest relative error of the semi-axes of a shape tensor (3, 3)."""
    return float(np.abs(_semi_axes(shape) / _semi_axes(exact) - 1.0).max())


def _row(method: str, setting: str, error: float, cpu: float) -> Document:
    return {"method": method, "setting": setting, "error_relative": error, "cpu_s": cpu}


def rows(figure: str | Path | None = None, repeat: int = 5) -> list[Document]:
    """Rows of method, setting, relative error, processor time (s) and time over that of the default at 1e-6."""
    problem = _problem()
    exact = problem.run(1e-12, keep=200_000)
    assert exact.history is not None  # rows are kept
    out = _default_rows(problem, exact.shape, repeat)
    out.append(_rigid_row(problem))
    out += _stepping_rows(problem, exact.shape)
    out += _library_rows(problem, exact.history)
    reached = [r["cpu_s"] for r in out if r["method"] == "default" and r["error_relative"] <= 1e-6]
    for row in out:
        row["cpu_over_default_at_1e-6"] = row["cpu_s"] / min(reached)
    if figure is not None:
        _plot(out, figure)
    return out


def _default_rows(problem: Problem, exact: Array, repeat: int) -> list[Document]:
    """Rows of the default integrator at several tolerances; `exact` is the reference shape tensor, m2."""
    out = []
    for tolerance in (1e-3, 3e-4, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10):
        error = _error(problem.run(tolerance).shape, exact)
        cpu = _best(problem.kernel(tolerance), repeat)
        out.append(_row("default", f"tol {tolerance:.0e}", error, cpu))
    return out


def _rigid_row(problem: Problem) -> Document:
    """Row of the default integrator in an encounter at 3 radii, in which the body does not yield."""
    far = Encounter.hyperbolic(
        "earth", periapsis=3.0 * R_earth, v_inf=5 * u.km / u.s, start_distance=10 * R_earth
    )
    found, exact = (problem.run(tolerance, encounter=far).velocity_gradient for tolerance in (1e-8, 1e-12))
    error = float(np.linalg.norm(found - exact) / np.linalg.norm(exact))
    return _row("default, rigid", "no yield, tol 1e-08", error, _best(problem.kernel(1e-8, far), 20))


def _stepping_rows(problem: Problem, exact: Array) -> list[Document]:
    """Rows of Moreau time stepping, extrapolated to vanishing steps from n and 2n of them."""
    e, t0 = problem.encounter, problem.t0

    def stepping(n: int) -> Array:
        y = np.zeros(15)
        y[:3] = (problem.body.axes / problem.a0) ** 2
        y[12:15] = problem.body.omega * t0
        follow_steps(e.t_start / t0, e.t_stop / t0, n, y, problem.parameters.material, problem.tide, False)
        return np.asarray(tensor(y[:6]) * problem.a0**2)

    out = []
    for n in (2000, 8000, 32000):
        coarse, fine = stepping(n), stepping(2 * n)
        cpu = _best(partial(stepping, n), 2) + _best(partial(stepping, 2 * n), 2)
        out.append(_row("stepping", f"{n} and {2 * n} steps", _error(2.0 * fine - coarse, exact), cpu))
    return out


def _library_rows(problem: Problem, history: Mapping[str, Array]) -> list[Document]:
    """Rows of SciPy and numbalsoda, from just after the onset of flow in a history to just before arrest.

    The flow starts as in the default integrator.
    """
    flowing = np.flatnonzero(history["regime"] == FLOWING)
    last = flowing[-1]
    span, target = history["time"][last] / problem.t0, history["shape"][last]
    starts = [(history["time"][i] / problem.t0, _state(problem, history, i)) for i in flowing[:STARTS]]

    def row(method: str, tolerance: float, solve: Solver) -> Document:
        found = []
        for t, state in starts:
            clock = time.process_time()
            y = solve(t, span, state, tolerance)
            clock = time.process_time() - clock
            error = _error(tensor(y[:6]) * problem.a0**2, target) if np.isfinite(y).all() else np.inf
            found.append((clock, error))
        cpu, error = np.median(found, axis=0)
        spread = {"cpu_least_s": min(c for c, _ in found), "cpu_most_s": max(c for c, _ in found)}
        return _row(method, f"rtol {tolerance:.0e}", float(error), float(cpu)) | spread

    out = []
    for method, tolerances in METHODS.items():
        solve = _scipy_solver(problem, method)
        out += [row(f"SciPy {method}", tolerance, solve) for tolerance in tolerances]
    if compiled := compiled_lsoda(problem.parameters, problem.tide):
        compiled(starts[0][0], span, starts[0][1], 1e-4)  # compiles
        out += [row("numbalsoda", tolerance, compiled) for tolerance in METHODS["LSODA"]]
    return out


def _state(problem: Problem, history: Mapping[str, Array], i: int) -> Array:
    """State (15,) of a row of a history, in the units of the right-hand side: shape, stretching and spin."""
    gradient = history["velocity_gradient"][i] * problem.t0
    d, w = 0.5 * (gradient + gradient.T), 0.5 * (gradient - gradient.T)
    shape = history["shape"][i] / problem.a0**2
    pick = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]
    return np.array([shape[p] for p in pick] + [d[p] for p in pick] + [w[2, 1], w[0, 2], w[1, 0]])


def _scipy_solver(problem: Problem, method: str) -> Solver:
    """A method of SciPy for the compiled right-hand side of the flow; nan after `MOST_STEPS` steps."""
    import scipy.integrate

    work, stepper = empty_buffers(), getattr(scipy.integrate, method)

    def derivative(t: float, y: Array) -> Array:
        dy = np.zeros(15)
        motion.rate(FLOWING, t, y, dy, problem.parameters, problem.tide, work)
        return dy

    def solve(t: float, stop: float, y: Array, tolerance: float) -> Array:
        # |D| starts at 1e-10: its absolute tolerance must be below it
        solver = stepper(derivative, t, y, stop, rtol=tolerance, atol=tolerance * 1e-4)
        for _ in range(MOST_STEPS):
            solver.step()
            if solver.status != "running":
                break
        return np.asarray(solver.y) if solver.status == "finished" else np.full(15, np.nan)

    return solve


def compiled_lsoda(par: Parameters, tide: TidePanels) -> Solver | None:
    """LSODA of numbalsoda; None if it is not installed."""
    if importlib.util.find_spec("numbalsoda") is None:
        return None
    import numba
    from numbalsoda import lsoda, lsoda_sig

    shape, (tau, start, width) = tide.coefficients.shape, tide[:3]

    @numba.cfunc(lsoda_sig)
    def derivative(t: float, y: Any, dy: Any, data: Any) -> None:
        # y, dy and data are pointers
        panels = TidePanels(tau, start, width, numba.carray(data, shape))
        state, out = numba.carray(y, (15,)), numba.carray(dy, (15,))
        motion.rate(FLOWING, t, state, out, par, panels, empty_buffers())

    def solve(t: float, stop: float, y: Array, tolerance: float) -> Array:
        found, good = lsoda(
            derivative.address, y, np.array([t, stop]), tide.coefficients, rtol=tolerance, atol=tolerance * 1e-4,
            mxstep=MOST_STEPS,
        )  # fmt: skip
        return np.asarray(found[-1]) if good else np.full(15, np.nan)

    return solve


def lines(rows: list[Document]) -> list[str]:
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
def _plot(rows: list[Document], path: str | Path) -> None:
    """Error against time; bars are the least and the most time over the initial states."""
    figure = new_figure(7.4, 4.2)
    panel: Axes = figure.subplots()
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
