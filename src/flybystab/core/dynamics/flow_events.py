"""Event functions of plastic flow, and the location of the first event in a step.

The event functions are continuous, and positive while the flow continues. They are sampled on the dense output of a
step; if no sample is negative, minima between the samples are searched. An explicit step with
``min g >= _CLEAR max g > 0`` over its stages, for every event function ``g``, counts as free of events: it is neither
sampled nor given a dense output.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flybystab.core.dynamics.rates import rate
from flybystab.core.dynamics.state import (
    BEYOND_FACE,
    DETERMINANT,
    FLOWING,
    N_FULL,
    PLACE,
    PRESSURE,
    STRENGTH,
    VOLUME,
    W_SCRATCH,
    W_SINV,
    W_VECTORS,
    Parameters,
)
from flybystab.core.dynamics.steppers import explicit_at, implicit_at
from flybystab.core.dynamics.workspace import (
    BEYOND,
    FADE,
    JAM,
    LOSS,
    N_SAMPLE,
    SWITCH,
    Log,
    Workspace,
    keeps_history,
    record,
)
from flybystab.core.ellipsoid.self_gravity import invariant_ratio
from flybystab.core.ellipsoid.tide import TidePanels
from flybystab.core.material.parameters import COMPRESSION_CORNER, FACE, SMOOTH
from flybystab.core.numerics.jit import kernel
from flybystab.core.numerics.tensors import eigensystem
from flybystab.typing import Array

# Rows of `Workspace.ends`: distance from the largest axis ratio, denominator of the pressure, strength, and distance
# from the end of the part of the yield section.
_RATIO, _DENOMINATOR, _STRENGTH, _PART = range(4)

# Columns of `Workspace.stages`.
_LEAST, _LARGEST = range(2)

#: An event function above this fraction of its largest value at all stages of a step counts as having no zero in it.
_CLEAR = 0.5


class Flow(NamedTuple):
    """Parameters of a flow, and the limits at which it ends."""

    par: Parameters
    tide: TidePanels
    limit2: float  # square of the largest axis ratio of the model
    fade_volume: float  # V/V0 at the start of the fade of the dilatancy; infinite if none is ahead


class FlowStep(NamedTuple):
    """A step of flow from ``ws.y`` at `t` over `h`, explicit or implicit."""

    explicit: bool
    t: float
    h: float


@kernel
def axis_ratio2(y: Array, ws: Workspace) -> float:
    """Square of the largest over the least semi-axis."""
    values = ws.work.m[W_SCRATCH, 0]
    eigensystem(y[0:6], values, ws.work.m[W_VECTORS])
    return max(values[0], max(values[1], values[2])) / min(values[0], min(values[1], values[2]))


@kernel
def _event_functions(denominator: float, y: Array, flow: Flow, ws: Workspace) -> None:
    """Write the event functions of a state to ``ws.ends[:, -1]``; `denominator` is that returned by its `rate`."""
    material = flow.par.material
    work, ends = ws.work, ws.ends
    s = work.s
    strength = s[STRENGTH]
    if material.sin_phi == 0.0 and material.cohesion == 0.0:
        strength = s[PRESSURE]
    below = np.inf
    ratio = np.sqrt(flow.limit2)
    if invariant_ratio(y[0:6], work.m[W_SINV]) > (ratio + 1.0 + 1.0 / ratio) ** 2:
        below = flow.limit2 - axis_ratio2(y, ws)
    # Where the denominator is not positive, the sign of the strength has no meaning.
    if not denominator > 0.0:
        strength = np.inf
    inside = np.inf
    if material.part != SMOOTH and denominator > 0.0 and strength > 0.0:
        place, beyond = s[PLACE], s[BEYOND_FACE]
        if material.part == FACE:
            inside = min(place, 1.0 - place)
        else:
            inside = material.fan_limit + (beyond if material.part == COMPRESSION_CORNER else -beyond)
    ends[_RATIO, -1], ends[_DENOMINATOR, -1], ends[_STRENGTH, -1], ends[_PART, -1] = (
        below,
        denominator,
        strength,
        inside,
    )


@kernel
def least_event(t: float, y: Array, dy: Array, flow: Flow, ws: Workspace) -> tuple[float, int]:
    """Least of the event functions of flow, negative past an event, and the code of the event. Writes the rate `dy`.

    The event functions are the strength ``k P + k c`` (the pressure of a frictionless material without cohesion), the
    denominator of the pressure, ``r_max^2 - r^2`` with the axis ratio ``r``, the volume at which the dilatancy begins
    to fade less the volume, and for Mohr-Coulomb the distance from the end of the face or of the fan of the corner at
    which the stress lies.
    """
    denominator = rate(FLOWING, t, y, dy, flow.par, flow.tide, ws.work)
    _event_functions(denominator, y, flow, ws)
    ends = ws.ends
    least, code = ends[_RATIO, -1], BEYOND
    if denominator < least:
        least, code = denominator, JAM
    if ends[_STRENGTH, -1] < least:
        least, code = ends[_STRENGTH, -1], LOSS
    if ends[_PART, -1] < least:
        least, code = ends[_PART, -1], SWITCH
    ahead = flow.fade_volume - ws.work.s[VOLUME]
    if ahead < least:
        least, code = ahead, FADE
    return least, code


@kernel
def begin_stages(ws: Workspace) -> None:
    """Start the range of the event functions over the stages of a step with their values at its start."""
    for i in range(4):
        ws.stages[i, _LEAST] = ws.stages[i, _LARGEST] = ws.ends[i, 0]


@kernel
def add_stage(denominator: float, y: Array, flow: Flow, ws: Workspace) -> None:
    """Extend the range by the state `y` of a stage; `denominator` is that returned by its `rate`."""
    _event_functions(denominator, y, flow, ws)
    for i in range(4):
        value = ws.ends[i, -1]
        # Not min and max: nan has to propagate.
        if not value >= ws.stages[i, _LEAST]:
            ws.stages[i, _LEAST] = value
        if not value <= ws.stages[i, _LARGEST]:
            ws.stages[i, _LARGEST] = value


@kernel
def clear_of_events(flow: Flow, ws: Workspace) -> bool:
    """True if ``min g >= _CLEAR max g > 0`` over the stages of the step just made, for every event function ``g``.

    The event functions at its end, which is its last stage, are then stored as the first sample of the next step.
    """
    for i in range(4):
        least = ws.stages[i, _LEAST]
        if not (least > 0.0 and least >= _CLEAR * ws.stages[i, _LARGEST]):
            return False
    # The volume does not decrease in flow: its value at the end is the largest.
    if not ws.work.s[VOLUME] < flow.fade_volume:
        return False
    sample(-1, 0, ws)
    return True


@kernel
def sample(a: int, b: int, ws: Workspace) -> None:
    """Copy the event functions at a sample `a` to `b`; -1 are those that `least_event` leaves."""
    for i in range(4):
        ws.ends[i, b] = ws.ends[i, a]


@kernel
def interpolate(x: float, step: FlowStep, ws: Workspace) -> None:
    """State ``ws.ys`` at the fraction `x` of a step just made."""
    if step.explicit:
        explicit_at(x, ws.y, N_FULL, ws.dense, ws.ys)
    else:
        implicit_at(x, ws.y, N_FULL, ws.dense, ws.y1, ws.ys)


@kernel
def _least_inside(x: float, step: FlowStep, flow: Flow, ws: Workspace) -> float:
    """Least event function at the fraction `x` of a step."""
    interpolate(x, step, ws)
    least, _ = least_event(step.t + x * step.h, ws.ys, ws.inner_rate, flow, ws)
    return least


@kernel
def _lowest(xa: float, va: float, xb: float, vb: float, xc: float, vc: float) -> tuple[float, float]:
    """Abscissa and value of the minimum of the parabola through three points; inf if it has none between them."""
    first, second = (vb - va) / (xb - xa), (vc - vb) / (xc - xb)
    bend = (second - first) / (xc - xa)
    if not bend > 0.0:
        return np.inf, np.inf
    x = 0.5 * (xa + xb - first / bend)
    if not xa < x < xc:
        return np.inf, np.inf
    return x, va + (x - xa) * (first + bend * (x - xb))


@kernel
def _minimum(step: FlowStep, points: int, flow: Flow, ws: Workspace) -> tuple[float, float, bool]:
    """Search for a point between the samples at which an event function is negative.

    ``ws.ends`` has the samples, none of them negative. Where the minimum of the parabola through three consecutive ones
    is below half of the least of them, or that is below a tenth of the largest, the event functions are evaluated
    there, and the parabola is refined up to four times: a minimum of the pressure can be shorter than a step.

    Returns the fraction of the step (2 if no such point was found), the fraction of the sample before it, and True if
    any point was evaluated.
    """
    evaluated = False
    for i in range(4):
        for j in range(1, points):
            xa, xb, xc = (j - 1.0) / points, float(j) / points, (j + 1.0) / points
            va, vb, vc = ws.ends[i, j - 1], ws.ends[i, j], ws.ends[i, j + 1]
            for _ in range(4):
                x, v = _lowest(xa, va, xb, vb, xc, vc)
                least = min(va, min(vb, vc))
                if not x < np.inf or x == xb or not (v < 0.5 * least or least < 0.1 * max(va, max(vb, vc))):
                    break
                evaluated = True
                if _least_inside(x, step, flow, ws) < 0.0:
                    return x, xa if x < xb else xb, evaluated
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
    return 2.0, 0.0, evaluated


@kernel
def first_event(step: FlowStep, f0: Array, flow: Flow, ws: Workspace) -> tuple[float, int]:
    """Fraction of the step just made at which an event is reached first, 2 if none is, and its code.

    Where there is none, `f0` gets the rate at the end of the step, the stress there is left in ``ws.work``, and the
    event functions in ``ws.ends`` as the first of the next step.
    """
    t, h = step.t, step.h
    found = 2.0
    low = 0.0
    points = 4 if step.explicit else 2
    code = BEYOND
    for j in range(1, points + 1):
        x = j / points
        if j < points:
            least = _least_inside(x, step, flow, ws)
        else:
            least, code = least_event(t + h, ws.y1, f0, flow, ws)
        sample(-1, j, ws)
        if least < 0.0:
            found = x
            break
        low = x
    if found > 1.0:
        found, low, evaluated = _minimum(step, points, flow, ws)
        if found > 1.0:
            if evaluated:
                least_event(t + h, ws.y1, f0, flow, ws)
            sample(points, 0, ws)
            return found, code
    high = found
    for _ in range(52):
        mid = 0.5 * (low + high)
        if _least_inside(mid, step, flow, ws) < 0.0:
            high = mid
        else:
            low = mid
    interpolate(high, step, ws)
    _, code = least_event(t + high * h, ws.ys, ws.inner_rate, flow, ws)
    return high, code


@kernel
def record_flow(t: float, y: Array, par: Parameters, ws: Workspace, log: Log) -> None:
    """Append a state of flow to the history, with the stress that `least_event` has left."""
    s = ws.work.s
    record(t, FLOWING, y, par, s[PRESSURE], s[STRENGTH], s[DETERMINANT], ws, log)


@kernel
def record_end(t: float, y: Array, dy: Array, flow: Flow, ws: Workspace, log: Log) -> None:
    """Append the last state of a flow to the history."""
    if keeps_history(log):
        least_event(t, y, dy, flow, ws)
        record_flow(t, y, flow.par, ws, log)


@kernel
def record_inside(step: FlowStep, dy: Array, flow: Flow, ws: Workspace, log: Log) -> None:
    """Append the quarters of a step to the history."""
    for j in range(1, N_SAMPLE):
        x = j / N_SAMPLE
        interpolate(x, step, ws)
        least_event(step.t + x * step.h, ws.ys, dy, flow, ws)
        record_flow(step.t + x * step.h, ws.ys, flow.par, ws, log)
