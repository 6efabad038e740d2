"""Checks and mass properties of a closed triangle mesh, on plain arrays."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flybystab.errors import InvalidInput
from flybystab.typing import Array

Integers = NDArray[np.int64]


class MassProperties(NamedTuple):
    """Integrals over the volume of a mesh, for unit density.

    Attributes
    ----------
    volume : float
        m3.
    centre : ndarray (3,)
        Centre of mass, m.
    second_moment : ndarray (3, 3)
        ``int x (x) x dV`` about the centre of mass, m5.
    """

    volume: float
    centre: Array
    second_moment: Array


def mass_properties(vertices: Array, facets: Integers) -> MassProperties:
    """Volume, centre of mass and second moments, summed over tetrahedra with one corner at the mean vertex.

    A tetrahedron with corners ``0, a, b, c`` has the volume ``a.(b x c)/6``, the centre ``(a + b + c)/4`` and the
    second moment ``(V/20)[aa + bb + cc + (a + b + c)(a + b + c)]`` (products are dyadic).
    """
    origin = vertices.mean(axis=0)
    a, b, c = (vertices[facets[:, i]] - origin for i in range(3))
    volumes = np.einsum("ni,ni->n", a, np.cross(b, c)) / 6.0
    volume = float(volumes.sum())
    total = a + b + c
    centre = (volumes @ total) / (4.0 * volume) if volume else np.zeros(3)
    second = sum(np.einsum("n,ni,nj->ij", volumes / 20.0, p, p) for p in (a, b, c, total))
    return MassProperties(volume, origin + centre, second - volume * np.outer(centre, centre))


def edges_of(facets: Integers) -> tuple[Integers, Integers]:
    """Each edge once, as its two vertices ``(e, 2)``, and the facets ``(e, 2)`` on its left and on its right.

    Raises
    ------
    InvalidInput
        For a surface that is open, branches, or whose facets are not oriented alike; the facets are named.
    """
    directed = np.concatenate([facets[:, [0, 1]], facets[:, [1, 2]], facets[:, [2, 0]]])
    owner = np.tile(np.arange(len(facets)), 3)
    key = np.sort(directed, axis=1)
    order = np.lexsort((directed[:, 0], key[:, 1], key[:, 0]))
    key, directed, owner = key[order], directed[order], owner[order]
    starts = np.flatnonzero(np.any(np.diff(key, axis=0, prepend=-1) != 0, axis=1))
    counts = np.diff(np.append(starts, len(key)))
    if np.any(counts == 1):
        raise _bad_facets(owner[starts[counts == 1]], "a closed surface: these facets have an open edge")
    if np.any(counts > 2):
        raise _bad_facets(
            owner[starts[counts > 2]], "an edge shared by exactly two facets: these share an edge with more"
        )
    first, second = starts, starts + 1
    same = directed[first, 0] == directed[second, 0]
    if np.any(same):
        raise _bad_facets(
            owner[first[same]], "facets oriented alike: these are oriented opposite to a neighbour"
        )
    return directed[first], np.column_stack([owner[first], owner[second]])


def self_intersections(vertices: Array, facets: Integers) -> Integers:
    """Numbers of the facets that an edge of another facet pierces.

    Candidate pairs are those whose bounding spheres meet. Facets that share a vertex are left out, so that two
    facets folded onto each other along an edge are not found.
    """
    from scipy.spatial import cKDTree

    corners = vertices[facets]
    centre = corners.mean(axis=1)
    radius = np.linalg.norm(corners - centre[:, None], axis=2).max(axis=1)
    pairs = cKDTree(centre).query_pairs(2.0 * radius.max(), output_type="ndarray")
    near = np.linalg.norm(centre[pairs[:, 0]] - centre[pairs[:, 1]], axis=1)
    pairs = pairs[near <= radius[pairs[:, 0]] + radius[pairs[:, 1]]]
    shared = (facets[pairs[:, 0]][:, :, None] == facets[pairs[:, 1]][:, None, :]).any(axis=(1, 2))
    pairs = pairs[~shared]
    hit = np.zeros(len(pairs), dtype=bool)
    for one, other in ((0, 1), (1, 0)):
        triangle = corners[pairs[:, other]]
        for i in range(3):
            start, end = corners[pairs[:, one], i], corners[pairs[:, one], (i + 1) % 3]
            hit |= _pierced(start, end, triangle)
    return np.unique(pairs[hit])


def _pierced(start: Array, end: Array, triangle: Array) -> NDArray[np.bool_]:
    """Mask of the segments ``(n, 3)`` that cross their triangles ``(n, 3, 3)`` (Moller & Trumbore 1997)."""
    direction = end - start
    first, second = triangle[:, 1] - triangle[:, 0], triangle[:, 2] - triangle[:, 0]
    normal = np.cross(direction, second)
    det = np.einsum("ni,ni->n", first, normal)
    with np.errstate(divide="ignore", invalid="ignore"):
        offset = start - triangle[:, 0]
        x = np.einsum("ni,ni->n", offset, normal) / det
        across = np.cross(offset, first)
        y = np.einsum("ni,ni->n", direction, across) / det
        t = np.einsum("ni,ni->n", second, across) / det
        return (x >= 0.0) & (y >= 0.0) & (x + y <= 1.0) & (t >= 0.0) & (t <= 1.0)


def _bad_facets(numbers: Integers, expected: str) -> InvalidInput:
    few = sorted({int(n) for n in numbers})
    text = ", ".join(map(str, few[:8])) + (f" and {len(few) - 8} more" if len(few) > 8 else "")
    return InvalidInput("facets", f"numbers {text} (from 0)", expected)
