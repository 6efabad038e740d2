"""Outcomes of many rigid bodies, `LANES` of them side by side: those of `rigid_rows`, to the last bit.

Each body has its own steps; when it has ended, the next one takes its lane. Steps, stresses and tides of all lanes are
computed together (:mod:`flybystab.core.dynamics.rigid_lanes`). What has to be decided about one body, the control of
its step and the searches for yield and for the largest mobilised friction, is left to the functions of
:mod:`flybystab.core.dynamics.rigid_extrema`. Bodies near the ground are not followed here.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flybystab.core.dynamics.rates import rigid_invariants, rigid_rate
from flybystab.core.dynamics.regimes import to_full_state
from flybystab.core.dynamics.rigid import longest_step
from flybystab.core.dynamics.rigid_extrema import (
    BOUND,
    FRICTION_ROW,
    ONSET_ROW,
    friction_bound,
    friction_peak,
    larger,
    measures,
    onset_margin,
    onset_of,
    sampled_peak,
    search_summits,
    yield_between,
    yields,
)
from flybystab.core.dynamics.rigid_lanes import (
    DETERMINANT,
    LANES,
    NORM,
    PRESSURE,
    Lanes,
    advance,
    empty_lanes,
    lane_error,
    lane_steps,
    lane_stresses,
    set_lane,
    set_step,
)
from flybystab.core.dynamics.run import FinalState, scaled, to_si
from flybystab.core.dynamics.state import N_FULL, N_RIGID, RIGID, Parameters, RigidShape
from flybystab.core.dynamics.steppers import explicit_at, explicit_growth, explicit_reduction
from flybystab.core.dynamics.verdict_row import (
    YIELDS,
    Encounters,
    body_of,
    encounter_of,
    in_equilibrium,
    verdict_code,
    write_end,
)
from flybystab.core.dynamics.workspace import (
    DONE,
    N_SAMPLE,
    N_SUMMITS,
    STUCK,
    Limits,
    Log,
    Peak,
    Workspace,
    copy,
    new_log,
    reset,
    workspace,
)
from flybystab.core.ellipsoid.tide import TidePanels
from flybystab.core.material.parameters import MaterialParameters
from flybystab.core.numerics.dop853 import N_POWERS
from flybystab.core.numerics.jit import borrowed, code, inlined, kernel
from flybystab.typing import Array

_NO_ROWS, _ONE = code(0), code(1)

#: Run in a lane, in the units of its body.
RUN = np.dtype(
    [
        ("row", "i8"),  # of the body; -1: empty lane
        ("can_yield", "?"),  # False: out of equilibrium from the start, and followed as a rigid body
        ("t", "f8"),
        ("h", "f8"),  # length of the next step
        ("end", "f8"),
        ("last", "?"),  # the step ends at `end`
        ("error", "f8"),  # of the step; accepted at <= 1
        ("friction", "f8"),  # largest mobilised friction, rad, and its time
        ("when", "f8"),
        ("steps", "i8"),  # tried
        ("tau", "f8"),  # panels of the tide
        ("start", "f8"),
        ("width", "f8"),
        ("panels", "i8"),
    ]
)


class Runs(NamedTuple):
    """Runs in the lanes: records, parameters, and tides in the units of the body.

    `samples` has the onset function and the mobilised friction, as ``Workspace.sample``; the last three are those of
    ``Workspace`` for each lane.
    """

    records: NDArray[Any]
    parameters: Array
    tides: Array
    samples: Array
    summits: Array
    summit_states: Array
    summit_dense: Array


class Known(NamedTuple):
    """Records of bodies and encounters, limits, and the outcomes to be written."""

    bodies: NDArray[Any]
    encounters: Encounters
    limits: Limits
    outcomes: NDArray[Any]


@kernel
def _empty_runs(panels: int, terms: int) -> Runs:
    records = np.zeros(LANES, RUN)
    for lane in range(LANES):
        records[lane]["row"] = -1
    return Runs(
        records,
        np.zeros((LANES, 16)),
        np.zeros((LANES, panels, terms, 6)),
        np.zeros((LANES, 2, N_SAMPLE + 1)),
        np.zeros((LANES, N_SUMMITS, 5 + N_SAMPLE)),
        np.zeros((LANES, N_SUMMITS, N_RIGID)),
        np.zeros((LANES, N_SUMMITS, N_POWERS, N_RIGID)),
    )


@kernel
def _keep_parameters(lane: int, par: Parameters, runs: Runs) -> None:
    """Store the parameters of a run."""
    m, r, p = par.material, par.rigid, runs.parameters[lane]
    p[0], p[1], p[2], p[3], p[4] = m.surface, m.sin_phi, m.cos_phi, m.beta, m.normal
    p[5], p[6], p[7], p[8], p[9] = m.cohesion, m.viscosity, m.expansion, m.part, m.fan_limit
    p[10], p[11], p[12], p[13], p[14], p[15] = r.s1, r.s2, r.s3, r.g1, r.g2, r.g3


@kernel
def _parameters(lane: int, runs: Runs) -> Parameters:
    """The parameters that `_keep_parameters` has stored."""
    p = runs.parameters[lane]
    material = MaterialParameters(int(p[0]), p[1], p[2], p[3], p[4] > 0.0, p[5], p[6], p[7], int(p[8]), p[9])
    return Parameters(material, RigidShape(p[10], p[11], p[12], p[13], p[14], p[15]))


@kernel
def _tide(lane: int, runs: Runs) -> TidePanels:
    """The tide of a run."""
    record = runs.records[lane]
    return TidePanels(record["tau"], record["start"], record["width"], runs.tides[lane, : record["panels"]])


@kernel
def _workspace(lane: int, lanes: Lanes, runs: Runs, ws: Workspace) -> Workspace:
    """The buffers `ws` with the step, the samples and the stored steps of a lane."""
    for i in range(N_RIGID):
        ws.y[i] = lanes.y[i * LANES + lane]
    for r in range(N_POWERS):
        for i in range(N_RIGID):
            ws.dense[r, i] = lanes.dense[r, i * LANES + lane]
    return Workspace(
        ws.work, ws.k, ws.jac, ws.lu, ws.pivots, ws.dense, ws.y, ws.y1, ws.ys, ws.scale, ws.stress,
        runs.samples[lane], ws.start_rate, ws.inner_rate, ws.ends, ws.stages,
        runs.summits[lane], runs.summit_states[lane], runs.summit_dense[lane],
    )  # fmt: skip


@kernel
def _begin(row: int, lane: int, known: Known, lanes: Lanes, runs: Runs, ws: Workspace) -> bool:
    """Put a body in a lane; False if it yields at the start."""
    body = body_of(known.bodies[row])
    span, tide, ground = encounter_of(known.bodies[row], known.encounters)
    run = scaled(body, span, tide, ground)
    c = run.tide.coefficients
    record, sample = runs.records[lane], runs.samples[lane]
    record["row"], record["can_yield"], record["steps"] = row, in_equilibrium(body, ws.stress), 0
    record["t"], record["end"] = run.span.start, min(run.span.stop, run.span.rest)
    record["tau"], record["start"], record["width"] = run.tide.tau, run.tide.start, run.tide.width
    record["panels"] = c.shape[0]
    runs.tides[lane, : c.shape[0], : c.shape[1]] = c
    _keep_parameters(lane, run.par, runs)
    own, t = _tide(lane, runs), record["t"]
    copy(run.y, ws.y, N_FULL)
    rigid_rate(t, ws.y, ws.k[0], run.par.rigid, own, ws.work)
    set_lane(lane, ws.y, ws.k[0], run.par.rigid, lanes)
    p, norm, det = rigid_invariants(t, ws.y, run.par.rigid, own, ws.work, ws.stress)
    excess, friction = measures(p, norm, det, run.par)
    onset = onset_of(excess, p, norm, det, run.par, ws.stress)
    sample[ONSET_ROW, N_SAMPLE], sample[FRICTION_ROW, N_SAMPLE] = onset, friction
    runs.summits[lane, :, BOUND] = -np.inf
    peak = larger(Peak(-1.0, 0.0), friction, t)
    record["friction"], record["when"] = peak.friction, peak.time
    record["h"] = min(0.05, record["end"] - t, longest_step(t, known.limits.tolerance, own))
    return not (record["can_yield"] and onset > 0.0)


@kernel
def _finish(
    lane: int, reason: int, known: Known, lanes: Lanes, runs: Runs, room: Workspace, log: Log
) -> None:
    """Write the outcome of the body in a lane."""
    record = runs.records[lane]
    row = record["row"]
    body = body_of(known.bodies[row])
    span, tide, ground = encounter_of(known.bodies[row], known.encounters)
    run = scaled(body, span, tide, ground)
    ws = _workspace(lane, lanes, runs, room)
    peak = search_summits(run.par, run.tide, Peak(record["friction"], record["when"]), ws)
    to_full_state(record["t"], run.par, run.tide, ws)
    copy(ws.y, run.y, N_FULL)
    shape, gradient, stress = np.empty((3, 3)), np.empty((3, 3)), np.empty(6)
    reset(log)
    log.counts[0]["steps"] = record["steps"]
    to_si(body.rho, run, shape, gradient, log)
    end = FinalState(reason, record["t"] * run.t0, RIGID, Peak(peak.friction, peak.time * run.t0))
    holds, out = in_equilibrium(body, stress), known.outcomes[row]
    write_end(body, end, holds, stress, out, shape, gradient, log)
    out["verdict"] = verdict_code(reason, holds, ground.least < 0.0, False)


@inlined
def _accepted(lane: int, runs: Runs) -> bool:
    """True if a lane has a body whose step is accepted."""
    return runs.records[lane]["row"] >= 0 and runs.records[lane]["error"] <= 1.0


@kernel
def _yields_at(i: int, lane: int, lanes: Lanes, runs: Runs, room: Workspace) -> bool:
    """True if a body whose stress exceeds the yield surface at the sample `i` of its step flows there."""
    record = runs.records[lane]
    ws = _workspace(lane, lanes, runs, room)
    x = i / N_SAMPLE
    explicit_at(x, ws.y, N_RIGID, ws.dense, ws.ys)
    onset = yields(record["t"] + x * record["h"], ws.ys, _parameters(lane, runs), _tide(lane, runs), ws)
    runs.samples[lane, ONSET_ROW, i] = onset
    return onset > 0.0


@kernel
def _take_samples(lanes: Lanes, runs: Runs, room: Workspace) -> None:
    """Onset function and mobilised friction at the samples of the accepted steps, as `rigid_extrema.sample_step`.

    A body that yields at a sample leaves its lane.
    """
    v = lanes.numbers
    for lane in range(LANES):
        if _accepted(lane, runs):
            for quantity in (ONSET_ROW, FRICTION_ROW):
                runs.samples[lane, quantity, 0] = runs.samples[lane, quantity, N_SAMPLE]
    for i in range(1, N_SAMPLE + 1):
        lane_stresses(i, lanes)
        for lane in range(LANES):
            if not _accepted(lane, runs):
                continue
            record, sample = runs.records[lane], runs.samples[lane]
            par = _parameters(lane, runs)
            p, norm, det = v[PRESSURE + lane], v[NORM + lane], v[DETERMINANT + lane]
            excess, friction = measures(p, norm, det, par)
            sample[ONSET_ROW, i], sample[FRICTION_ROW, i] = excess, friction
            if excess > 0.0 and record["can_yield"] and _yields_at(i, lane, lanes, runs, room):
                record["row"] = -1


@kernel
def _end_step(lane: int, known: Known, lanes: Lanes, runs: Runs, room: Workspace) -> bool:
    """Search the accepted step of a body for yield and friction, and advance it; False if the body yields."""
    record, sample = runs.records[lane], runs.samples[lane]
    par, tide = _parameters(lane, runs), _tide(lane, runs)
    t, h = record["t"], record["h"]
    onset, f = sample[ONSET_ROW], sample[FRICTION_ROW]
    norm = lanes.numbers[NORM + lane]  # at the end of the step, the last sample
    near = record["can_yield"] and onset.max() + onset_margin(onset, norm) > 0.0
    peak = sampled_peak(t, h, N_SAMPLE, f, Peak(record["friction"], record["when"]))
    if near or friction_bound(f, N_SAMPLE) > peak.friction:
        ws = _workspace(lane, lanes, runs, room)
        if near:
            end, _ = yield_between(t, h, norm, par, tide, ws)
            if end <= 1.0:
                return False
        peak = friction_peak(t, h, N_SAMPLE, par, tide, peak, ws)
    record["friction"], record["when"] = peak.friction, peak.time
    t = record["end"] if record["last"] else t + h
    record["t"] = t
    record["h"] = min(h * explicit_growth(record["error"]), longest_step(t, known.limits.tolerance, tide))
    advance(lane, lanes)
    return True


@inlined
def _needs_step(lane: int, known: Known, runs: Runs) -> bool:
    """True if a lane has a body whose run has not ended."""
    record = runs.records[lane]
    return record["row"] >= 0 and record["t"] < record["end"] and record["steps"] < known.limits.max_steps


@kernel
def _occupy(
    lane: int,
    begun: int,
    rows: NDArray[np.int64],
    known: Known,
    lanes: Lanes,
    runs: Runs,
    room: Workspace,
    log: Log,
) -> int:
    """Finish the run of a lane, if it has one, and begin the next ones until one needs a step.

    Returns the number of rows begun so far, of which `begun` were before.
    """
    record = runs.records[lane]
    while True:
        if record["row"] >= 0:
            if _needs_step(lane, known, runs):
                return begun
            _finish(lane, STUCK if record["t"] < record["end"] else DONE, known, lanes, runs, room, log)
            record["row"] = -1
        if begun == len(rows):
            return begun
        row = rows[begun]
        begun += 1
        known.outcomes[row]["verdict"] = YIELDS
        if not _begin(row, lane, known, lanes, runs, room):
            record["row"] = -1


@inlined
def _prepare_step(lane: int, lanes: Lanes, runs: Runs) -> None:
    """Set the length of the next step of a body, and the tides at its points."""
    record = runs.records[lane]
    record["last"] = record["h"] >= record["end"] - record["t"]
    if record["last"]:
        record["h"] = record["end"] - record["t"]
    record["steps"] += 1
    set_step(lane, record["t"], record["h"], _tide(lane, runs), lanes)


@kernel
def _follow(
    rows: NDArray[np.int64], known: Known, lanes: Lanes, runs: Runs, room: Workspace, log: Log
) -> None:
    """`lane_rows` with its buffers."""
    known, lanes, runs, room = borrowed(known), borrowed(lanes), borrowed(runs), borrowed(room)
    begun = 0
    while True:
        for lane in range(LANES):
            if not _needs_step(lane, known, runs):
                begun = _occupy(lane, begun, rows, known, lanes, runs, room, log)
            if runs.records[lane]["row"] >= 0:
                _prepare_step(lane, lanes, runs)
        if runs.records["row"].max() < 0:
            return
        lane_steps(lanes)
        accepted = False
        for lane in range(LANES):
            record = runs.records[lane]
            if record["row"] >= 0:
                record["error"] = lane_error(lane, record["h"], known.limits.tolerance, lanes)
                if record["error"] <= 1.0:
                    accepted = True
                else:
                    record["h"] *= explicit_reduction(record["error"])
        if not accepted:
            continue
        _take_samples(lanes, runs, room)
        for lane in range(LANES):
            if _accepted(lane, runs) and not _end_step(lane, known, lanes, runs, room):
                runs.records[lane]["row"] = -1


@kernel
def lane_rows(
    rows: NDArray[np.int64],
    bodies: NDArray[Any],
    encounters: Encounters,
    limits: Limits,
    outcomes: NDArray[Any],
) -> None:
    """`flybystab.core.dynamics.verdict_row.rigid_rows` for bodies that stay well above the ground.

    Parameters
    ----------
    rows : ndarray of int, shape (m,)
    bodies : ndarray of BODY, shape (n,)
    encounters : Encounters
    limits : Limits
    outcomes : ndarray of OUTCOME, shape (n,)
        Those of `rows` are written; the verdict of a body that yields is YIELDS.
    """
    most = 0
    for e in encounters.rows:
        most = max(most, e["tide"]["last"] - e["tide"]["first"])
    known = Known(bodies, encounters, limits, outcomes)
    runs = _empty_runs(most, encounters.tides.shape[1])
    _follow(rows, known, empty_lanes(), runs, workspace(), new_log(_NO_ROWS, _ONE))
