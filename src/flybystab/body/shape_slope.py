"""Slopes over the facets of a polyhedral shape, at rest and through an encounter.

On each facet the effective acceleration of loose material is ``g = grad U + (K_t - Omega^2 - Omegadot) x``: the
gravity of the polyhedron, the tide, and the centrifugal and Euler accelerations of the rigid body. The gravity of a
rigid body is constant in its own frame and is computed once.
"""

from __future__ import annotations

import astropy.units as u
import numpy as np
from astropy.units import Quantity

from flybystab.arguments import check_arguments
from flybystab.body.body import Body
from flybystab.body.equilibrium import tide_components
from flybystab.body.shape import Shape
from flybystab.body.surface_slope import SlopeChange, SurfaceSlopes, spin_and_tide
from flybystab.core.ellipsoid.surface_slope import effective_field
from flybystab.typing import Array


@check_arguments
def shape_slopes(shape: Shape, body: Body, tide: Quantity | None = None) -> SurfaceSlopes:
    """Slopes over the facets of a shape at the spin of a body, in an optional tide.

    Parameters
    ----------
    shape : Shape
    body : Body
        Density and spin, e.g. of :meth:`Body.from_shape`; its axes are the principal axes of the shape.
    tide : Quantity, shape (3, 3), optional
        Tidal tensor in the principal frame, s^-2.

    Returns
    -------
    SurfaceSlopes
        At the centroids of the facets.
    """
    gravity = gravity_at_facets(shape, body)
    slope = _slopes(shape, gravity, field_matrix(body, body.omega, tide_components(tide)))
    return SurfaceSlopes(shape.centroids, shape.facet_area, np.rad2deg(slope) * u.deg)


def shape_slope_change(shape: Shape, body: Body, spin: Quantity, tide: Quantity) -> SlopeChange:
    """Slopes over the facets of a rigid shape through an encounter.

    Parameters
    ----------
    shape, body
        As in :func:`shape_slopes`; the spin of the body is not used.
    spin : Quantity, shape (m, 3)
        Angular velocity at ``m`` instants, principal frame.
    tide : Quantity, shape (m, 3, 3) or (m, 6)
        Tidal tensors, or their components ``xx, yy, zz, xy, xz, yz``, at the same instants, principal frame, s^-2.
        The first instant is "before".

    Returns
    -------
    SlopeChange
        At the centroids of the facets.
    """
    w, k = spin_and_tide(spin, tide)
    gravity = gravity_at_facets(shape, body)
    before = _slopes(shape, gravity, field_matrix(body, w[0], k[0]))
    least, greatest = before.copy(), before.copy()
    for omega, tensor in zip(w[1:], k[1:], strict=True):
        now = _slopes(shape, gravity, field_matrix(body, omega, tensor))
        np.minimum(least, now, out=least)
        np.maximum(greatest, now, out=greatest)
    degrees = [np.rad2deg(v) * u.deg for v in (before, least, greatest)]
    return SlopeChange(shape.centroids, shape.facet_area, *degrees)


def gravity_at_facets(shape: Shape, body: Body) -> Array:
    """Gravity of the polyhedron at the centroids of its facets, (f, 3), m/s2."""
    return np.asarray(body.rho * shape.facet_gravity[1])


def field_matrix(body: Body, omega: Array, tide: Array) -> Array:
    """Matrix of the tide and the accelerations of the rotating frame, s^-2; no self-gravity."""
    out = np.empty((3, 3))
    effective_field(body.axes**2, 0.0, np.ascontiguousarray(omega), np.ascontiguousarray(tide), out)
    return out


def _slopes(shape: Shape, gravity: Array, field: Array) -> Array:
    """Angle between the outward normal and ``-g``, rad; ``atan2`` keeps small slopes exact."""
    down = -(gravity + shape.centroids.value @ field.T)
    across = np.linalg.norm(np.cross(shape.normals, down), axis=1)
    return np.asarray(np.arctan2(across, np.einsum("ni,ni->n", shape.normals, down)))
