"""Tidal tensors, and a tide as a function of time.

The tide of a point mass at ``R = R n`` is ``K = (GM/R^3)(3 n n - 1)`` (theory, section 2; the
acceleration of a body element at ``x`` from the centre is ``K x``). A symmetric tensor is stored as
its six components ``xx, yy, zz, xy, xz, yz``.

A whole encounter is stored as :class:`TidePanels`: piecewise Chebyshev series of the six components in
``u = asinh(t / tau)``, ``t`` counted from closest approach and ``tau`` = periapsis distance over speed.
In ``u`` the tide varies on a scale of one for grazing and distant passages alike, so that panels of
equal width keep 1e-13 of the peak; in ``t`` the same number of nodes loses nine digits.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev

from flybystab.core.numerics.jit import kernel
from flybystab.typing import Array

#: Row and column of each stored component of a symmetric tensor.
COMPONENTS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


class TidePanels(NamedTuple):
    """Piecewise Chebyshev series of a tidal tensor, in SI units or any other consistent ones.

    Attributes
    ----------
    tau : float
        Time scale of the change of variable, s.
    start : float
        ``u`` at the start of the first panel.
    width : float
        Width of a panel in ``u``.
    coefficients : ndarray, shape (panels, degree + 1, 6)
        Chebyshev coefficients of each component on each panel, s^-2. No panels: no tide.
    """

    tau: float
    start: float
    width: float
    coefficients: Array


@kernel
def tide_point(gm: float, x: float, y: float, z: float, out: Array) -> None:
    """Add to ``out[6]`` the tide of a point mass ``gm`` (m3/s2) at ``(x, y, z)`` (m) from the body, s^-2."""
    r2 = x * x + y * y + z * z
    c = gm / (r2 * np.sqrt(r2))
    q = 3.0 * c / r2
    out[0] += q * x * x - c
    out[1] += q * y * y - c
    out[2] += q * z * z - c
    out[3] += q * x * y
    out[4] += q * x * z
    out[5] += q * y * z


@kernel
def tide_j2(
    gm: float,
    j2: float,
    radius: float,
    px: float,
    py: float,
    pz: float,
    x: float,
    y: float,
    z: float,
    out: Array,
) -> None:
    """Add to ``out[6]`` the tide of the J2 of a planet at ``(x, y, z)`` (m) from the body, s^-2.

    ``(px, py, pz)`` is the unit vector of the planet's pole. With the field point at ``r`` from the
    planet and ``s = r.p``, the force function (minus the potential) is ``c (1/r^3 - 3 s^2/r^5)``,
    ``c = GM J2 a^2 / 2``; this is its Hessian, the tensor that multiplies a displacement.
    """
    c = 0.5 * gm * j2 * radius * radius
    r2 = x * x + y * y + z * z
    r = np.sqrt(r2)
    s = -(x * px + y * py + z * pz)
    i5 = 1.0 / (r2 * r2 * r)
    i7 = i5 / r2
    i9 = i7 / r2
    rx, ry, rz = -x, -y, -z
    # d_i d_j (r^-3) = 15 r_i r_j / r^7 - 3 d_ij / r^5
    # d_i d_j (s^2/r^5) = 2 p_i p_j/r^5 - 10 s (p_i r_j + r_i p_j)/r^7 - 5 s^2 d_ij/r^7 + 35 s^2 r_i r_j/r^9
    a = 15.0 * i7 - 105.0 * s * s * i9
    b = -3.0 * i5 + 15.0 * s * s * i7
    d = -6.0 * i5
    e = 30.0 * s * i7
    out[0] += c * (a * rx * rx + b + d * px * px + 2.0 * e * px * rx)
    out[1] += c * (a * ry * ry + b + d * py * py + 2.0 * e * py * ry)
    out[2] += c * (a * rz * rz + b + d * pz * pz + 2.0 * e * pz * rz)
    out[3] += c * (a * rx * ry + d * px * py + e * (px * ry + rx * py))
    out[4] += c * (a * rx * rz + d * px * pz + e * (px * rz + rx * pz))
    out[5] += c * (a * ry * rz + d * py * pz + e * (py * rz + ry * pz))


@kernel
def panel_at(tau: float, start: float, width: float, n: int, t: float) -> tuple[int, float]:
    """Which of `n` panels holds the time `t`, and the place -1...1 in it; the nearest end for times outside."""
    v = (np.arcsinh(t / tau) - start) / width
    i = min(max(int(np.floor(v)), 0), n - 1)
    return i, min(max(2.0 * (v - i) - 1.0, -1.0), 1.0)


@kernel
def tide_at(tau: float, start: float, width: float, coefficients: Array, t: float, out: Array) -> None:
    """Write into ``out[6]`` the tide at time ``t`` (s from closest approach); zero where there are no panels.

    Times outside the panels use the nearest panel's end value, so that a rounding error in ``t`` is harmless;
    callers keep ``t`` inside.
    """
    n = coefficients.shape[0]
    if n == 0:
        for j in range(6):
            out[j] = 0.0
        return
    i, x = panel_at(tau, start, width, n, t)
    c = coefficients[i]
    # Clenshaw, b_k = c_k + 2 x b_(k+1) - b_(k+2), all six at once: each alone would wait for itself
    x2 = 2.0 * x
    p0 = p1 = p2 = p3 = p4 = p5 = 0.0
    q0 = q1 = q2 = q3 = q4 = q5 = 0.0
    for k in range(c.shape[0] - 1, 0, -1):
        p0, q0 = c[k, 0] + x2 * p0 - q0, p0
        p1, q1 = c[k, 1] + x2 * p1 - q1, p1
        p2, q2 = c[k, 2] + x2 * p2 - q2, p2
        p3, q3 = c[k, 3] + x2 * p3 - q3, p3
        p4, q4 = c[k, 4] + x2 * p4 - q4, p4
        p5, q5 = c[k, 5] + x2 * p5 - q5, p5
    out[0] = c[0, 0] + x * p0 - q0
    out[1] = c[0, 1] + x * p1 - q1
    out[2] = c[0, 2] + x * p2 - q2
    out[3] = c[0, 3] + x * p3 - q3
    out[4] = c[0, 4] + x * p4 - q4
    out[5] = c[0, 5] + x * p5 - q5


def tensor(components: Array) -> Array:
    """Symmetric matrices, shape (..., 3, 3), from components, shape (..., 6)."""
    c = np.asarray(components, dtype=float)
    out = np.empty((*c.shape[:-1], 3, 3))
    for k, (i, j) in enumerate(COMPONENTS):
        out[..., i, j] = out[..., j, i] = c[..., k]
    return out


def components(matrix: Array) -> Array:
    """Components, shape (..., 6), of symmetric matrices, shape (..., 3, 3)."""
    m = np.asarray(matrix, dtype=float)
    return np.stack([m[..., i, j] for i, j in COMPONENTS], axis=-1)


def no_tide() -> TidePanels:
    """A tide that is zero at all times."""
    return TidePanels(1.0, 0.0, 1.0, np.zeros((0, 1, 6)))


def tide_panels(
    tide: Callable[[Array], Array],
    t_start: float,
    t_stop: float,
    tau: float,
    *,
    width: float = 0.5,
    degree: int = 13,
) -> tuple[TidePanels, float]:
    """Chebyshev panels of a tide.

    Parameters
    ----------
    tide : callable
        Maps times, shape (n,), in s from closest approach, to components, shape (n, 6), in s^-2; or to any other
        number of functions of time.
    t_start, t_stop : float
        Span, s from closest approach.
    tau : float
        Time scale of the passage, s: periapsis distance over periapsis speed.
    width, degree : float, int
        Largest panel width in ``u = asinh(t/tau)`` and degree of the series on each panel.

    Returns
    -------
    panels : TidePanels
    error : float
        Largest difference from `tide` half-way between the nodes, over the peak of ``|K|``: a measured
        interpolation error.
    """
    u0, u1 = np.arcsinh(t_start / tau), np.arcsinh(t_stop / tau)
    n = max(1, int(np.ceil((u1 - u0) / width)))
    w = (u1 - u0) / n
    k = np.arange(degree + 1)
    nodes = np.cos(np.pi * (k + 0.5) / (degree + 1))
    between = np.cos(np.pi * np.arange(1, degree + 1) / (degree + 1))
    left = u0 + w * np.arange(n)
    u_nodes = left[:, None] + 0.5 * w * (1.0 + nodes)
    u_tests = left[:, None] + 0.5 * w * (1.0 + between)
    values = tide(tau * np.sinh(u_nodes.ravel())).reshape(n, degree + 1, -1)
    exact = tide(tau * np.sinh(u_tests.ravel())).reshape(n, degree, -1)
    # Discrete cosine transform: exact interpolation at the Chebyshev nodes.
    transform = 2.0 / (degree + 1) * np.cos(np.pi * k[:, None] * (k + 0.5) / (degree + 1))
    transform[0] *= 0.5
    coefficients = np.ascontiguousarray(np.einsum("ab,nbj->naj", transform, values))
    fitted = np.stack([chebyshev.chebval(between, c) for c in coefficients])  # (n, components, degree)
    peak = np.abs(values).max()
    error = np.abs(np.swapaxes(fitted, 1, 2) - exact).max() / peak if peak > 0 else 0.0
    return TidePanels(float(tau), float(u0), float(w), coefficients), float(error)
