"""The ends of a flow: their event functions, and the first of them in a step.

The event functions are continuous, and positive while the flow goes on. A step is sampled on its dense output; where no
sample is negative, a dip between them is looked for.
"""

from __future__ import annotations

import numpy as np

from flybystab.core.dynamics.rates import rate
from flybystab.core.dynamics.state import (
    DETERMINANT,
    FLOWING,
    N_FULL,
    PAST,
    PLACE,
    PRESSURE,
    STRENGTH,
    VOLUME,
    W_SCRATCH,
    W_SINV,
    W_VECTORS,
)
from flybystab.core.dynamics.steppers import explicit_at, implicit_at
from flybystab.core.dynamics.workspace import (
    BEYOND,
    FADE,
    JAM,
    LOSS,
    N_SAMPLE,
    SWITCH,
    Counts,
    Workspace,
    record,
)
from flybystab.core.ellipsoid.self_gravity import spread
from flybystab.core.ellipsoid.tide import TidePanels
from flybystab.core.material.parameters import (
    BESIDE,
    COHESION,
    COMPRESSION_CORNER,
    FACE,
    PART,
    SIN_PHI,
    SMOOTH,
)
from flybystab.core.numerics.jit import kernel
from flybystab.core.numerics.tensors import eigensystem
from flybystab.typing import Array


@kernel
def axis_ratio2(y: Array, ws: Workspace) -> float:
    """Square of the largest over the least semi-axis."""
    values = ws.work.m[W_SCRATCH, 0]
    eigensystem(y[0:6], values, ws.work.m[W_VECTORS])
    return max(values[0], max(values[1], values[2])) / min(values[0], min(values[1], values[2]))


@kernel
def health(
    t: float, y: Array, dy: Array, par: Array, tide: TidePanels, limit2: float, ws: Workspace
) -> float:
    """Least of the event functions of flow; negative once one of them is over. Sets the rate `dy`.

    They are the strength ``k P + k c`` (the pressure of a fluid), the denominator of the pressure, the distance
    from the axis ratio where the model is left, from the volume ``ws.mark[4]`` where the dilatancy begins to fade,
    and on Mohr-Coulomb from the end of the face or of the fan of the corner where the stress is. ``ws.mark[3]`` keeps
    the code of the least.
    """
    denominator = rate(FLOWING, t, y, dy, par, tide, ws.work)
    strength = ws.work.s[STRENGTH]
    if par[SIN_PHI] == 0.0 and par[COHESION] == 0.0:
        strength = ws.work.s[PRESSURE]
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
        place, past = ws.work.s[PLACE], ws.work.s[PAST]
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
    if inside < least:
        least = inside
        ws.mark[3] = SWITCH
    ahead = ws.mark[4] - ws.work.s[VOLUME]
    if ahead < least:
        least = ahead
        ws.mark[3] = FADE
    return least


@kernel
def sample(a: int, b: int, ws: Workspace) -> None:
    """Copy the event functions at a sample `a` to `b`; -1 are those that `health` leaves."""
    for i in range(4):
        ws.ends[i, b] = ws.ends[i, a]


@kernel
def inside(explicit: bool, x: float, y: Array, ws: Workspace) -> None:
    """State ``ws.ys`` at the fraction `x` of a step just made."""
    if explicit:
        explicit_at(x, y, N_FULL, ws.dense, ws.ys)
    else:
        implicit_at(x, y, N_FULL, ws.dense, ws.y1, ws.ys)


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
                inside(explicit, x, y, ws)
                if health(t + x * h, ws.ys, ws.spare[:15], par, tide, limit2, ws) < 0.0:
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
def first_end(
    explicit: bool,
    t: float,
    y: Array,
    h: float,
    f0: Array,
    par: Array,
    tide: TidePanels,
    limit2: float,
    ws: Workspace,
) -> float:
    """Fraction of the step just made at which an end of flow is reached first; 2 if none is.

    ``ws.mark[3]`` gets the code of that end. Where there is none, `f0` gets the rate at the end of the step, the
    stress there is left in ``ws.work``, and the event functions in ``ws.ends`` as the first of the next step.
    """
    spare = ws.spare[:15]
    found = 2.0
    low = 0.0
    points = 4 if explicit else 2
    for j in range(1, points + 1):
        x = j / points
        if j < points:
            inside(explicit, x, y, ws)
            least = health(t + x * h, ws.ys, spare, par, tide, limit2, ws)
        else:
            least = health(t + h, ws.y1, f0, par, tide, limit2, ws)
        sample(-1, j, ws)
        if least < 0.0:
            found = x
            break
        low = x
    if found > 1.0:
        found, low, looked = _dip(explicit, t, y, h, points, par, tide, limit2, ws)
        if found > 1.0:
            if looked:
                health(t + h, ws.y1, f0, par, tide, limit2, ws)
            sample(points, 0, ws)
            return found
    high = found
    for _ in range(52):
        mid = 0.5 * (low + high)
        inside(explicit, mid, y, ws)
        if health(t + mid * h, ws.ys, spare, par, tide, limit2, ws) < 0.0:
            high = mid
        else:
            low = mid
    inside(explicit, high, y, ws)
    health(t + high * h, ws.ys, spare, par, tide, limit2, ws)
    return high


@kernel
def record_flow(t: float, y: Array, par: Array, ws: Workspace, hist: Array, count: Counts) -> None:
    """Append a state of flow to the history, with the stress that `health` has left of it."""
    s = ws.work.s
    record(t, FLOWING, y, par, s[PRESSURE], s[STRENGTH], s[DETERMINANT], ws, hist, count)


@kernel
def record_end(
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
        health(t, y, dy, par, tide, limit2, ws)
        record_flow(t, y, par, ws, hist, count)


@kernel
def record_inside(
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
        inside(explicit, x, y, ws)
        health(t + x * h, ws.ys, dy, par, tide, limit2, ws)
        record_flow(t + x * h, ws.ys, par, ws, hist, count)
