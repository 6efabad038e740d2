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

Every end is a root on the dense output, and the step is then repeated up to the root. `D_REST`, the rate of
strain at which flow starts and ends, is 1e-10 of the dynamical rate: its share of any result is of that size.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flybystab.core.contact import contact_impulse
from flybystab.core.jit import kernel
from flybystab.core.motion import (
    BETA,
    COHESION,
    DISPERSED,
    FLOWING,
    FLUID,
    N_FULL,
    N_RIGID,
    N_WORK,
    RIGID,
    S1,
    S2,
    S3,
    SIN_PHI,
    SURFACE,
    W_SCRATCH,
    Buffers,
    angular_momentum,
    invariants,
    rate,
    rigid_excess,
    rotation_matrix,
    set_rigid_shape,
)
from flybystab.core.rheology import required_friction, slope
from flybystab.core.steppers import (
    N_STAGES,
    explicit_at,
    explicit_dense,
    explicit_step,
    flow_jacobian,
    implicit_at,
    implicit_step,
)
from flybystab.core.tensors import determinant, eigensystem
from flybystab.core.tide import TidePanels

Array = NDArray[np.float64]

#: Rate of strain, in dynamical units, below which the body is at rest.
D_REST = 1e-10

# Why a regime (or the run) ended; the same codes head the rows of the event log.
DONE = np.int64(0)
ONSET = np.int64(1)
ARREST = np.int64(2)
LOSS = np.int64(3)
CONTACT = np.int64(4)
BEYOND = np.int64(5)
JAM = np.int64(6)
STUCK = np.int64(7)  # more steps or switches than allowed

#: Columns of the history: time, regime, S (6), D (6), w (3), pressure, deviator norm, unit determinant.
N_HISTORY = 20
#: Columns of the event log: code, time, Lode determinant, volume.
N_EVENT = 4
#: Samples in each step: history rows, and the grid on which extrema of the yield function are looked for.
N_SAMPLE = 4

# What the functions `_rigid_values` and `_flow_ends` return.
_ONSET = np.int64(0)
_FRICTION = np.int64(1)
_STRENGTH = np.int64(0)
_DENOMINATOR = np.int64(1)
_RATIO = np.int64(2)

_GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)


class Workspace(NamedTuple):
    """Buffers of a run, allocated once."""

    work: Buffers
    k: Array
    jac: Array
    ft: Array
    lu: Array
    pivots: NDArray[np.int64]
    dense: Array
    y: Array
    y1: Array
    ys: Array
    scale: Array
    stress: Array
    sample: Array
    mark: Array  # largest mobilised friction, its time; step size; |D| peak


@kernel
def copy(a: Array, b: Array, n: int) -> None:
    """``b[:n] = a[:n]``."""
    for i in range(n):
        b[i] = a[i]


@kernel
def workspace() -> Workspace:
    """Fresh buffers."""
    return Workspace(
        Buffers(np.zeros((N_WORK, 3, 3)), np.zeros((3, 6))),
        np.zeros((N_STAGES, 15)),
        np.zeros((15, 15)),
        np.zeros(15),
        np.zeros((15, 15)),
        np.zeros(15, dtype=np.int64),
        np.zeros((7, 15)),
        np.zeros(15),
        np.zeros(15),
        np.zeros(15),
        np.ones(15),
        np.zeros(6),
        np.zeros((2, N_SAMPLE + 1)),
        np.zeros(4),
    )


