"""The switching integrator: rigid, flowing and dispersed motion with located events (theory, section 3).

=========  ============================================================  ==========================
regime     ends when                                                     then
=========  ============================================================  ==========================
RIGID      the rigid stress leaves the yield surface, and a flow in its  FLOWING along the deviator
           direction can relieve it (positive denominator of the
           pressure: else the body is locked, a Painleve-type jam)
FLOWING    ``|D|`` falls to `D_REST` (arrest)                            RIGID if admissible, else
                                                                         FLOWING anew
FLOWING    the deviatoric strength ``k P + k c`` falls to zero           DISPERSED
FLOWING    the denominator of the pressure falls to zero (jam)           RIGID, locked
DISPERSED  the volume is back at its value at the loss of contact        inelastic impulse, then
                                                                         FLOWING or RIGID
=========  ============================================================  ==========================

A body that reaches the ground (:mod:`flybystab.core.dynamics.ground`) ends the run in any regime.

Every end is a root on the dense output, and the step is then repeated up to the root. `D_REST`, the rate of
strain at which flow starts and ends, is 1e-10 of the dynamical rate: its share of any result is of that size.
"""

from __future__ import annotations

import numpy as np

from flybystab.core.dynamics.dispersed import follow_free
from flybystab.core.dynamics.flowing import follow_flow
from flybystab.core.dynamics.ground import Ground
from flybystab.core.dynamics.impulse import FAILED, FREE, SLIDING, friction_impulse
from flybystab.core.dynamics.rates import rigid_excess, set_rigid_shape
from flybystab.core.dynamics.rigid import follow_rigid
from flybystab.core.dynamics.state import (
    DETERMINANT,
    DISPERSED,
    FLOWING,
    N_FULL,
    RIGID,
    S1,
    S2,
    S3,
    W_SCRATCH,
    angular_momentum,
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
    Counts,
    Workspace,
    borrowed_workspace,
    copy,
    log,
)
from flybystab.core.ellipsoid.tide import COMPONENTS, TidePanels
from flybystab.core.material.flow_rule import dilatancy
from flybystab.core.material.parameters import COHESION, NORMAL, PART, SIN_PHI, SMOOTH, SURFACE
from flybystab.core.material.yield_surface import flow_direction
from flybystab.core.numerics.jit import borrowed, kernel
from flybystab.core.numerics.tensors import determinant, deviator, eigensystem
from flybystab.typing import Array


