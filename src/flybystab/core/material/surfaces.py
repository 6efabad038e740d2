"""The table of yield surfaces: a surface is a row, and its code in the kernels is the number of the row.

Three families have closed formulas in :mod:`flybystab.core.material.yield_surface`. A further cone is one more row. A
surface with another dependence on the Lode angle is one more row of the family GENERAL with its gauge, a plain function
in this module: slope, flow rule, least slope and required friction follow from it. This module imports nothing
compiled, so that the command line can list the names at no cost.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

# Families.
CONE = 0
HEXAGON = 1
SMOOTH_HEXAGON = 2
GENERAL = 3


class YieldSurface(NamedTuple):
    """A row of the table.

    Attributes
    ----------
    name : str
        As in :class:`flybystab.Material`.
    family : int
        CONE, HEXAGON, SMOOTH_HEXAGON or GENERAL.
    cone : float
        ``c`` of a cone of slope ``2 sqrt6 sin/(3 - c sin)``: 1 meets Mohr-Coulomb in triaxial compression, -1 in
        extension. Not used by the other families.
    references : tuple of str
        Keys of the bibliography (:mod:`flybystab.io.citation`).
    gauge : callable, optional
        Of a GENERAL surface: ``gauge(sin_phi, theta)`` gives ``gamma = sin(phi)/k``, ``gamma'`` and
        ``gamma + gamma''`` at the Lode angle `theta` (rad, from -pi/6 to pi/6) as floats. It is compiled; it must be
        smooth, convex (``gamma + gamma'' > 0``), finite for ``0 <= sin_phi < 1``, and have ``gamma' = 0`` at both ends
        or a corner there.
    """

    name: str
    family: int
    cone: float
    references: tuple[str, ...]
    gauge: Callable[[float, float], tuple[float, float, float]] | None = None


SURFACES = (
    YieldSurface("drucker-prager", CONE, 1.0, ("DruckerPrager1952",)),
    YieldSurface("drucker-prager-extension", CONE, -1.0, ("DruckerPrager1952",)),
    YieldSurface("mohr-coulomb", HEXAGON, 0.0, ()),
    YieldSurface("matsuoka-nakai", SMOOTH_HEXAGON, 0.0, ("MatsuokaNakai1974",)),
)

#: Names in the order of their codes.
NAMES = tuple(surface.name for surface in SURFACES)

#: Default yield surface of a material: the one that agrees with discrete-element simulations.
DEFAULT = "mohr-coulomb"


def code_of(name: str) -> int:
    """Code of the surface of that name."""
    return NAMES.index(name)


if any(s.family not in (CONE, HEXAGON, SMOOTH_HEXAGON, GENERAL) for s in SURFACES):
    raise ValueError("a yield surface of an unknown family")
if any((s.family == GENERAL) != (s.gauge is not None) for s in SURFACES):
    raise ValueError("a yield surface of the family GENERAL has a gauge, and no other")