@kernel
def record(
    t: float,
    regime: int,
    y: Array,
    par: Array,
    p: float,
    s: float,
    det: float,
    ws: Workspace,
    hist: Array,
    count: Array,
) -> None:
    """Append a row to the history; when it is full every second row is dropped first."""
    if hist.shape[0] < 2:
        return
    n = count[0]
    if n == hist.shape[0]:
        m = n // 2
        for i in range(m):
            for j in range(N_HISTORY):
                hist[i, j] = hist[2 * i, j]
        n = m
    row = hist[n]
    row[0] = t
    row[1] = regime
    if regime == RIGID:
        m = ws.work.m[W_SCRATCH]
        rotation_matrix(y, m)
        s1, s2, s3 = par[S1], par[S2], par[S3]
        c = 2
        for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)):
            row[c] = s1 * m[i, 0] * m[j, 0] + s2 * m[i, 1] * m[j, 1] + s3 * m[i, 2] * m[j, 2]
            c += 1
        for i in range(6):
            row[8 + i] = 0.0
        for i in range(3):
            row[14 + i] = m[i, 0] * y[4] + m[i, 1] * y[5] + m[i, 2] * y[6]
    else:
        for i in range(15):
            row[2 + i] = y[i]
    row[17] = p
    row[18] = s
    row[19] = det
    count[0] = n + 1


@kernel
def log(code: int, t: float, det: float, volume: float, events: Array, count: Array) -> None:
    """Append a row to the event log; a full log keeps its first rows and counts on."""
    if count[1] < events.shape[0]:
        row = events[count[1]]
        row[0], row[1], row[2], row[3] = code, t, det, volume
    count[1] += 1


@kernel
def yields(t: float, y: Array, par: Array, tide: TidePanels, ws: Workspace) -> float:
    """Positive where a RIGID state has yielded and can flow: the smaller of the yield excess and, beyond
    yield, the denominator of the pressure for flow along the deviator of the rigid stress.
    """
    excess, p, norm, det = rigid_excess(t, y, par, tide, ws.work, ws.stress)
    if excess <= 0.0:
        return excess
    return min(excess, onset_denominator(p, norm, det, par, ws.stress))


