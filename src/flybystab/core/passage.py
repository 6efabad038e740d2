"""One run of the dynamics: SI floats and arrays in, SI arrays out.

The kernels of :mod:`flybystab.core.regimes` work in the units of the body (see :mod:`flybystab.core.motion`);
this is the only place where the two systems meet.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flybystab.constants import G
from flybystab.core import motion, regimes
from flybystab.core.rheology import DRUCKER_PRAGER, EXTENSION_CONE, least_slope
from flybystab.core.tide import TidePanels
from flybystab.core.workspace import N_EVENT, N_HISTORY

Array = NDArray[np.float64]

REGIMES = ("rigid", "flowing", "dispersed", "fluid")
EVENTS = ("done", "onset", "arrest", "loss of contact", "contact", "beyond model", "jam", "stuck")


class Passage(NamedTuple):
    """What happened to a body; SI units, fixed frame, times on the clock of the tide.

    Attributes
    ----------
    reason : str
        "done", "beyond model" (axis ratio past the limit) or "stuck".
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
    a0 = np.cbrt(np.prod(axes))
    rate2 = np.pi * G * rho
    par = np.zeros(motion.N_PARAMETERS)
    par[motion.SURFACE] = surface
    par[motion.SIN_PHI] = np.sin(phi)
    par[motion.COS_PHI] = np.cos(phi)
    # Associative flow on a slope k(theta) is the true normal; less dilatant flow goes along the stress deviator.
    normal = dilatancy >= 1.0 and surface not in (DRUCKER_PRAGER, EXTENSION_CONE)
    par[motion.NORMAL] = normal
    par[motion.BETA] = 1.0 if normal else dilatancy * least_slope(surface, np.sin(phi))
    par[motion.COHESION] = 5.0 * cohesion / (rho * a0 * a0 * rate2)
    par[motion.VISCOSITY] = 10.0 * viscosity / (rho * a0 * a0 * np.sqrt(rate2))
    par[motion.EXPANSION] = expansion
    s = (axes / a0) ** 2
    motion.set_rigid_shape(s[0], s[1], s[2], par)
    return par


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
    """
    t0 = 1.0 / np.sqrt(np.pi * G * rho)
    a0 = float(np.cbrt(np.prod(axes)))
    par = parameters(axes, rho, phi, cohesion, dilatancy, surface, expansion=expansion)
    y = np.zeros(15)
    regimes.quaternion(np.ascontiguousarray(attitude, dtype=float), y)
    y[4:7] = omega * t0
    start = motion.RIGID
    if deformation is not None:
        start = motion.FLOWING
        spin = np.array([[0.0, -y[6], y[5]], [y[6], 0.0, -y[4]], [-y[5], y[4], 0.0]])
        s = np.diag((axes / a0) ** 2)
        motion.pack(attitude @ s @ attitude.T, y[0:6])
        motion.set_gradient(attitude @ (spin + deformation * t0) @ attitude.T, y)
    scaled = TidePanels(tide.tau / t0, tide.start, tide.width, tide.coefficients * t0**2)
    hist = np.zeros((max(keep, 1), N_HISTORY))
    events = np.zeros((64, N_EVENT))
    count = np.zeros(4, dtype=np.int64)
    mark = np.zeros(2)
    reason, t, regime = regimes.follow(
        t_start / t0,
        t_stop / t0,
        (t_stop if t_rest is None else t_rest) / t0,
        start,
        y,
        par,
        scaled,
        tolerance,
        max_axis_ratio,
        brittle,
        unyielding,
        max_steps,
        hist,
        events,
        count,
        mark,
    )
    log = []
    for code, when, det, _ in events[: count[1]]:
        lode = np.arcsin(np.clip(-3.0 * np.sqrt(6.0) * det, -1.0, 1.0)) / 3.0 if det != 0.0 else np.nan
        log.append((EVENTS[int(code)], float(when) * t0, float(lode)))
    history = None
    if keep > 1:
        h = hist[: count[0]]
        stress = rho * a0**2 / t0**2 / 5.0 / np.sqrt(np.linalg.det(_symmetric(h[:, 2:8])))
        history = {
            "time": h[:, 0] * t0,
            "regime": h[:, 1].astype(int),
            "shape": _symmetric(h[:, 2:8]) * a0**2,
            "velocity_gradient": _gradient(h[:, 8:14], h[:, 14:17]) / t0,
            "pressure": h[:, 17] * stress,
            "deviator": h[:, 18] * stress,
            "determinant": h[:, 19].copy(),
            "quaternion": h[:, 20:24].copy(),
        }
    return Passage(
        EVENTS[reason],
        REGIMES[regime],
        float(t) * t0,
        _symmetric(y[0:6]) * a0**2,
        _gradient(y[6:12], y[12:15]) / t0,
        float(mark[0]),
        float(mark[1]) * t0,
        log,
        history,
        int(count[2]),
        int(count[3]),
    )


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
