"""Small-tensor algebra for the kernels.

A symmetric tensor is six numbers ``xx, yy, zz, xy, xz, yz``; a matrix is a (3, 3) array. All functions
write to buffers of the caller, so that loops do not allocate memory.
"""

from __future__ import annotations

import numpy as np

from flybystab.core.numerics.jit import kernel
from flybystab.typing import Array


@kernel
def unpack(c: Array, m: Array) -> None:
    """Write the symmetric matrix ``m[3, 3]`` of components ``c[6]``."""
    m[0, 0] = c[0]
    m[1, 1] = c[1]
    m[2, 2] = c[2]
    m[0, 1] = m[1, 0] = c[3]
    m[0, 2] = m[2, 0] = c[4]
    m[1, 2] = m[2, 1] = c[5]


@kernel
def pack(m: Array, c: Array) -> None:
    """Write the components ``c[6]`` of the symmetric part of ``m[3, 3]``."""
    c[0] = m[0, 0]
    c[1] = m[1, 1]
    c[2] = m[2, 2]
    c[3] = 0.5 * (m[0, 1] + m[1, 0])
    c[4] = 0.5 * (m[0, 2] + m[2, 0])
    c[5] = 0.5 * (m[1, 2] + m[2, 1])


@kernel
def multiply(a: Array, b: Array, out: Array) -> None:
    """``out = a b`` for (3, 3) arrays; `out` must not be `a` or `b`."""
    for i in range(3):
        for j in range(3):
            out[i, j] = a[i, 0] * b[0, j] + a[i, 1] * b[1, j] + a[i, 2] * b[2, j]


@kernel
def contract(a: Array, b: Array) -> float:
    """``A:B`` of two (3, 3) arrays."""
    total = 0.0
    for i in range(3):
        for j in range(3):
            total += a[i, j] * b[i, j]
    return total


@kernel
def determinant(c: Array) -> float:
    """Determinant of a symmetric tensor ``c[6]``."""
    return (
        c[0] * (c[1] * c[2] - c[5] * c[5])
        - c[3] * (c[3] * c[2] - c[5] * c[4])
        + c[4] * (c[3] * c[5] - c[1] * c[4])
    )


@kernel
def deviator(c: Array, unit: Array) -> tuple[float, float, float]:
    """``-tr/3``, norm of the deviator and determinant of the unit deviator of ``c[6]``; sets ``unit[6]``.

    Without a deviator `unit` and the determinant are zero. `unit` may be `c`.
    """
    p = -(c[0] + c[1] + c[2]) / 3.0
    a, b, d = c[0] + p, c[1] + p, c[2] + p
    norm = np.sqrt(a * a + b * b + d * d + 2.0 * (c[3] * c[3] + c[4] * c[4] + c[5] * c[5]))
    if norm == 0.0:
        for i in range(6):
            unit[i] = 0.0
        return p, 0.0, 0.0
    f = 1.0 / norm
    unit[0], unit[1], unit[2] = a * f, b * f, d * f
    unit[3], unit[4], unit[5] = c[3] * f, c[4] * f, c[5] * f
    return p, norm, determinant(unit)


@kernel
def inverse(c: Array, out: Array) -> float:
    """Write the inverse matrix ``out[3, 3]`` of a symmetric tensor ``c[6]``; return the determinant."""
    xx = c[1] * c[2] - c[5] * c[5]
    yy = c[0] * c[2] - c[4] * c[4]
    zz = c[0] * c[1] - c[3] * c[3]
    xy = c[4] * c[5] - c[3] * c[2]
    xz = c[3] * c[5] - c[1] * c[4]
    yz = c[3] * c[4] - c[0] * c[5]
    det = c[0] * xx + c[3] * xy + c[4] * xz
    d = 1.0 / det
    out[0, 0] = xx * d
    out[1, 1] = yy * d
    out[2, 2] = zz * d
    out[0, 1] = out[1, 0] = xy * d
    out[0, 2] = out[2, 0] = xz * d
    out[1, 2] = out[2, 1] = yz * d
    return det


@kernel
def eigensystem(c: Array, values: Array, vectors: Array) -> None:
    """Eigenvalues (unsorted) and eigenvectors (columns) of a symmetric tensor ``c[6]``.

    Cyclic Jacobi rotations: exact orthogonality to rounding, degenerate axes included.
    """
    a00, a11, a22, a01, a02, a12 = c[0], c[1], c[2], c[3], c[4], c[5]
    for i in range(3):
        for j in range(3):
            vectors[i, j] = 1.0 if i == j else 0.0
    for _ in range(12):
        off = abs(a01) + abs(a02) + abs(a12)
        if off <= 1e-18 * (abs(a00) + abs(a11) + abs(a22)):
            break
        if a01 != 0.0:
            cs, sn, t = _rotation(a00, a11, a01)
            a00 -= t * a01
            a11 += t * a01
            a01 = 0.0
            a02, a12 = cs * a02 - sn * a12, sn * a02 + cs * a12
            _turn(vectors, 0, 1, cs, sn)
        if a02 != 0.0:
            cs, sn, t = _rotation(a00, a22, a02)
            a00 -= t * a02
            a22 += t * a02
            a02 = 0.0
            a01, a12 = cs * a01 - sn * a12, sn * a01 + cs * a12
            _turn(vectors, 0, 2, cs, sn)
        if a12 != 0.0:
            cs, sn, t = _rotation(a11, a22, a12)
            a11 -= t * a12
            a22 += t * a12
            a12 = 0.0
            a01, a02 = cs * a01 - sn * a02, sn * a01 + cs * a02
            _turn(vectors, 1, 2, cs, sn)
    values[0] = a00
    values[1] = a11
    values[2] = a22


@kernel
def _rotation(app: float, aqq: float, apq: float) -> tuple[float, float, float]:
    """Cosine, sine and tangent of the rotation that makes ``apq`` zero."""
    theta = 0.5 * (aqq - app) / apq
    t = 1.0 / (abs(theta) + np.sqrt(theta * theta + 1.0))
    if theta < 0.0:
        t = -t
    cs = 1.0 / np.sqrt(t * t + 1.0)
    return cs, t * cs, t


@kernel
def _turn(v: Array, p: int, q: int, cs: float, sn: float) -> None:
    for i in range(3):
        vp = v[i, p]
        vq = v[i, q]
        v[i, p] = cs * vp - sn * vq
        v[i, q] = sn * vp + cs * vq
