"""Stress of a rigidly rotating ellipsoid, and the loads that a granular material can bear.

The volume-averaged stress of rigid rotation is ``sigma V = (K - Omegadot - Omega^2) I`` with ``K`` the sum of
self-gravity ``-2 pi G rho A`` and any tide. It is symmetric if ``Omegadot`` obeys Euler's equations; in principal axes,
with ``S = 5 I/m``,

    sigma_ij = (rho/5) (K - Omega^2)_ij 2 S_i S_j/(S_i + S_j)

(theory, sections 3 and 4). A stress is six numbers ``xx, yy, zz, xy, xz, yz``, positive in tension.
"""

from __future__ import annotations

import numpy as np

from flybystab.core.ellipsoid.potential import gravity_coefficients
from flybystab.core.material.yield_surface import required_cohesion, required_friction, slope_over_sine
from flybystab.core.numerics.jit import kernel
from flybystab.core.numerics.tensors import deviator
from flybystab.typing import Array


@kernel
def rigid_load(
    tide: Array,
    omega: Array,
    s: tuple[float, float, float],
    gravity: tuple[float, float, float],
    out: Array,
) -> None:
    """Write the stress ``out[6] = 5 sigma/rho`` of rigid rotation, along the body axes.

    ``(K - Omega^2)_ij 2 S_i S_j/(S_i + S_j)`` with the tide ``tide[6]``, the spin ``omega[3]``, squared semi-axes
    `s` and self-gravity ``K_g,i`` in `gravity`, in any consistent units.
    """
    w2 = omega[0] * omega[0] + omega[1] * omega[1] + omega[2] * omega[2]
    # (-Omega^2)_ij = omega^2 delta_ij - omega_i omega_j
    out[0] = (gravity[0] + tide[0] - omega[0] * omega[0] + w2) * s[0]
    out[1] = (gravity[1] + tide[1] - omega[1] * omega[1] + w2) * s[1]
    out[2] = (gravity[2] + tide[2] - omega[2] * omega[2] + w2) * s[2]
    out[3] = (tide[3] - omega[0] * omega[1]) * 2.0 * s[0] * s[1] / (s[0] + s[1])
    out[4] = (tide[4] - omega[0] * omega[2]) * 2.0 * s[0] * s[2] / (s[0] + s[2])
    out[5] = (tide[5] - omega[1] * omega[2]) * 2.0 * s[1] * s[2] / (s[1] + s[2])


@kernel
def rigid_stress(
    s1: float, s2: float, s3: float, rho: float, pi_g_rho: float, omega: Array, tide: Array, out: Array
) -> None:
    """Write the stress ``out[6]`` (Pa) of rigid rotation at a spin ``omega[3]`` in a tide ``tide[6]``.

    Everything is in principal axes: ``s_i`` squared semi-axes (m2), spin (rad/s), tide (s^-2), density `rho`
    (kg/m3) and `pi_g_rho` is ``pi G rho`` (s^-2). Any other consistent units do as well.
    """
    a1, a2, a3 = gravity_coefficients(s1, s2, s3)
    c = -2.0 * pi_g_rho
    rigid_load(tide, omega, (s1, s2, s3), (c * a1, c * a2, c * a3), out)
    for i in range(6):
        out[i] *= rho / 5.0


@kernel
def invariants(stress: Array) -> tuple[float, float, float]:
    """Pressure ``p``, norm of the deviator ``|s|`` and determinant of ``s/|s|`` (0 where ``s = 0``)."""
    p, s, det = deviator(stress, np.empty(6))
    # A hydrostatic stress has a deviator of a few ulp by rounding, whose direction has no meaning.
    if s <= 4e-16 * abs(p):
        return p, 0.0, 0.0
    return p, s, det


@kernel
def overload(code: int, phi: float, cohesion: float, stress: Array) -> float:
    """``|s| sin(phi)/k(theta) - p sin(phi) - Y cos(phi)``, Pa: positive where the stress cannot be borne.

    A convex function of the stress (the four yield surfaces are convex), finite at ``phi = 0``.
    """
    p, s, det = invariants(stress)
    sin = np.sin(phi)
    return s / slope_over_sine(code, sin, det) - p * sin - cohesion * np.cos(phi)


@kernel
def demand(code: int, phi: float, cohesion: float, stress: Array) -> tuple[float, float]:
    """Least friction angle (rad, at `cohesion`) and least cohesion (at `phi`) that bear a stress."""
    p, s, det = invariants(stress)
    return required_friction(code, cohesion, s, p, det), required_cohesion(code, phi, s, p, det)


@kernel
def _at(base: Array, load: Array, x: float, code: int, phi: float, cohesion: float) -> float:
    stress = np.empty(6)
    for i in range(6):
        stress[i] = base[i] + x * load[i]
    return overload(code, phi, cohesion, stress)


