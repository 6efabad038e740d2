"""Rigid motion up to yield, by Euler's equations."""

from __future__ import annotations

import numpy as np

from flybystab.core.dynamics.ground import Ground, Step, contact_time
from flybystab.core.dynamics.rates import rate, rigid_excess
from flybystab.core.dynamics.rigid_extrema import (
    BOUND,
    FRICTION_ROW,
    ONSET_ROW,
    friction_peak,
    larger,
    mobilised_friction,
    onset_of,
    sample_step,
    search_summits,
    yields,
)
from flybystab.core.dynamics.state import N_RIGID, RIGID, Parameters
from flybystab.core.dynamics.steppers import (
    explicit_at,
    explicit_dense,
    explicit_growth,
    explicit_reduction,
    explicit_step,
)
from flybystab.core.dynamics.workspace import (
    DONE,
    N_SAMPLE,
    ONSET,
    STUCK,
    TOUCH,
    Limits,
    Log,
    Peak,
    Workspace,
    copy,
    count_rejected,
    count_step,
    exhausted,
    keeps_history,
    record,
)
from flybystab.core.ellipsoid.tide import TidePanels
from flybystab.core.numerics.dop853 import N_STAGES
from flybystab.core.numerics.jit import kernel
from flybystab.typing import Array


@kernel
def _record_samples(
    t: float, h: float, n: int, par: Parameters, tide: TidePanels, ws: Workspace, log: Log
) -> None:
    """Append the samples 1 to `n` of a step to the history."""
    for j in range(1, n + 1):
        x = j / N_SAMPLE
        explicit_at(x, ws.y, N_RIGID, ws.dense, ws.ys)
        _, p, norm, det = rigid_excess(t + x * h, ws.ys, par, tide, ws.work, ws.stress)
        record(t + x * h, RIGID, ws.ys, par, p, norm, det, ws, log)


@kernel
def _step_to_yield(
    t: float, h: float, n: int, end: float, par: Parameters, tide: TidePanels, ws: Workspace
) -> float:
    """Repeat a step up to the onset of yield between sample `n` and the fraction `end`; returns its time.

    The root is located on the dense output; the state there is then computed by a step of order 8.
    """
    low, high = n / N_SAMPLE, end
    for _ in range(60):
        mid = 0.5 * (low + high)
        explicit_at(mid, ws.y, N_RIGID, ws.dense, ws.ys)
        if yields(t + mid * h, ws.ys, par, tide, ws) > 0.0:
            high = mid
        else:
            low = mid
        if (high - low) * h < 1e-14 * max(1.0, abs(t)):
            break
    explicit_step(RIGID, t, N_RIGID, high * h, par, tide, ws)
    copy(ws.y1, ws.y, N_RIGID)
    _normalise(ws.y)
    return t + high * h


@kernel
def longest_step(t: float, tolerance: float, tide: TidePanels) -> float:
    """Longest step at a time.

    It is at most 0.4 in the variable ``asinh(t/tau)``, in which the panels of the tide have equal widths, and scales as
    ``tolerance^(1/8)``: with a fixed limit, a run and the one with a smaller tolerance that measures its error would
    have the same error from the tide.
    """
    if tide.coefficients.shape[0] == 0:
        return np.inf
    return min(0.4, 0.225 * (1e8 * tolerance) ** 0.125) * np.sqrt(t * t + tide.tau * tide.tau)


@kernel
def _try_step(
    t: float, h: float, tolerance: float, par: Parameters, tide: TidePanels, ws: Workspace, log: Log
) -> float:
    """Error of one step of `h` (accept at <= 1), which is counted in `log`."""
    y = ws.y
    spin = np.sqrt(y[4] ** 2 + y[5] ** 2 + y[6] ** 2)
    for i in range(N_RIGID):
        ws.scale[i] = tolerance if i < 4 else tolerance * max(spin, 0.1)
    error = explicit_step(RIGID, t, N_RIGID, h, par, tide, ws)
    count_step(log)
    if not error <= 1.0:
        count_rejected(log)
    return error


