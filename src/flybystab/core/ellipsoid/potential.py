"""Self-gravity of a homogeneous ellipsoid: Carlson integrals, coefficients A_i, potential energy.

With semi-axes ``a_i`` and density ``rho`` the internal acceleration is ``-2 pi G rho A_i x_i`` and

    A_i = a1 a2 a3 int_0^inf du / ((a_i^2 + u) Delta) = (2/3) a1 a2 a3 R_D(a_j^2, a_k^2, a_i^2)

(Chandrasekhar 1969, section 17; theory, section 2). ``sum A_i = 2``. The potential energy is
``-(3/5) G m^2 R_F(a1^2, a2^2, a3^2)``.
"""

from __future__ import annotations

import numpy as np

from flybystab.core.numerics.jit import kernel
from flybystab.typing import Array

# 24 Gauss-Legendre nodes on [0, 1]: index symbols to 1e-14 for axis ratios up to 10, 2e-11 up to 100.
_X, _WEIGHTS = np.polynomial.legendre.leggauss(24)
NODES = 0.5 * (1.0 + _X)
WEIGHTS = 0.5 * _WEIGHTS


@kernel
def carlson_fd(x: float, y: float, z: float) -> tuple[float, float, float, float]:
    """``R_F(x,y,z)``, ``R_D(y,z,x)``, ``R_D(z,x,y)``, ``R_D(x,y,z)`` for positive arguments.

    Carlson's duplication theorem (DLMF 19.26.18, 19.36.1-2): all four share one sequence
    ``lambda = sqrt(xy) + sqrt(yz) + sqrt(zx)``, ``x -> (x + lambda)/4``, and the series in the last,
    nearly equal arguments is taken to degree 7. Relative error a few 1e-16, also for ratios of 1e-12.
    """
    sx = 0.0
    sy = 0.0
    sz = 0.0
    power = 1.0  # 4^-n
    for _ in range(60):
        mean = (x + y + z) / 3.0
        spread = max(abs(x - mean), abs(y - mean), abs(z - mean))
        if spread < 8e-3 * mean:
            break
        rx = np.sqrt(x)
        ry = np.sqrt(y)
        rz = np.sqrt(z)
        lam = rx * ry + ry * rz + rz * rx
        sx += power / (rx * (x + lam))
        sy += power / (ry * (y + lam))
        sz += power / (rz * (z + lam))
        power *= 0.25
        x = 0.25 * (x + lam)
        y = 0.25 * (y + lam)
        z = 0.25 * (z + lam)
    mean = (x + y + z) / 3.0
    dx = 1.0 - x / mean
    dy = 1.0 - y / mean
    dz = -(dx + dy)
    e2 = dx * dy - dz * dz
    e3 = dx * dy * dz
    # DLMF 19.36.1
    rf = (
        1.0
        - e2 / 10.0
        + e3 / 14.0
        + e2 * e2 / 24.0
        - 3.0 * e2 * e3 / 44.0
        - 5.0 * e2**3 / 208.0
        + 3.0 * e3 * e3 / 104.0
        + e2 * e2 * e3 / 16.0
    ) / np.sqrt(mean)
    return (
        rf,
        3.0 * sx + power * _rd_series(y, z, x),
        3.0 * sy + power * _rd_series(z, x, y),
        3.0 * sz + power * _rd_series(x, y, z),
    )


@kernel
def _rd_series(x: float, y: float, z: float) -> float:
    """``R_D(x, y, z)`` for nearly equal arguments (DLMF 19.36.2)."""
    mean = (x + y + 3.0 * z) / 5.0
    dx = 1.0 - x / mean
    dy = 1.0 - y / mean
    dz = -(dx + dy) / 3.0
    xy = dx * dy
    z2 = dz * dz
    e2 = xy - 6.0 * z2
    e3 = (3.0 * xy - 8.0 * z2) * dz
    e4 = 3.0 * (xy - z2) * z2
    e5 = xy * z2 * dz
    series = (
        1.0
        - 3.0 * e2 / 14.0
        + e3 / 6.0
        + 9.0 * e2 * e2 / 88.0
        - 3.0 * e4 / 22.0
        - 9.0 * e2 * e3 / 52.0
        + 3.0 * e5 / 26.0
        - e2**3 / 16.0
        + 3.0 * e3 * e3 / 40.0
        + 3.0 * e2 * e4 / 20.0
        + 45.0 * e2 * e2 * e3 / 272.0
        - 9.0 * (e3 * e4 + e2 * e5) / 68.0
    )
    return series / (mean * np.sqrt(mean))


