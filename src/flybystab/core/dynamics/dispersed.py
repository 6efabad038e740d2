"""Motion without friction: dispersed grains, and fluids."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flybystab.core.dynamics.flow_events import axis_ratio2
from flybystab.core.dynamics.ground import Ground, Step, contact_time
from flybystab.core.dynamics.rates import rate
from flybystab.core.dynamics.state import DISPERSED, FLUID, N_FULL, PRESSURE, Parameters
from flybystab.core.dynamics.steppers import (
    explicit_at,
    explicit_dense,
    explicit_growth,
    explicit_reduction,
    explicit_step,
)
from flybystab.core.dynamics.workspace import (
    BEYOND,
    CONTACT,
    DONE,
    N_SAMPLE,
    STUCK,
    TOUCH,
    Limits,
    Log,
    Workspace,
    copy,
    count_rejected,
    count_step,
    drop_last_row,
    exhausted,
    record,
)
from flybystab.core.ellipsoid.tide import TidePanels
from flybystab.core.numerics.dop853 import N_STAGES
from flybystab.core.numerics.jit import kernel
from flybystab.core.numerics.tensors import determinant
from flybystab.typing import Array


class Ends(NamedTuple):
    """Events that end motion without friction: contact of dispersed grains, and the limit of the model."""

    regime: int
    contact: float  # squared volume at which dispersed grains touch
    limit2: float  # squared axis ratio


@kernel
def _distance(reason: int, y: Array, ends: Ends, ws: Workspace) -> float:
    """Event function of CONTACT or BEYOND; negative past the event."""
    return determinant(y[0:6]) - ends.contact if reason == CONTACT else ends.limit2 - axis_ratio2(y, ws)


@kernel
def _end(y: Array, ends: Ends, ws: Workspace) -> int:
    """The end that a state has passed: CONTACT, BEYOND, or DONE if none."""
    if ends.regime == DISPERSED and _distance(CONTACT, y, ends, ws) < 0.0:
        return CONTACT
    return BEYOND if _distance(BEYOND, y, ends, ws) < 0.0 else DONE


@kernel
def _end_inside(x: float, ends: Ends, ws: Workspace) -> int:
    """The end that the state ``ws.ys`` at the fraction `x` of a step has passed."""
    explicit_at(x, ws.y, N_FULL, ws.dense, ws.ys)
    return _end(ws.ys, ends, ws)


@kernel
def _first_end(ends: Ends, ws: Workspace) -> tuple[float, int]:
    """Fraction of a step at which an end is reached first on the dense output (2 if none is), and the end."""
    low = 0.0
    high = 2.0
    for j in range(1, 2 * N_SAMPLE + 1):
        x = 0.5 * j / N_SAMPLE
        if _end_inside(x, ends, ws) != DONE:
            high = x
            break
        low = x
    if high > 1.0:
        return high, DONE
    # Both events may lie between two samples: the earlier root is returned.
    for _ in range(55):
        mid = 0.5 * (low + high)
        if _end_inside(mid, ends, ws) != DONE:
            high = mid
        else:
            low = mid
    return high, _end_inside(high, ends, ws)


@kernel
def _step_to_end(
    x: float,
    reason: int,
    t: float,
    h: float,
    ends: Ends,
    par: Parameters,
    tide: TidePanels,
    ws: Workspace,
) -> float:
    """Repeat a step up to an event near the fraction `x`; returns the fraction.

    The step is more accurate than its interpolant: the root is corrected by two Newton iterations on the state at the
    end of the repeated step, with the derivative of the interpolant.
    """
    high = x
    near = high * (1.0 - 1e-3)
    left = _distance(reason, ws.ys, ends, ws)
    explicit_at(near, ws.y, N_FULL, ws.dense, ws.ys)
    slope = (left - _distance(reason, ws.ys, ends, ws)) / (high - near)
    for turn in range(3):
        explicit_step(ends.regime, t, N_FULL, high * h, par, tide, ws)
        if turn < 2 and slope < 0.0:
            late = _distance(reason, ws.y1, ends, ws) / slope
            high -= min(1e-3 * high, max(-1e-3 * high, late))
    copy(ws.y1, ws.y, N_FULL)
    return high


@kernel
def follow_free(
    regime: int,
    t: float,
    t1: float,
    par: Parameters,
    tide: TidePanels,
    ground: Ground,
    limits: Limits,
    ws: Workspace,
    log: Log,
) -> tuple[int, float]:
    """Dispersed or fluid motion of ``ws.y`` up to contact, the limit of the model, the ground or `t1`.

    Returns (reason, time).
    """
    y = ws.y
    k = ws.k
    h = 1e-2
    touched = False
    ends = Ends(regime, determinant(y[0:6]), limits.axis_ratio * limits.axis_ratio)
    rate(regime, t, y, k[0], par, tide, ws.work)
    while t < t1:
        record(t, regime, y, par, ws.work.s[PRESSURE] if regime == FLUID else 0.0, 0.0, 0.0, ws, log)
        if exhausted(log, limits):
            return STUCK, t
        last = h >= t1 - t
        if last:
            h = t1 - t
        for i in range(15):
            ws.scale[i] = limits.tolerance * max(1.0, abs(y[i]))
        error = explicit_step(regime, t, N_FULL, h, par, tide, ws)
        count_step(log)
        if not error <= 1.0:
            count_rejected(log)
            h *= explicit_reduction(error)
            if h < 1e-14 * max(1.0, abs(t)):
                return STUCK, t
            continue
        explicit_dense(regime, t, N_FULL, h, par, tide, ws)
        if not touched:
            end_time = contact_time(Step(regime, True, t, h, par.rigid), ground, ws)
            if end_time < np.inf:  # repeat the step up to the contact with the ground
                touched = True
                t1 = end_time
                drop_last_row(log)
                continue
        end, reason = _first_end(ends, ws)
        if end <= 1.0:
            t += _step_to_end(end, reason, t, h, ends, par, tide, ws) * h
            record(t, regime, y, par, 0.0, 0.0, 0.0, ws, log)
            return reason, t
        t = t1 if last else t + h
        copy(ws.y1, y, N_FULL)
        k[0] = k[N_STAGES]
        h *= explicit_growth(error)
        if tide.coefficients.shape[0] > 0:
            h = min(h, 0.4 * np.sqrt(t * t + tide.tau * tide.tau))
    record(t, regime, y, par, ws.work.s[PRESSURE] if regime == FLUID else 0.0, 0.0, 0.0, ws, log)
    return TOUCH if touched else DONE, t
