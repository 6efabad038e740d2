"""One run of the dynamics: SI floats and arrays in, SI arrays out.

The kernels of :mod:`flybystab.core.dynamics.regimes` work in the units of the body (see
:mod:`flybystab.core.dynamics.state`); all conversions between the two systems of units are made here.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flybystab.constants import G
from flybystab.core.dynamics import regimes, state
from flybystab.core.dynamics.ground import Ground, no_ground
from flybystab.core.dynamics.regimes import Span
from flybystab.core.dynamics.state import RIGID
from flybystab.core.dynamics.workspace import Limits, Log, Peak, new_log, workspace
from flybystab.core.ellipsoid.tide import TidePanels
from flybystab.core.material.parameters import material_parameters
from flybystab.core.numerics.jit import inlined, kernel
from flybystab.core.numerics.tensors import determinant, multiply, pack, unpack
from flybystab.typing import Array

REGIMES = ("rigid", "flowing", "dispersed", "fluid")
EVENTS = (
    "done", "onset", "arrest", "loss of contact", "contact", "beyond model", "jam", "stuck", "switch", "ground"
)  # fmt: skip

#: ``V/V0`` at which dilation has ended.
EXPANSION = 1.5

#: Limits of :func:`integrate` unless others are given.
LIMITS = Limits(1e-9, 6.0, 200_000)


class BodyState(NamedTuple):
    """A body at the start of a run, in SI units.

    Attributes
    ----------
    axes, rho, omega : ndarray (3,), float, ndarray (3,)
        Semi-axes (m), density (kg/m3), spin along the body axes (rad/s).
    attitude : ndarray (3, 3)
        Rotation matrix, body axes -> frame of the tide.
    phi, cohesion : float
        Friction angle (rad) and cohesion (Pa).
    dilatancy : float
        ``beta / min k``.
    surface : int
        Code of the yield surface.
    brittle : bool
        True if the cohesion is lost at first yield.
    expansion : float
        ``V/V0`` at which dilation ends.
    """

    axes: Array
    rho: float
    omega: Array
    attitude: Array
    phi: float
    cohesion: float
    dilatancy: float
    surface: int
    brittle: bool
    expansion: float


def body_state(
    axes: Array,
    rho: float,
    omega: Array,
    attitude: Array,
    phi: float,
    cohesion: float = 0.0,
    dilatancy: float = 0.0,
    surface: int = 0,
    brittle: bool = False,
    expansion: float = EXPANSION,
) -> BodyState:
    """A :class:`BodyState` for :func:`integrate`, from arrays of any kind."""
    return BodyState(
        np.array(axes, dtype=float),
        rho,
        np.array(omega, dtype=float),
        np.array(attitude, dtype=float, order="C"),
        phi,
        cohesion,
        dilatancy,
        surface,
        brittle,
        expansion,
    )


class FinalState(NamedTuple):
    """End of a run, in SI units: why, when and in which regime it ended, and the largest mobilised friction."""

    reason: int
    time: float
    regime: int
    peak: Peak


class Run(NamedTuple):
    """Result of a run; SI units, fixed frame, times on the clock of the tide.

    Attributes
    ----------
    reason : str
        "done", "ground" (reached), "beyond model" (axis ratio above the limit) or "stuck" (too many steps or events).
    regime : str
        Regime at the end.
    time : float
        Time reached, s.
    shape : ndarray (3, 3)
        ``S = 5 I/m`` at the end, m2; its eigenvalues are the squared semi-axes.
    velocity_gradient : ndarray (3, 3)
        ``L`` at the end, 1/s.
    max_friction, max_friction_time : float
        Largest friction angle mobilised while rigid, rad (inf: none suffices), and when, s.
    events : list of (str, float, float)
        Name, time (s) and Lode angle of the stress (rad; nan where there is none) of every switch.
    history : dict of str to ndarray, or None
        ``time``, ``regime``, ``shape`` (n, 3, 3), ``velocity_gradient`` (n, 3, 3), and of the stress:
        ``pressure`` (Pa), ``deviator`` (Pa, norm), ``determinant`` of the unit deviator; ``quaternion`` (n, 4),
        body axes -> frame of the tide, scalar first, of rigid rows (zero otherwise).
    steps, rejected : int
        Integration steps tried and rejected.
    """

    reason: str
    regime: str
    time: float
    shape: Array
    velocity_gradient: Array
    max_friction: float
    max_friction_time: float
    events: list[tuple[str, float, float]]
    history: dict[str, Array] | None
    steps: int
    rejected: int


@kernel
def parameters(
    axes: Array,
    rho: float,
    phi: float,
    cohesion: float,
    dilatancy: float,
    surface: int,
    viscosity: float = 0.0,
    expansion: float = EXPANSION,
) -> state.Parameters:
    """Parameters of the kernels from SI floats (`phi` in rad, `cohesion` in Pa, `viscosity` in Pa s)."""
    a0 = np.cbrt(axes[0] * axes[1] * axes[2])
    rate2 = np.pi * G * rho
    material = material_parameters(
        surface,
        phi,
        5.0 * cohesion / (rho * a0 * a0 * rate2),
        dilatancy,
        10.0 * viscosity / (rho * a0 * a0 * np.sqrt(rate2)),
        expansion,
    )
    rigid = state.rigid_shape((axes[0] / a0) ** 2, (axes[1] / a0) ** 2, (axes[2] / a0) ** 2)
    return state.Parameters(material, rigid)


@kernel
def _set_flowing(axes: Array, omega: Array, deformation: Array, attitude: Array, y: Array) -> None:
    """Write ``y[15]`` for the velocity gradient ``deformation[3, 3]`` plus that of the spin, along the body axes."""
    a, b, back = np.empty((3, 3)), np.zeros((3, 3)), attitude.T.copy()
    for i in range(3):
        b[i, i] = axes[i] ** 2
    multiply(attitude, b, a)
    multiply(a, back, b)
    pack(b, y[0:6])
    a[:] = deformation
    a[2, 1] += omega[0]
    a[1, 2] -= omega[0]
    a[0, 2] += omega[1]
    a[2, 0] -= omega[1]
    a[1, 0] += omega[2]
    a[0, 1] -= omega[2]
    multiply(attitude, a, b)
    multiply(b, back, a)
    state.set_gradient(a, y)


class Scaled(NamedTuple):
    """A run in the units of the body, with its units of time ``t0`` (s) and of length ``a0`` (m)."""

    y: Array
    par: state.Parameters
    span: Span
    tide: TidePanels
    ground: Ground
    t0: float
    a0: float


@kernel
def scaled(body: BodyState, span: Span, tide: TidePanels, ground: Ground) -> Scaled:
    """A run of a body that starts rigid, in its own units."""
    t0 = 1.0 / np.sqrt(np.pi * G * body.rho)
    a0 = np.cbrt(body.axes[0] * body.axes[1] * body.axes[2])
    par = parameters(
        body.axes, body.rho, body.phi, body.cohesion, body.dilatancy, body.surface, 0.0, body.expansion
    )
    y = np.zeros(state.N_FULL)
    regimes.quaternion(body.attitude, y)
    for i in range(3):
        y[4 + i] = body.omega[i] * t0
    return Scaled(
        y, par, Span(span.start / t0, span.rest / t0, span.stop / t0),
        TidePanels(tide.tau / t0, tide.start, tide.width, tide.coefficients * t0**2),
        Ground(ground.tau / t0, ground.start, ground.width, ground.floor, ground.least, a0, ground.coefficients),
        t0, a0,
    )  # fmt: skip


@kernel
def to_si(rho: float, run: Scaled, shape: Array, gradient: Array, log: Log) -> None:
    """Write ``S`` (m2) and ``L`` (1/s) at the end of a run, and its log in SI units."""
    t0, a0 = run.t0, run.a0
    unpack(run.y[0:6], shape)
    state.gradient(run.y, gradient)
    for i in range(3):
        for j in range(3):
            shape[i, j] *= a0 * a0
            gradient[i, j] /= t0
    for i in range(log.counts[0]["rows"]):
        row = log.history[i]
        # T = 5 sigma/rho, and the density has changed with the volume
        stress = rho * a0**2 / t0**2 / 5.0 / np.sqrt(determinant(row["state"]))
        row["time"] *= t0
        row["pressure"] *= stress
        row["deviator"] *= stress
    for i in range(min(log.counts[0]["events"], log.events.shape[0])):
        log.events[i]["time"] *= t0


@inlined
def evolve_rigid(
    body: BodyState,
    span: Span,
    tide: TidePanels,
    ground: Ground,
    limits: Limits,
    unyielding: bool,
    shape: Array,
    gradient: Array,
    log: Log,
) -> FinalState:
    """`evolve` up to yield; if the reason is ONSET, `shape` and `gradient` are undefined."""
    run = scaled(body, span, tide, ground)
    reason, t, peak = regimes.follow_rigidly(
        run.span, run.y, run.par, run.tide, run.ground, limits, unyielding, log, workspace()
    )
    to_si(body.rho, run, shape, gradient, log)
    return FinalState(reason, t * run.t0, RIGID, Peak(peak.friction, peak.time * run.t0))


@inlined
def evolve(
    body: BodyState,
    span: Span,
    tide: TidePanels,
    ground: Ground,
    limits: Limits,
    unyielding: bool,
    deformation: Array,
    shape: Array,
    gradient: Array,
    log: Log,
) -> FinalState:
    """Integrate the motion of a body through its regimes, in SI units.

    `deformation` is a velocity gradient on top of the spin as in `integrate`; zero for a rigid start. Writes ``S``
    (m2) and ``L`` (1/s) at the end; history (in the units of the body, but with the stresses in Pa and times in s),
    events and counts go to `log`.
    """
    run = scaled(body, span, tide, ground)
    start = RIGID
    if np.any(deformation != 0.0):
        start = state.FLOWING
        _set_flowing(body.axes / run.a0, body.omega * run.t0, deformation * run.t0, body.attitude, run.y)
    reason, t, regime, peak = regimes.follow(
        run.span, start, run.y, run.par, run.tide, run.ground, limits, body.brittle, unyielding, log, workspace(),
    )  # fmt: skip
    to_si(body.rho, run, shape, gradient, log)
    return FinalState(reason, t * run.t0, regime, Peak(peak.friction, peak.time * run.t0))


# The plain Python functions, which call the compiled `follow`: as kernels they would have to be compiled, too.
_evolve: Any = getattr(evolve, "py_func", evolve)
_evolve_rigid: Any = getattr(evolve_rigid, "py_func", evolve_rigid)


def integrate(
    body: BodyState,
    span: Span | tuple[float, float],
    tide: TidePanels,
    *,
    limits: Limits = LIMITS,
    unyielding: bool = False,
    keep: int = 0,
    deformation: Array | None = None,
    ground: Ground | None = None,
) -> Run:
    """Integrate the motion of a body that starts rigid, or in plastic flow, in a tide.

    Parameters
    ----------
    body : BodyState
        Made by :func:`body_state`.
    span : Span or (float, float)
        Start and end, s, on the clock of the tide; a :class:`Span` also has the time after which the run ends as soon
        as the body is rigid.
    tide : TidePanels
        SI.
    limits : Limits
        Relative error allowed in a step, largest axis ratio of the model, largest number of steps.
    unyielding : bool
        If true, the body stays rigid at any stress, for the friction that would be required.
    keep : int
        Largest number of rows of the history; 0 for none.
    deformation : ndarray (3, 3), optional
        Velocity gradient along the body axes, 1/s, on top of the spin: the body starts in flow.
    ground : Ground, optional
        Ends the run where the body reaches it; none by default.
    """
    shape, gradient = np.empty((3, 3)), np.empty((3, 3))
    log = new_log(keep, 64)
    start, stop = float(span[0]), float(span[-1])
    times = Span(start, float(span.rest) if isinstance(span, Span) else stop, stop)
    limits = Limits(float(limits.tolerance), float(limits.axis_ratio), int(limits.max_steps))
    below = no_ground() if ground is None else ground
    if unyielding and deformation is None:
        end = _evolve_rigid(body, times, tide, below, limits, True, shape, gradient, log)
    else:
        added = np.zeros((3, 3)) if deformation is None else np.array(deformation, dtype=float, order="C")
        end = _evolve(body, times, tide, below, limits, unyielding, added, shape, gradient, log)
    counts = log.counts[0]
    return Run(
        EVENTS[end.reason],
        REGIMES[end.regime],
        float(end.time),
        shape,
        gradient,
        float(end.peak.friction),
        float(end.peak.time),
        event_log(log),
        unpacked_history(log.history[: counts["rows"]], body.axes, body.rho) if keep > 1 else None,
        int(counts["steps"]),
        int(counts["rejected"]),
    )


def event_log(log: Log) -> list[tuple[str, float, float]]:
    """Name, time (s) and Lode angle (rad; nan where there is none) of the events of a run."""
    out = []
    for event in log.events[: log.counts[0]["events"]]:
        det = event["determinant"]
        lode = np.arcsin(np.clip(-3.0 * np.sqrt(6.0) * det, -1.0, 1.0)) / 3.0 if det != 0.0 else np.nan
        out.append((EVENTS[event["code"]], float(event["time"]), float(lode)))
    return out


def unpacked_history(rows: NDArray[Any], axes: Array, rho: float) -> dict[str, Array]:
    """The history of :class:`Run` from the rows that `evolve` wrote."""
    t0 = 1.0 / np.sqrt(np.pi * G * rho)
    a0 = np.cbrt(np.prod(axes))
    y = rows["state"]
    return {
        "time": rows["time"].copy(),
        "regime": rows["regime"].copy(),
        "shape": _symmetric(y[:, 0:6]) * a0**2,
        "velocity_gradient": _gradient(y[:, 6:12], y[:, 12:15]) / t0,
        "pressure": rows["pressure"].copy(),
        "deviator": rows["deviator"].copy(),
        "determinant": rows["determinant"].copy(),
        "quaternion": rows["quaternion"].copy(),
    }


def _symmetric(c: Array) -> Array:
    m = np.empty((*c.shape[:-1], 3, 3))
    m[..., 0, 0], m[..., 1, 1], m[..., 2, 2] = c[..., 0], c[..., 1], c[..., 2]
    m[..., 0, 1] = m[..., 1, 0] = c[..., 3]
    m[..., 0, 2] = m[..., 2, 0] = c[..., 4]
    m[..., 1, 2] = m[..., 2, 1] = c[..., 5]
    return m


def _gradient(d: Array, w: Array) -> Array:
    m = _symmetric(d)
    m[..., 2, 1] += w[..., 0]
    m[..., 1, 2] -= w[..., 0]
    m[..., 0, 2] += w[..., 1]
    m[..., 2, 0] -= w[..., 1]
    m[..., 1, 0] += w[..., 2]
    m[..., 0, 1] -= w[..., 2]
    return m
