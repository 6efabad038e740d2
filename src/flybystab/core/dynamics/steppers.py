"""Two embedded one-step methods with dense output, for the equations of :mod:`flybystab.core.dynamics.rates`.

``explicit_step``  DOP853 (:mod:`flybystab.core.numerics.dop853`): rigid, dispersed and fluid motion.
``implicit_step``  Rodas5P (:mod:`flybystab.core.numerics.rodas5p`): plastic flow. The direction of flow relaxes at the
                   rate ``k P/(a^2 |D|)``, unbounded at onset and arrest, so that the equations are stiff there; a
                   Rosenbrock method needs one linear solve a stage and no Newton iteration.
"""

from __future__ import annotations

import numpy as np

from flybystab.core.dynamics.rates import rate
from flybystab.core.dynamics.state import FLOWING, N_FULL, Parameters
from flybystab.core.dynamics.workspace import Workspace
from flybystab.core.ellipsoid.tide import TidePanels
from flybystab.core.numerics.dop853 import (
    N_EXTENDED,
    N_STAGES,
    NODE,
    dense_coefficients,
    dense_state,
    error_norm,
    error_sums,
    stage_state,
)
from flybystab.core.numerics.jit import kernel
from flybystab.core.numerics.lu import factorise, solve
from flybystab.core.numerics.rodas5p import COUPLING, DENSE, GAMMA, NODES, STAGES, TIME
from flybystab.typing import Array


@kernel
def explicit_step(
    regime: int, t: float, n: int, h: float, par: Parameters, tide: TidePanels, ws: Workspace
) -> float:
    """One DOP853 step of the first `n` numbers of ``ws.y``; ``ws.k[0]`` must hold the rate at the start.

    Writes ``ws.y1`` and ``ws.k[1..12]`` (``k[12]``: the rate at the end); returns the error norm (accept at <= 1).
    """
    y, k, y1, work = ws.y, ws.k, ws.y1, ws.work
    for s in range(1, N_STAGES + 1):
        stage_state(s, y, n, h, k, y1)
        rate(regime, t + NODE[s] * h, y1, k[s], par, tide, work)
    five, three = error_sums(n, k, ws.scale)
    if not np.isfinite(five + three):
        return np.inf
    return error_norm(five, three, n, h)


@kernel
def explicit_growth(error: float) -> float:
    """Ratio of the next step to an accepted one of `explicit_step` with this error norm."""
    return min(5.0, max(0.3, 0.9 * error ** (-0.125))) if error > 0.0 else 5.0


@kernel
def explicit_reduction(error: float) -> float:
    """Factor by which a rejected step of `explicit_step` is shortened."""
    return max(0.2, 0.9 * error ** (-0.125)) if np.isfinite(error) else 0.2


@kernel
def explicit_dense(
    regime: int, t: float, n: int, h: float, par: Parameters, tide: TidePanels, ws: Workspace
) -> None:
    """Write the interpolant ``ws.dense`` of a step just made by `explicit_step` (three more rates)."""
    y, k, ys, work = ws.y, ws.k, ws.ys, ws.work
    for s in range(N_STAGES + 1, N_EXTENDED):
        stage_state(s, y, n, h, k, ys)
        rate(regime, t + NODE[s] * h, ys, k[s], par, tide, work)
    dense_coefficients(y, ws.y1, n, h, k, ws.dense)


@kernel
def explicit_at(x: float, y: Array, n: int, dense: Array, out: Array) -> None:
    """State ``out[n]`` at the fraction ``x`` of a step from `y`, from `explicit_dense`."""
    dense_state(x, y, n, dense, out)


@kernel
def implicit_at(x: float, y: Array, n: int, dense: Array, y1: Array, out: Array) -> None:
    """State at the fraction ``x`` of a step, from `implicit_step`."""
    for i in range(n):
        out[i] = (1.0 - x) * y[i] + x * (
            y1[i] + (1.0 - x) * (dense[0, i] + x * (dense[1, i] + x * dense[2, i]))
        )


@kernel
def implicit_step(t: float, h: float, par: Parameters, tide: TidePanels, ws: Workspace) -> float:
    """One Rodas5P step of plastic flow from ``ws.y`` with the Jacobian ``ws.jac``; returns the error norm.

    Writes ``ws.y1`` and the interpolant ``ws.dense[:3]``; accept at an error <= 1.
    """
    n = N_FULL
    y, y1, k, jac, lu, pivots = ws.y, ws.y1, ws.k, ws.jac, ws.lu, ws.pivots
    scale, dense, work = ws.scale, ws.dense, ws.work
    d = 1.0 / (GAMMA * h)
    for i in range(n):
        for j in range(n):
            lu[i, j] = -jac[i, j]
        lu[i, i] += d
    if not factorise(lu, n, pivots):
        return np.inf
    for s in range(8):
        stage = k[s]
        for i in range(n):
            y1[i] = y[i]
        for j in range(s):
            a = STAGES[s, j]
            before = k[j]
            for i in range(n):
                y1[i] += a * before[i]
        rate(FLOWING, t + NODES[s] * h, y1, stage, par, tide, work)
        for i in range(n):
            stage[i] += h * TIME[s] * jac[i, n]
        for j in range(s):
            a = COUPLING[s, j] / h
            before = k[j]
            for i in range(n):
                stage[i] += a * before[i]
        solve(lu, n, pivots, stage)
    error = 0.0
    last = k[7]
    for i in range(n):
        y1[i] += last[i]
        error += (last[i] / scale[i]) ** 2
    for r in range(3):
        row = dense[r]
        for i in range(n):
            row[i] = 0.0
        for j in range(8):
            a = DENSE[r, j]
            before = k[j]
            for i in range(n):
                row[i] += a * before[i]
    return np.sqrt(error / n) if np.isfinite(error) else np.inf
