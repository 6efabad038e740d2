"""Yield, and the largest mobilised friction, in a step of rigid motion: extrema on its dense output.

Both are functions of the stress of the rigid body. They are sampled at the quarters of a step; where a maximum between
samples may matter it is located by Brent's method.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flybystab.core.dynamics.rates import rigid_excess, rigid_invariants
from flybystab.core.dynamics.state import N_RIGID, Parameters, rigid_volume
from flybystab.core.dynamics.steppers import explicit_at
from flybystab.core.dynamics.workspace import N_SAMPLE, N_SUMMITS, Peak, Workspace, copy
from flybystab.core.ellipsoid.tide import TidePanels
from flybystab.core.material.flow_rule import dilatancy
from flybystab.core.material.yield_surface import excess_and_friction, required_friction, slope
from flybystab.core.numerics.jit import code, inlined, kernel
from flybystab.typing import Array

# Rows of `Workspace.sample`; they also choose the quantity that `_rigid_values` returns.
ONSET_ROW = code(0)  # the onset function
FRICTION_ROW = code(1)  # the mobilised friction angle, rad

_GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)

#: Distance from the ends of a step, as a fraction of it, at which the slope there is tested. A maximum closer to an end
#: is not found; it exceeds the value at the end by a term of second order in this fraction.
_BESIDE = 1e-4

#: Margin for the excess of the mobilised friction over the parabola through three samples, over the range (largest less
#: least) of the samples of the step.
_SLACK = 0.25

# Columns of `Workspace.summits`; the samples are the last ones.
BOUND, _TIME, _LENGTH, _LAST, _SAMPLES = range(5)


class RigidStep(NamedTuple):
    """A step of rigid motion from the state `y` at `t` over `h`, with its interpolant."""

    t: float
    h: float
    y: Array
    dense: Array


@kernel
def larger(peak: Peak, friction: float, t: float) -> Peak:
    """The larger of a peak and a mobilised friction angle at a time."""
    return Peak(friction, t) if friction > peak.friction else peak


@kernel
def yields(t: float, y: Array, par: Parameters, tide: TidePanels, ws: Workspace) -> float:
    """Onset function: positive where the stress of a RIGID state exceeds the yield surface and plastic flow can begin.

    It is the yield excess ``f`` for ``f <= 0``, otherwise ``min(f, d)`` with the denominator ``d`` of the pressure for
    flow along the deviator of the rigid stress.
    """
    excess, p, norm, det = rigid_excess(t, y, par, tide, ws.work, ws.stress)
    return onset_of(excess, p, norm, det, par, ws.stress)


@kernel
def onset_of(excess: float, p: float, norm: float, det: float, par: Parameters, stress: Array) -> float:
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
def mobilised_friction(p: float, norm: float, det: float, par: Parameters) -> float:
    """Friction angle, rad, that the stress of a rigid body requires."""
    cohesion = par.material.cohesion * rigid_volume(par.rigid)
    return required_friction(par.material.surface, cohesion, norm, p, det)


@kernel
def measures(p: float, norm: float, det: float, par: Parameters) -> tuple[float, float]:
    """Yield excess (:func:`flybystab.core.dynamics.rates.yield_excess`) and mobilised friction of a rigid body."""
    m, volume = par.material, rigid_volume(par.rigid)
    strength = p * m.sin_phi + m.cohesion * volume * m.cos_phi
    return excess_and_friction(m.surface, m.sin_phi, strength, m.cohesion * volume, norm, p, det)


@kernel
def _rigid_values(t: float, y: Array, par: Parameters, tide: TidePanels, ws: Workspace, which: int) -> float:
    """Onset function or mobilised friction angle (`which`: ONSET_ROW or FRICTION_ROW) of a RIGID state."""
    if which == ONSET_ROW:
        return yields(t, y, par, tide, ws)
    _, p, norm, det = rigid_excess(t, y, par, tide, ws.work, ws.stress)
    return mobilised_friction(p, norm, det, par)


@kernel
def _value_at(
    x: float, step: RigidStep, par: Parameters, tide: TidePanels, ws: Workspace, which: int
) -> float:
    """`_rigid_values` at the fraction `x` of a rigid step."""
    explicit_at(x, step.y, N_RIGID, step.dense, ws.ys)
    return _rigid_values(step.t + x * step.h, ws.ys, par, tide, ws, which)


@kernel
def _largest(
    a: float, b: float, step: RigidStep, par: Parameters, tide: TidePanels, ws: Workspace, which: int
) -> tuple[float, float]:
    """Maximum over the fractions [a, b] of a rigid step: fraction and value.

    Brent's method (Brent 1973, chapter 5): the vertex of the parabola through the three best points, or a golden
    section where the parabola is of no use. It ends at an error of 1e-4 of the interval; that of the maximum is of
    second order in it.
    """
    near = 1e-4 * (b - a)
    x = w = v = a + (1.0 - _GOLDEN) * (b - a)
    fx = fw = fv = _value_at(x, step, par, tide, ws, which)
    move = last = 0.0  # this move and the one before
    for _ in range(40):
        mid = 0.5 * (a + b)
        if abs(x - mid) <= 2.0 * near - 0.5 * (b - a):
            break
        r = (x - w) * (fx - fv)
        q = (x - v) * (fx - fw)
        p = (x - v) * q - (x - w) * r
        q = 2.0 * (q - r)
        if q > 0.0:
            p = -p
        q = abs(q)
        before, last = last, move
        # Not a number, and thus false, where a value is infinite.
        if abs(before) > near and abs(p) < abs(0.5 * q * before) and q * (a - x) < p < q * (b - x):
            move = p / q
            if min(x + move - a, b - x - move) < 2.0 * near:
                move = near if x < mid else -near
        else:
            last = (a if x >= mid else b) - x
            move = (1.0 - _GOLDEN) * last
        u = x + (move if abs(move) >= near else (near if move > 0.0 else -near))
        fu = _value_at(u, step, par, tide, ws, which)
        if fu >= fx:
            if u >= x:
                a = x
            else:
                b = x
            v, fv, w, fw, x, fx = w, fw, x, fx, u, fu
        else:
            if u < x:
                a = u
            else:
                b = u
            if fu >= fw or w == x:
                v, fv, w, fw = w, fw, u, fu
            elif fu >= fv or v in (x, w):
                v, fv = u, fu
    return x, fx


@kernel
def _vertex_inside(f0: float, f1: float, f2: float) -> bool:
    """True if the parabola through three equidistant values has its maximum between the outer two."""
    bend = f0 - 2.0 * f1 + f2
    return bend < 0.0 and abs(f2 - f0) <= -2.0 * bend


@kernel
def _summit(
    f: Array, j: int, last: int, step: RigidStep, par: Parameters, tide: TidePanels, ws: Workspace, which: int
) -> bool:
    """True if a maximum may lie next to sample `j` of ``f[: last + 1]`` in a step.

    Inside the step: if the parabola through the sample and its two neighbours has a maximum between these. At an end of
    the step: if the function at the fraction `_BESIDE` from the end exceeds its value at the end.
    """
    if 0 < j < last:
        return _vertex_inside(f[j - 1], f[j], f[j + 1])
    if last == 0:
        return False
    inside = j / N_SAMPLE + (_BESIDE if j == 0 else -_BESIDE)
    return _value_at(inside, step, par, tide, ws, which) > f[j]


@kernel
def _interval(j: int, last: int) -> tuple[float, float]:
    """Fractions of a step between which a maximum next to sample `j` of ``0 ... last`` lies."""
    return max(j - 1.0, 0.0) / N_SAMPLE, min(j + 1.0, last) / N_SAMPLE


@inlined
def sample_step(
    t: float, h: float, par: Parameters, tide: TidePanels, unyielding: bool, ws: Workspace
) -> tuple[float, int]:
    """Fraction of a step at which the body has yielded (2 if it has not), and the last sample before it.

    Writes the onset function and the mobilised friction at the samples to ``ws.sample``. Where the onset function is
    close to zero its maxima between samples are located.
    """
    onset, friction = ws.sample[ONSET_ROW], ws.sample[FRICTION_ROW]
    onset[0], friction[0] = onset[N_SAMPLE], friction[N_SAMPLE]
    norm = 0.0
    for j in range(1, N_SAMPLE + 1):
        x = j / N_SAMPLE
        explicit_at(x, ws.y, N_RIGID, ws.dense, ws.ys)
        p, norm, det = rigid_invariants(t + x * h, ws.ys, par.rigid, tide, ws.work, ws.stress)
        excess, friction[j] = measures(p, norm, det, par)
        onset[j] = onset_of(excess, p, norm, det, par, ws.stress)
        if not unyielding and onset[j] > 0.0:
            return x, j - 1
    if unyielding:
        return 2.0, N_SAMPLE
    return yield_between(t, h, norm, par, tide, ws)


@kernel
def onset_margin(onset: Array, norm: float) -> float:
    """A maximum is searched next to a sample of the onset function above minus this; `norm` as in `yield_between`."""
    return onset.max() - onset.min() + 0.02 * norm


@kernel
def yield_between(
    t: float, h: float, norm: float, par: Parameters, tide: TidePanels, ws: Workspace
) -> tuple[float, int]:
    """`sample_step` for a step at whose samples the body does not yield.

    `norm` is the norm of the deviator of the stress at the end of the step.
    """
    onset = ws.sample[ONSET_ROW]
    margin = onset_margin(onset, norm)
    step = RigidStep(t, h, ws.y, ws.dense)
    for j in range(N_SAMPLE + 1):
        if onset[j] + margin > 0.0 and _summit(onset, j, N_SAMPLE, step, par, tide, ws, ONSET_ROW):
            a, b = _interval(j, N_SAMPLE)
            x, value = _largest(a, b, step, par, tide, ws, ONSET_ROW)
            if value > 0.0:
                return x, int(np.floor(x * N_SAMPLE))
    return 2.0, N_SAMPLE


@kernel
def _summit_bound(f: Array, j: int, last: int, span: float) -> float:
    """Estimated upper bound of the friction around sample `j` of ``f[: last + 1]``, which have the range `span`.

    It is the maximum of the parabola through the three samples nearest to `j` plus `_SLACK` times the range, and at
    most ``f[j]`` plus the range.
    """
    if last < 2:
        return f[j] + span
    k = min(max(j, 1), last - 1)
    top = max(f[k - 1], max(f[k], f[k + 1]))
    if _vertex_inside(f[k - 1], f[k], f[k + 1]):
        top = max(top, f[k] - (f[k + 1] - f[k - 1]) ** 2 / (8.0 * (f[k - 1] - 2.0 * f[k] + f[k + 1])))
    return min(f[j] + span, top + _SLACK * span)


@kernel
def friction_bound(f: Array, last: int) -> float:
    """Estimated upper bound of the friction in a step with the samples ``f[: last + 1]``; infinite if a sample is."""
    least = most = f[0]
    for j in range(1, last + 1):
        least, most = min(least, f[j]), max(most, f[j])
    if not most - least < np.inf:
        return np.inf
    bound = most
    for j in range(last + 1):
        bound = max(bound, _summit_bound(f, j, last, most - least))
    return bound


@kernel
def _keep(bound: float, last: int, step: RigidStep, f: Array, least: float, ws: Workspace) -> bool:
    """Store a step for `search_summits`; False if there is no room. `least` is the peak so far."""
    for k in range(N_SUMMITS):
        row = ws.summits[k]
        if row[BOUND] <= least:
            row[BOUND], row[_TIME], row[_LENGTH], row[_LAST] = bound, step.t, step.h, last
            copy(f, row[_SAMPLES:], N_SAMPLE + 1)
            copy(step.y, ws.summit_states[k], N_RIGID)
            for i in range(ws.summit_dense.shape[1]):
                copy(step.dense[i], ws.summit_dense[k, i], N_RIGID)
            return True
    return False


@kernel
def _search_step(k: int, par: Parameters, tide: TidePanels, peak: Peak, ws: Workspace) -> Peak:
    """The larger of `peak` and the friction in the stored step `k`."""
    row = ws.summits[k]
    last, f = int(row[_LAST]), row[_SAMPLES:]
    step = RigidStep(row[_TIME], row[_LENGTH], ws.summit_states[k], ws.summit_dense[k])
    span = f[: last + 1].max() - f[: last + 1].min()
    for j in range(last + 1):
        higher = not _summit_bound(f, j, last, span) <= peak.friction
        if f[j] < np.inf and higher and _summit(f, j, last, step, par, tide, ws, FRICTION_ROW):
            a, b = _interval(j, last)
            x, value = _largest(a, b, step, par, tide, ws, FRICTION_ROW)
            peak = larger(peak, value, step.t + x * step.h)
    return peak


@kernel
def search_summits(par: Parameters, tide: TidePanels, peak: Peak, ws: Workspace) -> Peak:
    """The largest of `peak` and the friction in the stored steps, searched in the order of decreasing bounds."""
    while True:
        k = int(np.argmax(ws.summits[:, BOUND]))
        if not ws.summits[k, BOUND] > peak.friction:
            return peak
        ws.summits[k, BOUND] = -np.inf
        peak = _search_step(k, par, tide, peak, ws)


@kernel
def sampled_peak(t: float, h: float, last: int, f: Array, peak: Peak) -> Peak:
    """The larger of `peak` and the mobilised friction at the samples 1 to `last` of a step."""
    for j in range(1, last + 1):
        peak = larger(peak, f[j], t + h * j / N_SAMPLE)
    return peak


@kernel
def friction_peak(
    t: float, h: float, last: int, par: Parameters, tide: TidePanels, peak: Peak, ws: Workspace
) -> Peak:
    """The larger of `peak` and the mobilised friction at the samples up to `last` of a step.

    A step whose bound exceeds the peak is stored in ``ws.summits``; at the end of the motion only the steps whose
    bounds exceed the final peak are searched.
    """
    f = ws.sample[FRICTION_ROW]
    peak = sampled_peak(t, h, last, f, peak)
    bound, step = friction_bound(f, last), RigidStep(t, h, ws.y, ws.dense)
    if bound > peak.friction and not _keep(bound, last, step, f, peak.friction, ws):
        peak = search_summits(par, tide, peak, ws)
        _keep(bound, last, step, f, peak.friction, ws)
    return peak
