"""Plastic flow up to arrest, loss of contact, jam or the limit of the model (docs/theory.md, section 3)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flybystab.core.dynamics.flow_events import (
    Flow,
    FlowStep,
    add_stage,
    begin_stages,
    clear_of_events,
    first_event,
    least_event,
    record_end,
    record_flow,
    record_inside,
    sample,
)
from flybystab.core.dynamics.ground import Ground, Step, contact_time, may_touch
from flybystab.core.dynamics.jacobian import flow_jacobian
from flybystab.core.dynamics.rates import rate
from flybystab.core.dynamics.state import BEYOND_FACE, FLOWING, N_FULL, PLACE, W_N, Parameters
from flybystab.core.dynamics.steppers import explicit_dense, implicit_step
from flybystab.core.dynamics.workspace import (
    ARREST,
    BEYOND,
    D_REST,
    DONE,
    FADE,
    STUCK,
    SWITCH,
    TOUCH,
    Limits,
    Log,
    Workspace,
    copy,
    count_rejected,
    count_step,
    drop_last_row,
    exhausted,
    keeps_history,
)
from flybystab.core.ellipsoid.tide import TidePanels
from flybystab.core.material.flow_rule import fade_start
from flybystab.core.material.mohr_coulomb_hexagon import on_hexagon, part_of_flow, restore_flow_rule
from flybystab.core.material.parameters import FACE, SMOOTH, on_part
from flybystab.core.numerics.dop853 import N_STAGES, NODE, error_norm, error_sums, stage_state
from flybystab.core.numerics.jit import inlined, kernel
from flybystab.core.numerics.tensors import determinant, deviator
from flybystab.typing import Array

#: Explicit steps obey ``h r <= _STABLE``, ``r`` the relaxation rate of ``D``; DOP853 is stable on the negative real
#: axis up to ``h r = 6``.
_STABLE = 5.0

#: Explicit steps are given up where the step ``h`` that the error alone would allow has ``h r > _IMPLICIT_BETTER``.
_IMPLICIT_BETTER = 4.0 * _STABLE

#: Largest step while ``|D|`` falls, over the predicted time to rest ``-|D|/(d|D|/dt)``.
_APPROACH = 0.45

#: Least number of implicit steps after a change from explicit to implicit ones.
_MIN_IMPLICIT_STEPS = 3

#: Flow ends where ``-|D|/(d|D|/dt) < _REST_TIME max(tolerance, _MIN_REST_TOLERANCE)``, in dynamical times, that is at
#: 1e-9 for the default tolerance. The state is then extrapolated linearly to rest, with an error of the order of the
#: square of this time.
_REST_TIME = 0.1
_MIN_REST_TOLERANCE = 1e-8


class Method(NamedTuple):
    """Method of the next step, and the quantities on which the choice between explicit and implicit steps depends.

    The direction of ``D`` relaxes at a rate ``r`` proportional to ``1/|D|``. Near onset and rest the equations are
    stiff and the steps implicit; where ``h r`` is below the limit of stability of the explicit method of order 8 for
    the step ``h`` that the error allows, they are explicit.
    """

    explicit: bool
    stiffness: float  # r |D|, from the last Jacobian
    explicit_floor: float  # |D| below which explicit steps end
    implicit_ahead: int  # implicit steps still to be taken before an explicit one is allowed


@kernel
def _choose_part(
    t: float, angle_tolerance: float, par: Parameters, tide: TidePanels, ws: Workspace
) -> Parameters:
    """Parameters with the part of the yield section (face or corner) on which the stress of the flow ``ws.y`` lies.

    The stress lies on a face if the Lode angle of ``D`` is within `angle_tolerance` (rad) of that of the normal of the
    face, and a stress between the two corners keeps it there; otherwise at a corner.
    """
    if not on_hexagon(par.material):
        return Parameters(on_part(par.material, SMOOTH, par.material.fan_limit), par.rigid)
    par = Parameters(on_part(par.material, FACE, par.material.fan_limit), par.rigid)
    rate(FLOWING, t, ws.y, ws.inner_rate, par, tide, ws.work)
    s = ws.work.s
    return Parameters(part_of_flow(s[BEYOND_FACE], s[PLACE], angle_tolerance, par.material), par.rigid)


@kernel
def _begin_flow(
    t: float, angle_tolerance: float, par: Parameters, tide: TidePanels, limits: Limits, ws: Workspace
) -> Flow:
    """Parameters of the flow that starts in the state ``ws.y``; `angle_tolerance` (rad) as in `_choose_part`."""
    par = _choose_part(t, angle_tolerance, par, tide, ws)
    # The second derivative of beta(V) jumps where the fade begins (`fade_share`), so that a step has to end there. The
    # volume does not decrease in plastic flow (tr D >= 0): it reaches this value at most once.
    fading = fade_start(par.material)
    if not (par.material.beta > 0.0 and np.sqrt(determinant(ws.y[0:6])) < fading):
        fading = np.inf
    return Flow(par, tide, limits.axis_ratio * limits.axis_ratio, fading)


@kernel
def _explicit_step(t: float, h: float, flow: Flow, ws: Workspace) -> float:
    """`explicit_step` of flow; writes the range of the event functions over its stages into ``ws.stages``."""
    begin_stages(ws)
    y1, k = ws.y1, ws.k
    for s in range(1, N_STAGES + 1):
        stage_state(s, ws.y, N_FULL, h, k, y1)
        denominator = rate(FLOWING, t + NODE[s] * h, y1, k[s], flow.par, flow.tide, ws.work)
        add_stage(denominator, y1, flow, ws)
    five, three = error_sums(N_FULL, k, ws.scale)
    if not np.isfinite(five + three):
        return np.inf
    return error_norm(five, three, N_FULL, h)


@inlined
def _step(explicit: bool, t: float, h: float, flow: Flow, ws: Workspace) -> float:
    """One step of flow from ``ws.y`` to ``ws.y1``; an explicit one has its first rate in ``ws.k[0]``."""
    return _explicit_step(t, h, flow, ws) if explicit else implicit_step(t, h, flow.par, flow.tide, ws)


@kernel
def _stiffness(jac: Array, v: Array) -> float:
    """Relaxation rate of ``D``: spectral radius of ``d(Ddot)/dD``, by power iteration; ``v[12]`` is scratch."""
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


@inlined
def _choose_method(
    method: Method, t: float, h: float, d: float, f0: Array, flow: Flow, ws: Workspace
) -> Method:
    """Method of the next step, for a trial length `h` and ``|D|`` = `d`; writes ``ws.jac`` if it is implicit."""
    explicit, stiffness, explicit_floor, ahead = (
        method.explicit,
        method.stiffness,
        method.explicit_floor,
        method.implicit_ahead,
    )
    if explicit and (d < explicit_floor or h * stiffness > _IMPLICIT_BETTER * d):
        explicit, ahead = False, _MIN_IMPLICIT_STEPS
    if not explicit:
        flow_jacobian(t, ws.y, f0, 1e-6, flow.par.material, flow.tide, ws.work, ws.jac, ws.lu)
        stiffness = d * _stiffness(ws.jac, ws.inner_rate)
        ahead -= 1
        if ahead < 0 and 1.5 * h * stiffness < _STABLE * d:
            explicit, explicit_floor = True, 0.5 * d
    return Method(explicit, stiffness, explicit_floor, ahead)


@kernel
def _step_length(method: Method, h: float, d: float, trend: float) -> float:
    """`h`, shortened for stability and near rest; `d` and `trend` are ``|D|`` and its derivative in time."""
    if method.explicit:
        h = min(h, _STABLE * d / method.stiffness)
    if trend < 0.0:
        # |D| falls linearly to zero while the relaxation rate grows as 1/|D|: steps in proportion to the time to rest.
        h = min(h, _APPROACH * d / -trend)
    return h


@inlined
def _accepted_step(
    explicit: bool, t: float, t1: float, h: float, flow: Flow, limits: Limits, ws: Workspace, log: Log
) -> tuple[FlowStep, float, float]:
    """Make a step of at most `h`, not beyond `t1`, shortened until its error norm is at most 1.

    Returns the step, its error norm (nan if no step succeeded), and the largest allowed ratio of the next step to it.
    """
    growth = 6.0
    while True:
        if exhausted(log, limits):
            return FlowStep(explicit, t, h), np.nan, growth
        if h >= t1 - t:
            h = t1 - t
        error = _step(explicit, t, h, flow, ws)
        count_step(log)
        if error <= 1.0:
            return FlowStep(explicit, t, h), error, growth
        count_rejected(log)
        # Near onset the error falls more slowly than h^order: from the second rejection the step is at least halved.
        most = 0.9 if growth > 1.0 else 0.5
        growth = 1.0
        h *= min(most, max(0.1, 0.9 * error ** _exponent(explicit))) if np.isfinite(error) else 0.1
        if h < 1e-15 * max(1.0, abs(t)):
            return FlowStep(explicit, t, h), np.nan, growth


@kernel
def _exponent(explicit: bool) -> float:
    """Exponent of the error norm in the step-size control: minus one over the order of the method."""
    return -0.125 if explicit else -0.2


@kernel
def _next_length(step: FlowStep, error: float, growth: float) -> float:
    """Length of the step that follows an accepted one, from its error norm; at most `growth` times its length."""
    if error > 0.0:
        return step.h * min(growth, max(0.2, 0.9 * error ** _exponent(step.explicit)))
    return step.h * growth


@kernel
def _set_scale(d: float, tolerance: float, scale: Array) -> None:
    """Set the errors ``scale[15]`` allowed in a step that starts at ``|D|`` = `d`."""
    for i in range(6):
        scale[i] = tolerance
        scale[6 + i] = tolerance * max(d, 1e-4)
    for i in range(12, 15):
        scale[i] = tolerance


@kernel
def _strain_rate(y: Array, f0: Array, unit: Array) -> tuple[float, float]:
    """``|D'|`` of ``y[15]`` and its derivative ``Dhat:Ddot`` from the rate ``f0[15]``; writes ``unit[6]``."""
    _, d, _ = deviator(y[6:12], unit)
    trend = 0.0
    for i in range(3):
        trend += unit[i] * f0[6 + i] + 2.0 * unit[3 + i] * f0[9 + i]
    return d, trend


