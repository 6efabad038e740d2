"""Meshes of generated shapes: points on the sphere, their triangulation, radii of ellipsoids and Gaussian relief."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flybystab.errors import InvalidInput
from flybystab.typing import Array
from flybystab.units import whole

#: Default number of facets of a generated shape.
FACETS = 4000
#: Largest number of facets of a generated shape, a limit of memory.
MOST_FACETS = 1_000_000


def sphere_mesh(facets: int) -> tuple[Array, NDArray[np.int64]]:
    """Unit vectors of a Fibonacci lattice and the triangles of their convex hull, about `facets` of them."""
    from scipy.spatial import ConvexHull

    if whole(facets, "facets", 20) > MOST_FACETS:
        raise InvalidInput("facets", facets, f"at most {MOST_FACETS:,}")
    count = facets // 2 + 2
    i = np.arange(count) + 0.5
    z = 1.0 - 2.0 * i / count
    longitude = np.pi * (1.0 + np.sqrt(5.0)) * i
    r = np.sqrt(1.0 - z * z)
    x = np.column_stack([r * np.cos(longitude), r * np.sin(longitude), z])
    hull = ConvexHull(x)
    triangles = hull.simplices.astype(np.int64)
    a, b, c = (x[triangles[:, k]] for k in range(3))
    inward = np.einsum("ni,ni->n", a, np.cross(b, c)) < 0.0
    triangles[inward] = triangles[inward][:, ::-1]
    return x, triangles


def distance_to_surface(directions: Array, axes: Array, shift: float) -> Array:
    """Distance from the origin to the surface of an ellipsoid whose centre is at ``(shift, 0, 0)``; origin inside."""
    d = directions / axes
    s = np.array([shift / axes[0], 0.0, 0.0])
    aa, ab, bb = np.einsum("ni,ni->n", d, d), d @ s, s @ s
    return (ab + np.sqrt(ab * ab - aa * (bb - 1.0))) / aa


def gaussian_relief(directions: Array, degree: int, rng: np.random.Generator) -> Array:
    """Gaussian field on the sphere of unit variance: a sum of zonal waves about random poles."""
    field_ = np.zeros(len(directions))
    total = 0.0
    for ell in range(2, degree + 1):
        weight = 1.0 / ell**2
        total += weight
        for _ in range(2 * ell + 1):
            pole = rng.normal(size=3)
            pole /= np.linalg.norm(pole)
            wave = np.polynomial.legendre.Legendre.basis(ell)(directions @ pole)
            field_ += rng.normal() * np.sqrt(weight) * wave
    # P_l has the mean square 1/(2l + 1), and 2l + 1 waves are added
    return field_ / np.sqrt(total)