@kernel
def _record_state(
    t: float, par: Parameters, tide: TidePanels, ws: Workspace, log: Log
) -> tuple[float, float]:
    """Append the state ``ws.y`` to the history; returns its onset function and its mobilised friction."""
    excess, p, norm, det = rigid_excess(t, ws.y, par, tide, ws.work, ws.stress)
    record(t, RIGID, ws.y, par, p, norm, det, ws, log)
    return onset_of(excess, p, norm, det, par, ws.stress), mobilised_friction(p, norm, det, par)


@kernel
def _follow(
    t: float,
    t1: float,
    first_step: float,
    par: Parameters,
    tide: TidePanels,
    ground: Ground,
    limits: Limits,
    unyielding: bool,
    peak: Peak,
    ws: Workspace,
    log: Log,
) -> tuple[int, float, float, Peak]:
    """`follow_rigid` without the search of the stored intervals of friction."""
    y, k, tol = ws.y, ws.k, limits.tolerance
    h = min(0.05 if first_step <= 0.0 else first_step, t1 - t, longest_step(t, tol, tide))
    rate(RIGID, t, y, k[0], par, tide, ws.work)
    onset, friction = _record_state(t, par, tide, ws, log)
    ws.sample[ONSET_ROW, N_SAMPLE], ws.sample[FRICTION_ROW, N_SAMPLE] = onset, friction
    peak = larger(peak, friction, t)
    if not unyielding and onset > 0.0:
        return ONSET, t, first_step, peak
    touched = False
    while t < t1:
        if exhausted(log, limits):
            return STUCK, t, first_step, peak
        last = h >= t1 - t
        if last:
            h = t1 - t
        error = _try_step(t, h, tol, par, tide, ws, log)
        if not error <= 1.0:
            h *= explicit_reduction(error)
            continue
        explicit_dense(RIGID, t, N_RIGID, h, par, tide, ws)
        if not touched:
            end_time = contact_time(Step(RIGID, True, t, h, par.rigid), ground, ws)
            if end_time < np.inf:  # repeat the step up to the contact
                touched = True
                t1 = end_time
                continue
        end, n = sample_step(t, h, par, tide, unyielding, ws)
        if keeps_history(log):
            _record_samples(t, h, n, par, tide, ws, log)
        peak = friction_peak(t, h, n, par, tide, peak, ws)
        if end <= 1.0:
            t = _step_to_yield(t, h, n, end, par, tide, ws)
            _, friction = _record_state(t, par, tide, ws, log)
            return ONSET, t, h, larger(peak, friction, t)
        t = t1 if last else t + h
        copy(ws.y1, y, N_RIGID)
        _normalise(y)
        k[0] = k[N_STAGES]
        h = min(h * explicit_growth(error), longest_step(t, tol, tide))
    return TOUCH if touched else DONE, t, 0.0, peak


@kernel
def follow_rigid(
    t: float,
    t1: float,
    first_step: float,
    par: Parameters,
    tide: TidePanels,
    ground: Ground,
    limits: Limits,
    unyielding: bool,
    peak: Peak,
    ws: Workspace,
    log: Log,
) -> tuple[int, float, float, Peak]:
    """Rigid motion of ``ws.y[:7]`` up to yield, the ground or `t1`.

    Parameters
    ----------
    first_step : float
        Length of the first step; 0 for a default.
    unyielding : bool
        If true, the motion does not stop at yield.
    peak : Peak
        Largest mobilised friction up to `t`.

    Returns
    -------
    reason, time, step, peak
        The end, its time, the length of the next step (0 unless it ends at yield), and the largest mobilised friction.
    """
    ws.summits[:, BOUND] = -np.inf
    reason, t, step, peak = _follow(t, t1, first_step, par, tide, ground, limits, unyielding, peak, ws, log)
    return reason, t, step, search_summits(par, tide, peak, ws)


@kernel
def _normalise(q: Array) -> None:
    s = 1.0 / np.sqrt(q[0] ** 2 + q[1] ** 2 + q[2] ** 2 + q[3] ** 2)
    for i in range(4):
        q[i] *= s