@kernel
def onset_denominator(p: float, norm: float, det: float, par: Array, stress: Array) -> float:
    """``B:((1 - k Dhat) S^-1)`` for ``Dhat`` along the deviator of ``stress[6]`` (body axes)."""
    if norm == 0.0:
        return 1.0
    k = slope(int(par[SURFACE]), par[SIN_PHI], det)
    beta = par[BETA]
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
    for _ in range(36):
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
def follow_rigid(
    t: float,
    t1: float,
    par: Array,
    tide: TidePanels,
    tol: float,
    unyielding: bool,
    max_steps: int,
    ws: Workspace,
    hist: Array,
    count: Array,
) -> tuple[int, float]:
    """Rigid motion of ``ws.y[:7]`` up to yield or `t1`; returns (reason, time)."""
    y = ws.y
    k = ws.k
    h = min(0.05, t1 - t) if ws.mark[2] <= 0.0 else min(ws.mark[2], t1 - t)
    rate(RIGID, t, y, k[0], par, tide, ws.work)
    excess, p, norm, det = rigid_excess(t, y, par, tide, ws.work, ws.stress)
    code = int(par[SURFACE])
    cohesion = par[COHESION] * np.sqrt(par[S1] * par[S2] * par[S3])
    record(t, RIGID, y, par, p, norm, det, ws, hist, count)
    f = ws.sample
    f[0, N_SAMPLE] = yields(t, y, par, tide, ws)
    f[1, N_SAMPLE] = required_friction(code, cohesion, norm, p, det)
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
        f[0, 0], f[1, 0] = f[0, N_SAMPLE], f[1, N_SAMPLE]
        end = 2.0  # fraction at which the body yields
        for j in range(1, N_SAMPLE + 1):
            x = j / N_SAMPLE
            explicit_at(x, y, N_RIGID, ws.dense, ws.ys)
            excess, p, norm, det = rigid_excess(t + x * h, ws.ys, par, tide, ws.work, ws.stress)
            f[0, j] = (
                excess if excess <= 0.0 else min(excess, onset_denominator(p, norm, det, par, ws.stress))
            )
            f[1, j] = required_friction(code, cohesion, norm, p, det)
            if not unyielding and f[0, j] > 0.0:
                end = x
                break
            record(t + x * h, RIGID, ws.ys, par, p, norm, det, ws, hist, count)
        n = N_SAMPLE if end > 1.0 else int(np.rint(end * N_SAMPLE)) - 1
        # Extrema between the samples: of the mobilised friction, and of the yield function near zero.
        for j in range(1, n):
            a, b = (j - 1.0) / N_SAMPLE, (j + 1.0) / N_SAMPLE
            if (
                f[1, j] < np.inf
                and _vertex_inside(f[1, j - 1], f[1, j], f[1, j + 1])
                and f[1, j] + abs(f[1, j + 1] - f[1, j - 1]) > ws.mark[0]
            ):
                x, value = _largest(a, b, t, h, par, tide, ws, _FRICTION)
                if value > ws.mark[0]:
                    ws.mark[0], ws.mark[1] = value, t + x * h
            if (
                not unyielding
                and end > 1.0
                and _vertex_inside(f[0, j - 1], f[0, j], f[0, j + 1])
                and f[0, j] + abs(f[0, j + 1] - f[0, j - 1]) + 0.02 * norm > 0.0
            ):
                x, value = _largest(a, b, t, h, par, tide, ws, _ONSET)
                if value > 0.0:
                    end = x
                    n = j - 1
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
            explicit_at(high, y, N_RIGID, ws.dense, ws.ys)
            # Repeat the step up to the root: order 8 instead of the order of the interpolant.
            explicit_step(RIGID, t, y, N_RIGID, high * h, par, tide, ws.work, k, ws.scale, ws.y1)
            t += high * h
            copy(ws.y1, y, N_RIGID)
            _normalise(y)
            ws.mark[2] = h
            value = _rigid_values(t, y, par, tide, ws, _FRICTION)
            if value > ws.mark[0]:
                ws.mark[0], ws.mark[1] = value, t
            return ONSET, t
        t = t1 if last else t + h
        copy(ws.y1, y, N_RIGID)
        _normalise(y)
        k[0] = k[12]
        h *= min(5.0, max(0.3, 0.9 * error ** (-0.125))) if error > 0.0 else 5.0
        # A step never spans more of the change of variable of the tide than its panels resolve.
        h = min(h, 0.4 * np.sqrt(t * t + tide.tau * tide.tau) if tide.coefficients.shape[0] > 0 else h)
    ws.mark[2] = 0.0
    return DONE, t


@kernel
def _normalise(q: Array) -> None:
    s = 1.0 / np.sqrt(q[0] ** 2 + q[1] ** 2 + q[2] ** 2 + q[3] ** 2)
    for i in range(4):
        q[i] *= s


@kernel
def strain_rate(y: Array) -> float:
    """``|D'|`` of a 15-number state."""
    m = (y[6] + y[7] + y[8]) / 3.0
    return np.sqrt(
        (y[6] - m) ** 2 + (y[7] - m) ** 2 + (y[8] - m) ** 2 + 2.0 * (y[9] ** 2 + y[10] ** 2 + y[11] ** 2)
    )


@kernel
def _axis_ratio2(y: Array, ws: Workspace) -> float:
    """Square of the largest over the least semi-axis."""
    values = ws.work.m[W_SCRATCH, 0]
    eigensystem(y[0:6], values, ws.work.m[W_SCRATCH + 1])
    return max(values[0], max(values[1], values[2])) / min(values[0], min(values[1], values[2]))


@kernel
def _flow_ends(
    which: int, t: float, y: Array, par: Array, tide: TidePanels, ws: Workspace, limit2: float
) -> float:
    """Event functions of flow, negative once over: 0 strength, 1 denominator, 2 axis ratio."""
    if which == _RATIO:
        return limit2 - _axis_ratio2(y, ws)
    denominator = rate(FLOWING, t, y, ws.k[9], par, tide, ws.work)
    if which == _DENOMINATOR:
        return denominator
    strength = ws.work.m[W_SCRATCH, 1, 1]
    if par[SIN_PHI] == 0.0 and par[COHESION] == 0.0:
        strength = ws.work.m[W_SCRATCH, 1, 2]  # a fluid parts where its pressure vanishes
    return strength