@kernel
def gravity_coefficients(s1: float, s2: float, s3: float) -> tuple[float, float, float]:
    """``A_1, A_2, A_3`` (no unit, sum 2) from squared semi-axes ``s_i = a_i^2``, in any order and unit."""
    # A_i does not depend on the scale: dividing by s1 makes results for 1 m and 1000 km bodies equal to the last bit.
    y = s2 / s1
    z = s3 / s1
    _, d1, d2, d3 = carlson_fd(1.0, y, z)
    c = 2.0 / 3.0 * np.sqrt(y * z)
    return c * d1, c * d2, c * d3


@kernel
def potential_coefficient(s1: float, s2: float, s3: float) -> float:
    """``A_0 = 2 a1 a2 a3 R_F(a1^2, a2^2, a3^2)`` (m2 for ``s_i`` in m2).

    Interior potential per unit mass: ``-pi G rho (A_0 - sum A_i x_i^2)``.
    """
    rf, _, _, _ = carlson_fd(s1, s2, s3)
    return 2.0 * np.sqrt(s1 * s2 * s3) * rf


@kernel
def index_symbols(s1: float, s2: float, s3: float, one: Array, two: Array, three: Array) -> None:
    """Write Chandrasekhar's index symbols ``A_i``, ``A_ij``, ``A_ijk`` of squared semi-axes ``s_i``.

        A_ij... = a1 a2 a3 int_0^inf du / (Delta (s_i + u)(s_j + u)...),   Delta^2 = prod (s_i + u)

    into ``one[3]`` (no unit), ``two[3, 3]`` (m^-2) and ``three[3, 3, 3]`` (m^-4) (Chandrasekhar 1969, section 21).

    The usual recurrences ``A_ij = (A_j - A_i)/(s_i - s_j)`` lose all digits for nearly equal axes. Here all
    symbols come from one Gauss rule in ``y``: with ``tanh y = sqrt((s_max - s_min)/(s_max + u))`` the integrand is
    analytic in the strip ``|Im y| < pi/2`` and the range of ``y`` grows as the logarithm of the axis ratio
    only, so that the rule converges at the same geometric rate for spheres, discs and needles.
    """
    big = max(s1, s2, s3)
    small = min(s1, s2, s3)
    q = np.sqrt((big - small) / big)
    stretch = 1.0  # y_max/q
    if q > 0.0:
        stretch = np.arcsinh(np.sqrt((big - small) / small)) / q
    f1 = f2 = f3 = 1.0
    if q > 0.0:
        f1 = (s1 - small) / (big - small)
        f2 = (s2 - small) / (big - small)
        f3 = (s3 - small) / (big - small)
    for i in range(3):
        one[i] = 0.0
        for j in range(3):
            two[i, j] = 0.0
            for k in range(3):
                three[i, j, k] = 0.0
    volume = np.sqrt(s1 * s2 * s3)
    n = np.empty(3)
    for node in range(NODES.size):
        eta = stretch * NODES[node]
        y = q * eta
        t = np.tanh(y)
        w = t / q if y > 1e-9 else eta
        c = 1.0 / np.cosh(y)
        g1 = c * c + f1 * t * t
        g2 = c * c + f2 * t * t
        g3 = c * c + f3 * t * t
        r = w * w / big
        n[0] = r / g1
        n[1] = r / g2
        n[2] = r / g3
        weight = volume * WEIGHTS[node] * stretch * 2.0 * c * c / np.sqrt(big * g1 * g2 * g3)
        for i in range(3):
            x = weight * n[i]
            one[i] += x
            for j in range(i, 3):
                z = x * n[j]
                two[i, j] += z
                for k in range(j, 3):
                    three[i, j, k] += z * n[k]
    for i in range(3):
        for j in range(i + 1, 3):
            two[j, i] = two[i, j]
        for j in range(3):
            for k in range(3):
                a = min(i, j, k)
                b = max(i, j, k)
                three[i, j, k] = three[a, i + j + k - a - b, b]
