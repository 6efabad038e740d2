"""The table of yield surfaces: a surface is a row, and its code in the kernels is the number of the row.

The rows belong to three families, whose formulas are in :mod:`flybystab.core.material.yield_surface`. Another cone is
one more row and nothing else. A surface with another dependence on the Lode angle is a row of a new family: its gauge,
slope, least slope and required friction are added in that module. This module imports nothing compiled, so that the
command line can list the names at no cost.
"""

from __future__ import annotations

from typing import NamedTuple

# Families.
CONE = 0
HEXAGON = 1
SMOOTH_HEXAGON = 2


class YieldSurface(NamedTuple):
    """A row of the table.

    Attributes
    ----------
    name : str
        As in :class:`flybystab.Material`.
    family : int
        CONE, HEXAGON or SMOOTH_HEXAGON.
    cone : float
        ``c`` of a cone of slope ``2 sqrt6 sin/(3 - c sin)``: 1 meets Mohr-Coulomb in triaxial compression, -1 in
        extension. Not used by the other families.
    references : tuple of str
        Keys of the bibliography (:mod:`flybystab.io.citation`).
    """

    name: str
    family: int
    cone: float
    references: tuple[str, ...]


SURFACES = (
    YieldSurface("drucker-prager", CONE, 1.0, ("DruckerPrager1952",)),
    YieldSurface("drucker-prager-extension", CONE, -1.0, ("DruckerPrager1952",)),
    YieldSurface("mohr-coulomb", HEXAGON, 0.0, ()),
    YieldSurface("matsuoka-nakai", SMOOTH_HEXAGON, 0.0, ("MatsuokaNakai1974",)),
)

#: Names in the order of their codes.
NAMES = tuple(surface.name for surface in SURFACES)

#: Yield surface of a material by default: the one that discrete elements confirm.
DEFAULT = "mohr-coulomb"


def code_of(name: str) -> int:
    """Code of the surface of that name."""
    return NAMES.index(name)


if not {surface.family for surface in SURFACES} <= {CONE, HEXAGON, SMOOTH_HEXAGON}:
    raise ValueError("a yield surface of a family without formulas: add them in yield_surface.py")
