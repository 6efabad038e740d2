"""Rigid motion up to yield: Euler's equations, the yield function on dense output, and its extrema."""

from __future__ import annotations

import numpy as np

from flybystab.core.dynamics.ground import Ground, touches
from flybystab.core.dynamics.rates import rate, rigid_excess
from flybystab.core.dynamics.state import N_RIGID, RIGID, S1, S2, S3
from flybystab.core.dynamics.steppers import explicit_at, explicit_dense, explicit_step
from flybystab.core.dynamics.workspace import (
    DONE,
    N_SAMPLE,
    ONSET,
    STUCK,
    TOUCH,
    Counts,
    Workspace,
    copy,
    record,
)
from flybystab.core.ellipsoid.tide import TidePanels
from flybystab.core.material.flow_rule import dilatancy
from flybystab.core.material.parameters import COHESION, NORMAL, SIN_PHI, SURFACE
from flybystab.core.material.yield_surface import required_friction, slope
from flybystab.core.numerics.jit import code, kernel
from flybystab.typing import Array

# What `_rigid_values` returns.
_ONSET = code(0)
_FRICTION = code(1)

_GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)

#: Fraction of a step at which the slope at its ends is probed: a maximum nearer than this is missed by its square.
_BESIDE = 1e-4


@kernel
def yields(t: float, y: Array, par: Array, tide: TidePanels, ws: Workspace) -> float:
    """Positive where a RIGID state has yielded and can flow: the smaller of the yield excess and, beyond
    yield, the denominator of the pressure for flow along the deviator of the rigid stress.
    """
    excess, p, norm, det = rigid_excess(t, y, par, tide, ws.work, ws.stress)
    return _onset(excess, p, norm, det, par, ws.stress)


@kernel
def _onset(excess: float, p: float, norm: float, det: float, par: Array, stress: Array) -> float:
    """The onset function from what `rigid_excess` gives."""
    return excess if excess <= 0.0 else min(excess, onset_denominator(p, norm, det, par, stress))


@kernel
def onset_denominator(p: float, norm: float, det: float, par: Array, stress: Array) -> float:
    """``B:((1 - k shat) S^-1)`` for flow whose stress has the deviator of ``stress[6]`` (body axes).

    ``B = 1 - beta shat`` for the radial rule, ``1 - f k shat`` for the true normal.
    """
    if norm == 0.0:
        return 1.0
    k = slope(int(par[SURFACE]), par[SIN_PHI], det)
    beta, _ = dilatancy(np.sqrt(par[S1] * par[S2] * par[S3]), par)
    if par[NORMAL] > 0.0:
        beta *= k
    i1, i2, i3 = 1.0 / par[S1], 1.0 / par[S2], 1.0 / par[S3]
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
def _rigid_values(t: float, y: Array, par: Array, tide: TidePanels, ws: Workspace, which: int) -> float:
    """Onset function (`which` 0) or mobilised friction angle (1) of a RIGID state."""
    if which == _ONSET:
        return yields(t, y, par, tide, ws)
    _, p, norm, det = rigid_excess(t, y, par, tide, ws.work, ws.stress)
    volume = np.sqrt(par[S1] * par[S2] * par[S3])
    return required_friction(int(par[SURFACE]), par[COHESION] * volume, norm, p, det)


@kernel
def _largest(
    a: float, b: float, t: float, h: float, par: Array, tide: TidePanels, ws: Workspace, which: int
) -> tuple[float, float]:
    """Golden-section maximum over the fractions [a, b] of a rigid step: where, and how large."""
    x1 = b - _GOLDEN * (b - a)
    x2 = a + _GOLDEN * (b - a)
    explicit_at(x1, ws.y, N_RIGID, ws.dense, ws.ys)
    f1 = _rigid_values(t + x1 * h, ws.ys, par, tide, ws, which)
    explicit_at(x2, ws.y, N_RIGID, ws.dense, ws.ys)
    f2 = _rigid_values(t + x2 * h, ws.ys, par, tide, ws, which)
    for _ in range(20):  # the place to 1e-4 of the interval, the maximum to its square
        if f1 < f2:
            a = x1
            x1, f1 = x2, f2
            x2 = a + _GOLDEN * (b - a)
            explicit_at(x2, ws.y, N_RIGID, ws.dense, ws.ys)
            f2 = _rigid_values(t + x2 * h, ws.ys, par, tide, ws, which)
        else:
            b = x2
            x2, f2 = x1, f1
            x1 = b - _GOLDEN * (b - a)
            explicit_at(x1, ws.y, N_RIGID, ws.dense, ws.ys)
            f1 = _rigid_values(t + x1 * h, ws.ys, par, tide, ws, which)
    return (x1, f1) if f1 > f2 else (x2, f2)