@kernel
def _near_rest(d: float, trend: float, fastest: float, tolerance: float) -> bool:
    """True where the predicted time to rest ``-|D|/(d|D|/dt)`` is below ``_REST_TIME max(tolerance, 1e-8)``.

    For smaller ``|D|`` the computed direction of ``D`` is dominated by the error of the step. ``N`` has the principal
    axes of ``D``: at a sharp corner of the yield section the error turns the stress by a finite angle, and the computed
    ``|D|`` would not reach zero.
    """
    return d < 1e-2 * fastest and d < _REST_TIME * max(tolerance, _MIN_REST_TOLERANCE) * -trend


@kernel
def _step_to_event(
    step: FlowStep, end: float, goes_on: bool, flow: Flow, ws: Workspace, log: Log
) -> FlowStep:
    """Repeat a step up to its fraction `end`: the state has the order of the method, not that of the interpolant."""
    explicit, t, h = step.explicit, step.t, step.h * end
    _step(explicit, t, h, flow, ws)
    step = FlowStep(explicit, t, h)
    if goes_on and keeps_history(log):
        if explicit:
            explicit_dense(FLOWING, t, N_FULL, h, flow.par, flow.tide, ws)
        record_inside(step, ws.inner_rate, flow, ws, log)
    copy(ws.y1, ws.y, N_FULL)
    return step


