"""DOP853, the explicit Runge-Kutta method of Dormand & Prince of order 8(5,3).

Hairer, Norsett & Wanner (1993), section II.5, with dense output of order 7; coefficients as tabulated in SciPy. The
combinations of the stages are inlined into their callers and compiled with the floating-point flags of the caller.
"""

from __future__ import annotations

import runpy
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from flybystab.core.numerics.jit import inlined
from flybystab.typing import Array

#: Stages of a step; the rate at its end is one more, and dense output takes three more.
N_STAGES = 12
N_EXTENDED = 16
#: Powers of the dense output.
N_POWERS = 7


def coefficients() -> Any:
    """Coefficients A, C, E3, E5 and D of the method in SciPy.

    They are read from the file in which SciPy has kept them since version 1.4, if it is there: importing
    ``scipy.integrate`` takes 0.2 s.
    """
    scipy = find_spec("scipy")
    for folder in (scipy and scipy.submodule_search_locations) or ():
        file = Path(folder) / "integrate" / "_ivp" / "dop853_coefficients.py"
        if file.is_file():
            found = runpy.run_path(str(file))
            if {"A", "C", "E3", "E5", "D"} <= found.keys():
                return tuple(found[name] for name in ("A", "C", "E3", "E5", "D"))
    from scipy.integrate import DOP853

    a = np.zeros((N_EXTENDED, N_EXTENDED))
    a[:N_STAGES, :N_STAGES], a[N_STAGES, :N_STAGES], a[N_STAGES + 1 :] = DOP853.A, DOP853.B, DOP853.A_EXTRA
    return a, np.concatenate([DOP853.C, [1.0], DOP853.C_EXTRA]), DOP853.E3, DOP853.E5, DOP853.D


_A, NODE, E3, E5, D = (np.ascontiguousarray(table) for table in coefficients())
# Rows of the tableau without their zeros (a third of it): row s combines the stages STAGE[FROM[s] : FROM[s + 1]]. Row
# 12 gives the solution, rows 13 to 15 the stages of the dense output. NODE has their nodes.
STAGE = np.concatenate([np.flatnonzero(row) for row in _A])
WEIGHT = _A[_A != 0.0]
FROM = np.concatenate([[0], np.cumsum([np.count_nonzero(row) for row in _A])])


@inlined
def stage_state(s: int, y: Array, n: int, h: float, k: Array, out: Array) -> None:
    """Write the state ``out[n]`` at which the rate of stage `s` is taken (the solution for ``s = 12``)."""
    for i in range(n):
        out[i] = 0.0
    for m in range(FROM[s], FROM[s + 1]):
        a = WEIGHT[m]
        j = STAGE[m]
        for i in range(n):
            out[i] += a * k[j, i]
    for i in range(n):
        out[i] = y[i] + h * out[i]


@inlined
def error_sums(n: int, k: Array, scale: Array) -> tuple[float, float]:
    """Sums of squares of the error estimates of order 5 and 3, over ``scale[n]``, from the rates ``k[13, n]``."""
    five = 0.0
    three = 0.0
    for j in range(n):
        e5 = 0.0
        e3 = 0.0
        for i in range(N_STAGES + 1):
            e5 += E5[i] * k[i, j]
            e3 += E3[i] * k[i, j]
        five += (e5 / scale[j]) ** 2
        three += (e3 / scale[j]) ** 2
    return five, three


@inlined
def error_norm(five: float, three: float, n: int, h: float) -> float:
    """Error of a step of `n` numbers from the sums of `error_sums`."""
    if five == 0.0 and three == 0.0:
        return 0.0
    return abs(h) * five / np.sqrt((five + 0.01 * three) * n)


@inlined
def dense_coefficients(y: Array, y1: Array, n: int, h: float, k: Array, dense: Array) -> None:
    """Write the interpolant ``dense[7, n]`` of a step from `y` to `y1` with the rates ``k[16, n]``."""
    for i in range(n):
        dy = y1[i] - y[i]
        dense[0, i] = dy
        dense[1, i] = h * k[0, i] - dy
        dense[2, i] = 2.0 * dy - h * (k[N_STAGES, i] + k[0, i])
        for r in range(N_POWERS - 3):
            total = 0.0
            for j in range(N_EXTENDED):
                total += D[r, j] * k[j, i]
            dense[3 + r, i] = h * total


@inlined
def dense_state(x: float, y: Array, n: int, dense: Array, out: Array) -> None:
    """State ``out[n]`` at the fraction ``x`` of a step with the interpolant `dense`."""
    for i in range(n):
        value = 0.0
        for r in range(N_POWERS):
            value += dense[N_POWERS - 1 - r, i]
            value *= x if r % 2 == 0 else 1.0 - x
        out[i] = y[i] + value
