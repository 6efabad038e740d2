"""Rigid motion up to yield: Euler's equations, and extrema of the yield function on dense output."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flybystab.core.dynamics.ground import Ground, Step, contact_time
from flybystab.core.dynamics.rates import rate, rigid_excess
from flybystab.core.dynamics.state import N_RIGID, RIGID, Parameters, rigid_volume
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
    N_SUMMITS,
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
from flybystab.core.material.flow_rule import dilatancy
from flybystab.core.material.yield_surface import required_friction, slope
from flybystab.core.numerics.dop853 import N_STAGES
from flybystab.core.numerics.jit import code, inlined, kernel
from flybystab.typing import Array

# Rows of `Workspace.sample`, and selector of the value of `_rigid_values`.
_ONSET = code(0)  # the onset function
_FRICTION = code(1)  # the mobilised friction angle, rad

_GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)

#: Distance from the ends of a step, as a fraction of it, at which the slope there is tested. A maximum closer to an end
#: is not found; it exceeds the value at the end by a term of second order in this fraction.
_BESIDE = 1e-4

#: Margin for the excess of the mobilised friction over the parabola through three samples, over the range (largest less
#: least) of the samples of the step.
_SLACK = 0.25

# Columns of `Workspace.summits`.
_BOUND, _TIME, _LENGTH, _FROM, _TO = range(5)


class RigidStep(NamedTuple):
    """A step of rigid motion from the state `y` at `t` over `h`, with its interpolant."""

    t: float
    h: float
    y: Array
    dense: Array


@kernel
def yields(t: float, y: Array, par: Parameters, tide: TidePanels, ws: Workspace) -> float:
    """Onset function: positive where the stress of a RIGID state exceeds the yield surface and plastic flow can begin.

    It is the yield excess ``f`` for ``f <= 0``, otherwise ``min(f, d)`` with the denominator ``d`` of the pressure for
    flow along the deviator of the rigid stress.
    """
    excess, p, norm, det = rigid_excess(t, y, par, tide, ws.work, ws.stress)
    return _onset(excess, p, norm, det, par, ws.stress)


@kernel
def _onset(excess: float, p: float, norm: float, det: float, par: Parameters, stress: Array) -> float:
    """The onset function from the results of `rigid_excess`."""
    return excess if excess <= 0.0 else min(excess, onset_denominator(p, norm, det, par, stress))


@kernel
def onset_denominator(p: float, norm: float, det: float, par: Parameters, stress: Array) -> float:
    """``B:((1 - k shat) S^-1)`` for flow whose stress has the deviator of ``stress[6]`` (body axes).

    ``B = 1 - beta shat`` for the radial rule, ``1 - f k shat`` for the true normal.
    """
    if norm == 0.0:
        return 1.0
    k = slope(par.material.surface, par.material.sin_phi, det)
    beta, _ = dilatancy(rigid_volume(par.rigid), par.material)
    if par.material.normal:
        beta *= k
    i1, i2, i3 = 1.0 / par.rigid.s1, 1.0 / par.rigid.s2, 1.0 / par.rigid.s3
    n0, n1, n2 = (stress[0] + p) / norm, (stress[1] + p) / norm, (stress[2] + p) / norm
    n3, n4, n5 = stress[3] / norm, stress[4] / norm, stress[5] / norm
    n_s = n0 * i1 + n1 * i2 + n2 * i3
    nn_s = (
        (n0 * n0 + n3 * n3 + n4 * n4) * i1
        + (n1 * n1 + n3 * n3 + n5 * n5) * i2
        + (n2 * n2 + n4 * n4 + n5 * n5) * i3
    )
    return i1 + i2 + i3 - (k + beta) * n_s + k * beta * nn_s


@kernel
def _mobilised_friction(p: float, norm: float, det: float, par: Parameters) -> float:
    """Friction angle, rad, that the stress of a rigid body requires."""
    cohesion = par.material.cohesion * rigid_volume(par.rigid)
    return required_friction(par.material.surface, cohesion, norm, p, det)


@kernel
def _rigid_values(t: float, y: Array, par: Parameters, tide: TidePanels, ws: Workspace, which: int) -> float:
    """Onset function or mobilised friction angle (`which`: _ONSET or _FRICTION) of a RIGID state."""
    if which == _ONSET:
        return yields(t, y, par, tide, ws)
    _, p, norm, det = rigid_excess(t, y, par, tide, ws.work, ws.stress)
    return _mobilised_friction(p, norm, det, par)


@kernel
def _largest(
    a: float, b: float, step: RigidStep, par: Parameters, tide: TidePanels, ws: Workspace, which: int
) -> tuple[float, float]:
    """Maximum over the fractions [a, b] of a rigid step by golden section: fraction and value."""
    t, h, y, dense = step.t, step.h, step.y, step.dense
    x1 = b - _GOLDEN * (b - a)
    x2 = a + _GOLDEN * (b - a)
    explicit_at(x1, y, N_RIGID, dense, ws.ys)
    f1 = _rigid_values(t + x1 * h, ws.ys, par, tide, ws, which)
    explicit_at(x2, y, N_RIGID, dense, ws.ys)
    f2 = _rigid_values(t + x2 * h, ws.ys, par, tide, ws, which)
    for _ in range(20):  # 1e-4 of the interval; the error of the maximum is of second order in that
        if f1 < f2:
            a = x1
            x1, f1 = x2, f2
            x2 = a + _GOLDEN * (b - a)
            explicit_at(x2, y, N_RIGID, dense, ws.ys)
            f2 = _rigid_values(t + x2 * h, ws.ys, par, tide, ws, which)
        else:
            b = x2
            x2, f2 = x1, f1
            x1 = b - _GOLDEN * (b - a)
            explicit_at(x1, y, N_RIGID, dense, ws.ys)
            f1 = _rigid_values(t + x1 * h, ws.ys, par, tide, ws, which)
    return (x1, f1) if f1 > f2 else (x2, f2)


@kernel
def _vertex_inside(f0: float, f1: float, f2: float) -> bool:
    """True if the parabola through three equidistant values has its maximum between the outer two."""
    bend = f0 - 2.0 * f1 + f2
    return bend < 0.0 and abs(f2 - f0) <= -2.0 * bend


@kernel
def _summit(
    f: Array,
    j: int,
    last: int,
    t: float,
    h: float,
    par: Parameters,
    tide: TidePanels,
    ws: Workspace,
    which: int,
) -> bool:
    """True if a maximum may lie next to sample `j` of ``f[: last + 1]``.

    Inside the step: if the parabola through the sample and its two neighbours has a maximum between these. At an end of
    the step: if the function at the fraction `_BESIDE` from the end exceeds its value at the end.
    """
    if 0 < j < last:
        return _vertex_inside(f[j - 1], f[j], f[j + 1])
    if last == 0:
        return False
    inside = j / N_SAMPLE + (_BESIDE if j == 0 else -_BESIDE)
    explicit_at(inside, ws.y, N_RIGID, ws.dense, ws.ys)
    return _rigid_values(t + inside * h, ws.ys, par, tide, ws, which) > f[j]


@kernel
def _interval(j: int, last: int) -> tuple[float, float]:
    """Fractions of a step between which a maximum next to sample `j` of ``0 ... last`` lies."""
    return max(j - 1.0, 0.0) / N_SAMPLE, min(j + 1.0, last) / N_SAMPLE


@inlined
def _sample_step(
    t: float, h: float, par: Parameters, tide: TidePanels, unyielding: bool, ws: Workspace
) -> tuple[float, int]:
    """Fraction of a step at which the body has yielded (2 if it has not), and the last sample before it.

    Writes the onset function and the mobilised friction at the samples to ``ws.sample``. Where the onset function is
    close to zero its maxima between samples are located.
    """
    onset, friction = ws.sample[_ONSET], ws.sample[_FRICTION]
    onset[0], friction[0] = onset[N_SAMPLE], friction[N_SAMPLE]
    norm = 0.0
    for j in range(1, N_SAMPLE + 1):
        x = j / N_SAMPLE
        explicit_at(x, ws.y, N_RIGID, ws.dense, ws.ys)
        excess, p, norm, det = rigid_excess(t + x * h, ws.ys, par, tide, ws.work, ws.stress)
        onset[j] = _onset(excess, p, norm, det, par, ws.stress)
        friction[j] = _mobilised_friction(p, norm, det, par)
        if not unyielding and onset[j] > 0.0:
            return x, j - 1
    if unyielding:
        return 2.0, N_SAMPLE
    margin = onset.max() - onset.min() + 0.02 * norm
    for j in range(N_SAMPLE + 1):
        if onset[j] + margin > 0.0 and _summit(onset, j, N_SAMPLE, t, h, par, tide, ws, _ONSET):
            a, b = _interval(j, N_SAMPLE)
            x, value = _largest(a, b, RigidStep(t, h, ws.y, ws.dense), par, tide, ws, _ONSET)
            if value > 0.0:
                return x, int(np.floor(x * N_SAMPLE))
    return 2.0, N_SAMPLE


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
def _summit_bound(f: Array, j: int, last: int) -> float:
    """Estimated upper bound of the friction around sample `j` of ``f[: last + 1]``; infinite if a sample is.

    It is the maximum of the parabola through the three samples nearest to `j` plus `_SLACK` times the range of the
    samples, and at most ``f[j]`` plus that range.
    """
    span = f[: last + 1].max() - f[: last + 1].min()
    if not span < np.inf:
        return np.inf
    if last < 2:
        return f[j] + span
    k = min(max(j, 1), last - 1)
    top = max(f[k - 1], max(f[k], f[k + 1]))
    if _vertex_inside(f[k - 1], f[k], f[k + 1]):
        top = max(top, f[k] - (f[k + 1] - f[k - 1]) ** 2 / (8.0 * (f[k - 1] - 2.0 * f[k] + f[k + 1])))
    return min(f[j] + span, top + _SLACK * span)


@kernel
def _keep_summit(bound: float, a: float, b: float, step: RigidStep, least: float, ws: Workspace) -> bool:
    """Store an interval for `_search_summits`; False if there is no room. `least` is the peak so far."""
    for k in range(N_SUMMITS):
        row = ws.summits[k]
        if row[_BOUND] <= least:
            row[_BOUND], row[_TIME], row[_LENGTH], row[_FROM], row[_TO] = bound, step.t, step.h, a, b
            copy(step.y, ws.summit_states[k], N_RIGID)
            for i in range(ws.summit_dense.shape[1]):
                copy(step.dense[i], ws.summit_dense[k, i], N_RIGID)
            return True
    return False


@kernel
def _search_summits(par: Parameters, tide: TidePanels, peak: Peak, ws: Workspace) -> Peak:
    """The largest of `peak` and the friction in the stored intervals, searched in the order of decreasing bounds."""
    while True:
        k = np.argmax(ws.summits[:, _BOUND])
        row = ws.summits[k]
        if not row[_BOUND] > peak.friction:
            return peak
        row[_BOUND] = -np.inf
        step = RigidStep(row[_TIME], row[_LENGTH], ws.summit_states[k], ws.summit_dense[k])
        x, value = _largest(row[_FROM], row[_TO], step, par, tide, ws, _FRICTION)
        peak = larger(peak, value, step.t + x * step.h)


@inlined
def _friction_peak(
    t: float, h: float, n: int, par: Parameters, tide: TidePanels, peak: Peak, ws: Workspace
) -> Peak:
    """The larger of `peak` and the mobilised friction at the samples up to `n` of a step.

    An interval between samples whose bound exceeds the peak is stored in ``ws.summits``; at the end of the motion only
    the intervals whose bounds exceed the final peak are searched.
    """
    f = ws.sample[_FRICTION]
    for j in range(1, n + 1):
        if f[: n + 1].max() < np.inf:
            peak = larger(peak, f[j], t + h * j / N_SAMPLE)
    for j in range(n + 1):
        bound = _summit_bound(f, j, n)
        if f[j] < np.inf and bound > peak.friction and _summit(f, j, n, t, h, par, tide, ws, _FRICTION):
            a, b = _interval(j, n)
            step = RigidStep(t, h, ws.y, ws.dense)
            if bound == np.inf or not _keep_summit(bound, a, b, step, peak.friction, ws):
                x, value = _largest(a, b, step, par, tide, ws, _FRICTION)
                peak = larger(peak, value, t + x * h)
    for j in range(1, n + 1):
        peak = larger(peak, f[j], t + h * j / N_SAMPLE)
    return peak


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
def _longest_step(t: float, tolerance: float, tide: TidePanels) -> float:
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
    return _onset(excess, p, norm, det, par, ws.stress), _mobilised_friction(p, norm, det, par)


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
    h = min(0.05 if first_step <= 0.0 else first_step, t1 - t, _longest_step(t, tol, tide))
    rate(RIGID, t, y, k[0], par, tide, ws.work)
    onset, friction = _record_state(t, par, tide, ws, log)
    ws.sample[_ONSET, N_SAMPLE], ws.sample[_FRICTION, N_SAMPLE] = onset, friction
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
        end, n = _sample_step(t, h, par, tide, unyielding, ws)
        if keeps_history(log):
            _record_samples(t, h, n, par, tide, ws, log)
        peak = _friction_peak(t, h, n, par, tide, peak, ws)
        if end <= 1.0:
            t = _step_to_yield(t, h, n, end, par, tide, ws)
            _, friction = _record_state(t, par, tide, ws, log)
            return ONSET, t, h, larger(peak, friction, t)
        t = t1 if last else t + h
        copy(ws.y1, y, N_RIGID)
        _normalise(y)
        k[0] = k[N_STAGES]
        h = min(h * explicit_growth(error), _longest_step(t, tol, tide))
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
    ws.summits[:, _BOUND] = -np.inf
    reason, t, step, peak = _follow(t, t1, first_step, par, tide, ground, limits, unyielding, peak, ws, log)
    return reason, t, step, _search_summits(par, tide, peak, ws)


@kernel
def larger(peak: Peak, friction: float, t: float) -> Peak:
    """The larger of a peak and a mobilised friction angle at a time."""
    return Peak(friction, t) if friction > peak.friction else peak


@kernel
def _normalise(q: Array) -> None:
    s = 1.0 / np.sqrt(q[0] ** 2 + q[1] ** 2 + q[2] ** 2 + q[3] ** 2)
    for i in range(4):
        q[i] *= s
