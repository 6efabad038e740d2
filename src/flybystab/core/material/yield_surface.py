"""Yield surfaces ``|s| <= k(theta) (p + Y cot phi)`` of a granular material (theory, section 3).

Stress is positive in tension, ``p = -tr(sigma)/3``, ``s`` the deviator, ``|s|^2 = s:s``. The Lode angle
``theta = asin(-3 sqrt6 det(s/|s|))/3`` runs from -30 deg (triaxial extension) to +30 deg (compression).

The surfaces are the rows of one table, :mod:`flybystab.core.material.surfaces`, and belong to four families:

``CONE``            circular: ``k = 2 sqrt6 sin/(3 - c sin)``, the number ``c`` in the table; ``c = 1`` meets
                    Mohr-Coulomb in triaxial compression, ``c = -1`` in extension
``HEXAGON``         Mohr-Coulomb: ``k = sqrt2 sin/(cos theta - sin theta sin/sqrt3)``
``SMOOTH_HEXAGON``  Matsuoka-Nakai: k is the smallest positive root of ``eta d k^3 + (eta-3)/2 k^2 - (eta-9) = 0``,
                    ``d = det(s/|s|)``, ``eta = I1 I2/I3 = 9 + 8 tan^2``; meets Mohr-Coulomb at both ends
``GENERAL``         any smooth convex section, given by its gauge in the table; the rest is numerical

An unknown code is an error in every kernel.

Associative flow needs the inverse of the normal map: the stress deviator at which ``D'`` is the normal of the section
(`normal`), and the dilation ``tr D = m(D')`` of the flow rule, ``m`` the support function of the section. Both are
expressed by the gauge ``gamma = sin(phi)/k``: the section is ``|s| gamma(theta) <= p sin(phi)``
(+ ``Y cos(phi)``), its normal at ``theta`` is turned by ``atan(gamma'/gamma)`` from the radius, and convexity is
``gamma + gamma'' >= 0``.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from flybystab.core.material import surfaces
from flybystab.core.numerics.jit import code, kernel, uncached_kernel
from flybystab.typing import Array

SQRT2 = np.sqrt(2.0)
SQRT3 = np.sqrt(3.0)
SQRT6 = np.sqrt(6.0)

CONE = code(surfaces.CONE)
HEXAGON = code(surfaces.HEXAGON)
SMOOTH_HEXAGON = code(surfaces.SMOOTH_HEXAGON)
MOHR_COULOMB = code(surfaces.code_of("mohr-coulomb"))
GENERAL = code(surfaces.GENERAL)
_FAMILY = np.array([surface.family for surface in surfaces.SURFACES])
_CONE = np.array([surface.cone for surface in surfaces.SURFACES])


def _gauge_by_code(rows: list[tuple[int, Any]]) -> Any:
    """Kernel ``(surface, sin_phi, theta) -> (gamma, gamma', gamma + gamma'')`` from gauges by their codes."""
    if not rows:

        @uncached_kernel
        def undefined(surface: int, sin_phi: float, theta: float) -> tuple[float, float, float]:
            return np.nan, np.nan, np.nan

        return undefined
    (own_code, function), *rest = rows
    own, others = uncached_kernel(function), _gauge_by_code(rest)

    @uncached_kernel
    def select(surface: int, sin_phi: float, theta: float) -> tuple[float, float, float]:
        if surface == own_code:
            return own(sin_phi, theta)
        return others(surface, sin_phi, theta)

    return select


_general_gauge = _gauge_by_code(
    [(k, surface.gauge) for k, surface in enumerate(surfaces.SURFACES) if surface.gauge is not None]
)


@kernel
def family(surface: int) -> int:
    """Family of a surface; an unknown code raises ValueError."""
    if surface < 0 or surface >= _FAMILY.size:
        raise ValueError("unknown code of a yield surface")
    return _FAMILY[surface]


@kernel
def is_hexagon(surface: int) -> bool:
    """True if the yield section is a hexagon, with faces and corners."""
    return family(surface) == HEXAGON


@kernel
def is_circular(surface: int) -> bool:
    """True if the slope of a surface does not depend on the Lode angle."""
    return family(surface) == CONE


@kernel
def lode_angle(det: float) -> float:
    """Lode angle, rad, from the determinant of the unit deviator."""
    return np.arcsin(min(1.0, max(-1.0, -3.0 * SQRT6 * det))) / 3.0


@kernel
def slope_over_sine(surface: int, sin_phi: float, det: float) -> float:
    """``k / sin(phi)`` in the direction of a unit deviator with determinant `det`; finite at ``phi = 0``."""
    kind = family(surface)
    if kind == CONE:
        return 2.0 * SQRT6 / (3.0 - _CONE[surface] * sin_phi)
    if kind == HEXAGON:
        theta = lode_angle(det)
        return SQRT2 / (np.cos(theta) - np.sin(theta) * sin_phi / SQRT3)
    if kind == GENERAL:
        return 1.0 / _general_gauge(surface, sin_phi, lode_angle(det))[0]
    # x = 1/k solves x^3 - x (eta-3)/(2(eta-9)) - eta det/(eta-9) = 0; with t = tan phi and
    # eta - 9 = 8 t^2 the largest root is 2 sqrt(a/3) cos(acos(b)/3), a = (eta-3)/(2(eta-9)).
    t2 = sin_phi * sin_phi / (1.0 - sin_phi * sin_phi)
    eta = 9.0 + 8.0 * t2
    half = 0.5 * (eta - 3.0)
    # b = (3 eta det / (2 (eta-9))) / (a sqrt(a/3))  written without dividing by t2
    b = 1.5 * eta * det * np.sqrt(8.0 * t2) / (half * np.sqrt(half / 3.0))
    largest = 2.0 * np.sqrt(half / 3.0) * np.cos(np.arccos(min(1.0, max(-1.0, b))) / 3.0)
    # k = sqrt(8) tan(phi) / largest
    return np.sqrt(8.0 / (1.0 - sin_phi * sin_phi)) / largest


@kernel
def slope(surface: int, sin_phi: float, det: float) -> float:
    """Slope ``k(theta)`` of the yield surface in the direction of a unit deviator."""
    return sin_phi * slope_over_sine(surface, sin_phi, det)


@kernel
def gauge(surface: int, sin_phi: float, theta: float) -> tuple[float, float, float]:
    """``gamma = sin(phi)/k``, ``gamma'`` and ``gamma + gamma''`` at a Lode angle, rad."""
    kind = family(surface)
    if kind == HEXAGON:
        t = sin_phi / SQRT3
        c, s = np.cos(theta), np.sin(theta)
        return (c - s * t) / SQRT2, -(s + c * t) / SQRT2, 0.0
    if kind == GENERAL:
        return _general_gauge(surface, sin_phi, theta)
    if kind == CONE:
        g = 1.0 / slope_over_sine(surface, sin_phi, 0.0)
        return g, 0.0, g
    # gamma = size cos(psi/3) with cos psi = -b sin(3 theta), see `slope_over_sine`
    cos2 = 1.0 - sin_phi * sin_phi
    t2 = sin_phi * sin_phi / cos2
    eta = 9.0 + 8.0 * t2
    half = 0.5 * (eta - 3.0)
    b = 1.5 * eta * np.sqrt(8.0 * t2) / (half * np.sqrt(half / 3.0)) / (3.0 * SQRT6)
    size = 2.0 * np.sqrt(half / 3.0) * np.sqrt(cos2 / 8.0)
    s3, c3 = np.sin(3.0 * theta), np.cos(3.0 * theta)
    x = -b * s3
    root2 = max(1e-300, 1.0 - x * x)
    root = np.sqrt(root2)
    third = np.arccos(min(1.0, max(-1.0, x))) / 3.0
    first = b * c3 / root  # psi'/3
    second = -3.0 * b * s3 / root * (1.0 - (b * c3) ** 2 / root2)
    c, s = np.cos(third), np.sin(third)
    value = size * c
    return value, -size * s * first, value - size * (c * first * first + s * second)


@kernel
def _turned(theta: float, s3: float, c3: float, angle: float) -> tuple[float, float]:
    """Coefficients of ``u`` and ``u^2 - 1/3`` in the unit deviator `u` at `theta` turned by a Lode `angle`.

    The unit deviator of increasing theta is ``-(sqrt6 (u^2 - 1/3) + sin(3 theta) u)/cos(3 theta)``.
    """
    ratio = np.sin(angle) / c3
    return np.cos(angle) - ratio * s3, -SQRT6 * ratio


@kernel
def corner(sin_phi: float, det: float, extension: bool) -> tuple[float, float, float, float, float]:
    """As `normal`, with the stress at a given corner of Mohr-Coulomb for any direction ``u``.

    Correct within the fan of normals of that corner (for extension: Lode angles of ``u`` below that of the normal of
    the face); outside it the formulas are continued smoothly.
    """
    s3 = min(1.0 - 5e-13, max(5e-13 - 1.0, -3.0 * SQRT6 * det))
    c3 = np.sqrt(1.0 - s3 * s3)
    flow = np.arcsin(s3) / 3.0
    theta = -np.pi / 6.0 if extension else np.pi / 6.0
    g = 1.0 / gauge(MOHR_COULOMB, sin_phi, theta)[0]
    a, b = _turned(flow, s3, c3, theta - flow)
    return a * g, b * g, np.cos(theta - flow) * g, g, -np.sin(3.0 * theta) / (3.0 * SQRT6)


@kernel
def beyond_face(sin_phi: float, det: float) -> float:
    """Lode angle, rad, of a rate of strain minus that of the normal of a Mohr-Coulomb face.

    It is positive in the fan of the compression corner, negative in that of the extension corner.
    """
    return lode_angle(det) + np.arctan(sin_phi / SQRT3)


@kernel
def onto_face(sin_phi: float, det: float) -> tuple[float, float, float]:
    """Coefficients of ``u`` and ``u^2 - 1/3`` in the normal of the Mohr-Coulomb face closest to a unit deviator ``u``.

    The third number is the determinant of that normal.
    """
    s3 = min(1.0 - 5e-13, max(5e-13 - 1.0, -3.0 * SQRT6 * det))
    a, b = _turned(np.arcsin(s3) / 3.0, s3, np.sqrt(1.0 - s3 * s3), -beyond_face(sin_phi, det))
    return a, b, np.sin(3.0 * np.arctan(sin_phi / SQRT3)) / (3.0 * SQRT6)


@kernel
def normal(surface: int, sin_phi: float, det: float) -> tuple[float, float, float, float, float]:
    """Stress on the yield section whose outward normal is a unit deviator ``u`` of determinant `det`.

    Returns ``a, b``: the stress deviator over ``p sin(phi) + Y cos(phi)`` is ``a u + b (u^2 - 1/3)``; the support
    ``m/sin(phi) = a + 3 b det`` of the section in the direction ``u``; and ``k/sin(phi)`` and the unit determinant
    of that stress.

    Smooth sections: the root of ``gamma' cos(y) - gamma sin(y) = 0`` with ``y`` = (Lode angle of u) - theta is unique,
    since the left-hand side increases with theta for a convex section. Mohr-Coulomb: a corner (`corner`). For ``u``
    normal to a face, at the Lode angle ``-atan(sin(phi)/sqrt3)``, the stress is not unique: its value at one end of the
    face is returned; the support is the same for all.
    """
    if family(surface) == HEXAGON:
        return corner(sin_phi, det, beyond_face(sin_phi, det) <= 0.0)
    if is_circular(surface):
        g = slope_over_sine(surface, sin_phi, det)
        return g, 0.0, g, g, det
    s3 = min(1.0 - 5e-13, max(5e-13 - 1.0, -3.0 * SQRT6 * det))
    c3 = np.sqrt(1.0 - s3 * s3)
    flow = np.arcsin(s3) / 3.0
    low, high = -np.pi / 6.0, np.pi / 6.0
    theta = flow
    for _ in range(60):
        value, first, bend = gauge(surface, sin_phi, theta)
        y = flow - theta
        f = first * np.cos(y) - value * np.sin(y)
        if f > 0.0:
            high = theta
        else:
            low = theta
        step = f / (bend * np.cos(y)) if bend > 0.0 else np.inf
        if abs(step) < 1e-15:
            break
        new = theta - step
        if not (low < new < high):
            new = 0.5 * (low + high)
        if new == theta:
            break
        theta = new
    g = 1.0 / gauge(surface, sin_phi, theta)[0]
    a, b = _turned(flow, s3, c3, theta - flow)
    return a * g, b * g, np.cos(theta - flow) * g, g, -np.sin(3.0 * theta) / (3.0 * SQRT6)


@kernel
def flow_direction(surface: int, sin_phi: float, det: float) -> tuple[float, float, float]:
    """Normal of the yield section at a stress whose unit deviator ``u`` has determinant `det`.

    Returns ``a, b, m/sin(phi)``: the unit normal is ``a u + b (u^2 - 1/3)``, ``m`` the support. At a corner
    the normal is the middle of the fan, which is ``u`` itself.
    """
    s3 = min(1.0, max(-1.0, -3.0 * SQRT6 * det))
    c3 = np.sqrt(1.0 - s3 * s3)
    theta = np.arcsin(s3) / 3.0
    value, first, _ = gauge(surface, sin_phi, theta)
    if c3 < 1e-9 or first == 0.0:
        return 1.0, 0.0, 1.0 / value
    angle = np.arctan(first / value)
    a, b = _turned(theta, s3, c3, angle)
    return a, b, np.cos(angle) / value


@kernel
def least_slope(surface: int, sin_phi: float) -> float:
    """Smallest ``k`` over the Lode angle: the largest dilatancy with non-negative dissipation for all directions."""
    kind = family(surface)
    if kind == CONE:
        return 2.0 * SQRT6 * sin_phi / (3.0 - _CONE[surface] * sin_phi)
    if kind == HEXAGON:  # at tan(theta) = -sin(phi)/sqrt3
        return SQRT2 * sin_phi / np.sqrt(1.0 + sin_phi * sin_phi / 3.0)
    if kind == GENERAL:
        return sin_phi / _largest_gauge(surface, sin_phi)
    return 2.0 * SQRT6 * sin_phi / (3.0 + sin_phi)


@kernel
def _largest_gauge(surface: int, sin_phi: float) -> float:
    """Largest ``gamma`` of a GENERAL surface over the Lode angle: samples, then golden section around the largest."""
    n = 60
    spacing = np.pi / (3.0 * n)
    best = 0
    largest = -np.inf
    for i in range(n + 1):
        value = _general_gauge(surface, sin_phi, -np.pi / 6.0 + i * spacing)[0]
        if value > largest:
            best, largest = i, value
    a = -np.pi / 6.0 + max(best - 1, 0) * spacing
    b = -np.pi / 6.0 + min(best + 1, n) * spacing
    ratio = 0.5 * (np.sqrt(5.0) - 1.0)
    for _ in range(40):
        x1, x2 = b - ratio * (b - a), a + ratio * (b - a)
        f1 = _general_gauge(surface, sin_phi, x1)[0]
        f2 = _general_gauge(surface, sin_phi, x2)[0]
        largest = max(largest, max(f1, f2))
        if f1 < f2:
            a = x1
        else:
            b = x2
    return largest


@kernel
def required_friction(surface: int, cohesion: float, s: float, p: float, det: float) -> float:
    """Mobilised friction angle, rad: the least ``phi`` that bears a stress; inf where none does.

    Parameters
    ----------
    surface : int
        Yield surface.
    cohesion : float
        Mohr-Coulomb cohesion ``Y``, in the unit of `s` and `p`.
    s, p : float
        Norm of the deviator and pressure.
    det : float
        Determinant of the unit deviator (0 where ``s = 0``).

    Notes
    -----
    Cones and Mohr-Coulomb read ``A sin(phi) + B cos(phi) = C``; Matsuoka-Nakai without cohesion is
    ``tan^2(phi) = (I1 I2/I3 - 9)/8``. It is found by bisection with cohesion, and on GENERAL surfaces.
    """
    if s == 0.0:
        return 0.0 if p + cohesion >= 0.0 else np.inf
    kind = family(surface)
    if kind in (SMOOTH_HEXAGON, GENERAL):
        if kind == SMOOTH_HEXAGON and cohesion == 0.0:
            if p <= 0.0:
                return np.inf
            k = s / p
            i3 = 1.0 - 0.5 * k * k - det * k * k * k
            # all principal stresses compressive: I2 > 0 and I3 > 0
            if i3 <= 0.0 or 3.0 - 0.5 * k * k <= 0.0:
                return np.inf
            tan2 = (9.0 - 1.5 * k * k - 9.0 * i3) / (8.0 * i3)
            return np.arctan(np.sqrt(max(0.0, tan2)))
        # Y cos(phi) falls as phi grows: with cohesion the admissible phi may form a bounded interval.
        if _bears(surface, 0.0, cohesion, s, p, det):
            return 0.0
        step = 0.5 * np.pi * (1.0 - 1e-4) / 128.0  # tan^2 must stay finite
        n = 1
        while n <= 128 and not _bears(surface, n * step, cohesion, s, p, det):
            n += 1
        if n > 128:
            return np.inf
        low = (n - 1) * step
        high = n * step
        for _ in range(100):
            mid = 0.5 * (low + high)
            if mid in (low, high):
                break
            if _bears(surface, mid, cohesion, s, p, det):
                high = mid
            else:
                low = mid
        return high
    if kind == HEXAGON:
        theta = lode_angle(det)
        return _hexagon_friction(cohesion, s, p, np.sin(theta), np.cos(theta))
    return _least_angle(2.0 * SQRT6 * p + _CONE[surface] * s, 2.0 * SQRT6 * cohesion, 3.0 * s)


@kernel
def _hexagon_friction(cohesion: float, s: float, p: float, sin: float, cos: float) -> float:
    """`required_friction` of Mohr-Coulomb at the Lode angle with this sine and cosine, for ``s > 0``."""
    return _least_angle(SQRT2 * p + s * sin / SQRT3, SQRT2 * cohesion, s * cos)


@kernel
def _least_angle(a: float, b: float, c: float) -> float:
    """Least ``phi >= 0`` with ``a sin(phi) + b cos(phi) >= c``; inf if there is none below 90 deg."""
    if c <= b:
        return 0.0
    if b == 0.0:
        return np.arcsin(c / a) if a > 0.0 and c < a else np.inf
    r = np.hypot(a, b)
    if a <= 0.0 or c > r:  # a <= 0: the left side falls from b < c as phi grows
        return np.inf
    # r sin(phi + psi) = c, psi = atan2(b, a): the smaller root
    phi = np.arcsin(c / r) - np.arctan2(b, a)
    return phi if phi < 0.5 * np.pi else np.inf


@kernel
def excess_and_friction(
    surface: int, sin_phi: float, strength: float, cohesion: float, s: float, p: float, det: float
) -> tuple[float, float]:
    """Yield excess ``s - k/sin(phi) strength``, and `required_friction`; the trigonometry of both is done once.

    `strength` is ``p sin(phi) + Y cos(phi)``.
    """
    if s > 0.0 and family(surface) == HEXAGON:
        theta = lode_angle(det)
        sin, cos = np.sin(theta), np.cos(theta)
        excess = s - SQRT2 / (cos - sin * sin_phi / SQRT3) * strength
        return excess, _hexagon_friction(cohesion, s, p, sin, cos)
    return s - slope_over_sine(surface, sin_phi, det) * strength, required_friction(
        surface, cohesion, s, p, det
    )


@kernel
def required_frictions(surface: int, cohesion: float, s: Array, p: Array, det: Array) -> Array:
    """`required_friction` of each of a row of stresses."""
    out = np.empty(len(s))
    for i in range(len(s)):
        out[i] = required_friction(surface, cohesion, s[i], p[i], det[i])
    return out


@kernel
def _bears(surface: int, phi: float, cohesion: float, s: float, p: float, det: float) -> bool:
    g = slope_over_sine(surface, np.sin(phi), det)
    return s <= g * (p * np.sin(phi) + cohesion * np.cos(phi))


@kernel
def required_cohesion(surface: int, phi: float, s: float, p: float, det: float) -> float:
    """Least cohesion ``Y = tan(phi) max(0, |s|/k - p)`` that bears a stress, in the unit of `s` and `p`."""
    g = slope_over_sine(surface, np.sin(phi), det)
    return max(0.0, (s / g - p * np.sin(phi)) / np.cos(phi))
