"""Two embedded one-step methods with dense output, for the equations of :mod:`flybystab.core.dynamics.rates`.

``explicit_step``  DOP853 (Hairer, Norsett & Wanner 1993, section II.5), order 8(5,3), dense output of
                   order 7: the rigid, dispersed and fluid regimes. Coefficients as tabulated in SciPy.
``implicit_step``  Rodas5P (Steinebach 2023, BIT 63:27), an L-stable, stiffly accurate Rosenbrock method of
                   order 5(4), dense output of order 4: plastic flow. The direction of flow relaxes at the
                   rate ``k P/(a^2 |D|)``, which is unbounded at onset and arrest; one linear solve a stage
                   and no Newton iteration follow it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.integrate._ivp import dop853_coefficients as _dop853

from flybystab.core.dynamics.rates import rate
from flybystab.core.dynamics.state import FLOWING, Buffers
from flybystab.core.ellipsoid.tide import TidePanels
from flybystab.core.numerics.jit import kernel
from flybystab.typing import Array

_S = _dop853.N_STAGES  # 12, and one more for the end point, and three for the dense output
_SX = _dop853.N_STAGES_EXTENDED
_A = np.ascontiguousarray(_dop853.A)
_C = np.ascontiguousarray(_dop853.C)
_B = np.ascontiguousarray(_dop853.B)
_E3 = np.ascontiguousarray(_dop853.E3)
_E5 = np.ascontiguousarray(_dop853.E5)
_D = np.ascontiguousarray(_dop853.D)
_POWER = _dop853.INTERPOLATOR_POWER

# Rodas5P: (1/(gamma h) - J) k_i = f(t + c_i h, y + sum a_ij k_j) + sum C_ij k_j / h + h d_i f_t,
# y1 = y + sum b_j k_j with b the last row of a plus the last stage, error = k_8.
GAMMA = 0.21193756319429014
_RC = np.array(
    [0.0, 0.6358126895828704, 0.4095798393397535, 0.9769306725060716, 0.4288403609558664, 1.0, 1.0, 1.0]
)
_RD = np.array(
    [GAMMA, -0.42387512638858027, -0.3384627126235924, 1.8046452872882734, 2.325825639765069, 0.0, 0.0, 0.0]
)
_RA = np.zeros((8, 8))
_RA[1, :1] = [3.0]
_RA[2, :2] = [2.849394379747939, 0.45842242204463923]
_RA[3, :3] = [-6.954028509809101, 2.489845061869568, -10.358996098473584]
_RA[4, :4] = [2.8029986275628964, 0.5072464736228206, -0.3988312541770524, -0.04721187230404641]
_RA[5, :5] = [
    -7.502846399306121,
    2.561846144803919,
    -11.627539656261098,
    -0.18268767659942256,
    0.030198172008377946,
]
_RA[6, :6] = [*_RA[5, :5], 1.0]
_RA[7, :7] = [*_RA[5, :5], 1.0, 1.0]
_RK = np.zeros((8, 8))
_RK[1, :1] = [-14.155112264123755]
_RK[2, :2] = [-17.97296035885952, -2.859693295451294]
_RK[3, :3] = [147.12150275711716, -1.41221402718213, 71.68940251302358]
_RK[4, :4] = [165.43517024871676, -0.4592823456491126, 42.90938336958603, -5.961986721573306]
_RK[5, :5] = [
    24.854864614690072,
    -3.0009227002832186,
    47.4931110020768,
    5.5814197821558125,
    -0.6610691825249471,
]
_RK[6, :6] = [
    30.91273214028599,
    -3.1208243349937974,
    77.79954646070892,
    34.28646028294783,
    -19.097331116725623,
    -28.087943162872662,
]
_RK[7, :7] = [
    37.80277123390563,
    -3.2571969029072276,
    112.26918849496327,
    66.9347231244047,
    -40.06618937091002,
    -54.66780262877968,
    -9.48861652309627,
]
_RH = np.array(
    [
        [
            25.948786856663858,
            -2.5579724845846235,
            10.433815404888879,
            -2.3679251022685204,
            0.524948541321073,
            1.1241088310450404,
            0.4272876194431874,
            -0.17202221070155493,
        ],
        [
            -9.91568850695171,
            -0.9689944594115154,
            3.0438037242978453,
            -24.495224566215796,
            20.176138334709044,
            15.98066361424651,
            -6.789040303419874,
            -6.710236069923372,
        ],
        [
            11.419903575922262,
            2.8879645146136994,
            72.92137995996029,
            80.12511834622643,
            -52.072871366152654,
            -59.78993625266729,
            -0.15582684282751913,
            4.883087185713722,
        ],
    ]
)

#: Rows that the stage buffers need.
N_STAGES = _SX


@kernel
def explicit_step(
    regime: int,
    t: float,
    y: Array,
    n: int,
    h: float,
    par: Array,
    tide: TidePanels,
    work: Buffers,
    k: Array,
    scale: Array,
    y1: Array,
) -> float:
    """One DOP853 step of the first `n` numbers; ``k[0]`` must hold the rate at the start.

    Writes ``y1`` and ``k[1..12]`` (``k[12]``: the rate at the end); returns the error norm (accept at <= 1).
    """
    for s in range(1, _S):
        for i in range(n):
            total = 0.0
            for j in range(s):
                total += _A[s, j] * k[j, i]
            y1[i] = y[i] + h * total
        rate(regime, t + _C[s] * h, y1, k[s], par, tide, work)
    for i in range(n):
        total = 0.0
        for j in range(_S):
            total += _B[j] * k[j, i]
        y1[i] = y[i] + h * total
    rate(regime, t + h, y1, k[_S], par, tide, work)
    e5 = 0.0
    e3 = 0.0
    for i in range(n):
        sum5 = 0.0
        sum3 = 0.0
        for j in range(_S + 1):
            sum5 += _E5[j] * k[j, i]
            sum3 += _E3[j] * k[j, i]
        e5 += (sum5 / scale[i]) ** 2
        e3 += (sum3 / scale[i]) ** 2
    if not np.isfinite(e5 + e3):
        return np.inf
    if e5 == 0.0 and e3 == 0.0:
        return 0.0
    return abs(h) * e5 / np.sqrt((e5 + 0.01 * e3) * n)


@kernel
def explicit_dense(
    regime: int,
    t: float,
    y: Array,
    n: int,
    h: float,
    par: Array,
    tide: TidePanels,
    work: Buffers,
    k: Array,
    y1: Array,
    scratch: Array,
    dense: Array,
) -> None:
    """Write the interpolant ``dense[7, n]`` of a step just made by `explicit_step` (three more rates)."""
    for s in range(_S + 1, _SX):
        for i in range(n):
            total = 0.0
            for j in range(s):
                total += _A[s, j] * k[j, i]
            scratch[i] = y[i] + h * total
        rate(regime, t + _C[s] * h, scratch, k[s], par, tide, work)
    for i in range(n):
        dy = y1[i] - y[i]
        dense[0, i] = dy
        dense[1, i] = h * k[0, i] - dy
        dense[2, i] = 2.0 * dy - h * (k[_S, i] + k[0, i])
        for r in range(_POWER - 3):
            total = 0.0
            for j in range(_SX):
                total += _D[r, j] * k[j, i]
            dense[3 + r, i] = h * total


@kernel
def explicit_at(x: float, y: Array, n: int, dense: Array, out: Array) -> None:
    """State at the fraction ``x`` of a step, from `explicit_dense`."""
    for i in range(n):
        value = 0.0
        for r in range(_POWER):
            value += dense[_POWER - 1 - r, i]
            value *= x if r % 2 == 0 else 1.0 - x
        out[i] = y[i] + value


@kernel
def implicit_at(x: float, y: Array, n: int, dense: Array, y1: Array, out: Array) -> None:
    """State at the fraction ``x`` of a step, from `implicit_step`."""
    for i in range(n):
        out[i] = (1.0 - x) * y[i] + x * (
            y1[i] + (1.0 - x) * (dense[0, i] + x * (dense[1, i] + x * dense[2, i]))
        )


@kernel
def factorise(a: Array, n: int, pivots: NDArray[np.int64]) -> bool:
    """LU factors of ``a[n, n]`` in place with partial pivoting; False if singular."""
    for c in range(n):
        p = c
        big = abs(a[c, c])
        for i in range(c + 1, n):
            if abs(a[i, c]) > big:
                big = abs(a[i, c])
                p = i
        pivots[c] = p
        if not big > 0.0:
            return False
        if p != c:
            for j in range(n):
                a[c, j], a[p, j] = a[p, j], a[c, j]
        inv = 1.0 / a[c, c]
        for i in range(c + 1, n):
            m = a[i, c] * inv
            a[i, c] = m
            if m != 0.0:
                for j in range(c + 1, n):
                    a[i, j] -= m * a[c, j]
    return True


@kernel
def solve(a: Array, n: int, pivots: NDArray[np.int64], b: Array) -> None:
    """Solve ``a x = b`` in place from `factorise`."""
    for c in range(n):
        p = pivots[c]
        if p != c:
            b[c], b[p] = b[p], b[c]
    for i in range(1, n):
        total = b[i]
        for j in range(i):
            total -= a[i, j] * b[j]
        b[i] = total
    for i in range(n - 1, -1, -1):
        total = b[i]
        for j in range(i + 1, n):
            total -= a[i, j] * b[j]
        b[i] = total / a[i, i]


@kernel
def implicit_step(
    t: float,
    y: Array,
    h: float,
    par: Array,
    tide: TidePanels,
    work: Buffers,
    jac: Array,
    lu: Array,
    pivots: NDArray[np.int64],
    k: Array,
    scale: Array,
    y1: Array,
    dense: Array,
) -> float:
    """One Rodas5P step of plastic flow with its Jacobian ``jac[15, 16]``; returns the error norm (accept at <= 1).

    Writes ``y1`` and the interpolant ``dense[3, 15]``.
    """
    n = 15
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
            a = _RA[s, j]
            before = k[j]
            for i in range(n):
                y1[i] += a * before[i]
        rate(FLOWING, t + _RC[s] * h, y1, stage, par, tide, work)
        for i in range(n):
            stage[i] += h * _RD[s] * jac[i, n]
        for j in range(s):
            a = _RK[s, j] / h
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
            a = _RH[r, j]
            before = k[j]
            for i in range(n):
                row[i] += a * before[i]
    return np.sqrt(error / n) if np.isfinite(error) else np.inf
