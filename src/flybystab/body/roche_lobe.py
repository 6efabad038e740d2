"""Roche lobe of a rotating polyhedron in a tide: the facets from which loose material could escape.

In the frame that rotates with the body the effective potential is ``V(x) = -U(x) - x.F x/2`` with ``F`` the symmetric
part of ``K_t - Omega^2``. Its saddle points lie beyond the body on both sides of the directions in which ``F``
stretches; the lowest of them bounds the lobe. A particle at rest on a facet whose ``V`` exceeds that of the saddle is
not confined. For a spinning sphere the saddle is the synchronous orbit, ``r^3 = GM/omega^2`` with ``V = -3GM/(2r)``.

Spin and tide are frozen at an instant; the Euler acceleration, which has no potential, is left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import astropy.units as u
import numpy as np
from astropy.units import Quantity
from numpy.typing import NDArray

from flybystab.arguments import check_arguments
from flybystab.body.body import Body
from flybystab.body.equilibrium import tide_components
from flybystab.body.shape import Shape
from flybystab.constants import G
from flybystab.core.ellipsoid.tide import COMPONENTS
from flybystab.errors import NotConverged
from flybystab.tabular import Tabular
from flybystab.typing import Array

#: Newton steps to a saddle point, and the relative length of the last one.
STEPS = 60
ACCURACY = 1e-10


@dataclass(frozen=True, eq=False, repr=False)
class RocheLobe(Tabular):
    """Roche lobe of a body at one instant.

    Attributes
    ----------
    saddle : Quantity or None, shape (3,)
        Lowest saddle point of the effective potential, principal frame, m; None where the potential rises in all
        directions (no spin, no tide).
    level : Quantity
        Effective potential there, m2/s2; infinite without a saddle.
    potential : Quantity, shape (f,)
        Effective potential at the facets, m2/s2.
    inside : ndarray of bool, shape (f,)
        Facets below the level: material at rest there cannot leave the lobe.
    share_outside : float
        Fraction of the surface area on the other facets.
    """

    saddle: Quantity | None
    level: Quantity
    potential: Quantity
    inside: NDArray[np.bool_]
    share_outside: float


@check_arguments
def roche_lobe(shape: Shape, body: Body, tide: Quantity | None = None) -> RocheLobe:
    """Roche lobe of a shape at the spin of a body, in an optional tide.

    Parameters
    ----------
    shape : Shape
    body : Body
        Density and spin, e.g. of :meth:`Body.from_shape`.
    tide : Quantity, shape (3, 3), optional
        Tidal tensor, principal frame, s^-2.

    Raises
    ------
    NotConverged
        A saddle point could not be located: it lies on or inside the surface, where the body itself sheds mass.
    """
    k = tide_components(tide)
    f = np.outer(body.omega, -body.omega) + np.eye(3) * (body.omega @ body.omega)
    for value, (i, j) in zip(k, COMPONENTS, strict=True):
        f[i, j] += value
        if i != j:
            f[j, i] += value
    surface = body.rho * shape.facet_gravity[0]
    x = shape.centroids.value
    potential = -surface - 0.5 * np.einsum("ni,ij,nj->n", x, f, x)
    gm = G * body.rho * shape.volume.value
    rates, axes = np.linalg.eigh(f)
    saddle, level = None, np.inf
    for rate, axis in zip(rates, axes.T, strict=True):
        if rate <= 1e-12 * np.pi * G * body.rho:
            continue
        for sign in (1.0, -1.0):
            point = _saddle(shape, body, f, sign * np.cbrt(gm / rate) * axis)
            v = float(-shape.gravity(point[None] * u.m, body.density)[0].value[0] - 0.5 * point @ f @ point)
            if v < level:
                saddle, level = point, v
    inside = potential < level
    area = shape.facet_area.value
    return RocheLobe(
        None if saddle is None else saddle * u.m,
        level * u.m**2 / u.s**2,
        potential * u.m**2 / u.s**2,
        inside,
        float(area[~inside].sum() / area.sum()),
    )


def _saddle(shape: Shape, body: Body, f: Array, start: Array) -> Array:
    """Zero of ``grad U + F x`` near `start` by Newton's method; steps are limited to a fifth of the distance."""
    x = start.copy()
    for _ in range(STEPS):
        _, acceleration, gradient = shape.gravity(x[None] * u.m, body.density)
        step = np.linalg.solve(gradient.value[0] + f, -(acceleration.value[0] + f @ x))
        size, reach = np.linalg.norm(step), 0.2 * np.linalg.norm(x)
        x += step * min(1.0, reach / size)
        if size < ACCURACY * np.linalg.norm(x):
            return x
    raise NotConverged("no saddle point of the effective potential was found outside the shape")
