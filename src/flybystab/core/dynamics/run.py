"""One run of the dynamics: SI floats and arrays in, SI arrays out.

The kernels of :mod:`flybystab.core.dynamics.regimes` work in the units of the body (see
:mod:`flybystab.core.dynamics.state`); this is the only place where the two systems meet.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flybystab.constants import G
from flybystab.core.dynamics import rates as motion
from flybystab.core.dynamics import regimes, state
from flybystab.core.dynamics.ground import Ground, no_ground
from flybystab.core.dynamics.workspace import N_EVENT, N_HISTORY, Counts, workspace
from flybystab.core.ellipsoid.tide import TidePanels
from flybystab.core.material import parameters as material
from flybystab.core.material.yield_surface import is_circular, least_slope
from flybystab.core.numerics.jit import inlined, kernel
from flybystab.core.numerics.tensors import determinant, multiply, pack, unpack
from flybystab.typing import Array

REGIMES = ("rigid", "flowing", "dispersed", "fluid")
EVENTS = (
    "done", "onset", "arrest", "loss of contact", "contact", "beyond model", "jam", "stuck", "switch", "ground"
)  # fmt: skip


class Passage(NamedTuple):
    """What happened to a body; SI units, fixed frame, times on the clock of the tide.

    Attributes
    ----------
    reason : str
        "done", "ground" (reached), "beyond model" (axis ratio past the limit) or "stuck".
    regime : str
        Regime at the end.
    time : float
        Time reached, s.
    shape : ndarray (3, 3)
        ``S = 5 I/m`` at the end, m2; its eigenvalues are the squared semi-axes.
    velocity_gradient : ndarray (3, 3)
        ``L`` at the end, 1/s.
    max_friction, max_friction_time : float
        Largest friction angle mobilised while rigid, rad (inf: none would do), and when, s.
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
    expansion: float = 1.5,
) -> Array:
    """Parameter array of the kernels from SI floats (`phi` in rad, `cohesion` in Pa, `viscosity` in Pa s)."""
    a0 = np.cbrt(axes[0] * axes[1] * axes[2])
    rate2 = np.pi * G * rho
    par = np.zeros(state.N_PARAMETERS)
    par[material.SURFACE] = surface
    par[material.SIN_PHI] = np.sin(phi)
    par[material.COS_PHI] = np.cos(phi)
    par[material.BETA] = dilatancy * least_slope(surface, np.sin(phi))
    # Associative flow on a slope k(theta) is the true normal; less dilatant flow goes along the stress deviator.
    if dilatancy >= 1.0 and not is_circular(surface):
        par[material.NORMAL] = 1.0
        par[material.BETA] = 1.0
    par[material.COHESION] = 5.0 * cohesion / (rho * a0 * a0 * rate2)
    par[material.VISCOSITY] = 10.0 * viscosity / (rho * a0 * a0 * np.sqrt(rate2))
    par[material.EXPANSION] = expansion
    motion.set_rigid_shape((axes[0] / a0) ** 2, (axes[1] / a0) ** 2, (axes[2] / a0) ** 2, par)
    return par


@kernel
def _set_flowing(axes: Array, omega: Array, deformation: Array, attitude: Array, y: Array) -> None:
    """State of a body that flows with the velocity gradient ``deformation[3, 3]`` on top of its spin (body axes)."""
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


@inlined
def carry(
    axes: Array,
    rho: float,
    omega: Array,
    attitude: Array,
    t_start: float,
    t_stop: float,
    t_rest: float,
    tide: TidePanels,
    ground: Ground,
    phi: float,
    cohesion: float,
    dilatancy: float,
    surface: int,
    brittle: bool,
    expansion: float,
    unyielding: bool,
    tolerance: float,
    max_axis_ratio: float,
    max_steps: int,
    shape: Array,
    gradient: Array,
    hist: Array,
    events: Array,
    count: Counts,
    mark: Array,
    deformation: Array,
) -> tuple[int, float, int]:
    """Follow a body; the arguments are those of `passage`, with a `deformation` of zero for a rigid start.

    Writes ``S`` (m2) and ``L`` (1/s) at the end, and the history (in the units of the body, but with the stresses
    in Pa and times in s), event log (s), counts and mark (rad, s) of
    :func:`flybystab.core.dynamics.regimes.follow`; returns the reason, time (s) and regime of the end.
    """
    t0 = 1.0 / np.sqrt(np.pi * G * rho)
    a0 = np.cbrt(axes[0] * axes[1] * axes[2])
    par = parameters(axes, rho, phi, cohesion, dilatancy, surface, 0.0, expansion)
    y = np.zeros(state.N_FULL)
    regimes.quaternion(attitude, y)
    for i in range(3):
        y[4 + i] = omega[i] * t0
    start = state.RIGID
    if np.any(deformation != 0.0):
        start = state.FLOWING
        _set_flowing(axes / a0, omega * t0, deformation * t0, attitude, y)
    scaled = TidePanels(tide.tau / t0, tide.start, tide.width, tide.coefficients * t0**2)
    below = Ground(
        ground.tau / t0, ground.start, ground.width, ground.floor, ground.least, a0, ground.coefficients
    )
    reason, t, regime = regimes.follow(
        t_start / t0, t_stop / t0, t_rest / t0, start, y, par, scaled, below, tolerance, max_axis_ratio,
        brittle, unyielding, max_steps, hist, events, count, mark, workspace(),
    )  # fmt: skip
    unpack(y[0:6], shape)
    state.gradient(y, gradient)
    for i in range(3):
        for j in range(3):
            shape[i, j] *= a0 * a0
            gradient[i, j] /= t0
    for i in range(count[0]):
        # T = 5 sigma/rho, and the density has changed with the volume
        stress = rho * a0**2 / t0**2 / 5.0 / np.sqrt(determinant(hist[i, 2:8]))
        hist[i, 0] *= t0
        hist[i, 17] *= stress
        hist[i, 18] *= stress
    for i in range(min(count[1], events.shape[0])):
        events[i, 1] *= t0
    mark[1] *= t0
    return reason, t * t0, regime