@kernel
def _crossing(
    base: Array, load: Array, inside: float, outside: float, code: int, phi: float, cohesion: float
) -> float:
    """Last ``x`` from `inside` towards `outside` at which the stress is admissible, by bisection to the last bit."""
    for _ in range(200):
        mid = 0.5 * (inside + outside)
        if mid in (inside, outside):
            break
        if _at(base, load, mid, code, phi, cohesion) <= 0.0:
            inside = mid
        else:
            outside = mid
    return inside


@kernel
def _bracketed_minimum(
    base: Array, load: Array, g0: float, scale: float, code: int, phi: float, cohesion: float
) -> tuple[float, float]:
    """Interval of ``x >= 0`` with the least overload of ``base + x load``, by doubling; `g0` is the value at zero."""
    left = 0.0
    mid = 1e-3 * scale
    g_mid = _at(base, load, mid, code, phi, cohesion)
    if g_mid >= g0:
        return left, mid
    right = 2.0 * mid
    g_right = _at(base, load, right, code, phi, cohesion)
    while g_right < g_mid and right < 1e9 * scale:
        left = mid
        mid = right
        g_mid = g_right
        right *= 2.0
        g_right = _at(base, load, right, code, phi, cohesion)
    return left, right


@kernel
def _least_overload(
    base: Array, load: Array, g0: float, a: float, b: float, code: int, phi: float, cohesion: float
) -> tuple[float, float]:
    """``x`` and value of the least overload, at zero (value `g0`) or between `a` and `b`, by golden section."""
    golden = 0.3819660112501051
    best = 0.0
    g_best = g0
    x1 = a + golden * (b - a)
    x2 = b - golden * (b - a)
    g1 = _at(base, load, x1, code, phi, cohesion)
    g2 = _at(base, load, x2, code, phi, cohesion)
    for _ in range(90):
        if g1 < g_best:
            best, g_best = x1, g1
        if g2 < g_best:
            best, g_best = x2, g2
        if g1 < g2:
            b = x2
            x2, g2 = x1, g1
            x1 = a + golden * (b - a)
            g1 = _at(base, load, x1, code, phi, cohesion)
        else:
            a = x1
            x1, g1 = x2, g2
            x2 = b - golden * (b - a)
            g2 = _at(base, load, x2, code, phi, cohesion)
        if b - a <= 1e-15 * abs(b):
            break
    return best, g_best


@kernel
def load_interval(base: Array, load: Array, code: int, phi: float, cohesion: float) -> tuple[float, float]:
    """Least and largest ``x >= 0`` for which the stress ``base + x load`` is admissible; (nan, nan) if there is none.

    The overload is convex along the line, so that the admissible loads form one interval: its minimum is bracketed by
    doubling and found by golden section, its ends by bisection. The upper end is inf if it is unbounded.
    """
    size_load = 0.0
    size_base = 0.0
    for i in range(6):
        size_load = max(size_load, abs(load[i]))
        size_base = max(size_base, abs(base[i]))
    g0 = _at(base, load, 0.0, code, phi, cohesion)
    if size_load == 0.0:
        return (0.0, np.inf) if g0 <= 0.0 else (np.nan, np.nan)
    scale = max(size_base, cohesion) / size_load
    if scale == 0.0:
        scale = 1.0
    left, right = _bracketed_minimum(base, load, g0, scale, code, phi, cohesion)
    best, g_best = _least_overload(base, load, g0, left, right, code, phi, cohesion)
    if g_best > 0.0:
        return np.nan, np.nan
    low = 0.0 if g0 <= 0.0 else _crossing(base, load, best, 0.0, code, phi, cohesion)
    outside = max(right, best)
    while _at(base, load, outside, code, phi, cohesion) <= 0.0:
        outside = 2.0 * outside
        if outside > 1e12 * scale:
            return low, np.inf
    return low, _crossing(base, load, best, outside, code, phi, cohesion)


@kernel
def spin_interval(
    s1: float, s2: float, s3: float, code: int, phi: float, cohesion: float
) -> tuple[float, float]:
    """Lower and upper spin limit ``w2 = omega^2/(pi G rho)`` about ``a3``; (nan, nan) if no spin is admissible.

    `cohesion` is in units of ``pi G rho^2 s1`` with ``s1 = a1^2``, so that only the axis ratios matter.
    """
    omega = np.zeros(3)
    none = np.zeros(6)
    base = np.empty(6)
    rigid_stress(1.0, s2 / s1, s3 / s1, 1.0, 1.0, omega, none, base)
    load = np.zeros(6)
    load[0] = 0.2
    load[1] = 0.2 * s2 / s1
    return load_interval(base, load, code, phi, cohesion)
