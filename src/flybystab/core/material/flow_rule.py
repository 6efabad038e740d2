"""What a rate of strain says of the stress and of the dilation: the flow rule (theory, section 3).

The stress deviator over ``p sin(phi) + c cos(phi)`` is an isotropic function of the direction ``u`` of ``D'``,
``N = a u + b (u^2 - 1/3)``; the dilation ``tr D`` is a share of ``|D'|``, or of the support of the yield section.
"""

from __future__ import annotations

from flybystab.core.material.parameters import (
    BETA,
    COMPRESSION_CORNER,
    EXPANSION,
    NORMAL,
    PART,
    SIN_PHI,
    SMOOTH,
    SURFACE,
)
from flybystab.core.material.yield_surface import corner, normal, slope_over_sine
from flybystab.core.numerics.jit import kernel
from flybystab.core.numerics.tensors import deviator, unpack
from flybystab.typing import Array


@kernel
def fade(par: Array) -> float:
    """``V/V0`` where the dilatancy begins to fade."""
    return par[EXPANSION] - 0.1 * (par[EXPANSION] - 1.0)


@kernel
def fade_share(volume: float, end: float) -> tuple[float, float]:
    """Share of the dilatancy left at ``V/V0``, and its derivative: a cubic over the last tenth of the expansion.

    `end` is the ``V/V0`` at which dilation has ended: a critical state reached smoothly.
    """
    begin = end - 0.1 * (end - 1.0)
    if volume <= begin:
        return 1.0, 0.0
    if volume >= end:
        return 0.0, 0.0
    x = (volume - begin) / (end - begin)
    return 1.0 - x * x * (3.0 - 2.0 * x), -6.0 * x * (1.0 - x) / (end - begin)


@kernel
def dilatancy(volume: float, par: Array) -> tuple[float, float]:
    """``beta`` and ``d beta/dV`` at ``V/V0``: constant, then faded to zero where the material is loosest.

    Where NORMAL is on, the share of the dilation ``m(D')`` of the normal. The fade is that of :func:`fade_share`.
    """
    share, slope = fade_share(volume, par[EXPANSION])
    return par[BETA] * share, par[BETA] * slope


@kernel
def flow_coefficients(det: float, par: Array) -> tuple[float, float, float, float, float]:
    """``a, b`` of the stress with the direction ``u`` of ``D'``, ``det u`` given, and what belongs to them.

    Returns ``a, b``, the support ``N:u``, the norm of ``N`` and the determinant of the unit stress deviator.
    """
    surface = int(par[SURFACE])
    if par[NORMAL] == 0.0:
        g = slope_over_sine(surface, par[SIN_PHI], det)
        return g, 0.0, g, g, det
    part = int(par[PART])
    if part == SMOOTH:
        return normal(surface, par[SIN_PHI], det)
    return corner(par[SIN_PHI], det, part != COMPRESSION_CORNER)


@kernel
def flow_stress(d: Array, par: Array, unit: Array, n: Array) -> tuple[float, float, float, float]:
    """Stress deviator ``n[3, 3]`` over ``p sin(phi) + c cos(phi)`` of a flow with rate of strain ``d[6]``.

    Returns ``|D'|``, the norm of `n`, the support ``n:Dhat`` and the determinant of the unit stress deviator; sets
    ``unit[6]`` to ``Dhat``. At rest `n` is zero.
    """
    _, norm, det = deviator(d, unit)
    if norm == 0.0:
        g = slope_over_sine(int(par[SURFACE]), par[SIN_PHI], det)
        unpack(unit, n)
        return norm, g, g, det
    a, b, support, g, det = flow_coefficients(det, par)
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
def dilation(beta: float, norm: float, support: float, par: Array) -> float:
    """``tr D`` of the flow rule: ``beta |D'|``, or the share `beta` of ``m(D')`` where NORMAL is on."""
    return beta * norm * (support * par[SIN_PHI] if par[NORMAL] > 0.0 else 1.0)
