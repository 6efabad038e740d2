"""Limit analysis of an ellipsoid: bounds of the cohesion below which its material fails somewhere.

The two theorems of limit analysis hold for materials with associated flow:

- Kinematic: the body collapses if the stress power of any velocity field exceeds what the material can dissipate. For
  uniform strain rates this is the criterion on the average stress ``s`` (Holsapple 2001, Icarus 154, 432), which gives
  a cohesion that is *necessary*.
- Static: the body does not collapse if any stress field in equilibrium with the loads and free of traction on the
  surface is nowhere beyond the yield surface, which gives a cohesion that is *sufficient*.

The field ``(5/2) s (1 - m^2)``, ``m^2 = sum (x_i/a_i)^2``, is such a field; its principal stresses keep their ratios.
Without cohesion both bounds therefore agree: the criterion on the average stress is exact. With cohesion the sufficient
one is the least over all admissible fields of degree 2: this one plus the fields in equilibrium with no load.
"""

from __future__ import annotations

from dataclasses import dataclass

import astropy.units as u
import numpy as np
from astropy.units import Quantity
from scipy.linalg import null_space
from scipy.optimize import minimize
from scipy.special import logsumexp, softmax

from flybystab.arguments import check_arguments
from flybystab.body.body import Body, Material, check_body
from flybystab.body.elastic_stress import DIRECTIONS, ball_quadrature, sphere_directions
from flybystab.body.equilibrium import tide_components
from flybystab.constants import G
from flybystab.core.ellipsoid.rigid_stress import overload, rigid_stress
from flybystab.core.ellipsoid.tide import COMPONENTS
from flybystab.tabular import Record
from flybystab.typing import Array
from flybystab.units import brief

#: Exponents of the terms of a stress component: 1 and the six products of two coordinates.
TERMS = np.array([[0, 0, 0], [2, 0, 0], [0, 2, 0], [0, 0, 2], [1, 1, 0], [1, 0, 1], [0, 1, 1]])
#: Every n-th point of the quadrature over the volume at which the stress is optimised.
THINNING = 24
#: Sharpness of the smooth maximum of the required cohesion, over its largest value, in successive minimisations.
SHARPNESS = (10.0, 50.0, 250.0)


@dataclass(frozen=True)
class CohesionBounds(Record):
    """Cohesion that keeps an ellipsoid from failing anywhere.

    Attributes
    ----------
    necessary : Quantity
        Below it the body collapses as a whole, Pa: the criterion on the average stress.
    sufficient : Quantity
        With it no part of the body needs to yield, Pa.
    point : Quantity, shape (3,)
        Point at which the best stress field requires that cohesion, principal axes, m; the centre if it requires none.
    """

    necessary: Quantity
    sufficient: Quantity
    point: Quantity

    def __repr__(self) -> str:
        return f"<CohesionBounds {brief(self.necessary)} to {brief(self.sufficient)}>"


