"""The tide at all points of a DOP853 step at once: at its stages and at the samples of its interpolant.

The numbers are those of :func:`flybystab.core.ellipsoid.tide.tide_at`, to the last bit. Clenshaw's recurrence is
advanced for all components and points side by side, in vector instructions; for one point at a time each term waits for
the one before it.
"""

from __future__ import annotations

import numpy as np

from flybystab.core.dynamics.workspace import N_SAMPLE
from flybystab.core.ellipsoid.tide import TidePanels, panel_at
from flybystab.core.numerics.dop853 import NODE
from flybystab.core.numerics.jit import inlined, kernel
from flybystab.typing import Array

_FRACTIONS = np.unique(np.concatenate([NODE[1:], np.arange(1, N_SAMPLE + 1) / N_SAMPLE]))
#: Fractions of the step at which the tide is needed, each once, in their order; the end is repeated to fill vectors.
POINTS = np.concatenate([_FRACTIONS, np.ones(-_FRACTIONS.size % 8)])
N_POINTS = POINTS.size
#: Point of each stage and of each sample. The first of each is at the start of the step, and not used.
STAGE_POINT = np.searchsorted(POINTS, NODE)
SAMPLE_POINT = np.searchsorted(POINTS, np.arange(N_SAMPLE + 1) / N_SAMPLE)

# Places in the scratch array: argument of the series, twice the argument, and the two terms of the recurrence for each
# component.
_X, _X2, _P, _Q, N_SCRATCH = 0, N_POINTS, 2 * N_POINTS, 8 * N_POINTS, 14 * N_POINTS


@inlined
def _advance(v: Array, j: int, term: float, n: int) -> None:
    """Advance the recurrence of component `j` at `n` points: ``b_k = c_k + 2 x b_(k+1) - b_(k+2)``."""
    for i in range(n):
        before = v[_P + j * N_POINTS + i]
        v[_P + j * N_POINTS + i] = term + v[_X2 + i] * before - v[_Q + j * N_POINTS + i]
        v[_Q + j * N_POINTS + i] = before


@kernel
def _sum_series(c: Array, last: int, v: Array, out: Array) -> None:
    """Write the series with the coefficients ``c[m, 6]`` at the points up to `last` (excluded) into ``out[6, :]``."""
    # A number that the compiler does not know: it would unroll the loops before it makes vector instructions.
    n = out.shape[1]
    for i in range(n):
        v[_X2 + i] = 2.0 * v[_X + i]
    for i in range(12 * N_POINTS):
        v[_P + i] = 0.0
    for k in range(c.shape[0] - 1, 0, -1):
        _advance(v, 0, c[k, 0], n)
        _advance(v, 1, c[k, 1], n)
        _advance(v, 2, c[k, 2], n)
        _advance(v, 3, c[k, 3], n)
        _advance(v, 4, c[k, 4], n)
        _advance(v, 5, c[k, 5], n)
    for j in range(6):
        row, term = out[j], c[0, j]
        for i in range(last):
            row[i] = term + v[_X + i] * v[_P + j * N_POINTS + i] - v[_Q + j * N_POINTS + i]


@kernel
def step_tide(t: float, h: float, tide: TidePanels, v: Array, out: Array) -> None:
    """Write the tide at the points of a step from `t` over `h` into ``out[6, N_POINTS]``; `v` is scratch."""
    n = tide.coefficients.shape[0]
    if n == 0:
        out[:] = 0.0
        return
    # The points are in the order of time: the last panel is summed first, and the earlier ones overwrite their points.
    last, panel = N_POINTS, -1
    for i in range(N_POINTS - 1, -1, -1):
        here, x = panel_at(tide.tau, tide.start, tide.width, n, t + POINTS[i] * h)
        if here != panel and panel >= 0:
            _sum_series(tide.coefficients[panel], last, v, out)
            last = i + 1
        panel = here
        v[_X + i] = x
    _sum_series(tide.coefficients[panel], last, v, out)
