"""Plastic flow up to arrest, loss of contact, jam or the limit of the model."""

from __future__ import annotations

import numpy as np

from flybystab.core.dynamics.flow_events import (
    first_end,
    health,
    record_end,
    record_flow,
    record_inside,
    sample,
)
from flybystab.core.dynamics.ground import Ground, touches
from flybystab.core.dynamics.jacobian import flow_jacobian
from flybystab.core.dynamics.mohr_coulomb_hexagon import choose_part, settle
from flybystab.core.dynamics.state import FLOWING, N_FULL
from flybystab.core.dynamics.steppers import (
    explicit_dense,
    explicit_step,
    implicit_step,
)
from flybystab.core.dynamics.workspace import (
    ARREST,
    D_REST,
    DONE,
    FADE,
    STUCK,
    SWITCH,
    TOUCH,
    Counts,
    Workspace,
    copy,
)
from flybystab.core.ellipsoid.tide import TidePanels
from flybystab.core.material.flow_rule import fade
from flybystab.core.material.parameters import BETA
from flybystab.core.numerics.jit import kernel
from flybystab.core.numerics.tensors import determinant, deviator
from flybystab.typing import Array

#: Longest explicit step, times the rate of relaxation of ``D``: DOP853 is stable to 6 on the axis.
_STABLE = 5.0

#: The same where stability, not the error, holds explicit steps back so much that implicit ones are better.
_HELD = 4.0 * _STABLE

#: Longest step towards rest, over the time to it.
_APPROACH = 0.45

#: Implicit steps at least between explicit stretches.
_BETWEEN = 3

#: Time to rest at which flow ends, dynamical times over the tolerance of a step, and the least tolerance that counts:
#: at 1e-9 the body is drawn to rest by its rate, to the square of that.
_BRIEF = 0.1
_TIGHT = 1e-8


@kernel
def _step(explicit: bool, t: float, y: Array, h: float, par: Array, tide: TidePanels, ws: Workspace) -> float:
    """One step of flow to ``ws.y1``, explicit (with its first rate in ``ws.k[0]``) or implicit; returns the error."""
    if explicit:
        return explicit_step(FLOWING, t, y, N_FULL, h, par, tide, ws.work, ws.k, ws.scale, ws.y1)
    return implicit_step(
        t, y, h, par, tide, ws.work, ws.jac, ws.lu, ws.pivots, ws.k, ws.scale, ws.y1, ws.dense
    )


@kernel
def _stiffness(jac: Array, v: Array) -> float:
    """Rate at which ``D`` relaxes: spectral radius of its block of the Jacobian, by power iteration in ``v[12]``."""
    for i in range(6):
        v[i] = 0.0
        for j in range(6, 12):
            v[i] += jac[6 + i, j] * (1.0 if j % 2 == 0 else -0.5)
    size = 0.0
    for _ in range(6):
        before = 0.0
        for i in range(6):
            before += v[i] * v[i]
        if before == 0.0:
            return 0.0
        before = 1.0 / np.sqrt(before)
        size = 0.0
        for i in range(6):
            v[6 + i] = 0.0
            for j in range(6):
                v[6 + i] += jac[6 + i, 6 + j] * v[j] * before
            size += v[6 + i] ** 2
        copy(v[6:12], v, 6)
        size = np.sqrt(size)
    return size


