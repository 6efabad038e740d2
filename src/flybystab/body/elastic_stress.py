"""Elastic stress inside an ellipsoid under self-gravity, rotation and tide.

The body force per mass is ``g = M x`` with ``M = K_g + K_t - Omega^2 - Omegadot``. For a homogeneous, isotropic,
linearly elastic ellipsoid with a free surface the displacement is then exactly a polynomial with terms of degree 1 and
3 (as in Dobrovolskis 1982, Icarus 52, 136), and the stress one of degree 0 and 2. Its 39 coefficients follow from
equilibrium ``div sigma + rho g = 0`` in the volume and ``sigma n = 0`` on the surface. The stress depends on Poisson's
ratio but not on Young's modulus.

The volume average of the stress is that of the rigid body for any Poisson's ratio. The elastic stress refers to a
solid that was free of stress before gravity and spin acted: a rubble pile has another, unknown initial stress, so that
the local stress is an estimate. Its changes in an encounter do not depend on that assumption as long as nothing yields.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations_with_replacement

import astropy.units as u
import numpy as np
from astropy.units import Quantity

from flybystab.arguments import check_arguments
from flybystab.body.body import Body, Material, check_body
from flybystab.body.equilibrium import tide_components
from flybystab.constants import G
from flybystab.core.ellipsoid.rigid_stress import invariants
from flybystab.core.ellipsoid.surface_slope import effective_field
from flybystab.core.ellipsoid.tide import COMPONENTS
from flybystab.core.material.yield_surface import required_cohesion
from flybystab.errors import InvalidInput, NotConverged
from flybystab.tabular import Record
from flybystab.typing import Array
from flybystab.units import brief, to_si

#: Exponents of the terms of the displacement: 3 of degree 1 and 10 of degree 3.
TERMS = np.array(
    [
        [c.count(i) for i in range(3)]
        for degree in (1, 3)
        for c in combinations_with_replacement(range(3), degree)
    ]
)
#: Points of the surface at which the traction is set to zero.
SURFACE_POINTS = 120
#: Largest residual of equations that have an exact solution, relative.
RESIDUAL = 1e-8
#: Shells and directions of the quadrature over the volume.
SHELLS, DIRECTIONS = 16, 600


@dataclass(frozen=True, eq=False, repr=False)
class YieldRegion(Record):
    """Region of a body in which the elastic stress exceeds the strength of a material.

    Attributes
    ----------
    share : float
        Fraction of the volume.
    point : Quantity, shape (3,)
        Point at which yield starts if the cohesion decreases, where the body requires :attr:`required_cohesion`;
        principal axes, m.
    depth : float
        Depth of that point: 0 at the surface, 1 at the centre.
    required_cohesion : Quantity
        Largest cohesion that any point requires at the friction angle of the material, Pa.
    """

    share: float
    point: Quantity
    depth: float
    required_cohesion: Quantity


@dataclass(frozen=True, eq=False)
class ElasticStress(Record):
    """Elastic stress in an ellipsoid.

    Attributes
    ----------
    body : Body
    poisson : float
    mean : Quantity, shape (3, 3)
        Volume average, Pa; tension is positive.
    """

    body: Body
    poisson: float
    mean: Quantity
    _coefficients: Array

    def __repr__(self) -> str:
        return f"<ElasticStress Poisson {self.poisson:g}, mean pressure {brief(-np.trace(self.mean) / 3.0)}>"

    @check_arguments
    def at(self, points: Quantity) -> Quantity:
        """Stress tensors (n, 3, 3), Pa, at points (n, 3) inside the ellipsoid, principal axes; tension is positive."""
        x = to_si(points, u.m, "points", shape=None)
        if x.ndim != 2 or x.shape[1] != 3:
            raise InvalidInput("points", np.shape(x), "shape (n, 3)")
        if np.any(np.sum((x / self.body.axes) ** 2, axis=1) > 1.0 + 1e-9):
            raise InvalidInput("points", points, "points inside the ellipsoid")
        rows = _stress_rows(x, self.body.axes, self.poisson)
        return rows @ self._coefficients * u.Pa

    @check_arguments
    def yield_region(self, material: Material | None = None) -> YieldRegion:
        """Fraction of the volume beyond the yield surface of a material, and the point at which yield starts.

        Parameters
        ----------
        material : Material, optional
            That of the body by default.
        """
        m = self.body.material if material is None else material
        points, weights = ball_quadrature()
        points = np.concatenate([points, sphere_directions(DIRECTIONS)])
        weights = np.append(weights, np.zeros(DIRECTIONS))
        x = points * self.body.axes
        stress = _stress_rows(x, self.body.axes, self.poisson) @ self._coefficients
        six = np.stack([stress[:, i, j] for i, j in COMPONENTS], axis=-1)
        required = np.empty(len(x))
        for n, components in enumerate(six):
            p, norm, det = invariants(components)
            required[n] = required_cohesion(m.surface_code, m.phi, norm, p, det)
        worst = int(np.argmax(required))
        return YieldRegion(
            float(weights[required > m.c_pa].sum() / weights.sum()),
            x[worst] * u.m,
            float(1.0 - np.linalg.norm(points[worst])),
            float(required[worst]) * u.Pa,
        )


def elastic_stress(body: Body, tide: Quantity | None = None, *, poisson: float = 0.25) -> ElasticStress:
    """Elastic stress of a body under its gravity, its spin and an optional tide.

    Parameters
    ----------
    body : Body
        Any spin vector.
    tide : Quantity, shape (3, 3), optional
        Tidal tensor, principal axes, s^-2.
    poisson : float
        Poisson's ratio, 0 to 0.49.

    Raises
    ------
    InvalidInput, UnitMismatch, NotConverged
    """
    check_body(body)
    nu = to_si(poisson, u.dimensionless_unscaled, "poisson", low=0.0, high=0.49)
    axes = body.axes
    field = np.empty((3, 3))
    effective_field(axes**2, np.pi * G * body.rho, body.omega, tide_components(tide), field)
    # equilibrium holds for all x if it does for the three unit vectors: both sides are linear
    inside = np.diag(axes)
    force = -body.rho * inside @ field.T
    surface = sphere_directions(SURFACE_POINTS) * axes
    normals = surface / axes**2
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    rows = np.einsum("nijk,nj->nik", _stress_rows(surface, axes, nu), normals)
    scale = float(axes[2])
    matrix = np.concatenate([scale * _divergence_rows(inside, axes, nu).reshape(9, -1), rows.reshape(-1, 39)])
    right = np.concatenate([scale * force.ravel(), np.zeros(3 * SURFACE_POINTS)])
    coefficients, *_ = np.linalg.lstsq(matrix, right, rcond=1e-13)
    size = float(np.abs(right).max())
    if float(np.abs(matrix @ coefficients - right).max()) > RESIDUAL * size:
        raise NotConverged("the elastic stress: the equations of equilibrium are not satisfied to 1e-8")
    points, weights = ball_quadrature()
    values = _stress_rows(points * axes, axes, nu) @ coefficients
    mean = np.einsum("n,nij->ij", weights, values) / weights.sum()
    return ElasticStress(body, float(nu), mean * u.Pa, coefficients)


def stress_change(first: ElasticStress, second: ElasticStress) -> Quantity:
    """Largest von Mises stress, Pa, of the difference of two elastic states of one shape over the volume."""
    if not np.array_equal(first.body.axes, second.body.axes) or first.poisson != second.poisson:
        raise InvalidInput("second", second, "a state of the same body and Poisson's ratio")
    axes = first.body.axes
    # the difference is a polynomial of degree 2: its extremes lie inside or on the surface
    points = np.concatenate([ball_quadrature()[0], sphere_directions(DIRECTIONS)]) * axes
    change = _stress_rows(points, axes, first.poisson) @ (second._coefficients - first._coefficients)
    deviator = change - np.trace(change, axis1=1, axis2=2)[:, None, None] / 3.0 * np.eye(3)
    return float(np.sqrt(1.5 * np.einsum("nij,nij->n", deviator, deviator)).max()) * u.Pa


def _derivatives(x: Array, axes: Array) -> tuple[Array, Array]:
    """First (n, 3, m) and second (n, 3, 3, m) derivatives of the terms in ``x_i/a_i``."""
    y = x / axes
    first = np.zeros((len(x), 3, len(TERMS)))
    second = np.zeros((len(x), 3, 3, len(TERMS)))
    for m, powers in enumerate(TERMS):
        for i in range(3):
            one = powers.copy()
            one[i] -= 1
            if powers[i]:
                first[:, i, m] = powers[i] * np.prod(y**one, axis=1) / axes[i]
            for j in range(3):
                two = one.copy()
                two[j] -= 1
                factor = powers[i] * (one[j] if powers[i] else 0)
                if factor:
                    second[:, i, j, m] = factor * np.prod(y**two, axis=1) / (axes[i] * axes[j])
    return first, second


def _stress_rows(x: Array, axes: Array, poisson: float) -> Array:
    """Stress over the shear modulus, (n, 3, 3, 39), of unit coefficients of each term of each displacement."""
    first, _ = _derivatives(x, axes)
    ratio = 2.0 * poisson / (1.0 - 2.0 * poisson)
    out = np.zeros((len(x), 3, 3, 3, len(TERMS)))
    for i in range(3):
        for k in range(3):
            out[:, k, k, i] += ratio * first[:, i]
            out[:, i, k, i] += first[:, k]
            out[:, k, i, i] += first[:, k]
    return out.reshape(len(x), 3, 3, -1)


def _divergence_rows(x: Array, axes: Array, poisson: float) -> Array:
    """Divergence of the stress over the shear modulus, (n, 3, 39)."""
    _, second = _derivatives(x, axes)
    ratio = 2.0 * poisson / (1.0 - 2.0 * poisson)
    laplacian = np.einsum("niim->nm", second)
    out = np.zeros((len(x), 3, 3, len(TERMS)))
    for i in range(3):
        for k in range(3):
            out[:, k, i] += (ratio + 1.0) * second[:, k, i]
        out[:, i, i] += laplacian
    return out.reshape(len(x), 3, -1)


def sphere_directions(count: int) -> Array:
    """Unit vectors of a Fibonacci lattice."""
    i = np.arange(count) + 0.5
    z = 1.0 - 2.0 * i / count
    longitude = np.pi * (1.0 + np.sqrt(5.0)) * i
    r = np.sqrt(1.0 - z * z)
    return np.column_stack([r * np.cos(longitude), r * np.sin(longitude), z])


def ball_quadrature() -> tuple[Array, Array]:
    """Points (n, 3) and weights (n,) of a quadrature over the unit ball."""
    nodes, weights = np.polynomial.legendre.leggauss(SHELLS)
    radii = 0.5 * (nodes + 1.0)
    directions = sphere_directions(DIRECTIONS)
    points = (radii[:, None, None] * directions).reshape(-1, 3)
    return points, np.repeat(0.5 * weights * radii**2, DIRECTIONS)
