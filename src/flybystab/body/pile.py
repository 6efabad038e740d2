"""Rubble piles of grains with the shape, density, spin, friction angle and cohesion of a body.

A pile is made in scaled units (:mod:`flybystab.body.packing`), in which a pile without cohesion has neither size nor
density, and is stored on disk under its inputs. Cohesion is switched on in the settled pile; a spinning one is spun up
rigidly and relaxes.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from functools import cached_property

import astropy.units as u
import numpy as np
from astropy.units import Quantity
from numpy.typing import ArrayLike

from flybystab.arguments import check_arguments
from flybystab.body.body import Body, Material, check_settled, refuse_cut_off
from flybystab.body.grain_calibration import Friction, contact_cohesion, contact_friction
from flybystab.body.grain_sizes import GrainSizes, grain_sizes
from flybystab.body.packing import OVERLAP, settled_pile, simulation_of
from flybystab.body.pile_cache import arrays_of, stored_pile
from flybystab.body.pile_strength import spin_up
from flybystab.body.shape import Shape
from flybystab.constants import G
from flybystab.core.grains.clumps import moments, semi_axes, spin_of
from flybystab.core.grains.simulation import Simulation
from flybystab.core.numerics.threads import in_order
from flybystab.errors import InvalidInput
from flybystab.typing import Array
from flybystab.units import to_si, whole

#: Least and largest number of grains: fewer do not resolve a shape, more take days to compute.
LEAST, MOST = 20, 200_000
#: Memory of a pile, bytes a grain.
_BYTES = 4000
#: Time in which a cohesive pile comes to rest before it is spun up (scaled), and the drag in it.
_COHERED, _DRAG = 1.0, 3.0
#: Number of spheres from which a friction angle is measured.
_SPHERES = 3


@dataclass
class PileState:
    """A pile at the start of an encounter, in scaled units, with the scale of its body.

    Attributes
    ----------
    simulation : Simulation
        Grains, contacts and history, centred, with the spin of the body, in body axes.
    length, time : float
        Units of the simulation, m and s.
    friction : Friction
    axes : ndarray (3,)
        Semi-axes of the ellipsoid with the pile's inertia, longest first, m.
    spin : ndarray (3,)
        Angular velocity of the rigid body with the pile's inertia and angular momentum, body axes, rad/s.
    """

    simulation: Simulation
    length: float
    time: float
    friction: Friction
    axes: Array
    spin: Array

    @property
    def count(self) -> int:
        """Number of grains."""
        return len(self.simulation.grains.mass)


@check_arguments
def make_pile(
    body: Body,
    grains: int = 500,
    seed: int = 0,
    friction: Friction | None = None,
    *,
    shape: Shape | None = None,
    sizes: GrainSizes | None = None,
    keep: bool = True,
    overlap: float = OVERLAP,
    **options: object,
) -> PileState:
    """A pile with the shape, density, spin, friction angle and cohesion of a body.

    Parameters
    ----------
    body : Body
    grains : int
        Number of grains.
    seed : int
        Piles with different seeds differ in the positions and sizes of all grains.
    friction : Friction, optional
        Contact friction instead of that calibrated for the body's friction angle.
    shape : Shape, optional
        Shape of the pile instead of the ellipsoid; the body is its equivalent ellipsoid.
    sizes : GrainSizes, optional
        Of the grains.
    keep : bool
        Whether to read the pile from the cache, and to store it there (:mod:`flybystab.body.pile_cache`).
    overlap : float
        Mean overlap of the grains over their radius, which sets the stiffness: from 1e-6 to 0.1.
    **options
        Attributes of :class:`flybystab.core.grains.simulation.Simulation`, for tests of the numerics.

    Raises
    ------
    InvalidInput
        A friction angle beyond the calibrated range, too strong a cohesion, and a number of grains or an
        overlap out of range.
    """
    whole(seed, "seed", 0)
    overlap = float(to_si(overlap, u.dimensionless_unscaled, "overlap", low=1e-6, high=0.1))
    if friction is None:
        check_grains(body, grains)
    friction = friction or contact_friction(body.material.phi)
    cohesion, friction = contact_cohesion(body.material.c_pa, friction, _central_pressure(body))
    axes = body.axes / np.cbrt(np.prod(body.axes))
    inputs: dict[str, ArrayLike] = {
        "shape": axes, "grains": grains, "seed": seed, "mu_s": friction.mu_s, "beta": friction.beta,
    }  # fmt: skip
    if sizes is not None and sizes != GrainSizes():
        inputs |= {"sizes": [sizes.low, sizes.high, sizes.index], "distribution": sizes.distribution}
    if shape is not None:
        points = shape.vertices.value / shape.mean_radius.value
        inputs |= {"facets": shape.facets.ravel(), "vertices": points.ravel()}

    def settled() -> Simulation:
        return settled_pile(axes, grains, seed, friction.mu_s, friction.beta, sizes, shape)

    arrays = stored_pile(inputs, settled) if keep else arrays_of(settled())
    strength = body.material.c_pa / _pressure_unit(body)
    cohesion /= _pressure_unit(body)
    sim = simulation_of(arrays, friction.mu_s, friction.beta, overlap, cohesion, strength, **options)
    if cohesion > 0.0:
        sim.advance(_COHERED, drag=_DRAG)
        sim.centre()
    return spun(sim, body, friction, 1.0 if shape is None else _spread_out(shape))


def _spread_out(shape: Shape) -> float:
    """Size of the ellipsoid with the inertia of a shape over that of the equivalent ellipsoid of equal volume."""
    return float(np.sqrt(2.5 * np.sum(shape.inertia.value) / np.sum(shape.ellipsoid().value ** 2)))


def _pressure_unit(body: Body) -> float:
    """Unit of pressure of the simulation, ``G M^2/R^4``, Pa."""
    return float(G * body.mass.to_value(u.kg) ** 2 / np.prod(body.axes) ** (4.0 / 3.0))


def _central_pressure(body: Body) -> float:
    """Central pressure of the sphere of equal mass and volume, Pa."""
    return float(2.0 / 3.0 * np.pi * G * body.rho**2 * np.prod(body.axes) ** (2.0 / 3.0))


def checked_number(grains: int) -> int:
    """The number of grains; raises InvalidInput for one out of range."""
    if not isinstance(grains, int | np.integer) or isinstance(grains, bool) or not grains >= LEAST:
        raise InvalidInput("grains", grains, f"a whole number of grains, {LEAST} or more")
    fitting = int(_memory() / _BYTES) if np.isfinite(_memory()) else MOST
    if grains > min(MOST, fitting):
        reason = "which fit in the memory of this machine" if fitting < MOST else "which take days to compute"
        raise InvalidInput("grains", grains, f"at most {min(MOST, fitting)} grains, {reason}")
    return int(grains)


def check_grains(body: Body, grains: int) -> None:
    """Raise InvalidInput for a number of grains, or a body, that cannot be modelled by grains."""
    checked_number(grains)
    refuse_cut_off(body.material, "a pile of grains")
    friction = contact_friction(body.material.phi)
    contact_cohesion(body.material.c_pa, friction, _central_pressure(body))
    if body.material.brittle and body.material.c_pa > 0.0:
        raise InvalidInput(
            "brittle", True, "False: broken contacts become cohesive again when the grains touch"
        )


def _memory() -> float:
    """Bytes of memory of this machine; infinite where it is not known."""
    try:
        return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    except (AttributeError, ValueError, OSError):
        return np.inf


def spun(sim: Simulation, body: Body, friction: Friction, size: float = 1.0) -> PileState:
    """The pile spun up to the body's spin, relaxed and turned back to body axes.

    `size` is that of the ellipsoid with the pile's inertia over that of the body.
    """
    g = sim.grains
    held = g.mass > 0.0
    mass, _, _, inertia, _ = moments(g, held)
    axes, _ = semi_axes(mass, inertia)
    length = size * float(np.cbrt(np.prod(body.axes) / np.prod(axes)))
    unit = float(np.sqrt(length**3 / (G * body.mass.to_value(u.kg))))
    spin = body.omega * unit
    start = g.x.copy()
    sim.add_spin(spin - spin_of(inertia, moments(g, held)[4]))
    sim.advance(2.2)
    # reverse the rotation of the pile: the best fit between the positions before and after (Kabsch 1976)
    left, _, right = np.linalg.svd(g.x.T @ (g.mass[:, None] * start))
    turn = right.T @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ left.T
    sim.rotate(turn)
    sim.centre()
    mass, _, _, inertia, momentum = moments(g, held)
    sim.add_spin(spin - spin_of(inertia, momentum))
    mass, _, _, inertia, momentum = moments(g, held)
    axes, _ = semi_axes(mass, inertia)
    sim.time = 0.0
    return PileState(sim, length, unit, friction, axes * length, spin_of(inertia, momentum) / unit)


@dataclass(frozen=True, eq=False)
class Pile:
    """A rubble pile of grains.

    Parameters
    ----------
    source : Body or Shape
        The pile has its shape: an ellipsoid, or a polyhedron in its principal axes.
    grains : int
        Number of grains.
    seed : int
        Piles with different seeds differ in the positions and sizes of all grains.
    size_distribution : str
        ``"uniform"`` in the radius, or ``"power law"``: the number of grains larger than ``r`` goes as ``r^-index``.
    index : float, optional
        Exponent of the power law, 3 by default.
    size_range : (float, float), optional
        Smallest and largest radius in any unit, at most 1:10; 0.6 to 1.4 (uniform) or 0.5 to 2 by default.
    density, spin_period, spin, material
        Of a pile with the shape of a polyhedron, as for :meth:`Body.from_shape`; a body has its own.

    Raises
    ------
    InvalidInput, UnknownName, UnitMismatch, UnsettledBody

    Notes
    -----
    The pile is made, or read from the cache, when a property is first accessed. ``flyby(pile, encounter)`` carries it
    through an encounter.
    """

    source: Body | Shape
    grains: int = 500
    seed: int = 0
    size_distribution: str = "uniform"
    index: float | None = None
    size_range: tuple[float, float] | None = None
    density: Quantity | None = field(default=None, kw_only=True)
    spin_period: Quantity | None = field(default=None, kw_only=True)
    spin: Quantity | None = field(default=None, kw_only=True)
    material: Material | None = field(default=None, kw_only=True)

    body: Body = field(init=False, repr=False)  #: the equivalent ellipsoid of the pile
    sizes: GrainSizes = field(init=False, repr=False)

    def __post_init__(self) -> None:
        given = {k: getattr(self, k) for k in ("density", "spin_period", "spin", "material")}
        if isinstance(self.source, Body):
            for name, value in given.items():
                if value is not None:
                    raise InvalidInput(name, value, "the one of the body: body.with_(...) changes it")
            body = self.source
        elif isinstance(self.source, Shape):
            if self.density is None:
                raise InvalidInput("density", None, "the bulk density: a shape has none")
            body = Body.from_shape(self.source, **given)
        else:
            raise InvalidInput("source", self.source, "a Body or a Shape")
        check_settled(body)
        check_grains(body, self.grains)
        whole(self.seed, "seed", 0)
        object.__setattr__(self, "body", body)
        sizes = grain_sizes(self.size_distribution, self.index, self.size_range)
        object.__setattr__(self, "sizes", sizes)

    def state(self, seed: int | None = None) -> PileState:
        """A copy for a simulation: of this pile, or of another seed."""
        return make_pile(
            self.body,
            self.grains,
            self.seed if seed is None else whole(seed, "seed", 0),
            shape=self.source if isinstance(self.source, Shape) else None,
            sizes=self.sizes,
        )

    @cached_property
    def _state(self) -> PileState:
        return self.state()

    @property
    def positions(self) -> Quantity:
        """Centres of the grains from the centre of mass, ``(n, 3)``, body axes, m."""
        return self._state.simulation.grains.x * self._state.length * u.m

    @property
    def radii(self) -> Quantity:
        """Radii of the grains, ``(n,)``, m."""
        return self._state.simulation.grains.radius * self._state.length * u.m

    @property
    def masses(self) -> Quantity:
        """Masses of the grains, ``(n,)``, kg."""
        return self._state.simulation.grains.mass * self.body.mass

    @property
    def semi_axes(self) -> Quantity:
        """Semi-axes of the ellipsoid with the inertia of the pile, longest first, m."""
        return self._state.axes * u.m

    @property
    def spin_vector(self) -> Quantity:
        """Angular velocity of the rigid body with the pile's inertia and angular momentum, body axes, rad/s."""
        return self._state.spin * u.rad / u.s

    @property
    def porosity(self) -> float:
        """Porosity: fraction of the volume of the body that is not filled by grains."""
        return 1.0 - float((4.0 / 3.0 * np.pi * (self.radii**3).sum() / self.body.volume).to_value(u.one))

    @cached_property
    def _measured(self) -> tuple[float, float]:
        friction = contact_friction(self.body.material.phi)

        def course(seed: int) -> Array:
            sim = settled_pile(np.ones(3), self.grains, seed, friction.mu_s, friction.beta, self.sizes)
            return spin_up(sim, _first(0.6 * self.body.material.phi))

        seeds = range(self.seed, self.seed + _SPHERES)
        courses = list(in_order(course, seeds, min(_SPHERES, os.cpu_count() or 1)))
        peaks = np.array([c[:, 1].max() for c in courses])
        # the peak lies between two increments of the spin
        increment = max(float(np.diff(c[: c[:, 1].argmax() + 1, 1])[-1:].sum()) for c in courses)
        return float(peaks.mean()), float(np.hypot(peaks.std(ddof=1) / np.sqrt(_SPHERES), 0.5 * increment))

    @property
    def friction_angle(self) -> Quantity:
        """Friction angle of piles of such grains, deg, measured as the largest that spheres mobilise in a spin-up.

        The spheres have the number, sizes and contact friction of the grains of this pile, and its seed and the next
        two. The first access takes as long as about thirty encounters.
        """
        return self._measured[0] * u.deg

    @property
    def friction_angle_error(self) -> Quantity:
        """Error of :attr:`friction_angle`, deg: standard error over the spheres, and half an increment of the spin."""
        return self._measured[1] * u.deg

    def __repr__(self) -> str:
        kind = (
            "" if self.size_distribution == "uniform" else f", {self.size_distribution} {self.sizes.index:g}"
        )
        return f"<Pile {self.grains} grains{kind}, seed {self.seed}, {repr(self.source)[1:-1]}>"


def _first(angle: float) -> float:
    """``omega^2/(pi G rho)`` at which a sphere mobilises a friction angle (rad) of Mohr-Coulomb.

    Mean pressures ``(rho a^2/5)(4/3 pi G rho - omega^2)`` across the spin and ``(rho a^2/5)(4/3 pi G rho)`` along it,
    in the ratio ``(1 - sin phi)/(1 + sin phi)``.
    """
    sin = np.sin(angle)
    return float(4.0 / 3.0 * (1.0 - (1.0 - sin) / (1.0 + sin)))
