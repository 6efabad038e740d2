"""Motion without friction: dispersed grains, and the fluid closures."""

from __future__ import annotations

import numpy as np

from flybystab.core.dynamics.flow_events import axis_ratio2
from flybystab.core.dynamics.ground import Ground, touches
from flybystab.core.dynamics.rates import rate
from flybystab.core.dynamics.state import DISPERSED, FLUID, N_FULL, PRESSURE
from flybystab.core.dynamics.steppers import explicit_at, explicit_dense, explicit_step
from flybystab.core.dynamics.workspace import (
    BEYOND,
    CONTACT,
    DONE,
    N_SAMPLE,
    STUCK,
    TOUCH,
    Counts,
    Workspace,
    copy,
    record,
)
from flybystab.core.ellipsoid.tide import TidePanels
from flybystab.core.numerics.jit import kernel
from flybystab.core.numerics.tensors import determinant
from flybystab.typing import Array


@kernel
def _left(reason: int, y: Array, lost: float, limit: float, ws: Workspace) -> float:
    """What is left to CONTACT, at the squared volume `lost`, or to BEYOND, at the axis ratio `limit` squared."""
    return determinant(y[0:6]) - lost if reason == CONTACT else limit * limit - axis_ratio2(y, ws)


@kernel
def _end(regime: int, y: Array, lost: float, limit: float, ws: Workspace) -> int:
    """The end that a state has passed: CONTACT, BEYOND, or DONE if none."""
    if regime == DISPERSED and _left(CONTACT, y, lost, limit, ws) < 0.0:
        return CONTACT
    return BEYOND if _left(BEYOND, y, lost, limit, ws) < 0.0 else DONE


@kernel
def follow_free(
    regime: int,
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
    """Dispersed or fluid motion of ``ws.y`` up to contact, the ratio `limit`, the ground or `t1`; (reason, time)."""
    y = ws.y
    k = ws.k
    h = 1e-2
    touched = False
    lost = determinant(y[0:6])
    rate(regime, t, y, k[0], par, tide, ws.work)
    while t < t1:
        if hist.shape[0] > 1:
            record(
                t,
                regime,
                y,
                par,
                ws.work.s[PRESSURE] if regime == FLUID else 0.0,
                0.0,
                0.0,
                ws,
                hist,
                count,
            )
        if count[2] >= max_steps:
            return STUCK, t
        last = h >= t1 - t
        if last:
            h = t1 - t
        for i in range(15):
            ws.scale[i] = tol * max(1.0, abs(y[i]))
        error = explicit_step(regime, t, y, N_FULL, h, par, tide, ws.work, k, ws.scale, ws.y1)
        count[2] += 1
        if not error <= 1.0:
            count[3] += 1
            h *= max(0.2, 0.9 * error ** (-0.125)) if np.isfinite(error) else 0.2
            if h < 1e-14 * max(1.0, abs(t)):
                return STUCK, t
            continue
        explicit_dense(regime, t, y, N_FULL, h, par, tide, ws.work, k, ws.y1, ws.ys, ws.dense)
        if not touched:
            end_time = touches(regime, True, t, h, par, ground, ws)
            if end_time < np.inf:  # the step again, up to there
                touched = True
                t1 = end_time
                count[0] = max(count[0] - 1, 0)
                continue
        found = 2.0
        low = 0.0
        for j in range(1, 2 * N_SAMPLE + 1):
            x = 0.5 * j / N_SAMPLE
            explicit_at(x, y, N_FULL, ws.dense, ws.ys)
            if _end(regime, ws.ys, lost, limit, ws) != DONE:
                found = x
                break
            low = x
        if found <= 1.0:
            # Both ends may be passed between two samples: the root of the first of them.
            high = found
            for _ in range(55):
                mid = 0.5 * (low + high)
                explicit_at(mid, y, N_FULL, ws.dense, ws.ys)
                if _end(regime, ws.ys, lost, limit, ws) != DONE:
                    high = mid
                else:
                    low = mid
            explicit_at(high, y, N_FULL, ws.dense, ws.ys)
            reason = _end(regime, ws.ys, lost, limit, ws)
            # Steps to the root, which the interpolant of a long step has less well than the step, by its slope.
            near = high * (1.0 - 1e-3)
            left = _left(reason, ws.ys, lost, limit, ws)
            explicit_at(near, y, N_FULL, ws.dense, ws.ys)
            slope = (left - _left(reason, ws.ys, lost, limit, ws)) / (high - near)
            for turn in range(3):
                explicit_step(regime, t, y, N_FULL, high * h, par, tide, ws.work, k, ws.scale, ws.y1)
                if turn < 2 and slope < 0.0:
                    late = _left(reason, ws.y1, lost, limit, ws) / slope
                    high -= min(1e-3 * high, max(-1e-3 * high, late))
            copy(ws.y1, y, N_FULL)
            record(t + high * h, regime, y, par, 0.0, 0.0, 0.0, ws, hist, count)
            return reason, t + high * h
        t = t1 if last else t + h
        copy(ws.y1, y, N_FULL)
        k[0] = k[12]
        h *= min(5.0, max(0.3, 0.9 * error ** (-0.125))) if error > 0.0 else 5.0
        if tide.coefficients.shape[0] > 0:
            h = min(h, 0.4 * np.sqrt(t * t + tide.tau * tide.tau))
    p = ws.work.s[PRESSURE] if regime == FLUID else 0.0
    record(t, regime, y, par, p, 0.0, 0.0, ws, hist, count)
    return TOUCH if touched else DONE, t