@kernel
def _vertex_inside(f0: float, f1: float, f2: float) -> bool:
    """Whether the parabola through three equidistant values has its maximum between the outer two."""
    bend = f0 - 2.0 * f1 + f2
    return bend < 0.0 and abs(f2 - f0) <= -2.0 * bend


@kernel
def _summit(
    f: Array, j: int, last: int, t: float, h: float, par: Array, tide: TidePanels, ws: Workspace, which: int
) -> bool:
    """Whether a maximum may lie beside sample `j` of ``f[: last + 1]``.

    Inside the step its neighbours tell, by the parabola. At an end of the step there is one neighbour only, and a
    maximum on the way to it shows in the slope: a point next to the end is higher than the end.
    """
    if 0 < j < last:
        return _vertex_inside(f[j - 1], f[j], f[j + 1])
    if last == 0:
        return False
    inside = j / N_SAMPLE + (_BESIDE if j == 0 else -_BESIDE)
    explicit_at(inside, ws.y, N_RIGID, ws.dense, ws.ys)
    return _rigid_values(t + inside * h, ws.ys, par, tide, ws, which) > f[j]


@kernel
def follow_rigid(
    t: float,
    t1: float,
    par: Array,
    tide: TidePanels,
    ground: Ground,
    tol: float,
    unyielding: bool,
    max_steps: int,
    ws: Workspace,
    hist: Array,
    count: Counts,
) -> tuple[int, float]:
    """Rigid motion of ``ws.y[:7]`` up to yield, the ground or `t1`; returns (reason, time)."""
    y = ws.y
    k = ws.k
    h = min(0.05, t1 - t) if ws.mark[2] <= 0.0 else min(ws.mark[2], t1 - t)
    rate(RIGID, t, y, k[0], par, tide, ws.work)
    excess, p, norm, det = rigid_excess(t, y, par, tide, ws.work, ws.stress)
    surface = int(par[SURFACE])
    cohesion = par[COHESION] * np.sqrt(par[S1] * par[S2] * par[S3])
    record(t, RIGID, y, par, p, norm, det, ws, hist, count)
    # A step never spans more of the change of variable of the tide than its panels resolve, and less of it for a
    # smaller tolerance, as steps of order 8 are smaller: else the run that measures the error would share it.
    reach = min(0.4, 0.225 * (1e8 * tol) ** 0.125)
    if tide.coefficients.shape[0] > 0:
        h = min(h, reach * np.sqrt(t * t + tide.tau * tide.tau))
    touched = False
    f = ws.sample
    f[0, N_SAMPLE] = _onset(excess, p, norm, det, par, ws.stress)
    f[1, N_SAMPLE] = required_friction(surface, cohesion, norm, p, det)
    if f[1, N_SAMPLE] > ws.mark[0]:
        ws.mark[0], ws.mark[1] = f[1, N_SAMPLE], t
    if not unyielding and f[0, N_SAMPLE] > 0.0:
        return ONSET, t
    while t < t1:
        if count[2] >= max_steps:
            return STUCK, t
        last = h >= t1 - t
        if last:
            h = t1 - t
        spin = np.sqrt(y[4] ** 2 + y[5] ** 2 + y[6] ** 2)
        for i in range(7):
            ws.scale[i] = tol if i < 4 else tol * max(spin, 0.1)
        error = explicit_step(RIGID, t, y, N_RIGID, h, par, tide, ws.work, k, ws.scale, ws.y1)
        count[2] += 1
        if not error <= 1.0:
            count[3] += 1
            h *= max(0.2, 0.9 * error ** (-0.125)) if np.isfinite(error) else 0.2
            continue
        explicit_dense(RIGID, t, y, N_RIGID, h, par, tide, ws.work, k, ws.y1, ws.ys, ws.dense)
        if not touched:
            end_time = touches(RIGID, True, t, h, par, ground, ws)
            if end_time < np.inf:  # the step again, up to there
                touched = True
                t1 = end_time
                continue
        f[0, 0], f[1, 0] = f[0, N_SAMPLE], f[1, N_SAMPLE]
        end = 2.0  # fraction at which the body yields
        for j in range(1, N_SAMPLE + 1):
            x = j / N_SAMPLE
            explicit_at(x, y, N_RIGID, ws.dense, ws.ys)
            excess, p, norm, det = rigid_excess(t + x * h, ws.ys, par, tide, ws.work, ws.stress)
            f[0, j] = _onset(excess, p, norm, det, par, ws.stress)
            f[1, j] = required_friction(surface, cohesion, norm, p, det)
            if not unyielding and f[0, j] > 0.0:
                end = x
                break
        n = N_SAMPLE if end > 1.0 else int(np.rint(end * N_SAMPLE)) - 1
        # Extrema between the samples: of the yield function near zero, then of the friction mobilised before.
        if not unyielding and end > 1.0:
            spread = f[0].max() - f[0].min() + 0.02 * norm
            for j in range(N_SAMPLE + 1):
                if (
                    end > 1.0
                    and f[0, j] + spread > 0.0
                    and _summit(f[0], j, N_SAMPLE, t, h, par, tide, ws, _ONSET)
                ):
                    a, b = max(j - 1.0, 0.0) / N_SAMPLE, min(j + 1.0, N_SAMPLE) / N_SAMPLE
                    x, value = _largest(a, b, t, h, par, tide, ws, _ONSET)
                    if value > 0.0:
                        end = x
                        n = int(np.floor(x * N_SAMPLE))
        if hist.shape[0] > 1:
            for j in range(1, n + 1):
                x = j / N_SAMPLE
                explicit_at(x, y, N_RIGID, ws.dense, ws.ys)
                excess, p, norm, det = rigid_excess(t + x * h, ws.ys, par, tide, ws.work, ws.stress)
                record(t + x * h, RIGID, ws.ys, par, p, norm, det, ws, hist, count)
        spread = f[1, : n + 1].max() - f[1, : n + 1].min()
        for j in range(n + 1):
            if (
                f[1, j] < np.inf
                and f[1, j] + spread > ws.mark[0]
                and _summit(f[1], j, n, t, h, par, tide, ws, _FRICTION)
            ):
                a, b = max(j - 1.0, 0.0) / N_SAMPLE, min(j + 1.0, n) / N_SAMPLE
                x, value = _largest(a, b, t, h, par, tide, ws, _FRICTION)
                if value > ws.mark[0]:
                    ws.mark[0], ws.mark[1] = value, t + x * h
        for j in range(1, n + 1):
            if f[1, j] > ws.mark[0]:
                ws.mark[0], ws.mark[1] = f[1, j], t + h * j / N_SAMPLE
        if end <= 1.0:
            low, high = n / N_SAMPLE, end
            for _ in range(60):
                mid = 0.5 * (low + high)
                explicit_at(mid, y, N_RIGID, ws.dense, ws.ys)
                if yields(t + mid * h, ws.ys, par, tide, ws) > 0.0:
                    high = mid
                else:
                    low = mid
                if (high - low) * h < 1e-14 * max(1.0, abs(t)):
                    break
            # Repeat the step up to the root: order 8 instead of the order of the interpolant.
            explicit_step(RIGID, t, y, N_RIGID, high * h, par, tide, ws.work, k, ws.scale, ws.y1)
            t += high * h
            copy(ws.y1, y, N_RIGID)
            _normalise(y)
            ws.mark[2] = h
            excess, p, norm, det = rigid_excess(t, y, par, tide, ws.work, ws.stress)
            value = required_friction(surface, cohesion, norm, p, det)
            if value > ws.mark[0]:
                ws.mark[0], ws.mark[1] = value, t
            record(t, RIGID, y, par, p, norm, det, ws, hist, count)
            return ONSET, t
        t = t1 if last else t + h
        copy(ws.y1, y, N_RIGID)
        _normalise(y)
        k[0] = k[12]
        h *= min(5.0, max(0.3, 0.9 * error ** (-0.125))) if error > 0.0 else 5.0
        h = min(h, reach * np.sqrt(t * t + tide.tau * tide.tau) if tide.coefficients.shape[0] > 0 else h)
    ws.mark[2] = 0.0
    return TOUCH if touched else DONE, t


@kernel
def _normalise(q: Array) -> None:
    s = 1.0 / np.sqrt(q[0] ** 2 + q[1] ** 2 + q[2] ** 2 + q[3] ** 2)
    for i in range(4):
        q[i] *= s
