"""Buffers and codes common to the regimes, limits of a run, and its record: history, events, counts."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flybystab.core.dynamics.state import RIGID, W_SCRATCH, Buffers, Parameters, empty_buffers, to_fixed_frame
from flybystab.core.numerics.dop853 import N_EXTENDED
from flybystab.core.numerics.jit import code, kernel
from flybystab.typing import Array

# Reasons for the end of a regime or of the run; also the codes of the rows of the event log.
DONE = code(0)
ONSET = code(1)
ARREST = code(2)
LOSS = code(3)
CONTACT = code(4)
BEYOND = code(5)
JAM = code(6)
STUCK = code(7)  # more steps or switches than allowed
SWITCH = code(8)  # the stress moves to another part of the yield section (not logged)
TOUCH = code(9)  # the body has reached the ground
FADE = code(10)  # the dilatancy of a flow begins to fade (not logged)

#: Row of the history, in the units of the body: state in the fixed frame, stress, and the unit quaternion (body axes
#: -> fixed frame) of a rigid body, zero otherwise.
HISTORY = np.dtype(
    [
        ("time", "f8"),
        ("regime", "i8"),
        ("state", "f8", 15),  # S (6), D (6), w (3)
        ("pressure", "f8"),
        ("deviator", "f8"),  # norm
        ("determinant", "f8"),  # of the unit deviator
        ("quaternion", "f8", 4),
    ]
)
#: Row of the event log.
EVENT = np.dtype([("code", "i8"), ("time", "f8"), ("determinant", "f8"), ("volume", "f8")])
#: Rows of the history, events, steps tried and steps rejected.
COUNTS = np.dtype([("rows", "i8"), ("events", "i8"), ("steps", "i8"), ("rejected", "i8")])
#: Samples in a step: rows of the history, and the grid of the search for extrema of the yield function in rigid motion.
N_SAMPLE = 4

#: Steps of rigid motion that may hold the largest mobilised friction, kept until the end of the motion.
N_SUMMITS = 8

#: Rate of strain, in dynamical units, below which the body counts as at rest.
D_REST = 1e-10


class Limits(NamedTuple):
    """Limits of a run.

    Attributes
    ----------
    tolerance : float
        Relative error allowed in a step.
    axis_ratio : float
        Largest axis ratio of the homogeneous model; the run ends there.
    max_steps : int
        Largest number of steps; the run then ends with STUCK.
    """

    tolerance: float
    axis_ratio: float
    max_steps: int


class Log(NamedTuple):
    """Record of a run: ``history[n]`` of `HISTORY`, ``events[m]`` of `EVENT` and ``counts[1]`` of `COUNTS`.

    With ``n < 2`` no history is kept.
    """

    history: NDArray[np.void]
    events: NDArray[np.void]
    counts: NDArray[np.void]


class Peak(NamedTuple):
    """Largest friction angle (rad) that a rigid body has mobilised, and its time."""

    friction: float
    time: float


class Workspace(NamedTuple):
    """Buffers of a run, allocated once."""

    work: Buffers
    k: Array  # rates of the stages
    jac: Array  # Jacobian, and the derivative in time as the last column
    lu: Array
    pivots: NDArray[np.int64]
    dense: Array  # interpolant of a step
    y: Array  # state at the start of a step, at its end, and inside it
    y1: Array
    ys: Array
    scale: Array  # error allowed in each number of the state
    stress: Array
    sample: Array  # rigid: onset function and mobilised friction (rows) at the samples of a step
    start_rate: Array  # flow: rate at the start of a step
    inner_rate: Array  # flow: rate at a point inside a step
    ends: Array  # flow: event functions (rows) at the samples of a step, and last
    stages: Array  # flow: least and largest event functions (rows) over the stages of a step
    summits: Array  # rigid, of `N_SUMMITS` steps: bound of the friction, time, length, last sample, samples
    summit_states: Array  # the states at the start of these steps
    summit_dense: Array  # their interpolants


@kernel
def new_log(rows: int, events: int) -> Log:
    """An empty record with room for the given rows and events."""
    return Log(np.zeros(max(rows, 1), HISTORY), np.zeros(events, EVENT), np.zeros(1, COUNTS))


@kernel
def copy(a: Array, b: Array, n: int) -> None:
    """``b[:n] = a[:n]``."""
    for i in range(n):
        b[i] = a[i]


@kernel
def workspace() -> Workspace:
    """Fresh buffers."""
    return Workspace(
        empty_buffers(),
        np.zeros((N_EXTENDED, 15)),
        np.zeros((15, 16)),
        np.zeros((15, 15)),
        np.zeros(15, dtype=np.int64),
        np.zeros((7, 15)),
        np.zeros(15),
        np.zeros(15),
        np.zeros(15),
        np.ones(15),
        np.zeros(6),
        np.zeros((2, N_SAMPLE + 1)),
        np.zeros(15),
        np.zeros(15),
        np.zeros((4, N_SAMPLE + 2)),
        np.zeros((4, 2)),
        np.zeros((N_SUMMITS, 5 + N_SAMPLE)),
        np.zeros((N_SUMMITS, 7)),
        np.zeros((N_SUMMITS, 7, 7)),
    )


@kernel
def reset(log: Log) -> None:
    """Set the counts to zero."""
    counts = log.counts[0]
    counts["rows"] = counts["events"] = counts["steps"] = counts["rejected"] = 0


@kernel
def keeps_history(log: Log) -> bool:
    """True if a history is kept."""
    return log.history.shape[0] > 1


@kernel
def count_step(log: Log) -> None:
    """Count an attempted step."""
    log.counts[0]["steps"] += 1


@kernel
def count_rejected(log: Log) -> None:
    """Count a rejected step."""
    log.counts[0]["rejected"] += 1


@kernel
def exhausted(log: Log, limits: Limits) -> bool:
    """True if no further step is allowed."""
    return log.counts[0]["steps"] >= limits.max_steps


@kernel
def drop_last_row(log: Log) -> None:
    """Remove the last row of the history, at the start of a step that will be repeated."""
    log.counts[0]["rows"] = max(log.counts[0]["rows"] - 1, 0)


@kernel
def record(
    t: float, regime: int, y: Array, par: Parameters, p: float, s: float, det: float, ws: Workspace, log: Log
) -> None:
    """Append a row to the history; in a full history every second row is dropped first."""
    history = log.history
    if history.shape[0] < 2:
        return
    n = log.counts[0]["rows"]
    if n == history.shape[0]:
        m = n // 2
        for i in range(m):
            history[i] = history[2 * i]
        n = m
    row = history[n]
    row["time"] = t
    row["regime"] = regime
    state = row["state"]
    turn = row["quaternion"]
    if regime == RIGID:
        to_fixed_frame(y, par.rigid, ws.work.m[W_SCRATCH], state[0:6], state[12:15])
        for i in range(6):
            state[6 + i] = 0.0
        for i in range(4):
            turn[i] = y[i]
    else:
        for i in range(15):
            state[i] = y[i]
        for i in range(4):
            turn[i] = 0.0
    row["pressure"] = p
    row["deviator"] = s
    row["determinant"] = det
    log.counts[0]["rows"] = n + 1


@kernel
def log_event(what: int, t: float, det: float, volume: float, log: Log) -> None:
    """Append a row to the event log; events beyond its size are counted but not stored."""
    n = log.counts[0]["events"]
    if n < log.events.shape[0]:
        row = log.events[n]
        row["code"] = what
        row["time"] = t
        row["determinant"] = det
        row["volume"] = volume
    log.counts[0]["events"] = n + 1
