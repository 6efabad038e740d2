"""Parameters of the material in a run, in the units of the body (:mod:`flybystab.core.dynamics.state`)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flybystab.core.material.yield_surface import is_circular, least_slope
from flybystab.core.numerics.jit import code, kernel

# Part of the yield section on which the stress of an associative flow lies: a face or a corner of the hexagon of
# Mohr-Coulomb; SMOOTH on any other section.
SMOOTH = code(0)
EXTENSION_CORNER = code(1)
COMPRESSION_CORNER = code(2)
FACE = code(3)


class MaterialParameters(NamedTuple):
    """Parameters of the flow rule.

    Attributes
    ----------
    surface : int
        Code of the yield surface (:mod:`flybystab.core.material.surfaces`).
    sin_phi, cos_phi : float
        Of the friction angle.
    beta : float
        Dilatancy ``tr D/|D'|``; 1 where `normal` is set.
    normal : bool
        Associative flow on a slope ``k(theta)``: D is normal to the yield surface. Otherwise D' is parallel to the
        stress deviator.
    cohesion : float
        ``5 Y/rho0`` in units of ``a0^2 pi G rho0``.
    viscosity : float
        ``5 (2 mu)/rho0`` in units of ``a0^2 sqrt(pi G rho0)``, of a fluid.
    expansion : float
        ``V/V0`` at which dilation has ended.
    part : int
        Part of the yield section on which the stress lies.
    fan_limit : float
        Lode angle, rad, by which ``D`` may lie beyond the normal of the face, outside the fan of the corner, while the
        stress stays at the corner.
    """

    surface: int
    sin_phi: float
    cos_phi: float
    beta: float
    normal: bool
    cohesion: float
    viscosity: float
    expansion: float
    part: int
    fan_limit: float


@kernel
def material_parameters(
    surface: int, phi: float, cohesion: float, dilatancy: float, viscosity: float, expansion: float
) -> MaterialParameters:
    """Parameters from the friction angle (rad), `cohesion` and `viscosity` in the units of the body.

    `dilatancy` is ``beta/min k``. Associative flow on a slope ``k(theta)`` is along the normal of the yield surface;
    for a smaller dilatancy ``D'`` is along the stress deviator.
    """
    normal = dilatancy >= 1.0 and not is_circular(surface)
    beta = 1.0 if normal else dilatancy * least_slope(surface, np.sin(phi))
    return MaterialParameters(
        surface, np.sin(phi), np.cos(phi), beta, normal, cohesion, viscosity, expansion, SMOOTH, 0.0
    )


@kernel
def without_cohesion(m: MaterialParameters) -> MaterialParameters:
    """The material after brittle failure."""
    return MaterialParameters(
        m.surface, m.sin_phi, m.cos_phi, m.beta, m.normal, 0.0, m.viscosity, m.expansion, m.part, m.fan_limit
    )


@kernel
def with_friction(m: MaterialParameters, sin_phi: float) -> MaterialParameters:
    """The material with another ``sin(phi)`` and the same strength ``c cos(phi)`` at zero pressure."""
    return MaterialParameters(
        m.surface, sin_phi, m.cos_phi, m.beta, m.normal, m.cohesion, m.viscosity, m.expansion, m.part,
        m.fan_limit,
    )  # fmt: skip


@kernel
def on_part(m: MaterialParameters, part: int, fan_limit: float) -> MaterialParameters:
    """The material with the stress on another part of the yield section."""
    return MaterialParameters(
        m.surface, m.sin_phi, m.cos_phi, m.beta, m.normal, m.cohesion, m.viscosity, m.expansion, part,
        fan_limit,
    )  # fmt: skip
