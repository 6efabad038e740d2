"""Stability of granular ellipsoids: one row of results for each.

Columns are named by the constants below. Units as in :mod:`flybystab.core.energy.potential`.
"""

from __future__ import annotations

import numpy as np

from flybystab.core.ellipsoid.rigid_stress import demand, invariants, overload, rigid_stress
from flybystab.core.energy.direction_search import (
    BARRIER,
    COARSE,
    DENSE,
    ENERGY,
    FOUR,
    MEDIUM,
    ROUGH,
    SECOND,
    STRAIN,
    THIRD,
    THREE,
    YIELD,
    least,
)
from flybystab.core.energy.perturbation import (
    Ellipsoid,
    direction,
    ellipsoid,
    overload_at,
    path_along,
    powers,
    rate_of_strain,
    slope_of_flow,
)
from flybystab.core.energy.potential import MASS, energy_derivatives
from flybystab.core.energy.trust_region import curvature_form, least_second_order, trust_region
from flybystab.core.material.yield_surface import is_circular
from flybystab.core.numerics.jit import kernel
from flybystab.core.numerics.tensors import eigensystem
from flybystab.typing import Array

(
    FRICTION,  # required friction angle, rad
    PRESSURE,
    COHESION,  # required at the given friction angle
    OVERLOAD,  # |s| sin/k - p sin - Y cos: the body is admissible where it is not positive
    LEVEL,  # 0 inadmissible, 1 admissible, 2 stable to infinitesimal perturbations, 3 to any at second order
    CURVATURE,  # Phi''/(p V) along D* with the required friction mobilised
    ENERGY_2,
    STRAIN_2,
    ENERGY_3,
    STRAIN_3,
    ENERGY_B,
    STRAIN_B,
    KAPPA,  # kappa_crit
    SOFTEST,  # greatest P2/V over all directions
) = range(14)
COLUMNS = 14

#: Rows of the directions: second order by energy and by strain, third order by energy and by strain, barrier.
DIRECTIONS = 5

#: A stress counts as on the yield surface within this distance from it, relative to the pressure.
ON_YIELD = 1e-9


@kernel
def _certified(b: Ellipsoid) -> bool:
    """True if ``P1`` is linear and ``P2`` quadratic in the direction, that is without a reaction pressure."""
    return is_circular(b.code) and (b.associative or b.kappa > 0.0 or b.sin <= 0.0)


@kernel
def first_to_flow(b: Ellipsoid, x: Array) -> float:
    """``P1/V`` in the direction in which the body flows at first yield, which is written to ``x[5]``.

    For associative flow this is the direction of the greatest ``P1/V``, otherwise that of the stress deviator.
    """
    size = np.sqrt(np.sum(b.stress * b.stress))
    if is_circular(b.code) or not b.associative:
        if size > 0.0:
            x[:] = b.stress / size
        else:
            x[:] = 0.0
            x[0] = 1.0
    else:
        seeds = np.zeros((2, 5))
        seeds[0, 0] = seeds[1, 0] = 1.0
        if size > 0.0:
            seeds[0] = b.stress / size
            _face_normal(b, seeds[1])
        least(b, YIELD, ENERGY, seeds, DENSE, THREE, 1e-7, ROUGH, x)
        x /= np.sqrt(np.sum(x * x))
    p1, _, _ = powers(b, x)
    return p1 / MASS


@kernel
def overload_rate(b: Ellipsoid, x: Array) -> float:
    """Rate at which the overload of the rigid body grows along the flow ``x[5]``, at fixed angular momentum.

    Stability criterion against infinitesimal perturbations of a body at yield whose flow is not associative (in place
    of ``P2``): unstable if positive. The direction of a slow flow relaxes to that of the deviator of the rigid stress,
    for which the stress is continuous, and turns with it as the shape changes. For associative flow the power is
    stationary in the direction, so that this rotation has no effect at second order; for ``beta < k`` it has. Slow flow
    continues if the deformed body is overloaded at rest, and stops otherwise.
    """
    h = 1e-4
    path = path_along(b, x)
    return (overload_at(b, path, h) - overload_at(b, path, -h)) / (2.0 * h)


