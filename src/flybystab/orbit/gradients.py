"""Gradients of the gravitational accelerations of an asteroid by its position and velocity.

They are the coefficients of the variational equations (e.g. Montenbruck & Gill 2000, section 7.2):

- point masses: ``GM (3 r r^T/r^5 - 1/r^3)``;
- zonal harmonics: central differences of their acceleration as a function of the position relative to the body;
- relativity: the Schwarzschild term of the Sun; the other terms of 1PN are smaller by three orders of magnitude.

Those of the non-gravitational acceleration are in :mod:`flybystab.orbit.nongravitational`. A gradient is an array
``a[3, 6]``: derivatives of the acceleration by position (1/s2) and by velocity (1/s).
"""

from __future__ import annotations

import numpy as np

from flybystab.constants import C_LIGHT
from flybystab.core.numerics.jit import kernel
from flybystab.orbit.forces import fade, zonal_factors
from flybystab.typing import Array

#: Step of the difference quotients over the distance.
_RELATIVE_STEP = 1e-4


@kernel
def add_attraction_gradient(p: Array, n: int, gm: Array, inner2: Array, y: Array, a: Array) -> None:
    """Add the gradient of the attraction by `n` bodies at ``y[:3]`` (m) to ``a[3, 6]``.

    ``p`` has the positions (m): x of all bodies, then y, then z; ``inner2`` the squares of the radii of their smooth
    cores, m2. Inside a core the gradient is that at its surface.
    """
    x, y_, z = y[0], y[1], y[2]
    sxx = sxy = sxz = syy = syz = szz = trace = 0.0
    for i in range(n):
        dx, dy, dz = p[i] - x, p[n + i] - y_, p[2 * n + i] - z
        r2 = max(dx * dx + dy * dy + dz * dz, inner2[i])
        c = gm[i] / (r2 * np.sqrt(r2))
        b = 3.0 * c / r2
        trace += c
        sxx += b * dx * dx
        sxy += b * dx * dy
        sxz += b * dx * dz
        syy += b * dy * dy
        syz += b * dy * dz
        szz += b * dz * dz
    a[0, 0] += sxx - trace
    a[1, 1] += syy - trace
    a[2, 2] += szz - trace
    a[0, 1] += sxy
    a[1, 0] += sxy
    a[0, 2] += sxz
    a[2, 0] += sxz
    a[1, 2] += syz
    a[2, 1] += syz


@kernel
def add_oblateness_gradient(
    c2: float, c3: float, c4: float, pole: Array, inner2: float, d: Array, a: Array
) -> None:
    """Add the gradient of the acceleration by J2, J3, J4 at ``d`` (m) from a body to ``a[3, 6]``.

    ``cn = Jn GM a^n`` (m^(n+3)/s2), ``pole[3]`` is the pole at that time, ``inner2`` the square of the radius of the
    smooth core (m2), below which the harmonics fade.
    """
    x = np.empty(3)
    ends = np.empty((2, 3))
    r = np.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
    w = fade(r * r / inner2)
    if w == 0.0:
        return
    h = _RELATIVE_STEP * r
    for m in range(3):
        for side in range(2):
            x[:] = d
            x[m] += h if side == 0 else -h
            b = np.sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2])
            s = (x[0] * pole[0] + x[1] * pole[1] + x[2] * pole[2]) / b
            radial, along = zonal_factors(w * c2, w * c3, w * c4, 1.0 / b, s)
            for j in range(3):
                ends[side, j] = radial * x[j] + along * pole[j]
        for j in range(3):
            a[j, m] += 0.5 * (ends[0, j] - ends[1, j]) / h


@kernel
def add_relativity_gradient(gm: float, r: Array, v: Array, a: Array) -> None:
    """Add the gradient of ``GM/(c^2 r^3) [(4 GM/r - v^2) r + 4 (r.v) v]`` by position and velocity to ``a[3, 6]``.

    ``r`` (m) and ``v`` (m/s) are heliocentric, ``gm`` (m3/s2) is the Sun's.
    """
    r2 = r[0] * r[0] + r[1] * r[1] + r[2] * r[2]
    v2 = v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
    rv = r[0] * v[0] + r[1] * v[1] + r[2] * v[2]
    d = np.sqrt(r2)
    k = gm / (C_LIGHT * C_LIGHT * r2 * d)
    b = 4.0 * gm / d - v2
    for j in range(3):
        whole = b * r[j] + 4.0 * rv * v[j]
        a[j, j] += k * b
        a[j, 3 + j] += 4.0 * k * rv
        for m in range(3):
            a[j, m] += k * (-3.0 * r[m] / r2 * whole - 4.0 * gm * r[m] / (r2 * d) * r[j] + 4.0 * v[m] * v[j])
            a[j, 3 + m] += k * (4.0 * r[m] * v[j] - 2.0 * v[m] * r[j])