@inlined
def _after_event(reason: int, t: float, angle_tolerance: float, flow: Flow, ws: Workspace) -> Flow:
    """Parameters of the flow after SWITCH (another part of the yield section) or FADE (the dilatancy falls with V)."""
    if reason == FADE:
        return Flow(flow.par, flow.tide, flow.limit2, np.inf)
    return Flow(
        _choose_part(t, angle_tolerance, flow.par, flow.tide, ws), flow.tide, flow.limit2, flow.fade_volume
    )


@inlined
def _first_length(reason: int, step: FlowStep, end: float, method: Method) -> tuple[float, Method]:
    """Length and method of the first step after an event at the fraction `end` of a step, repeated as `step`."""
    if reason == FADE:
        return step.h / end, method
    return max(step.h, 1e-4), Method(False, method.stiffness, method.explicit_floor, _MIN_IMPLICIT_STEPS)


@inlined
def _first_values(t: float, f0: Array, flow: Flow, ws: Workspace) -> tuple[float, int]:
    """`least_event` of the state ``ws.y``, whose event functions become the first of the next step."""
    least, reason = least_event(t, ws.y, f0, flow, ws)
    sample(-1, 0, ws)
    return least, reason


@inlined
def _find_event(step: FlowStep, clear: bool, f0: Array, flow: Flow, ws: Workspace) -> tuple[float, int]:
    """`first_event`, or its result for an explicit step that is `clear` of events."""
    if not clear:
        return first_event(step, f0, flow, ws)
    copy(ws.k[N_STAGES], f0, N_FULL)
    return 2.0, BEYOND