@kernel
def _face_normal(b: Ellipsoid, x: Array) -> None:
    """Unit deviator ``x[5]`` of the normal to the Mohr-Coulomb face in the sector of the stress.

    ``f = (sigma_1 - sigma_3) + (sigma_1 + sigma_3) sin(phi)``: ``P1`` has a kink there, at which a descent stalls.
    """
    stress = np.empty(6)
    rate_of_strain(b.stress, 0.0, stress)
    values = np.empty(3)
    vectors = np.empty((3, 3))
    eigensystem(stress, values, vectors)
    top = np.argmax(values)
    low = np.argmin(values)
    d = np.empty(6)
    for i in range(3):
        d[i] = (1.0 + b.sin) * vectors[i, top] ** 2 - (1.0 - b.sin) * vectors[i, low] ** 2
    for k in range(3):
        i = 0 if k < 2 else 1
        j = k + 1 if k < 2 else 2
        d[3 + k] = (1.0 + b.sin) * vectors[i, top] * vectors[j, top]
        d[3 + k] -= (1.0 - b.sin) * vectors[i, low] * vectors[j, low]
    direction(d, x)
    x /= np.sqrt(np.sum(x * x))


@kernel
def mobilised_curvature(
    s: Array, spin: Array, code: int, friction: float, cohesion: float, pressure: float
) -> float:
    """``Phi''/(p V)`` along the associative ``D*`` for a friction angle equal to the required one, `friction`.

    Positive: the body is stable to infinitesimal perturbations even with its friction fully mobilised. nan if the
    deviator is zero (``D*`` is undefined), the pressure is not positive or no friction is sufficient.
    """
    b = ellipsoid(s[0], s[1], s[2], spin, code, friction, cohesion, 1.0, 0.0)
    if not friction < np.inf or pressure <= 0.0 or np.sum(b.stress * b.stress) <= 1e-28 * pressure * pressure:
        return np.nan
    x = np.empty(5)
    first_to_flow(b, x)
    _, beta = slope_of_flow(b, x)
    d = np.empty(6)
    rate_of_strain(x, beta, d)
    _, f2, _ = energy_derivatives(b.s[0], b.s[1], b.s[2], b.one, b.two, b.three, b.spin, d)
    return f2 / (pressure * MASS)


@kernel
def _critical_kappa(b: Ellipsoid, stress: Array, p: float, beta: float) -> float:
    """Plastic bulk modulus below which the body is unstable along its stress deviator; nan if there is none."""
    y = np.empty(5)
    direction(stress, y)
    y /= np.sqrt(np.sum(y * y))
    d = np.empty(6)
    rate_of_strain(y, beta, d)
    _, f2, _ = energy_derivatives(b.s[0], b.s[1], b.s[2], b.one, b.two, b.three, b.spin, d)
    g, _ = slope_of_flow(b, y)
    return p + (f2 / MASS + beta * g * b.cohesion) / (beta * (g * b.sin - beta))


@kernel
def _stable(b: Ellipsoid, x: Array, p1: float, p: float, size: float, tolerance: float) -> bool:
    """True if the body is stable to infinitesimal perturbations.

    ``P1/V`` is the largest, in the direction ``x[5]``; `p` and `size` are the pressure and the norm of the deviator.
    """
    g, _ = slope_of_flow(b, x)
    if p1 < -tolerance:
        return True
    if size <= ON_YIELD * abs(p) and g * b.sin * p <= tolerance:
        # neither deviator nor friction: a fluid, tested in all directions of constant volume
        f = np.empty((6, 6))
        curvature_form(b, f)
        return trust_region(f[:5, :5].copy(), np.zeros(5), False, np.zeros(5)) > 0.0
    if b.associative or b.kappa > 0.0 or b.sin <= 0.0:
        _, p2, _ = powers(b, x)
        return p1 <= tolerance and p2 < 0.0
    return p1 <= tolerance and overload_rate(b, x) < 0.0


