"""Flow rule of the material: stress and dilation as functions of the rate of strain (theory, section 3).

The stress deviator over ``p sin(phi) + c cos(phi)`` is an isotropic function of the direction ``u`` of ``D'``,
``N = a u + b (u^2 - 1/3)``; the dilation ``tr D`` is proportional to ``|D'|``, or to the support function of the yield
section.
"""

from __future__ import annotations

from flybystab.core.material.parameters import COMPRESSION_CORNER, SMOOTH, MaterialParameters
from flybystab.core.material.yield_surface import corner, normal, slope_over_sine
from flybystab.core.numerics.jit import kernel
from flybystab.core.numerics.tensors import deviator, unpack
from flybystab.typing import Array


@kernel
def fade_start(material: MaterialParameters) -> float:
    """``V/V0`` at which the dilatancy begins to fade."""
    return material.expansion - 0.1 * (material.expansion - 1.0)


@kernel
def fade_share(volume: float, end: float) -> tuple[float, float]:
    """Fraction of the dilatancy that remains at ``V/V0``, and its derivative.

    It falls from 1 to 0 as the cubic ``1 - x^2 (3 - 2 x)`` over the last tenth of the expansion up to `end`, the
    ``V/V0`` of the critical state. Its first derivative is continuous.
    """
    begin = end - 0.1 * (end - 1.0)
    if volume <= begin:
        return 1.0, 0.0
    if volume >= end:
        return 0.0, 0.0
    x = (volume - begin) / (end - begin)
    return 1.0 - x * x * (3.0 - 2.0 * x), -6.0 * x * (1.0 - x) / (end - begin)


@kernel
def dilatancy(volume: float, material: MaterialParameters) -> tuple[float, float]:
    """``beta`` and ``d beta/dV`` at ``V/V0``: constant up to `fade_start`, then falling to zero (`fade_share`).

    For associative flow ``beta`` is the fraction of the associative dilation ``m(D')``.
    """
    share, slope = fade_share(volume, material.expansion)
    return material.beta * share, material.beta * slope


@kernel
def flow_coefficients(det: float, material: MaterialParameters) -> tuple[float, float, float, float, float]:
    """Coefficients ``a, b`` of the stress for a direction ``u`` of ``D'`` with the determinant `det`.

    Returns ``a, b``, the support ``N:u``, the norm of ``N`` and the determinant of the unit stress deviator.
    """
    if not material.normal:
        g = slope_over_sine(material.surface, material.sin_phi, det)
        return g, 0.0, g, g, det
    if material.part == SMOOTH:
        return normal(material.surface, material.sin_phi, det)
    return corner(material.sin_phi, det, material.part != COMPRESSION_CORNER)


@kernel
def flow_stress(
    d: Array, material: MaterialParameters, unit: Array, n: Array
) -> tuple[float, float, float, float]:
    """Stress deviator ``n[3, 3]`` over ``p sin(phi) + c cos(phi)`` of a flow with rate of strain ``d[6]``.

    Returns ``|D'|``, the norm of `n`, the support ``n:Dhat`` and the determinant of the unit stress deviator; sets
    ``unit[6]`` to ``Dhat``. At rest `n` is zero.
    """
    _, norm, det = deviator(d, unit)
    if norm == 0.0:
        g = slope_over_sine(material.surface, material.sin_phi, det)
        unpack(unit, n)
        return norm, g, g, det
    a, b, support, g, det = flow_coefficients(det, material)
    isotropic(a, b, unit, n)
    return norm, g, support, det


@kernel
def isotropic(a: float, b: float, u: Array, n: Array) -> None:
    """Write the deviator ``n[3, 3] = a u + b (u^2 - 1/3)`` of a unit deviator ``u[6]``."""
    u0, u1, u2, u3, u4, u5 = u[0], u[1], u[2], u[3], u[4], u[5]
    n[0, 0] = a * u0 + b * (u0 * u0 + u3 * u3 + u4 * u4 - 1.0 / 3.0)
    n[1, 1] = a * u1 + b * (u3 * u3 + u1 * u1 + u5 * u5 - 1.0 / 3.0)
    n[2, 2] = a * u2 + b * (u4 * u4 + u5 * u5 + u2 * u2 - 1.0 / 3.0)
    n[0, 1] = n[1, 0] = a * u3 + b * (u0 * u3 + u3 * u1 + u4 * u5)
    n[0, 2] = n[2, 0] = a * u4 + b * (u0 * u4 + u3 * u5 + u4 * u2)
    n[1, 2] = n[2, 1] = a * u5 + b * (u3 * u4 + u1 * u5 + u5 * u2)


@kernel
def dilation(beta: float, norm: float, support: float, material: MaterialParameters) -> float:
    """``tr D`` of the flow rule: ``beta |D'|``, or for associative flow the fraction `beta` of ``m(D')``."""
    return beta * norm * (support * material.sin_phi if material.normal else 1.0)
