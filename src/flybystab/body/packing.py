"""Settled piles of grains in scaled units (:mod:`flybystab.core.grains.state`).

Spheres with little friction collapse in a central field whose level surfaces are similar to the ellipsoid. The required
number of grains is cut out of the aggregate, friction is switched on, and the pile settles under its own gravity, at
first with a drag. The preparation affects the outcome: a pile that has collapsed under its own gravity into a sphere
before the ellipsoid is cut out is stretched less, by 3 % without spin and 4 % retrograde
(``python benchmarks/grains_packing.py``).
"""

from __future__ import annotations

import astropy.units as u
import numpy as np
from numpy.typing import NDArray

from flybystab.body.grain_sizes import GrainSizes
from flybystab.body.shape import Shape
from flybystab.core.grains.clumps import moments, semi_axes, spin_of
from flybystab.core.grains.neighbours import Pairs, empty_pairs
from flybystab.core.grains.simulation import Simulation
from flybystab.core.grains.state import CENTRAL_PRESSURE, OVERLAP, Contact, Grains, contact_parameters
from flybystab.typing import Array

#: First estimate of the packing fraction: volume of the grains over that of the ellipsoid.
_PACKING = 0.6
#: Number of grains in the initial cloud, over that of the pile.
_SURPLUS = 1.35
#: Size of the cloud, over that of the ellipsoid.
_CLOUD = 1.75


def settled_pile(
    axes: Array,
    grains: int,
    seed: int,
    mu_s: float,
    beta: float,
    sizes: GrainSizes | None = None,
    shape: Shape | None = None,
) -> Simulation:
    """A pile at rest in principal axes, scaled units.

    Parameters
    ----------
    axes : ndarray (3,)
        Ratios of the semi-axes, longest first, product one.
    grains, seed : int
    mu_s, beta : float
        Contact friction.
    sizes : GrainSizes, optional
    shape : Shape, optional
        Cut out of the aggregate instead of the ellipsoid; `axes` are those of its equivalent ellipsoid.
    """
    generator = np.random.default_rng(np.random.SeedSequence([seed, grains]))
    reach = 1.0 if shape is None else _protrusion(shape, axes)
    cloud = round(_SURPLUS * grains * reach**3) + 20
    radius = (sizes or GrainSizes()).draw(cloud, generator)
    radius *= np.cbrt(_PACKING / (grains * np.mean(radius**3)))
    x = _scattered(axes * _CLOUD * reach, radius, generator)
    mass = radius**3 / (grains * np.mean(radius**3))
    falling = Grains(x, np.zeros_like(x), np.zeros_like(x), radius, mass)
    loose = contact_parameters(float(radius.mean()), mu_s=0.2, beta=0.0)
    sim = Simulation.of(falling, loose)
    field = np.array([1.0, *(1.0 / axes**2)])
    sim.advance(3.5, gravity=False, pull=field, drag=0.6)
    sim.advance(1.5, gravity=False, pull=field, drag=3.0)
    chosen = _carved(sim.grains, axes, grains) if shape is None else _cut(sim.grains, shape, grains)
    g = Grains(*(a[chosen].copy() for a in sim.grains))
    # a shape is already in its principal axes, which must not be permuted
    return settled(g, mu_s, beta, principal_axes=shape is None)


def settled(g: Grains, mu_s: float, beta: float, principal_axes: bool = True) -> Simulation:
    """The grains settled under their own gravity, without rotation and in scaled units.

    Parameters
    ----------
    g : Grains
        Grains cut out of an aggregate; positions and radii are scaled in place.
    mu_s, beta : float
        Sliding friction and contact patch.
    principal_axes : bool
        Whether to rotate the grains into their principal axes.
    """
    g = g._replace(mass=g.mass / g.mass.sum())
    everything = np.ones(len(g.mass), np.bool_)
    m, _, _, inertia, _ = moments(g, everything)
    found, _ = semi_axes(m, inertia)
    g.x[:] /= np.cbrt(np.prod(found))
    g.radius[:] /= np.cbrt(np.prod(found))
    g.v[:], g.w[:] = 0.0, 0.0
    sim = Simulation.of(g, contact_parameters(float(g.radius.mean()), mu_s=mu_s, beta=beta))
    sim.centre()
    sim.advance(1.9, drag=3.0)
    sim.advance(1.9)
    sim.centre()
    m, _, _, inertia, momentum = moments(g, everything)
    sim.add_spin(-spin_of(inertia, momentum))
    if principal_axes:
        _, turn = semi_axes(m, inertia)
        sim.rotate(turn.T)
    return sim


