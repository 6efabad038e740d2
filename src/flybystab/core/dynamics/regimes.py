"""The switching integrator: rigid, flowing and dispersed motion with located events (theory, section 3).

=========  ============================================================  ==========================
regime     ends when                                                     then
=========  ============================================================  ==========================
RIGID      the rigid stress leaves the yield surface, and the            FLOWING along the deviator
           denominator of the pressure is positive for a flow in its
           direction (else the body is locked, a Painleve-type jam)
FLOWING    ``|D|`` falls to `D_REST` (arrest)                            RIGID if admissible, else
                                                                         FLOWING anew
FLOWING    the deviatoric strength ``k P + k c`` falls to zero           DISPERSED
FLOWING    the denominator of the pressure falls to zero (jam)           RIGID, locked
DISPERSED  the volume falls to its value at the loss of contact          inelastic impulse, then
                                                                         FLOWING or RIGID
=========  ============================================================  ==========================

A body that reaches the ground (:mod:`flybystab.core.dynamics.ground`) ends the run in any regime.

Every end is located as a root on the dense output, and the step is then repeated up to the root. `D_REST`, the rate of
strain at which flow starts and ends, is 1e-10 of the dynamical rate; it changes results by about this fraction.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flybystab.core.dynamics.dispersed import follow_free
from flybystab.core.dynamics.flowing import follow_flow
from flybystab.core.dynamics.ground import Ground
from flybystab.core.dynamics.impulse import FAILED, FREE, SLIDING, friction_impulse, impulse_room
from flybystab.core.dynamics.rates import rigid_excess
from flybystab.core.dynamics.rigid import follow_rigid
from flybystab.core.dynamics.state import (
    DETERMINANT,
    DISPERSED,
    FLOWING,
    N_FULL,
    RIGID,
    W_SCRATCH,
    Parameters,
    RigidShape,
    angular_momentum,
    rigid_shape,
    rigid_volume,
    to_fixed_frame,
)
from flybystab.core.dynamics.workspace import (
    ARREST,
    CONTACT,
    D_REST,
    DONE,
    JAM,
    LOSS,
    ONSET,
    STUCK,
    Limits,
    Log,
    Peak,
    Workspace,
    copy,
    log_event,
)
from flybystab.core.ellipsoid.tide import COMPONENTS, TidePanels
from flybystab.core.material.flow_rule import dilatancy
from flybystab.core.material.parameters import SMOOTH, on_part, without_cohesion
from flybystab.core.material.yield_surface import flow_direction
from flybystab.core.numerics.jit import borrowed, kernel
from flybystab.core.numerics.tensors import determinant, deviator, eigensystem
from flybystab.typing import Array


class Span(NamedTuple):
    """Times on the clock of the tide.

    Attributes
    ----------
    start, stop : float
        Start and end of the run.
    rest : float
        A body that is rigid at or after this time ends the run.
    """

    start: float
    rest: float
    stop: float


@kernel
def begin_flow(y: Array, par: Parameters, ws: Workspace) -> None:
    """Turn the RIGID state ``y[:7]`` into a flowing one with ``|D'| = 2 D_REST`` under the stress ``ws.stress``.

    ``D'`` is along the deviator of the stress (radial rule) or along the normal of the yield surface (associative
    flow).
    """
    m = ws.work.m[0]
    out = ws.y1
    material = par.material
    to_fixed_frame(y, par.rigid, m, out[0:6], out[12:15])
    u = ws.ys
    _, _, det = deviator(ws.stress, u[:6])
    trace, _ = dilatancy(rigid_volume(par.rigid), material)
    if material.normal:
        p, q, support = flow_direction(material.surface, material.sin_phi, det)
        trace *= support * material.sin_phi
        u0, u1, u2, u3, u4, u5 = u[0], u[1], u[2], u[3], u[4], u[5]
        u[0] = p * u0 + q * (u0 * u0 + u3 * u3 + u4 * u4 - 1.0 / 3.0)
        u[1] = p * u1 + q * (u3 * u3 + u1 * u1 + u5 * u5 - 1.0 / 3.0)
        u[2] = p * u2 + q * (u4 * u4 + u5 * u5 + u2 * u2 - 1.0 / 3.0)
        u[3] = p * u3 + q * (u0 * u3 + u3 * u1 + u4 * u5)
        u[4] = p * u4 + q * (u0 * u4 + u3 * u5 + u4 * u2)
        u[5] = p * u5 + q * (u3 * u4 + u1 * u5 + u5 * u2)
    for c, (i, j) in enumerate(COMPONENTS):
        flow = trace / 3.0 if i == j else 0.0
        for a in range(3):
            flow += m[i, a] * m[j, a] * u[a]
        flow += (m[i, 0] * m[j, 1] + m[i, 1] * m[j, 0]) * u[3]
        flow += (m[i, 0] * m[j, 2] + m[i, 2] * m[j, 0]) * u[4]
        flow += (m[i, 1] * m[j, 2] + m[i, 2] * m[j, 1]) * u[5]
        out[6 + c] = 2.0 * D_REST * flow
    copy(out, y, N_FULL)


@kernel
def make_rigid(y: Array, ws: Workspace) -> RigidShape:
    """Turn a 15-number state into the RIGID one with the same shape and angular momentum; returns its shape."""
    h = ws.ys
    angular_momentum(y, ws.work, h)
    values = ws.work.m[W_SCRATCH, 0]
    v = ws.work.m[0]
    eigensystem(y[0:6], values, v)
    det = (
        v[0, 0] * (v[1, 1] * v[2, 2] - v[1, 2] * v[2, 1])
        - v[0, 1] * (v[1, 0] * v[2, 2] - v[1, 2] * v[2, 0])
        + v[0, 2] * (v[1, 0] * v[2, 1] - v[1, 1] * v[2, 0])
    )
    if det < 0.0:
        for i in range(3):
            v[i, 2] = -v[i, 2]
    s1, s2, s3 = values[0], values[1], values[2]
    y[4] = (v[0, 0] * h[0] + v[1, 0] * h[1] + v[2, 0] * h[2]) / (s2 + s3)
    y[5] = (v[0, 1] * h[0] + v[1, 1] * h[1] + v[2, 1] * h[2]) / (s1 + s3)
    y[6] = (v[0, 2] * h[0] + v[1, 2] * h[1] + v[2, 2] * h[2]) / (s1 + s2)
    quaternion(v, y)
    return rigid_shape(s1, s2, s3)


@kernel
def quaternion(m: Array, q: Array) -> None:
    """Unit quaternion ``q[:4]`` (scalar first) of a rotation matrix (Shepperd 1978: the largest divisor)."""
    t = m[0, 0] + m[1, 1] + m[2, 2]
    if t >= m[0, 0] and t >= m[1, 1] and t >= m[2, 2]:
        r = np.sqrt(1.0 + t)
        q[0] = 0.5 * r
        f = 0.5 / r
        q[1] = (m[2, 1] - m[1, 2]) * f
        q[2] = (m[0, 2] - m[2, 0]) * f
        q[3] = (m[1, 0] - m[0, 1]) * f
        return
    i = 0
    if m[1, 1] > m[0, 0]:
        i = 1
    if m[2, 2] > m[i, i]:
        i = 2
    j = (i + 1) % 3
    k = (i + 2) % 3
    r = np.sqrt(max(0.0, 1.0 + m[i, i] - m[j, j] - m[k, k]))
    f = 0.5 / r
    q[0] = (m[k, j] - m[j, k]) * f
    q[1 + i] = 0.5 * r
    q[1 + j] = (m[j, i] + m[i, j]) * f
    q[1 + k] = (m[k, i] + m[i, k]) * f


@kernel
def _contact(y: Array, par: Parameters, ws: Workspace) -> int:
    """Apply the inelastic impulse at the end of DISPERSED to ``y[15]``; returns its outcome."""
    material = on_part(par.material, SMOOTH, par.material.fan_limit)
    return friction_impulse(y, material, 0.0, np.zeros(6), ws.work, impulse_room()).outcome


@kernel
def _next_regime(
    regime: int,
    reason: int,
    t: float,
    par: Parameters,
    tide: TidePanels,
    brittle: bool,
    ws: Workspace,
    log: Log,
) -> tuple[int, Parameters]:
    """Regime and parameters after the end `reason` of `regime`; converts ``ws.y``. -1 if the contact impulse fails."""
    if reason == ONSET:
        if brittle:
            par = Parameters(without_cohesion(par.material), par.rigid)
        _, _, _, det = rigid_excess(t, ws.y, par, tide, ws.work, ws.stress)
        log_event(ONSET, t, det, rigid_volume(par.rigid), log)
        begin_flow(ws.y, par, ws)
        return FLOWING, par
    volume = np.sqrt(determinant(ws.y[0:6]))
    if reason in (ARREST, JAM):
        log_event(reason, t, ws.work.s[DETERMINANT], volume, log)
        return RIGID, Parameters(par.material, make_rigid(ws.y, ws))
    log_event(reason, t, 0.0, volume, log)
    if reason == LOSS:
        return DISPERSED, par
    outcome = _contact(ws.y, par, ws)
    if outcome == FAILED:
        return -1, par
    if outcome == SLIDING:
        return FLOWING, par
    if outcome == FREE:
        return regime, par
    return RIGID, Parameters(par.material, make_rigid(ws.y, ws))


@kernel
def follow(
    span: Span,
    regime: int,
    y: Array,
    par: Parameters,
    tide: TidePanels,
    ground: Ground,
    limits: Limits,
    brittle: bool,
    unyielding: bool,
    log: Log,
    room: Workspace,
) -> tuple[int, float, int, Peak]:
    """Follow a body through its regimes.

    Parameters
    ----------
    span : Span
        In dynamical times.
    regime : int
        RIGID (``y[:7]``), FLOWING, DISPERSED or FLUID (``y[:15]``) at the start.
    y : ndarray (15,)
        State, overwritten with the last one, which is a 15-number state in any regime.
    par : Parameters
    tide : TidePanels
    ground : Ground
        Its surface ends the run; times in dynamical ones.
    limits : Limits
    brittle, unyielding : bool
        Cohesion is lost at first yield; the body never yields (for the friction that it would need).
    log : Log
        History, events and counts, to be continued.
    room : Workspace

    Returns
    -------
    reason, time, regime, peak
        DONE, TOUCH, BEYOND or STUCK; the time reached; the regime there; the largest mobilised friction.
    """
    # Counting references at each use of a buffer would take longer than the arithmetic.
    ws, log, y, tide = borrowed(room), borrowed(log), borrowed(y), borrowed(tide)
    copy(y, ws.y, N_FULL)
    t = span.start
    peak = Peak(-1.0, 0.0)
    step = 0.0
    reason = DONE
    for _ in range(2000):
        if regime == RIGID:
            reason, t, step, peak = follow_rigid(
                t, min(span.stop, span.rest), step, par, tide, ground, limits, unyielding, peak, ws, log
            )
        elif regime == FLOWING:
            reason, t = follow_flow(t, span.stop, par, tide, ground, limits, ws, log)
        else:
            reason, t = follow_free(regime, t, span.stop, par, tide, ground, limits, ws, log)
        if reason not in (ONSET, ARREST, JAM, LOSS, CONTACT):
            break
        following, par = _next_regime(regime, reason, t, par, tide, brittle, ws, log)
        if following < 0:
            reason = STUCK
            break
        regime = following
        if t >= span.stop:
            reason = DONE
            break
    else:
        reason = STUCK
    if regime == RIGID:
        to_full_state(t, par, tide, ws)
    copy(ws.y, y, N_FULL)
    return reason, t, regime, peak


@kernel
def to_full_state(t: float, par: Parameters, tide: TidePanels, ws: Workspace) -> None:
    """Turn the RIGID state ``ws.y[:7]`` into the 15-number state of the same body."""
    rigid_excess(t, ws.y, par, tide, ws.work, ws.stress)
    begin_flow(ws.y, par, ws)
    for i in range(6, 12):
        ws.y[i] = 0.0


@kernel
def follow_rigidly(
    span: Span,
    y: Array,
    par: Parameters,
    tide: TidePanels,
    ground: Ground,
    limits: Limits,
    unyielding: bool,
    log: Log,
    room: Workspace,
) -> tuple[int, float, Peak]:
    """`follow` for a body that starts rigid, up to yield (ONSET); does not compile the kernels of flow.

    Arguments as in `follow`; `y` is unchanged if the body yields.

    Returns
    -------
    reason, time, peak
        DONE, TOUCH, STUCK or ONSET; the time reached; the largest mobilised friction.
    """
    ws, log, y, tide = borrowed(room), borrowed(log), borrowed(y), borrowed(tide)
    copy(y, ws.y, N_FULL)
    reason, t, _, peak = follow_rigid(
        span.start,
        min(span.stop, span.rest),
        0.0,
        par,
        tide,
        ground,
        limits,
        unyielding,
        Peak(-1.0, 0.0),
        ws,
        log,
    )
    if reason != ONSET:
        to_full_state(t, par, tide, ws)
        copy(ws.y, y, N_FULL)
    return reason, t, peak