# Outside of a kernel the plain function, which calls the compiled `follow`; as a kernel it would be compiled anew.
_carry = getattr(carry, "py_func", carry)


def passage(
    axes: Array,
    rho: float,
    omega: Array,
    attitude: Array,
    t_start: float,
    t_stop: float,
    tide: TidePanels,
    *,
    t_rest: float | None = None,
    phi: float,
    cohesion: float = 0.0,
    dilatancy: float = 0.0,
    surface: int = 0,
    brittle: bool = False,
    expansion: float = 1.5,
    unyielding: bool = False,
    tolerance: float = 1e-9,
    max_axis_ratio: float = 6.0,
    max_steps: int = 200_000,
    keep: int = 0,
    deformation: Array | None = None,
    ground: Ground | None = None,
) -> Passage:
    """Follow a body that starts rigid, or in flow, through a tide.

    Parameters
    ----------
    axes, rho, omega : ndarray (3,), float, ndarray (3,)
        Semi-axes (m), density (kg/m3), spin along the body axes (rad/s).
    attitude : ndarray (3, 3)
        Rotation matrix, body axes -> frame of the tide.
    t_start, t_stop : float
        Span, s, on the clock of the tide.
    t_rest : float, optional
        A body that is rigid at or after this time ends the run; `t_stop` by default.
    tide : TidePanels
        SI.
    phi, cohesion, dilatancy, surface, brittle, expansion
        Material: rad, Pa, ``beta / min k``, code of the yield surface, loss of cohesion at first yield,
        ``V/V0`` at which dilation ends.
    unyielding : bool
        Stay rigid whatever the stress, to learn the friction that would be needed.
    tolerance : float
        Relative error allowed in a step.
    max_axis_ratio : float
        Where the homogeneous model is left.
    keep : int
        Rows of history to keep at most; 0 for none.
    deformation : ndarray (3, 3), optional
        Velocity gradient along the body axes, 1/s, on top of the spin: the body starts in flow.
    ground : Ground, optional
        Ends the run where the body reaches it; none by default.
    """
    shape, gradient = np.empty((3, 3)), np.empty((3, 3))
    hist = np.zeros((max(keep, 1), N_HISTORY))
    events = np.zeros((64, N_EVENT))
    count = np.zeros(4, dtype=np.int64)
    mark = np.zeros(2)
    reason, time, regime = _carry(
        np.array(axes, dtype=float),
        rho,
        np.array(omega, dtype=float),
        np.array(attitude, dtype=float, order="C"),
        t_start,
        t_stop,
        t_stop if t_rest is None else t_rest,
        tide,
        no_ground() if ground is None else ground,
        phi,
        cohesion,
        dilatancy,
        surface,
        brittle,
        expansion,
        unyielding,
        tolerance,
        max_axis_ratio,
        max_steps,
        shape,
        gradient,
        hist,
        events,
        count,
        mark,
        np.zeros((3, 3)) if deformation is None else np.array(deformation, dtype=float, order="C"),
    )
    return Passage(
        EVENTS[reason],
        REGIMES[regime],
        float(time),
        shape,
        gradient,
        float(mark[0]),
        float(mark[1]),
        event_log(events, count),
        unpacked_history(hist[: count[0]], axes, rho) if keep > 1 else None,
        int(count[2]),
        int(count[3]),
    )


def event_log(events: Array, count: Counts) -> list[tuple[str, float, float]]:
    """Name, time (s) and Lode angle (rad; nan where there is none) of the events that `carry` wrote."""
    log = []
    for code, when, det, _ in events[: count[1]]:
        lode = np.arcsin(np.clip(-3.0 * np.sqrt(6.0) * det, -1.0, 1.0)) / 3.0 if det != 0.0 else np.nan
        log.append((EVENTS[int(code)], float(when), float(lode)))
    return log


def unpacked_history(rows: Array, axes: Array, rho: float) -> dict[str, Array]:
    """The columns of :class:`Passage` from the rows that `carry` wrote."""
    t0 = 1.0 / np.sqrt(np.pi * G * rho)
    a0 = np.cbrt(np.prod(axes))
    return {
        "time": rows[:, 0].copy(),
        "regime": rows[:, 1].astype(int),
        "shape": _symmetric(rows[:, 2:8]) * a0**2,
        "velocity_gradient": _gradient(rows[:, 8:14], rows[:, 14:17]) / t0,
        "pressure": rows[:, 17].copy(),
        "deviator": rows[:, 18].copy(),
        "determinant": rows[:, 19].copy(),
        "quaternion": rows[:, 20:24].copy(),
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