@kernel
def follow_flow(
    t: float,
    t1: float,
    par: Array,
    tide: TidePanels,
    tol: float,
    limit: float,
    max_steps: int,
    ws: Workspace,
    hist: Array,
    count: Array,
) -> tuple[int, float]:
    """Plastic flow of ``ws.y`` up to one of its ends or `t1`; returns (reason, time)."""
    y = ws.y
    f0 = ws.k[8]
    h = 1e-4
    limit2 = limit * limit
    denominator = rate(FLOWING, t, y, f0, par, tide, ws.work)
    if denominator <= 0.0:
        return JAM, t
    if _flow_ends(_STRENGTH, t, y, par, tide, ws, limit2) < 0.0:
        return LOSS, t
    while t < t1:
        denominator = rate(FLOWING, t, y, f0, par, tide, ws.work)
        p = ws.work.m[W_SCRATCH, 1, 2]
        strength = ws.work.m[W_SCRATCH, 1, 1]
        _, _, det = invariants(y[6:12], ws.stress)
        if hist.shape[0] > 1:
            record(t, FLOWING, y, par, p, strength, det, ws, hist, count)
        flow_jacobian(t, y, f0, 1e-6, par, tide, ws.work, ws.jac, ws.ft, ws.ys)
        d = strain_rate(y)
        # d|D'|/dt = Dhat : Ddot
        trend = 0.0
        for i in range(3):
            trend += ws.stress[i] * f0[6 + i] + 2.0 * ws.stress[3 + i] * f0[9 + i]
        if trend < 0.0:
            # |D| falls linearly to arrest while the rate of relaxation grows as 1/|D|: approach it geometrically.
            h = min(h, 0.8 * d / -trend)
        for i in range(6):
            ws.scale[i] = tol
            ws.scale[6 + i] = tol * max(d, 1e-4)
        for i in range(12, 15):
            ws.scale[i] = tol
        while True:
            if count[2] >= max_steps:
                return STUCK, t
            last = h >= t1 - t
            if last:
                h = t1 - t
            error = implicit_step(
                t, y, h, par, tide, ws.work, ws.jac, ws.ft, ws.lu, ws.pivots, ws.k, ws.scale, ws.y1, ws.dense
            )
            count[2] += 1
            if error <= 1.0:
                break
            count[3] += 1
            h *= max(0.1, 0.9 * error ** (-0.2)) if np.isfinite(error) else 0.1
            if h < 1e-15 * max(1.0, abs(t)):
                return (JAM, t) if denominator < 1e-3 else (STUCK, t)
        reason = DONE
        x_end = 1.0
        for which in range(3):
            found = 2.0
            low = 0.0
            for j in range(1, N_SAMPLE + 1):
                x = j / N_SAMPLE
                if which == _RATIO and j < N_SAMPLE:
                    continue
                implicit_at(x, y, N_FULL, ws.dense, ws.y1, ws.ys)
                if _flow_ends(which, t + x * h, ws.ys, par, tide, ws, limit2) < 0.0:
                    found = x
                    break
                low = x
            if found <= x_end:
                high = found
                for _ in range(50):
                    mid = 0.5 * (low + high)
                    implicit_at(mid, y, N_FULL, ws.dense, ws.y1, ws.ys)
                    if _flow_ends(which, t + mid * h, ws.ys, par, tide, ws, limit2) < 0.0:
                        high = mid
                    else:
                        low = mid
                if reason == DONE or high < x_end:
                    x_end = high
                    reason = LOSS if which == _STRENGTH else (JAM if which == _DENOMINATOR else BEYOND)
        if reason != DONE:
            # Repeat the step up to the root: the order of the method instead of that of the interpolant.
            last = False
            h *= x_end
            implicit_step(
                t, y, h, par, tide, ws.work, ws.jac, ws.ft, ws.lu, ws.pivots, ws.k, ws.scale, ws.y1, ws.dense
            )
        elif hist.shape[0] > 1:
            for j in range(1, N_SAMPLE):
                x = j / N_SAMPLE
                implicit_at(x, y, N_FULL, ws.dense, ws.y1, ws.ys)
                rate(FLOWING, t + x * h, ws.ys, ws.k[9], par, tide, ws.work)
                p = ws.work.m[W_SCRATCH, 1, 2]
                strength = ws.work.m[W_SCRATCH, 1, 1]
                _, _, det = invariants(ws.ys[6:12], ws.stress)
                record(t + x * h, FLOWING, ws.ys, par, p, strength, det, ws, hist, count)
        t = t1 if last else t + h
        copy(ws.y1, y, N_FULL)
        if reason != DONE:
            return reason, t
        if strain_rate(y) < D_REST:
            return ARREST, t
        h *= min(6.0, max(0.2, 0.9 * error ** (-0.2))) if error > 0.0 else 6.0
    return DONE, t


