"""The inelastic impulse with which a dispersed body comes back into contact (theory, section 3).

``Delta L = -That S^-1`` with ``That = Phat (-1 + k Dhat)``, ``Phat >= 0`` and ``Dhat`` along the deviatoric
rate of strain afterwards, such that ``tr D = beta |D'|`` then. A symmetric ``That`` keeps the angular
momentum; being opposed to the motion that it leaves, it never raises the kinetic energy.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flybystab.core.jit import kernel
from flybystab.core.motion import (
    SIN_PHI,
    SURFACE,
    W_B,
    W_L,
    W_N,
    W_R,
    W_S,
    W_SINV,
    Buffers,
    dilatancy,
    invariants,
)
from flybystab.core.rheology import slope
from flybystab.core.tensors import inverse, multiply, pack, unpack

Array = NDArray[np.float64]


@kernel
def contact_impulse(y: Array, par: Array, work: Buffers) -> bool:
    """Apply the impulse to the state ``y[15]``; False if it brings the body to rest (``D = 0``).

    The direction ``Dhat`` and ``Phat`` are found together by a damped fixed point on ``Dhat``, whose pressure
    follows from the trace condition at every turn. Where the fixed point has no rate of strain left, friction
    holds the body.
    """
    s = work.m[W_S]
    sinv = work.m[W_SINV]
    unpack(y[0:6], s)
    volume = np.sqrt(inverse(y[0:6], sinv))
    before = work.m[W_L]
    unpack(y[6:12], before)
    before[0, 1] -= y[14]
    before[1, 0] += y[14]
    before[0, 2] += y[13]
    before[2, 0] -= y[13]
    before[1, 2] -= y[12]
    before[2, 1] += y[12]
    beta, _ = dilatancy(volume, par)
    trace_sinv = sinv[0, 0] + sinv[1, 1] + sinv[2, 2]
    trace_l = y[6] + y[7] + y[8]
    unit = work.c[2]
    after = work.m[W_R]
    n = work.m[W_N]
    b = work.m[W_B]
    d = work.c[0]
    old = work.c[1]
    _, start, det = invariants(y[6:12], unit)
    if start == 0.0:
        return False
    total = start
    for _turn in range(400):
        unpack(unit, n)
        k = slope(int(par[SURFACE]), par[SIN_PHI], det)
        multiply(n, sinv, b)
        # (1 - beta n) : (L + P (1 - k n) S^-1) = 0, the trace condition along n
        n_s = b[0, 0] + b[1, 1] + b[2, 2]
        nn_s = 0.0
        n_l = 0.0
        for i in range(3):
            for j in range(3):
                nn_s += n[i, j] * b[i, j]
                n_l += n[i, j] * before[i, j]
        p = (beta * n_l - trace_l) / (trace_sinv - (k + beta) * n_s + k * beta * nn_s)
        if not p >= 0.0:
            p = 0.0
        for i in range(3):
            for j in range(3):
                after[i, j] = before[i, j] + p * (sinv[i, j] - k * b[i, j])
        pack(after, d)
        for i in range(6):
            old[i] = unit[i]
        _, total, det = invariants(d, unit)
        change = 0.0
        if total < 1e-12 * start:
            return False
        for i in range(6):
            change += (unit[i] - old[i]) ** 2
            unit[i] = 0.5 * (unit[i] + old[i])
        _, _, det = invariants(unit, unit)
        if change < 1e-28:
            for i in range(6):
                y[6 + i] = d[i]
            y[12] = 0.5 * (after[2, 1] - after[1, 2])
            y[13] = 0.5 * (after[0, 2] - after[2, 0])
            y[14] = 0.5 * (after[1, 0] - after[0, 1])
            return True
    return False