def _scattered(axes: Array, radius: Array, generator: np.random.Generator) -> Array:
    """Random positions of spheres in an ellipsoid without overlaps, placed in order of decreasing radius."""
    x = np.empty((len(radius), 3))
    order = np.argsort(-radius)
    for k, i in enumerate(order):
        placed = order[:k]
        while True:
            p = generator.uniform(-1.0, 1.0, 3)
            if p @ p > 1.0:
                continue
            p = p * axes
            gap = ((x[placed] - p) ** 2).sum(axis=1) - (radius[placed] + radius[i]) ** 2
            if not (gap < 0.0).any():
                x[i] = p
                break
    return x


def _carved(g: Grains, axes: Array, count: int) -> NDArray[np.int64]:
    """The `count` grains inside an ellipsoid whose axes give the inertia of the grains the required ratios."""
    ratios = axes
    axes = axes.copy()
    chosen = np.arange(count)
    for _ in range(30):
        order = np.argsort(((g.x / axes) ** 2).sum(axis=1), kind="stable")
        chosen = np.sort(order[:count])
        member = np.zeros(len(g.mass), np.bool_)
        member[chosen] = True
        x, m = g.x[member], g.mass[member]
        x = x - m @ x / m.sum()
        # second moments along the axes of the ellipsoid, the grains' own included
        a2 = 5.0 * (m @ x**2 + 0.2 * m @ g.radius[member] ** 2) / m.sum()
        found = np.sqrt(a2 / np.cbrt(np.prod(a2)))
        axes *= np.sqrt(ratios / found)
        axes /= np.cbrt(np.prod(axes))
    return chosen


def _protrusion(shape: Shape, axes: Array) -> float:
    """Size of the ellipsoid around a shape over that of the equivalent ellipsoid."""
    x = shape.vertices.value / shape.mean_radius.value
    return float(np.sqrt(((x / axes) ** 2).sum(axis=1).max()))


def _inside(shape: Shape, x: Array) -> NDArray[np.bool_]:
    """Mask of the points (m, principal axes) inside a polyhedron: the Laplacian of its potential vanishes outside."""
    _, _, gradient = shape.gravity(x * u.m, 1.0 * u.kg / u.m**3)
    trace = np.trace(gradient.value, axis1=1, axis2=2)
    return np.asarray(trace < 0.5 * trace.min()) if trace.min() < 0.0 else np.zeros(len(x), np.bool_)


def _cut(g: Grains, shape: Shape, count: int) -> NDArray[np.int64]:
    """The `count` grains with centres in a shape, scaled so that it contains that many."""
    unit = shape.mean_radius.value
    low, high = 0.3, 2.0  # sizes of the shape over its own
    held: NDArray[np.bool_] = np.zeros(len(g.mass), np.bool_)
    more: NDArray[np.bool_] = np.ones(len(g.mass), np.bool_)
    for _ in range(30):
        size = 0.5 * (low + high)
        found = _inside(shape, g.x * (unit / size))
        if found.sum() <= count:
            low, held = size, found
        else:
            high, more = size, found
        if held.sum() == count:
            break
    # the two sizes differ by rounding: any grains between them may be taken
    rest = np.flatnonzero(more & ~held)[: count - int(held.sum())]
    return np.sort(np.concatenate([np.flatnonzero(held), rest]))


def simulation_of(
    arrays: dict[str, Array],
    mu_s: float,
    beta: float,
    overlap: float = OVERLAP,
    cohesion: float = 0.0,
    strength: float = 0.0,
    **options: object,
) -> Simulation:
    """A simulation from stored arrays, with the history of its contacts.

    Parameters
    ----------
    arrays : dict
        From :func:`flybystab.body.pile_cache.stored_pile`.
    mu_s, beta : float
    overlap : float
        Mean overlap that sets the stiffness. If it differs from that with which the pile was made, the forces of the
        springs are kept.
    cohesion : float
        Attraction per area of a contact, scaled.
    strength : float
        Bulk cohesion, scaled, which adds to the pressure that sets the stiffness.
    **options
        Of :class:`flybystab.core.grains.simulation.Simulation`.
    """
    g = Grains(*(np.array(arrays[k], dtype=float) for k in ("x", "v", "w", "radius", "mass")))
    n, last = len(g.mass), len(arrays["other"])
    pairs: Pairs = empty_pairs(n, max(40, 2 * last // n))
    pairs.first[:] = arrays["first"]
    pairs.other[:last] = arrays["other"]
    pairs.spring[:last] = arrays["spring"]
    pairs.touching[:last] = arrays["touching"]

    def contact(overlap: float = OVERLAP, pressure: float = CENTRAL_PRESSURE) -> Contact:
        return contact_parameters(
            float(g.radius.mean()),
            mu_s=mu_s,
            beta=beta,
            cohesion=cohesion,
            overlap=overlap,
            pressure=pressure,
        )

    asked = contact(overlap, CENTRAL_PRESSURE + strength)
    if asked.k_n != contact().k_n:
        pairs.spring[:last] *= contact().k_n / asked.k_n
    return Simulation(g, asked, pairs, **options)  # type: ignore[arg-type]