@kernel
def _finite_perturbations(
    b: Ellipsoid, x: Array, marginal: bool, stable: bool, depth: int, row: Array, directions: Array
) -> None:
    """Critical energies and strains from the second order on, and their `directions`; see `classify`.

    The body flows first along ``x[5]``; `marginal`: it is at yield.
    """
    xe, xs = x.copy(), np.empty(5)
    seeds = np.zeros((3, 5))
    if _certified(b):
        row[ENERGY_2], row[STRAIN_2], most = least_second_order(b, xe, xs)
        row[SOFTEST] = most / MASS
        if marginal and not stable:
            row[ENERGY_2] = row[STRAIN_2] = 0.0
    else:
        seeds[:] = x
        row[ENERGY_2], _ = least(b, SECOND, ENERGY, seeds, DENSE, FOUR, 1e-6, depth > 4, xe)
        row[STRAIN_2], _ = least(b, SECOND, STRAIN, seeds, DENSE, FOUR, 1e-6, depth > 4, xs)
    directions[0], directions[1] = xe, xs
    # A critical energy <= 0 of a stable body: the flow does not keep this direction, the series along it has no
    # meaning.
    undefined = stable and not b.associative and row[ENERGY_2] <= 0.0
    if undefined:
        row[ENERGY_2] = row[STRAIN_2] = np.nan
        directions[:2] = np.nan
    if stable and row[ENERGY_2] == np.inf:
        row[LEVEL] = 3.0
    if depth < 3:
        return
    seeds[0], seeds[1], seeds[2] = xe, xs, x
    row[ENERGY_3], row[STRAIN_3] = least(b, THIRD, ENERGY, seeds, MEDIUM, THREE, 1e-4, depth > 4, xe)
    directions[2] = xe
    if depth > 4:
        row[STRAIN_3], _ = least(b, THIRD, STRAIN, seeds, MEDIUM, THREE, 1e-4, depth > 4, xs)
        directions[3] = xs
    if undefined:
        row[ENERGY_3] = row[STRAIN_3] = np.nan
        directions[2:4] = np.nan
    if depth < 4:
        return
    seeds[2] = xe
    row[ENERGY_B], row[STRAIN_B] = least(
        b, BARRIER, ENERGY, seeds, MEDIUM if depth > 4 else COARSE, THREE, 1e-3, depth > 4, xe
    )
    directions[4] = xe


@kernel
def classify(
    s1: float,
    s2: float,
    s3: float,
    spin: Array,
    code: int,
    phi: float,
    cohesion: float,
    flow_cohesion: float,
    dilatancy: float,
    kappa: float,
    depth: int,
    row: Array,
    directions: Array,
) -> None:
    """Write ``row[COLUMNS]`` and ``directions[DIRECTIONS, 5]``.

    `depth` 0 stops at the required friction, 1 at infinitesimal stability, 2 at the second order, 3 at the third,
    4 at the barrier; 5 also minimises the strain at third order separately. Results beyond `depth` are nan.
    `flow_cohesion` is the cohesion while the body flows: zero where it is brittle, since a deforming body is at yield.
    """
    row[:] = np.nan
    directions[:] = np.nan
    scale = np.cbrt(s1 * s2 * s3)
    s = np.empty(3)
    s[0], s[1], s[2] = s1 / scale, s2 / scale, s3 / scale
    stress = np.empty(6)
    rigid_stress(s[0], s[1], s[2], 1.0, 1.0, spin, np.zeros(6), stress)
    p, size, _ = invariants(stress)
    row[PRESSURE] = p
    row[FRICTION], row[COHESION] = demand(code, phi, cohesion, stress)
    row[OVERLOAD] = overload(code, phi, cohesion, stress)
    tolerance = ON_YIELD * max(abs(p), cohesion)
    admissible = row[OVERLOAD] <= tolerance
    row[LEVEL] = 1.0 if admissible else 0.0
    if depth < 1:
        return
    row[CURVATURE] = mobilised_curvature(s, spin, code, row[FRICTION], cohesion, p)
    if not admissible:
        for i in range(ENERGY_2, STRAIN_B + 1):
            row[i] = 0.0
        return
    b = ellipsoid(s[0], s[1], s[2], spin, code, phi, flow_cohesion, dilatancy, kappa)
    x = np.empty(5)
    p1 = first_to_flow(b, x)
    g, beta = slope_of_flow(b, x)
    if 0.0 < beta < g * b.sin and not b.associative and size > 0.0:
        row[KAPPA] = _critical_kappa(b, stress, p, beta)
    stable = _stable(b, x, p1, p, size, tolerance)
    if stable:
        row[LEVEL] = 2.0
    if depth >= 2:
        _finite_perturbations(b, x, p1 >= -tolerance, stable, depth, row, directions)


@kernel
def classify_many(
    s: Array,
    spin: Array,
    code: int,
    phi: Array,
    cohesion: Array,
    flow_cohesion: Array,
    dilatancy: float,
    kappa: Array,
    depth: int,
    out: Array,
) -> None:
    """:func:`classify` for every row of ``s[n, 3]``, ``spin[n, 3]``, ``phi[n]``, ...; writes ``out[n, COLUMNS]``.

    Rows whose squared axes are not all positive are nan.
    """
    directions = np.empty((DIRECTIONS, 5))
    for i in range(s.shape[0]):
        if s[i, 0] > 0.0 and s[i, 1] > 0.0 and s[i, 2] > 0.0:
            classify(
                s[i, 0],
                s[i, 1],
                s[i, 2],
                spin[i],
                code,
                phi[i],
                cohesion[i],
                flow_cohesion[i],
                dilatancy,
                kappa[i],
                depth,
                out[i],
                directions,
            )
        else:
            out[i] = np.nan