@kernel
def follow_flow(
    t: float,
    t1: float,
    par: Array,
    tide: TidePanels,
    ground: Ground,
    tol: float,
    limit: float,
    max_steps: int,
    ws: Workspace,
    hist: Array,
    count: Counts,
) -> tuple[int, float]:
    """Plastic flow of ``ws.y`` up to one of its ends or `t1`; returns (reason, time).

    Near onset and rest, where the direction of ``D`` relaxes as ``1/|D|``, the steps are implicit; in between, where
    explicit ones of order 8 can be longer without losing stability, they are explicit.
    """
    y = ws.y
    f0 = ws.spare[15:30]
    spare = ws.spare[:15]
    h = 1e-4
    explicit = False
    pull = 0.0  # rate of relaxation times |D|, from the last Jacobian
    slow = 0.0  # |D| at which explicit steps end
    implicit_ahead = 0
    limit2 = limit * limit
    touched = False
    near = 1e-6 + 10.0 * tol  # the direction of D is known no better
    fastest = 0.0
    choose_part(t, y, par, tide, near, ws)
    # A step must not straddle the kink of the dilatancy: plastic flow only ever dilates, and passes it once.
    ws.mark[4] = fade(par) if par[BETA] > 0.0 and np.sqrt(determinant(y[0:6])) < fade(par) else np.inf
    if health(t, y, f0, par, tide, limit2, ws) < 0.0:
        return int(ws.mark[3]), t
    sample(-1, 0, ws)
    while t < t1:
        # Here f0 and the stress in `ws.work` belong to (t, y).
        record_flow(t, y, par, ws, hist, count)
        _, d, _ = deviator(y[6:12], ws.stress)
        # d|D'|/dt = Dhat : Ddot
        trend = 0.0
        for i in range(3):
            trend += ws.stress[i] * f0[6 + i] + 2.0 * ws.stress[3 + i] * f0[9 + i]
        fastest = max(fastest, d)
        if d < 1e-2 * fastest and d < _BRIEF * max(tol, _TIGHT) * -trend:
            # Rest is nearer than the tolerance can tell: the direction of so small a D is noise, and on a sharp corner
            # of the yield section, which turns the stress with it, D would never come to rest.
            for i in range(N_FULL):
                y[i] += d / -trend * f0[i]
            return ARREST, t + d / -trend
        if explicit and (d < slow or h * pull > _HELD * d):
            explicit, implicit_ahead = False, _BETWEEN
        if not explicit:
            flow_jacobian(t, y, f0, 1e-6, par, tide, ws.work, ws.jac, ws.lu)
            pull = d * _stiffness(ws.jac, spare)
            implicit_ahead -= 1
            if implicit_ahead < 0 and 1.5 * h * pull < _STABLE * d:
                explicit, slow = True, 0.5 * d
        if explicit:
            copy(f0, ws.k[0], N_FULL)
            h = min(h, _STABLE * d / pull)
        if trend < 0.0:
            # |D| falls linearly to arrest, its direction relaxes as 1/|D|: approach it geometrically.
            h = min(h, _APPROACH * d / -trend)
        for i in range(6):
            ws.scale[i] = tol
            ws.scale[6 + i] = tol * max(d, 1e-4)
        for i in range(12, 15):
            ws.scale[i] = tol
        growth = 6.0
        while True:
            if count[2] >= max_steps:
                return STUCK, t
            last = h >= t1 - t
            if last:
                h = t1 - t
            error = _step(explicit, t, y, h, par, tide, ws)
            count[2] += 1
            if error <= 1.0:
                break
            count[3] += 1
            # Near onset the error falls slower than the order says: a second refusal halves the step at least.
            most = 0.9 if growth > 1.0 else 0.5
            growth = 1.0
            h *= (
                min(most, max(0.1, 0.9 * error ** (-0.125 if explicit else -0.2)))
                if np.isfinite(error)
                else 0.1
            )
            if h < 1e-15 * max(1.0, abs(t)):
                return STUCK, t
        # On the way and at the end: has one of the event functions changed its sign?
        if explicit:
            explicit_dense(FLOWING, t, y, N_FULL, h, par, tide, ws.work, ws.k, ws.y1, ws.ys, ws.dense)
        if not touched:
            end_time = touches(FLOWING, explicit, t, h, par, ground, ws)
            if end_time < np.inf:  # the step again, up to there
                touched = True
                t1 = end_time
                count[0] = max(count[0] - 1, 0)
                health(t, y, f0, par, tide, limit2, ws)
                continue
        end = first_end(explicit, t, y, h, f0, par, tide, limit2, ws)
        if end <= 1.0:
            reason = int(ws.mark[3])
            # Repeat the step up to the root: the order of the method instead of that of the interpolant.
            h *= end
            _step(explicit, t, y, h, par, tide, ws)
            goes_on = reason in (SWITCH, FADE)
            if goes_on and hist.shape[0] > 1:
                if explicit:
                    explicit_dense(FLOWING, t, y, N_FULL, h, par, tide, ws.work, ws.k, ws.y1, ws.ys, ws.dense)
                record_inside(explicit, t, y, h, spare, par, tide, limit2, ws, hist, count)
            copy(ws.y1, y, N_FULL)
            t += h
            if not goes_on:
                record_end(t, y, f0, par, tide, limit2, ws, hist, count)
                return reason, t
            if reason == FADE:
                ws.mark[4] = np.inf
                h /= end
            else:
                choose_part(t, y, par, tide, near, ws)
                h = max(h, 1e-4)
                explicit, implicit_ahead = False, _BETWEEN
            if health(t, y, f0, par, tide, limit2, ws) < 0.0:
                return int(ws.mark[3]), t
            sample(-1, 0, ws)
            continue
        if hist.shape[0] > 1:
            record_inside(explicit, t, y, h, spare, par, tide, limit2, ws, hist, count)
            health(t + h, ws.y1, f0, par, tide, limit2, ws)
        t = t1 if last else t + h
        copy(ws.y1, y, N_FULL)
        if settle(y, par, ws.scale[6], ws):
            health(t, y, f0, par, tide, limit2, ws)
        _, d, _ = deviator(y[6:12], ws.stress)
        if d < D_REST:
            record_end(t, y, f0, par, tide, limit2, ws, hist, count)
            return ARREST, t
        h *= min(growth, max(0.2, 0.9 * error ** (-0.125 if explicit else -0.2))) if error > 0.0 else growth
    record_end(t, y, f0, par, tide, limit2, ws, hist, count)
    return TOUCH if touched else DONE, t