@check_arguments
def cohesion_bounds(
    body: Body, tide: Quantity | None = None, *, material: Material | None = None
) -> CohesionBounds:
    """Necessary and sufficient cohesion of a body under its gravity, its spin and an optional tide.

    Parameters
    ----------
    body : Body
        Any spin vector.
    tide : Quantity, shape (3, 3), optional
        Tidal tensor, principal axes, s^-2.
    material : Material, optional
        Its friction angle and yield surface; that of the body by default.

    Raises
    ------
    InvalidInput, UnitMismatch
    """
    check_body(body)
    m = body.material if material is None else material
    average = np.empty(6)
    s = body.axes**2
    rigid_stress(s[0], s[1], s[2], body.rho, np.pi * G * body.rho, body.omega, tide_components(tide), average)
    necessary = float(_required(average[None], m)[0])
    if necessary <= 0.0:  # the field (5/2) s (1 - m^2) then requires none either
        return CohesionBounds(0.0 * u.Pa, 0.0 * u.Pa, np.zeros(3) * u.m)
    free = self_equilibrated(body.axes)
    points = np.concatenate([ball_quadrature()[0], sphere_directions(DIRECTIONS), np.zeros((1, 3))])

    def fields(at: Array) -> tuple[Array, Array]:
        given = 2.5 * (1.0 - np.sum(at * at, axis=1))[:, None] * average
        return given, np.einsum("nt,ftc->nfc", _terms(at), free)

    given, modes = fields(points[::THINNING])
    scale = float(np.abs(average).max()) or 1.0
    weights = np.zeros(len(free))
    for sharpness in SHARPNESS:

        def smooth(w: Array, s: float = sharpness) -> tuple[float, Array]:
            stress = given + scale * np.einsum("f,nfc->nc", w, modes)
            required, slope = _required_and_slope(stress, scale * modes, m)
            e = s / scale * required
            return float(logsumexp(e) * scale / s) / scale, softmax(e) @ slope / scale

        weights = minimize(smooth, weights, jac=True, method="BFGS", options={"gtol": 1e-6}).x
    given, modes = fields(points)
    candidates = [
        _required(given + scale * np.einsum("f,nfc->nc", w, modes), m) for w in (weights, 0.0 * weights)
    ]
    best = min(candidates, key=lambda c: float(c.max()))
    worst = int(np.argmax(best))
    return CohesionBounds(necessary * u.Pa, float(best[worst]) * u.Pa, points[worst] * body.axes * u.m)


def self_equilibrated(axes: Array) -> Array:
    """Stress fields of degree 2 without divergence in an ellipsoid and without traction on its surface.

    Returns
    -------
    ndarray (fields, 7, 6)
        Orthonormal coefficients of the terms in ``x_i/a_i`` for each stress component.
    """
    rows = []
    for k in range(3):  # the divergence is linear: it vanishes if it does at the three unit vectors
        row = np.zeros((3, len(TERMS), 6))
        for t, powers in enumerate(TERMS):
            for c, (i, j) in enumerate(COMPONENTS):
                row[i, t, c] += _derivative(powers, j, np.eye(3)[k]) / axes[j]
                if i != j:
                    row[j, t, c] += _derivative(powers, i, np.eye(3)[k]) / axes[i]
        rows.append(row.reshape(3, -1) * axes[2])
    surface = sphere_directions(120)
    normals = surface / axes
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    terms = _terms(surface)
    traction = np.zeros((len(surface), 3, len(TERMS), 6))
    for c, (i, j) in enumerate(COMPONENTS):
        traction[:, i, :, c] += normals[:, j, None] * terms
        if i != j:
            traction[:, j, :, c] += normals[:, i, None] * terms
    matrix = np.concatenate([*rows, traction.reshape(3 * len(surface), -1)])
    return np.asarray(null_space(matrix, rcond=1e-10).T.reshape(-1, len(TERMS), 6))


def _terms(at: Array) -> Array:
    return np.asarray(np.prod(at[:, None, :] ** TERMS, axis=2))


def _derivative(powers: Array, axis: int, at: Array) -> float:
    """Derivative of a term along one scaled coordinate."""
    if not powers[axis]:
        return 0.0
    lower = powers.copy()
    lower[axis] -= 1
    return float(powers[axis] * np.prod(at**lower))


def _required(stress: Array, m: Material) -> Array:
    """Cohesion that stresses (n, 6) require, Pa; negative where there is a reserve."""
    return np.array([overload(m.surface_code, m.phi, 0.0, six) for six in stress]) / np.cos(m.phi)


def _required_and_slope(stress: Array, modes: Array, m: Material) -> tuple[Array, Array]:
    """Required cohesion (n,) and its derivatives (n, f) along the fields, by central differences."""
    size = float(np.abs(stress).max())
    slope = np.empty(modes.shape[:2])
    for f in range(modes.shape[1]):
        step = 1e-5 * size / max(float(np.abs(modes[:, f]).max()), 1e-300)
        slope[:, f] = (
            _required(stress + step * modes[:, f], m) - _required(stress - step * modes[:, f], m)
        ) / (2.0 * step)
    return _required(stress, m), slope
