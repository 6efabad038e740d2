"""What the followers of the regimes share: buffers, codes, the history and the event log."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flybystab.core.dynamics.state import RIGID, W_SCRATCH, Buffers, empty_buffers, to_fixed_frame
from flybystab.core.dynamics.steppers import N_STAGES
from flybystab.core.numerics.jit import borrowed, code, kernel
from flybystab.typing import Array

Counts = NDArray[np.int64]

# Why a regime (or the run) ended; the same codes head the rows of the event log.
DONE = code(0)
ONSET = code(1)
ARREST = code(2)
LOSS = code(3)
CONTACT = code(4)
BEYOND = code(5)
JAM = code(6)
STUCK = code(7)  # more steps or switches than allowed
SWITCH = code(8)  # flow passes from one part of the yield section to another (not logged)
TOUCH = code(9)  # the body has reached the ground
FADE = code(10)  # the dilatancy of a flow begins to fade (not logged)

#: Columns of the history: time, regime, S (6), D (6), w (3), pressure, deviator norm, unit determinant, and
#: the unit quaternion (body axes -> fixed frame) of a rigid body, zero otherwise.
N_HISTORY = 24
#: Columns of the event log: code, time, Lode determinant, volume.
N_EVENT = 4
#: Samples in a step: history rows, and the grid on which extrema of the yield function are looked for while rigid.
N_SAMPLE = 4

#: Rate of strain, in dynamical units, below which the body is at rest.
D_REST = 1e-10


class Workspace(NamedTuple):
    """Buffers of a run, allocated once."""

    work: Buffers
    k: Array
    jac: Array
    lu: Array
    pivots: NDArray[np.int64]
    dense: Array
    y: Array
    y1: Array
    ys: Array
    scale: Array
    stress: Array
    sample: Array
    spare: Array  # 36 of an impulse, its 6 zeros, 3 of the ground; of a flow the first 30
    mark: Array  # largest mobilised friction, its time; step size; in flow: code of the event nearest, volume ahead
    ends: Array  # flow: event functions at the samples of a step, and last


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
        np.zeros((N_STAGES, 15)),
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
        np.zeros(45),
        np.zeros(5),
        np.zeros((4, N_SAMPLE + 2)),
    )


@kernel
def borrowed_workspace(ws: Workspace) -> Workspace:
    """The same buffers without reference counts, for use inside a kernel that has them as an argument."""
    return Workspace(
        Buffers(borrowed(ws.work.m), borrowed(ws.work.c), borrowed(ws.work.s)),
        borrowed(ws.k),
        borrowed(ws.jac),
        borrowed(ws.lu),
        borrowed(ws.pivots),
        borrowed(ws.dense),
        borrowed(ws.y),
        borrowed(ws.y1),
        borrowed(ws.ys),
        borrowed(ws.scale),
        borrowed(ws.stress),
        borrowed(ws.sample),
        borrowed(ws.spare),
        borrowed(ws.mark),
        borrowed(ws.ends),
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
    count: Counts,
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
        to_fixed_frame(y, par, ws.work.m[W_SCRATCH], row[2:8], row[14:17])
        for i in range(6):
            row[8 + i] = 0.0
        for i in range(4):
            row[20 + i] = y[i]
    else:
        for i in range(15):
            row[2 + i] = y[i]
        for i in range(4):
            row[20 + i] = 0.0
    row[17] = p
    row[18] = s
    row[19] = det
    count[0] = n + 1


@kernel
def log(what: int, t: float, det: float, volume: float, events: Array, count: Counts) -> None:
    """Append a row to the event log; a full log keeps its first rows and counts on."""
    if count[1] < events.shape[0]:
        row = events[count[1]]
        row[0], row[1], row[2], row[3] = what, t, det, volume
    count[1] += 1