@kernel
def loosen(y: Array, par: Array, ws: Workspace) -> None:
    """Turn the RIGID state ``y[:7]`` into one that flows as the stress ``ws.stress`` wants, barely.

    The direction is the deviator of the stress, or the normal of the yield surface there.
    """
    m = ws.work.m[0]
    out = ws.y1
    to_fixed_frame(y, par, m, out[0:6], out[12:15])
    u = ws.ys
    _, _, det = deviator(ws.stress, u[:6])
    trace, _ = dilatancy(np.sqrt(par[S1] * par[S2] * par[S3]), par)
    if par[NORMAL] > 0.0:
        p, q, support = flow_direction(int(par[SURFACE]), par[SIN_PHI], det)
        trace *= support * par[SIN_PHI]
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
def stiffen(y: Array, par: Array, ws: Workspace) -> None:
    """Turn a 15-number state into the RIGID one with the same shape and angular momentum."""
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
    set_rigid_shape(s1, s2, s3, par)
    y[4] = (v[0, 0] * h[0] + v[1, 0] * h[1] + v[2, 0] * h[2]) / (s2 + s3)
    y[5] = (v[0, 1] * h[0] + v[1, 1] * h[1] + v[2, 1] * h[2]) / (s1 + s3)
    y[6] = (v[0, 2] * h[0] + v[1, 2] * h[1] + v[2, 2] * h[2]) / (s1 + s2)
    quaternion(v, y)


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
def follow(
    t: float,
    t1: float,
    t_rest: float,
    regime: int,
    y: Array,
    par: Array,
    tide: TidePanels,
    ground: Ground,
    tol: float,
    limit: float,
    brittle: bool,
    unyielding: bool,
    max_steps: int,
    hist: Array,
    events: Array,
    count: Counts,
    mark: Array,
    room: Workspace,
) -> tuple[int, float, int]:
    """Follow a body from `t` to `t1` through its regimes.

    Parameters
    ----------
    t, t1, t_rest : float
        Start and end, in dynamical times, on the clock of the tide; a body that is rigid at or after `t_rest`
        ends the run there.
    regime : int
        RIGID (``y[:7]``), FLOWING, DISPERSED or FLUID (``y[:15]``) at the start.
    y : ndarray (15,)
        State, overwritten with the last one, which is a 15-number state in any regime.
    par : ndarray (16,)
        Parameters, see :mod:`flybystab.core.dynamics.state`; cohesion and rigid shape are updated.
    ground : Ground
        Its surface ends the run; times in dynamical ones.
    tol : float
        Relative error allowed in a step.
    limit : float
        Axis ratio beyond which the model is left.
    brittle, unyielding : bool
        Cohesion is lost at first yield; the body never yields (for the friction that it would need).
    hist, events : ndarray (n, 24), (m, 4)
        History (one row or less: none is kept) and event log.
    count : ndarray of int (4,)
        Rows of history, events, steps, rejected steps.
    mark : ndarray (2,)
        Largest mobilised friction angle while rigid, rad, and its time.
    room : Workspace

    Returns
    -------
    reason, time, regime
        DONE, TOUCH, BEYOND or STUCK; the time reached; the regime there.
    """
    # Counting references at each use of a buffer would take longer than the sums.
    ws = borrowed_workspace(room)
    y, par, hist = borrowed(y), borrowed(par), borrowed(hist)
    tide = TidePanels(tide.tau, tide.start, tide.width, borrowed(tide.coefficients))
    copy(y, ws.y, N_FULL)
    ws.mark[0] = -1.0
    reason = DONE
    det = 0.0
    switches = 0
    while True:
        switches += 1
        if switches > 2000:
            reason = STUCK
            break
        if regime == RIGID:
            reason, t = follow_rigid(
                t, min(t1, t_rest), par, tide, ground, tol, unyielding, max_steps, ws, hist, count
            )
            if reason != ONSET:
                break
            if brittle:
                par[COHESION] = 0.0
            _, _, _, det = rigid_excess(t, ws.y, par, tide, ws.work, ws.stress)
            log(ONSET, t, det, np.sqrt(par[S1] * par[S2] * par[S3]), events, count)
            loosen(ws.y, par, ws)
            regime = FLOWING
        elif regime == FLOWING:
            reason, t = follow_flow(t, t1, par, tide, ground, tol, limit, max_steps, ws, hist, count)
            volume = np.sqrt(determinant(ws.y[0:6]))
            if reason in (ARREST, JAM):
                det = ws.work.s[DETERMINANT]
                stiffen(ws.y, par, ws)
                log(reason, t, det, volume, events, count)
                regime = RIGID
            elif reason == LOSS:
                log(LOSS, t, 0.0, volume, events, count)
                regime = DISPERSED
            else:
                break
        else:
            reason, t = follow_free(regime, t, t1, par, tide, ground, tol, limit, max_steps, ws, hist, count)
            if reason != CONTACT:
                break
            log(CONTACT, t, 0.0, np.sqrt(determinant(ws.y[0:6])), events, count)
            par[PART] = SMOOTH
            offset = ws.spare[36:42]
            offset[:] = 0.0
            did = friction_impulse(ws.y, par, 0.0, offset, ws.work, ws.jac, ws.pivots, ws.spare)
            if did == FAILED:
                reason = STUCK
                break
            if did == SLIDING:
                regime = FLOWING
            elif did != FREE:
                stiffen(ws.y, par, ws)
                regime = RIGID
        if t >= t1:
            reason = DONE
            break
    if regime == RIGID:
        rigid_excess(t, ws.y, par, tide, ws.work, ws.stress)
        loosen(ws.y, par, ws)
        for i in range(6, 12):
            ws.y[i] = 0.0
    copy(ws.y, y, N_FULL)
    mark[0], mark[1] = ws.mark[0], ws.mark[1]
    return reason, t, regime
