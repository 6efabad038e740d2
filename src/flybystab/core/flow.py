"""Plastic flow up to arrest, loss of contact, jam or the limit of the model."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flybystab.core.flow_rule import dilatancy, dilation, fade, isotropic
from flybystab.core.ground import Ground, touches
from flybystab.core.jacobian import flow_jacobian
from flybystab.core.jit import kernel
from flybystab.core.motion import rate
from flybystab.core.rheology import MOHR_COULOMB, corner, onto_face
from flybystab.core.selfgravity import spread
from flybystab.core.state import (
    BESIDE,
    BETA,
    COHESION,
    COMPRESSION_CORNER,
    EXTENSION_CORNER,
    FACE,
    FLOWING,
    N_FULL,
    NORMAL,
    PART,
    SIN_PHI,
    SMOOTH,
    SURFACE,
    W_N,
    W_SCRATCH,
    W_SINV,
    W_VECTORS,
)
from flybystab.core.steppers import (
    explicit_at,
    explicit_dense,
    explicit_step,
    implicit_at,
    implicit_step,
)
from flybystab.core.tensors import determinant, deviator, eigensystem, pack
from flybystab.core.tide import TidePanels
from flybystab.core.workspace import (
    ARREST,
    BEYOND,
    D_REST,
    DONE,
    JAM,
    LOSS,
    N_SAMPLE,
    STUCK,
    SWITCH,
    TOUCH,
    Counts,
    Workspace,
    copy,
    record,
)

Array = NDArray[np.float64]

#: Lode angle, rad, by which `D` may be past the fan of a corner, and share of a face that counts as its end: the switch
#: is located no better, and it is far below any other error.
_SLACK = 1e-9

#: Longest explicit step, times the rate of relaxation of ``D``: DOP853 is stable to 6 on the axis.
_STABLE = 5.0

#: Longest step towards rest, over the time to it.
_APPROACH = 0.45

#: Implicit steps at least between explicit stretches.
_BETWEEN = 3

#: Time to rest at which flow ends, dynamical times over the tolerance of a step, and the least tolerance that counts:
#: at 1e-9 the body is drawn to rest by its rate, to the square of that.
_BRIEF = 0.1
_TIGHT = 1e-8


@kernel
def axis_ratio2(y: Array, ws: Workspace) -> float:
    """Square of the largest over the least semi-axis."""
    values = ws.work.m[W_SCRATCH, 0]
    eigensystem(y[0:6], values, ws.work.m[W_VECTORS])
    return max(values[0], max(values[1], values[2])) / min(values[0], min(values[1], values[2]))


@kernel
def _health(
    t: float, y: Array, dy: Array, par: Array, tide: TidePanels, limit2: float, ws: Workspace
) -> float:
    """Least of the event functions of flow; negative once one of them is over. Sets the rate `dy`.

    They are the strength ``k P + k c`` (the pressure of a fluid), the denominator of the pressure, the distance
    from the axis ratio where the model is left, from the volume ``ws.mark[4]`` where the dilatancy begins to fade,
    and on Mohr-Coulomb from the end of the face or of the fan of the corner where the stress is. ``ws.mark[3]`` keeps
    the code of the least.
    """
    denominator = rate(FLOWING, t, y, dy, par, tide, ws.work)
    strength = ws.work.m[W_SCRATCH, 1, 1]
    if par[SIN_PHI] == 0.0 and par[COHESION] == 0.0:
        strength = ws.work.m[W_SCRATCH, 1, 2]
    below = np.inf
    ratio = np.sqrt(limit2)
    if spread(y[0:6], ws.work.m[W_SINV]) > (ratio + 1.0 + 1.0 / ratio) ** 2:
        below = limit2 - axis_ratio2(y, ws)
    # Past a vanishing denominator the sign of the strength says nothing.
    if not denominator > 0.0:
        strength = np.inf
    part = int(par[PART])
    inside = np.inf
    if part != SMOOTH and denominator > 0.0 and strength > 0.0:
        place, past = ws.work.m[W_SCRATCH, 2, 1], ws.work.m[W_SCRATCH, 2, 2]
        if part == FACE:
            inside = min(place, 1.0 - place)
        else:
            inside = par[BESIDE] + (past if part == COMPRESSION_CORNER else -past)
    ends = ws.ends
    ends[0, -1], ends[1, -1], ends[2, -1], ends[3, -1] = below, denominator, strength, inside
    least = below
    ws.mark[3] = BEYOND
    if denominator < least:
        least = denominator
        ws.mark[3] = JAM
    if strength < least:
        least = strength
        ws.mark[3] = LOSS
    inside = min(inside, ws.mark[4] - ws.work.m[W_SCRATCH, 1, 0])
    if inside < least:
        least = inside
        ws.mark[3] = SWITCH
    return least


@kernel
def _sample(a: int, b: int, ws: Workspace) -> None:
    """Copy the event functions at a sample `a` to `b`; -1 are those that `_health` leaves."""
    for i in range(4):
        ws.ends[i, b] = ws.ends[i, a]


@kernel
def _record_end(
    t: float,
    y: Array,
    dy: Array,
    par: Array,
    tide: TidePanels,
    limit2: float,
    ws: Workspace,
    hist: Array,
    count: Counts,
) -> None:
    """Append the last state of a flow to the history."""
    if hist.shape[0] > 1:
        _health(t, y, dy, par, tide, limit2, ws)
        p, strength, det = ws.work.m[W_SCRATCH, 1, 2], ws.work.m[W_SCRATCH, 1, 1], ws.work.m[W_SCRATCH, 2, 0]
        record(t, FLOWING, y, par, p, strength, det, ws, hist, count)


@kernel
def _at(explicit: bool, x: float, y: Array, ws: Workspace) -> None:
    """State ``ws.ys`` at the fraction `x` of a step just made."""
    if explicit:
        explicit_at(x, y, N_FULL, ws.dense, ws.ys)
    else:
        implicit_at(x, y, N_FULL, ws.dense, ws.y1, ws.ys)


@kernel
def _record_inside(
    explicit: bool,
    t: float,
    y: Array,
    h: float,
    dy: Array,
    par: Array,
    tide: TidePanels,
    limit2: float,
    ws: Workspace,
    hist: Array,
    count: Counts,
) -> None:
    """Append the quarters of a step to the history."""
    for j in range(1, N_SAMPLE):
        x = j / N_SAMPLE
        _at(explicit, x, y, ws)
        _health(t + x * h, ws.ys, dy, par, tide, limit2, ws)
        p, strength, det = ws.work.m[W_SCRATCH, 1, 2], ws.work.m[W_SCRATCH, 1, 1], ws.work.m[W_SCRATCH, 2, 0]
        record(t + x * h, FLOWING, ws.ys, par, p, strength, det, ws, hist, count)


@kernel
def _lowest(xa: float, va: float, xb: float, vb: float, xc: float, vc: float) -> tuple[float, float]:
    """Lowest point (place, value) of the parabola through three points; infinite if it has none between them."""
    first, second = (vb - va) / (xb - xa), (vc - vb) / (xc - xb)
    bend = (second - first) / (xc - xa)
    if not bend > 0.0:
        return np.inf, np.inf
    x = 0.5 * (xa + xb - first / bend)
    if not xa < x < xc:
        return np.inf, np.inf
    return x, va + (x - xa) * (first + bend * (x - xb))


@kernel
def _dip(
    explicit: bool,
    t: float,
    y: Array,
    h: float,
    points: int,
    par: Array,
    tide: TidePanels,
    limit2: float,
    ws: Workspace,
) -> tuple[float, float, bool]:
    """Where in a step an event function is below zero between two samples of it that are not, and the one before.

    ``ws.ends`` has the samples. Where a parabola through three of them falls towards zero, its lowest point is looked
    at: contact may be lost in a dip of the pressure that is shorter than a step. The place is 2 where there is none;
    the last answer is whether anything was looked at.
    """
    looked = False
    for i in range(4):
        for j in range(1, points):
            xa, xb, xc = (j - 1.0) / points, float(j) / points, (j + 1.0) / points
            va, vb, vc = ws.ends[i, j - 1], ws.ends[i, j], ws.ends[i, j + 1]
            for _ in range(4):
                x, v = _lowest(xa, va, xb, vb, xc, vc)
                least = min(va, min(vb, vc))
                if not x < np.inf or x == xb or not (v < 0.5 * least or least < 0.1 * max(va, max(vb, vc))):
                    break
                looked = True
                _at(explicit, x, y, ws)
                if _health(t + x * h, ws.ys, ws.spare[:15], par, tide, limit2, ws) < 0.0:
                    return x, xa if x < xb else xb, looked
                v = ws.ends[i, -1]
                if v > vb:
                    if x < xb:
                        xa, va = x, v
                    else:
                        xc, vc = x, v
                elif x < xb:
                    xc, vc, xb, vb = xb, vb, x, v
                else:
                    xa, va, xb, vb = xb, vb, x, v
    return 2.0, 0.0, looked


@kernel
def choose_part(t: float, y: Array, par: Array, tide: TidePanels, near: float, ws: Workspace) -> None:
    """Find the part of the yield section for a flow: a face if `D` is normal to one and can stay so, or a corner.

    `D` within the Lode angle `near` of the normal of the face counts as normal to it. A corner then keeps the
    stress while `D` is in its fan, or no further out of it than now and `_SLACK`.
    """
    par[PART] = SMOOTH
    if par[NORMAL] == 0.0 or int(par[SURFACE]) != MOHR_COULOMB:
        return
    par[PART] = FACE
    rate(FLOWING, t, y, ws.spare[:15], par, tide, ws.work)
    place, past = ws.work.m[W_SCRATCH, 2, 1], ws.work.m[W_SCRATCH, 2, 2]
    if abs(past) <= near:
        # A stress at the very end of the face belongs to the corner: it may have just come there along the face, and
        # chosen again the face would end in a step of no length.
        if _SLACK <= place <= 1.0 - _SLACK:
            return
        compression = place > 0.5
    else:
        compression = past > 0.0
    par[PART] = COMPRESSION_CORNER if compression else EXTENSION_CORNER
    par[BESIDE] = _SLACK + max(0.0, -past if compression else past)


@kernel
def _settle(y: Array, par: Array, ws: Workspace) -> None:
    """Make ``D`` exactly normal to the face on which the stress is, ``|D'|`` and the flow rule kept.

    The flow on a face keeps what is not normal as it is, errors of the steps included, and ``|D|`` falls to nothing.
    """
    unit, n = ws.stress, ws.work.m[W_N]
    _, size, det = deviator(y[6:12], unit)
    a, b, det = onto_face(par[SIN_PHI], det)
    isotropic(a, b, unit, n)
    _, _, support, _, _ = corner(par[SIN_PHI], det, False)
    beta, _ = dilatancy(np.sqrt(determinant(y[0:6])), par)
    mean = dilation(beta, size, support, par) / 3.0
    pack(n, y[6:12])
    for i in range(6):
        y[6 + i] = size * y[6 + i] + (mean if i < 3 else 0.0)


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
    if _health(t, y, f0, par, tide, limit2, ws) < 0.0:
        return int(ws.mark[3]), t
    _sample(-1, 0, ws)
    while t < t1:
        # Here f0 and the stress in `ws.work` belong to (t, y).
        p, strength = ws.work.m[W_SCRATCH, 1, 2], ws.work.m[W_SCRATCH, 1, 1]
        _, d, _ = deviator(y[6:12], ws.stress)
        det = ws.work.m[W_SCRATCH, 2, 0]
        record(t, FLOWING, y, par, p, strength, det, ws, hist, count)
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
        if explicit and d < slow:
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
                _health(t, y, f0, par, tide, limit2, ws)
                continue
        found = 2.0
        low = 0.0
        points = 4 if explicit else 2
        for j in range(1, points + 1):
            x = j / points
            if j < points:
                _at(explicit, x, y, ws)
                least = _health(t + x * h, ws.ys, spare, par, tide, limit2, ws)
            else:
                least = _health(t + h, ws.y1, f0, par, tide, limit2, ws)
            _sample(-1, j, ws)
            if least < 0.0:
                found = x
                break
            low = x
        if found > 1.0:
            found, low, looked = _dip(explicit, t, y, h, points, par, tide, limit2, ws)
            if found > 1.0 and (looked or hist.shape[0] > 1):
                if hist.shape[0] > 1:
                    _record_inside(explicit, t, y, h, spare, par, tide, limit2, ws, hist, count)
                _health(t + h, ws.y1, f0, par, tide, limit2, ws)
        if found <= 1.0:
            high = found
            for _ in range(52):
                mid = 0.5 * (low + high)
                _at(explicit, mid, y, ws)
                if _health(t + mid * h, ws.ys, spare, par, tide, limit2, ws) < 0.0:
                    high = mid
                else:
                    low = mid
            _at(explicit, high, y, ws)
            _health(t + high * h, ws.ys, spare, par, tide, limit2, ws)
            reason = int(ws.mark[3])
            # Repeat the step up to the root: the order of the method instead of that of the interpolant.
            h *= high
            _step(explicit, t, y, h, par, tide, ws)
            if reason == SWITCH and hist.shape[0] > 1:
                if explicit:
                    explicit_dense(FLOWING, t, y, N_FULL, h, par, tide, ws.work, ws.k, ws.y1, ws.ys, ws.dense)
                _record_inside(explicit, t, y, h, spare, par, tide, limit2, ws, hist, count)
            copy(ws.y1, y, N_FULL)
            t += h
            if reason != SWITCH:
                _record_end(t, y, f0, par, tide, limit2, ws, hist, count)
                return reason, t
            if ws.mark[4] - np.sqrt(determinant(y[0:6])) < 1e-6:
                ws.mark[4] = np.inf
                h /= high
            else:
                choose_part(t, y, par, tide, near, ws)
                h = max(h, 1e-4)
                explicit, implicit_ahead = False, _BETWEEN
            if _health(t, y, f0, par, tide, limit2, ws) < 0.0:
                return int(ws.mark[3]), t
            _sample(-1, 0, ws)
            continue
        t = t1 if last else t + h
        copy(ws.y1, y, N_FULL)
        if int(par[PART]) == FACE and abs(ws.work.m[W_SCRATCH, 2, 2]) > _SLACK:
            _settle(y, par, ws)
            _health(t, y, f0, par, tide, limit2, ws)
        _sample(points, 0, ws)
        _, d, _ = deviator(y[6:12], ws.stress)
        if d < D_REST:
            _record_end(t, y, f0, par, tide, limit2, ws, hist, count)
            return ARREST, t
        h *= min(growth, max(0.2, 0.9 * error ** (-0.125 if explicit else -0.2))) if error > 0.0 else growth
    _record_end(t, y, f0, par, tide, limit2, ws, hist, count)
    return TOUCH if touched else DONE, t