@kernel
def _reach_rest(t: float, d: float, trend: float, f0: Array, y: Array) -> float:
    """Advance ``y[15]`` to the time, which is returned, at which ``|D|`` = `d` vanishes at its present rate."""
    time = d / -trend
    for i in range(N_FULL):
        y[i] += time * f0[i]
    return t + time


@kernel
def _end_step(step: FlowStep, t1: float, flow: Flow, ws: Workspace, log: Log) -> float:
    """Record a step without an event, move ``ws.y`` to its end at `t1`, restore the flow rule; returns ``|D'|``."""
    y, f0 = ws.y, ws.start_rate
    if keeps_history(log):
        record_inside(step, ws.inner_rate, flow, ws, log)
        least_event(step.t + step.h, ws.y1, f0, flow, ws)
    copy(ws.y1, y, N_FULL)
    volume = np.sqrt(determinant(y[0:6]))
    beyond = ws.work.s[BEYOND_FACE]
    d_error = ws.scale[6]
    if restore_flow_rule(y[6:12], volume, beyond, flow.par.material, d_error, ws.stress, ws.work.m[W_N]):
        least_event(t1, y, f0, flow, ws)
    _, d, _ = deviator(y[6:12], ws.stress)
    return d


@kernel
def follow_flow(
    t: float,
    t1: float,
    par: Parameters,
    tide: TidePanels,
    ground: Ground,
    limits: Limits,
    ws: Workspace,
    log: Log,
) -> tuple[int, float]:
    """Plastic flow of ``ws.y`` up to `t1` or the first event that ends it; returns (reason, time)."""
    y, f0, tol = ws.y, ws.start_rate, limits.tolerance
    angle_tolerance = 1e-6 + 10.0 * tol  # rad: error of the direction of D
    h = 1e-4
    method = Method(False, 0.0, 0.0, 0)
    fastest = 0.0
    flow = _begin_flow(t, angle_tolerance, par, tide, limits, ws)
    least, reason = _first_values(t, f0, flow, ws)
    if least < 0.0:
        return reason, t
    touched = False
    while t < t1:
        # Invariant: f0 and the stress in `ws.work` are those of (t, y).
        record_flow(t, y, flow.par, ws, log)
        d, trend = _strain_rate(y, f0, ws.stress)
        fastest = max(fastest, d)
        if _near_rest(d, trend, fastest, tol):
            return ARREST, _reach_rest(t, d, trend, f0, y)
        method = _choose_method(method, t, h, d, f0, flow, ws)
        if method.explicit:
            copy(f0, ws.k[0], N_FULL)
        _set_scale(d, tol, ws.scale)
        h = _step_length(method, h, d, trend)
        step, error, growth = _accepted_step(method.explicit, t, t1, h, flow, limits, ws, log)
        if not error <= 1.0:
            return STUCK, t
        h = step.h
        last = h >= t1 - t
        ground_step = Step(FLOWING, step.explicit, t, h, par.rigid)
        near_ground = not touched and may_touch(ground_step, ground, ws)
        clear = step.explicit and not (near_ground or keeps_history(log)) and clear_of_events(flow, ws)
        if step.explicit and not clear:
            explicit_dense(FLOWING, t, N_FULL, h, flow.par, flow.tide, ws)
        if near_ground:
            end_time = contact_time(ground_step, ground, ws)
            if end_time < np.inf:  # repeat the step up to the contact
                touched = True
                t1 = end_time
                drop_last_row(log)
                least_event(t, y, f0, flow, ws)
                continue
        end, reason = _find_event(step, clear, f0, flow, ws)
        if end <= 1.0:
            goes_on = reason in (SWITCH, FADE)
            step = _step_to_event(step, end, goes_on, flow, ws, log)
            t += step.h
            if not goes_on:
                record_end(t, y, f0, flow, ws, log)
                return reason, t
            flow = _after_event(reason, t, angle_tolerance, flow, ws)
            h, method = _first_length(reason, step, end, method)
            least, reason = _first_values(t, f0, flow, ws)
            if least < 0.0:
                return reason, t
            continue
        t = t1 if last else t + h
        if _end_step(step, t, flow, ws, log) < D_REST:
            record_end(t, y, f0, flow, ws, log)
            return ARREST, t
        h = _next_length(step, error, growth)
    record_end(t, y, f0, flow, ws, log)
    return TOUCH if touched else DONE, t