@kernel
def follow_free(
    regime: int,
    t: float,
    t1: float,
    par: Array,
    tide: TidePanels,
    tol: float,
    limit: float,
    max_steps: int,
    ws: Workspace,
    hist: Array,
    count: Array,
) -> tuple[int, float]:
    """Dispersed or fluid motion of ``ws.y`` up to contact, the axis ratio `limit` or `t1`; (reason, time)."""
    y = ws.y
    k = ws.k
    h = 1e-2
    lost = determinant(y[0:6])
    rate(regime, t, y, k[0], par, tide, ws.work)
    while t < t1:
        if hist.shape[0] > 1:
            record(
                t,
                regime,
                y,
                par,
                ws.work.m[W_SCRATCH, 1, 2] if regime == FLUID else 0.0,
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
        found = 2.0
        low = 0.0
        reason = DONE
        for j in range(1, 2 * N_SAMPLE + 1):
            x = 0.5 * j / N_SAMPLE
            explicit_at(x, y, N_FULL, ws.dense, ws.ys)
            if _axis_ratio2(ws.ys, ws) > limit * limit:
                found, reason = x, BEYOND
                break
            if regime == DISPERSED and determinant(ws.ys[0:6]) < lost:
                found, reason = x, CONTACT
                break
            low = x
        if found <= 1.0:
            high = found
            for _ in range(55):
                mid = 0.5 * (low + high)
                explicit_at(mid, y, N_FULL, ws.dense, ws.ys)
                if (reason == BEYOND and _axis_ratio2(ws.ys, ws) > limit * limit) or (
                    reason == CONTACT and determinant(ws.ys[0:6]) < lost
                ):
                    high = mid
                else:
                    low = mid
            explicit_step(regime, t, y, N_FULL, high * h, par, tide, ws.work, k, ws.scale, ws.y1)
            copy(ws.y1, y, N_FULL)
            return reason, t + high * h
        t = t1 if last else t + h
        copy(ws.y1, y, N_FULL)
        k[0] = k[12]
        h *= min(5.0, max(0.3, 0.9 * error ** (-0.125))) if error > 0.0 else 5.0
        if tide.coefficients.shape[0] > 0:
            h = min(h, 0.4 * np.sqrt(t * t + tide.tau * tide.tau))
    return DONE, t


@kernel
def loosen(y: Array, par: Array, ws: Workspace, det: float) -> None:
    """Turn the RIGID state ``y[:7]`` into one that flows at `D_REST` along the deviator ``ws.stress`` (body axes)."""
    m = ws.work.m[0]
    rotation_matrix(y, m)
    p, _, _ = invariants(ws.stress, ws.ys[:6])
    s = (par[S1], par[S2], par[S3])
    w0 = m[0, 0] * y[4] + m[0, 1] * y[5] + m[0, 2] * y[6]
    w1 = m[1, 0] * y[4] + m[1, 1] * y[5] + m[1, 2] * y[6]
    w2 = m[2, 0] * y[4] + m[2, 1] * y[5] + m[2, 2] * y[6]
    u = ws.ys
    beta = par[BETA]
    out = ws.y1
    c = 0
    for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)):
        total = 0.0
        flow = 0.0
        for a in range(3):
            total += m[i, a] * m[j, a] * s[a]
            flow += m[i, a] * m[j, a] * u[a]
        flow += (m[i, 0] * m[j, 1] + m[i, 1] * m[j, 0]) * u[3]
        flow += (m[i, 0] * m[j, 2] + m[i, 2] * m[j, 0]) * u[4]
        flow += (m[i, 1] * m[j, 2] + m[i, 2] * m[j, 1]) * u[5]
        out[c] = total
        out[6 + c] = 2.0 * D_REST * (flow + (beta / 3.0 if i == j else 0.0))
        c += 1
    out[12], out[13], out[14] = w0, w1, w2
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
    tol: float,
    limit: float,
    brittle: bool,
    unyielding: bool,
    max_steps: int,
    hist: Array,
    events: Array,
    count: Array,
    mark: Array,
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
    par : ndarray (13,)
        Parameters, see :mod:`flybystab.core.motion`; cohesion and rigid shape are updated.
    tol : float
        Relative error allowed in a step.
    limit : float
        Axis ratio beyond which the model is left.
    brittle, unyielding : bool
        Cohesion is lost at first yield; the body never yields (for the friction that it would need).
    hist, events : ndarray (n, 20), (m, 4)
        History (one row or less: none is kept) and event log.
    count : ndarray of int (4,)
        Rows of history, events, steps, rejected steps.
    mark : ndarray (2,)
        Largest mobilised friction angle while rigid, rad, and its time.

    Returns
    -------
    reason, time, regime
        DONE, BEYOND or STUCK; the time reached; the regime there.
    """
    ws = workspace()
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
                t, min(t1, t_rest), par, tide, tol, unyielding, max_steps, ws, hist, count
            )
            if reason != ONSET:
                break
            if brittle:
                par[COHESION] = 0.0
            _, p, norm, det = rigid_excess(t, ws.y, par, tide, ws.work, ws.stress)
            log(ONSET, t, det, np.sqrt(par[S1] * par[S2] * par[S3]), events, count)
            loosen(ws.y, par, ws, det)
            regime = FLOWING
        elif regime == FLOWING:
            reason, t = follow_flow(t, t1, par, tide, tol, limit, max_steps, ws, hist, count)
            volume = np.sqrt(determinant(ws.y[0:6]))
            if reason == ARREST or reason == JAM:
                _, _, det = invariants(ws.y[6:12], ws.stress)
                stiffen(ws.y, par, ws)
                log(reason, t, det, volume, events, count)
                regime = RIGID
            elif reason == LOSS:
                log(LOSS, t, 0.0, volume, events, count)
                regime = DISPERSED
            else:
                break
        else:
            reason, t = follow_free(regime, t, t1, par, tide, tol, limit, max_steps, ws, hist, count)
            if reason != CONTACT:
                break
            log(CONTACT, t, 0.0, np.sqrt(determinant(ws.y[0:6])), events, count)
            if contact_impulse(ws.y, par, ws.work):
                regime = FLOWING
            else:
                stiffen(ws.y, par, ws)
                regime = RIGID
        if t >= t1:
            reason = DONE
            break
    if regime == RIGID:
        rigid_excess(t, ws.y, par, tide, ws.work, ws.stress)
        loosen(ws.y, par, ws, det)
        for i in range(6, 12):
            ws.y[i] = 0.0
    copy(ws.y, y, N_FULL)
    mark[0], mark[1] = ws.mark[0], ws.mark[1]
    return reason, t, regime
