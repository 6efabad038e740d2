"""Self-gravity of an ellipsoid from its shape tensor, without principal axes, and its derivative.

With ``S`` the shape tensor (squared semi-axes ``s_i`` as eigenvalues) the acceleration is ``-2 pi G rho A x``,

    A = sqrt(det S) Gamma(S),    Gamma = int_0^inf (S + u)^-1 du/Delta,    Delta^2 = det(S + u)

(:mod:`flybystab.core.ellipsoid.potential`). The inverse is the adjugate over the determinant, and the adjugate is
a polynomial:

    adj(S + u) = adj S + u (tr S - S) + u^2,    Delta^2 = I3 + I2 u + I1 u^2 + u^3.

So ``Gamma = M_0 adj S + M_1 (tr S - S) + M_2`` with three integrals ``M_k = int u^k du/Delta^3`` that depend on the
invariants ``I_n`` alone. All terms are positive: there is no cancellation, also for spheres and spheroids.

The integrals are Gauss sums. ``t = sqrt(m/(m + u))`` makes them polynomials for a sphere,

    M_k = 2 m^(k - 7/2) int_0^1 t^(6-2k) (1 - t^2)^k dt / Q^(3/2),    Q = prod (1 - t^2 + s_i t^2/m),

and with ``m^2 = I1 I3/I2`` the singularities of the integrand are equally far for discs and needles. The number of
nodes for full precision depends on ``I1 I2/I3`` (9 for a sphere) alone, to a few per cent.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial.legendre import leggauss

from flybystab.core.ellipsoid.potential import gravity_coefficients
from flybystab.core.numerics.jit import kernel, summing_kernel
from flybystab.core.numerics.tensors import eigensystem
from flybystab.typing import Array

#: Nodes of the rules, and the largest ``I1 I2/I3`` at which each keeps 7e-15: axis ratios of 2, 4, 9 and 20 at least.
NODES = (12, 20, 32, 48)
REACH = (13.0, 37.0, 175.0, 750.0)


# the positive half of each symmetric rule
_T, _WEIGHT = np.concatenate([np.array(leggauss(2 * n))[:, n:] for n in NODES], axis=1)
_FIRST = np.concatenate([[0], np.cumsum(NODES)])
_X = _T * _T
# Q = Q_0 + j1 Q_1 + j2 Q_2 + j3 Q_3 with the invariants j of S/m
_Q0, _Q1, _Q2, _Q3 = (_X**k * (1.0 - _X) ** (3 - k) for k in range(4))
_M0, _M1, _M2 = (2.0 * _WEIGHT * _X ** (3 - k) * (1.0 - _X) ** k for k in range(3))
_N0, _N1, _N2, _N3, _N4 = (2.0 * _WEIGHT * _X ** (6 - k) * (1.0 - _X) ** k for k in range(5))


@kernel
def _rule(ratio: float) -> int:
    """The rule for a value of ``I1 I2/I3``; the longest beyond all of them."""
    rule = 0
    while rule < len(NODES) - 1 and ratio > REACH[rule]:
        rule += 1
    return rule


@summing_kernel
def _first_moments(a: int, b: int, j1: float, j2: float, j3: float) -> tuple[float, float, float]:
    """``M_k`` of ``S/m``."""
    m0 = m1 = m2 = 0.0
    for i in range(a, b):
        q = _Q0[i] + j1 * _Q1[i] + j2 * _Q2[i] + j3 * _Q3[i]
        f = 1.0 / (q * np.sqrt(q))
        m0 += _M0[i] * f
        m1 += _M1[i] * f
        m2 += _M2[i] * f
    return m0, m1, m2


@summing_kernel
def _second_moments(
    a: int, b: int, j1: float, j2: float, j3: float
) -> tuple[float, float, float, float, float]:
    """``N_k = int u^k du/Delta^5`` of ``S/m``."""
    n0 = n1 = n2 = n3 = n4 = 0.0
    for i in range(a, b):
        q = _Q0[i] + j1 * _Q1[i] + j2 * _Q2[i] + j3 * _Q3[i]
        f = 1.0 / (q * q * np.sqrt(q))
        n0 += _N0[i] * f
        n1 += _N1[i] * f
        n2 += _N2[i] * f
        n3 += _N3[i] * f
        n4 += _N4[i] * f
    return n0, n1, n2, n3, n4


@kernel
def _invariants(s: Array, sinv: Array, det: float) -> tuple[float, float, float]:
    """``I1``, ``I2`` and ``sqrt(I1 I3/I2)``."""
    i1 = s[0] + s[1] + s[2]
    i2 = det * (sinv[0, 0] + sinv[1, 1] + sinv[2, 2])
    return i1, i2, np.sqrt(i1 * det / i2)


@kernel
def invariant_ratio(s: Array, sinv: Array) -> float:
    """``I1 I2/I3 = tr S tr S^-1``: 9 for a sphere; below ``(r + 1 + 1/r)^2`` no axis ratio exceeds ``r``."""
    return (s[0] + s[1] + s[2]) * (sinv[0, 0] + sinv[1, 1] + sinv[2, 2])


@kernel
def gravity_tensor(s: Array, sinv: Array, det: float, values: Array, vectors: Array, out: Array) -> None:
    """Write ``Gamma[3, 3]``, self-gravity over ``-2 pi G rho sqrt(det S)``, of a shape tensor ``s[6]``.

    Parameters
    ----------
    s, sinv, det : ndarray (6,), ndarray (3, 3), float
        Shape tensor in any unit, its inverse and determinant (:func:`flybystab.core.numerics.tensors.inverse`).
    values, vectors : ndarray (3,), ndarray (3, 3)
        Scratch for the principal axes, which are used only beyond the range of the Gauss rules.
    """
    ratio = invariant_ratio(s, sinv)
    if ratio > REACH[-1]:
        eigensystem(s, values, vectors)
        a1, a2, a3 = gravity_coefficients(values[0], values[1], values[2])
        c = 1.0 / np.sqrt(det)
        for i in range(3):
            for j in range(3):
                axes = a1 * vectors[i, 0] * vectors[j, 0] + a2 * vectors[i, 1] * vectors[j, 1]
                out[i, j] = c * (axes + a3 * vectors[i, 2] * vectors[j, 2])
        return
    i1, i2, m = _invariants(s, sinv, det)
    r = 1.0 / m
    rule = _rule(ratio)
    m0, m1, m2 = _first_moments(_FIRST[rule], _FIRST[rule + 1], i1 * r, i2 * r * r, det * r * r * r)
    f = r * r * r * np.sqrt(r)  # m^(-7/2)
    m0 *= f * det
    m1 *= f * m
    m2 *= f * m * m
    d = m1 * i1 + m2
    out[0, 0] = m0 * sinv[0, 0] - m1 * s[0] + d
    out[1, 1] = m0 * sinv[1, 1] - m1 * s[1] + d
    out[2, 2] = m0 * sinv[2, 2] - m1 * s[2] + d
    out[0, 1] = out[1, 0] = m0 * sinv[0, 1] - m1 * s[3]
    out[0, 2] = out[2, 0] = m0 * sinv[0, 2] - m1 * s[4]
    out[1, 2] = out[2, 1] = m0 * sinv[1, 2] - m1 * s[5]


@kernel
def gravity_derivative(s: Array, sinv: Array, det: float, out: Array) -> None:
    """Write ``out[6, :6]``: components (columns) of the derivative of ``Gamma`` along each of those of ``s`` (rows).

    An off-diagonal component changes both elements of ``S``. With ``dM_k = -3/2 (N_(k+2) dI1 + N_(k+1) dI2 + N_k
    dI3)``. Beyond the range of the rules the error is up to 2e-5 of the largest element (axis ratio of 100).
    """
    i1, i2, m = _invariants(s, sinv, det)
    r = 1.0 / m
    rule = _rule(invariant_ratio(s, sinv))
    a, b = _FIRST[rule], _FIRST[rule + 1]
    j1, j2, j3 = i1 * r, i2 * r * r, det * r * r * r
    m0, m1, _ = _first_moments(a, b, j1, j2, j3)
    f = j3 * np.sqrt(r) / det  # m^(-7/2)
    m0 *= f
    m1 *= f * m
    n0, n1, n2, n3, n4 = _second_moments(a, b, j1, j2, j3)
    f *= -1.5 * r * r * r  # -3/2 m^(-13/2)
    n0 *= f
    n1 *= f * m
    n2 *= f * m * m
    n3 *= f * m * m * m
    n4 *= f * m * m * m * m
    for c in range(6):
        p, q = (c, c) if c < 3 else ((0, 1) if c == 3 else (0, 2) if c == 4 else (1, 2))
        # invariants along the direction H of this component: tr H, I1 tr H - S:H, adj S:H
        if c < 3:
            d1, d2, d3 = 1.0, i1 - s[c], det * sinv[c, c]
        else:
            d1, d2, d3 = 0.0, -2.0 * s[c], 2.0 * det * sinv[p, q]
        dm0 = n2 * d1 + n1 * d2 + n0 * d3
        dm1 = n3 * d1 + n2 * d2 + n1 * d3
        dm2 = n4 * d1 + n3 * d2 + n2 * d3
        diagonal = dm1 * i1 + m1 * d1 + dm2
        row = out[c]
        row[0] = dm0 * det * sinv[0, 0] - dm1 * s[0] + diagonal
        row[1] = dm0 * det * sinv[1, 1] - dm1 * s[1] + diagonal
        row[2] = dm0 * det * sinv[2, 2] - dm1 * s[2] + diagonal
        row[3] = dm0 * det * sinv[0, 1] - dm1 * s[3]
        row[4] = dm0 * det * sinv[0, 2] - dm1 * s[4]
        row[5] = dm0 * det * sinv[1, 2] - dm1 * s[5]
        row[c] -= m1
    # M_0 times the derivative of the adjugate, each element of which is a difference of two products
    _add_adjugate_derivative(m0, s, out)


@kernel
def _add_adjugate_derivative(m: float, s: Array, out: Array) -> None:
    """Add to ``out[6, 6]`` `m` times the derivative of the adjugate of ``s[6]`` along each of its components."""
    xx, yy, zz, xy, xz, yz = m * s[0], m * s[1], m * s[2], m * s[3], m * s[4], m * s[5]
    # adj_xx = S_yy S_zz - S_yz^2 and so on; adj_xy = S_xz S_yz - S_xy S_zz
    out[1, 0] += zz
    out[2, 0] += yy
    out[5, 0] -= 2.0 * yz
    out[0, 1] += zz
    out[2, 1] += xx
    out[4, 1] -= 2.0 * xz
    out[0, 2] += yy
    out[1, 2] += xx
    out[3, 2] -= 2.0 * xy
    out[4, 3] += yz
    out[5, 3] += xz
    out[3, 3] -= zz
    out[2, 3] -= xy
    out[3, 4] += yz
    out[5, 4] += xy
    out[4, 4] -= yy
    out[1, 4] -= xz
    out[3, 5] += xz
    out[4, 5] += xy
    out[5, 5] -= xx
    out[0, 5] -= yz
