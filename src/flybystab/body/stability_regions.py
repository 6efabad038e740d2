"""Stability of many bodies at once, and maps over shape and spin: arrays in, arrays out.

The kernels release the interpreter lock: the rows are divided among threads, one for each core.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields
from difflib import get_close_matches

import astropy.units as u
import numpy as np
from astropy.units import Quantity
from numpy.typing import ArrayLike, NDArray

from flybystab.body.body import DEFAULT_SURFACE, YIELD_SURFACES, Body, refuse_cut_off
from flybystab.body.perturbation import flow_cohesion
from flybystab.body.stability import LEVELS
from flybystab.constants import G
from flybystab.core.ellipsoid.potential import carlson_fd
from flybystab.core.energy import stability_row as columns
from flybystab.core.energy.potential import GRAVITY
from flybystab.core.energy.stability_row import classify_many
from flybystab.core.numerics.threads import in_order, worker_count
from flybystab.errors import InvalidInput, UnknownName
from flybystab.progress import Progressing, progress_bar
from flybystab.typing import Array
from flybystab.units import to_si

#: Levels of a batch; each costs about ten times the one before.
DEPTHS = ("friction", "infinitesimal", "second", "third", "barrier")


@dataclass(frozen=True)
class StabilityTable:
    """Stability of many bodies; every attribute has the shape of the input.

    Attributes
    ----------
    required_friction_angle : Quantity
        deg; inf where none suffices.
    required_cohesion, mean_pressure : Quantity
        Pa; pi G rho^2 a^2 with the mean radius ``a`` in a map.
    level : ndarray of int
        Index into :data:`~flybystab.body.stability.LEVELS`; -1 where the axis ratios are not those of an ellipsoid.
    curvature_at_yield : ndarray
        ``Phi''/(p V)`` with the required friction mobilised.
    energy_second, energy_third, energy_barrier : Quantity
        Least critical energy, J; in units of the binding energy in a map. nan where not computed.
    strain_second, strain_third, strain_barrier : ndarray
        Least critical strain at second order; the strains of least energy at the other two.
    """

    required_friction_angle: Quantity
    required_cohesion: Quantity
    mean_pressure: Quantity
    level: NDArray[np.int64]
    curvature_at_yield: Array
    energy_second: Quantity
    energy_third: Quantity
    energy_barrier: Quantity
    strain_second: Array
    strain_third: Array
    strain_barrier: Array

    def names(self) -> NDArray[np.str_]:
        """Names of the levels."""
        return np.array([*LEVELS, "not a shape"])[self.level]

    def reshaped(self, shape: tuple[int, ...]) -> StabilityTable:
        """The same in another shape."""
        return StabilityTable(**{f.name: getattr(self, f.name).reshape(shape) for f in fields(self)})


def stability_many(
    bodies: Iterable[Body],
    *,
    friction_angle: Quantity | None = None,
    dilatancy: float = 1.0,
    depth: str = "barrier",
    workers: int | None = None,
    threads: int | None = None,
    progress: Progressing = None,
) -> StabilityTable:
    """Stability of many bodies with one yield surface.

    Parameters
    ----------
    bodies : iterable of Body
        All with the same yield surface.
    friction_angle : Quantity, scalar or shape (n,), optional
        In place of the bodies' own.
    dilatancy : float
        ``beta/min k`` of the test; 1 is associative flow.
    depth : str
        One of :data:`DEPTHS`: the last level that is computed.
    workers : int, optional
        Number of threads; one per processor by default.
    threads : int, optional
        Deprecated name of `workers`.
    progress : bool or function, optional
        Whether to show a bar (:mod:`flybystab.progress`); after two seconds on a terminal by default.

    Returns
    -------
    StabilityTable, shape (n,)
    """
    bodies = list(bodies)
    for b in bodies:
        refuse_cut_off(b.material, "stability_many")
    surfaces = {b.material.yield_surface for b in bodies}
    if len(surfaces) > 1:
        raise InvalidInput("bodies", sorted(surfaces), "bodies with one yield surface")
    if not bodies:
        return _table(np.empty((0, columns.COLUMNS)), np.empty(0), np.empty(0), u.Pa, u.J)
    axes = np.array([b.axes for b in bodies])
    rho = np.array([b.rho for b in bodies])
    omega = np.array([b.omega for b in bodies])
    length = np.cbrt(axes.prod(axis=1))
    rate = np.sqrt(np.pi * G * rho)
    stress = rho * (rate * length) ** 2
    if friction_angle is None:
        phi = np.array([b.material.phi for b in bodies])
    else:
        phi = to_si(
            friction_angle, u.rad, "friction_angle", shape=None, low=0.0, high=np.pi / 2, open_high=True
        )
    moduli = (b.material.bulk_modulus for b in bodies)
    out = _rows(
        axes**2,
        omega / rate[:, None],
        YIELD_SURFACES.index(surfaces.pop()),
        np.broadcast_to(phi, rho.shape),
        np.array([b.material.c_pa for b in bodies]) / stress,
        np.array([flow_cohesion(b) for b in bodies]) / stress,
        np.array([0.0 if k is None else k.to_value(u.Pa) for k in moduli]) / stress,
        dilatancy,
        depth,
        worker_count(workers, threads),
        progress,
    )
    return _table(out, stress, stress * length**3, u.Pa, u.J)


def stability_map(
    a2_a1: ArrayLike,
    a3_a1: ArrayLike,
    w2: ArrayLike,
    friction_angle: Quantity,
    *,
    cohesion: float = 0.0,
    yield_surface: str = DEFAULT_SURFACE,
    dilatancy: float = 1.0,
    depth: str = "second",
    workers: int | None = None,
    threads: int | None = None,
    progress: Progressing = None,
) -> StabilityTable:
    """Stability over axis ratios and spin, in units of the body itself.

    Parameters
    ----------
    a2_a1, a3_a1, w2 : array_like
        Axis ratios and ``omega^2/(pi G rho)``, broadcast against each other: for example with
        shapes (1, n), (m, 1) and () for the (a2/a1, a3/a1) plane. Level -1 and nan unless ``1 >= a2/a1 >= a3/a1 > 0``.
    friction_angle : Quantity, scalar
        Of the material.
    cohesion : float
        In ``pi G rho^2 a^2``, ``a`` the mean radius.
    yield_surface, dilatancy, depth, workers, threads, progress
        As in :func:`stability_many`.

    Returns
    -------
    StabilityTable
        In the broadcast shape, without dimensions: stresses in ``pi G rho^2 a^2``, energies in the binding
        energy ``(3/5) G m^2 R_F``.
    """
    a2, a3, w = np.broadcast_arrays(*(np.asarray(v, dtype=float) for v in (a2_a1, a3_a1, w2)))
    if np.any(w < 0.0) or not np.all(np.isfinite(w)):
        raise InvalidInput("w2", w2, "finite numbers of at least zero")
    if not (np.isfinite(cohesion) and cohesion >= 0.0):
        raise InvalidInput("cohesion", cohesion, "a finite number of at least zero")
    if yield_surface not in YIELD_SURFACES:
        near = get_close_matches(str(yield_surface), YIELD_SURFACES, cutoff=0.4)
        raise UnknownName("yield surface", str(yield_surface), near, f"(known: {', '.join(YIELD_SURFACES)})")
    phi = to_si(friction_angle, u.rad, "friction_angle", low=0.0, high=np.pi / 2, open_high=True)
    n = a2.size
    shape_exists = ((a2 <= 1.0) & (a3 <= a2) & (a3 > 0.0)).ravel()
    s = np.where(
        shape_exists[:, None], np.column_stack([np.ones(n), a2.ravel() ** 2, a3.ravel() ** 2]), np.nan
    )
    spin = np.zeros((n, 3))
    spin[:, 2] = np.sqrt(w.ravel())
    out = _rows(
        s,
        spin,
        YIELD_SURFACES.index(yield_surface),
        np.full(n, phi),
        np.full(n, float(cohesion)),
        np.full(n, float(cohesion)),
        np.zeros(n),
        dilatancy,
        depth,
        worker_count(workers, threads),
        progress,
    )
    scaled = s / np.cbrt(s.prod(axis=1))[:, None]
    binding = np.array([2.0 * GRAVITY * carlson_fd(*row)[0] if row[0] > 0 else np.nan for row in scaled])
    one = u.dimensionless_unscaled
    return _table(out, np.ones(n), 1.0 / binding, one, one).reshaped(a2.shape)


def _rows(
    s: Array,
    spin: Array,
    code: int,
    phi: Array,
    cohesion: Array,
    in_flow: Array,
    kappa: Array,
    dilatancy: float,
    depth: str,
    workers: int,
    progress: Progressing,
) -> Array:
    if depth not in DEPTHS:
        raise UnknownName(
            "depth", str(depth), get_close_matches(str(depth), DEPTHS), f"(known: {', '.join(DEPTHS)})"
        )
    beta = to_si(dilatancy, u.dimensionless_unscaled, "dilatancy", low=0.0, high=1.0)
    n = len(s)
    out = np.empty((n, columns.COLUMNS))
    # Small chunks balance the load: the cost of a cell varies over a map, but little between neighbours.
    size = max(1, min(512, -(-n // (8 * workers))))
    contiguous = [np.ascontiguousarray(v) for v in (s, spin, phi, cohesion, in_flow, kappa)]

    def work(start: int) -> None:
        part = slice(start, start + size)
        s_, spin_, phi_, cohesion_, in_flow_, kappa_ = (v[part] for v in contiguous)
        classify_many(
            s_, spin_, code, phi_, cohesion_, in_flow_, beta, kappa_, DEPTHS.index(depth), out[part]
        )

    with progress_bar(progress, n, "bodies", "stability") as tick:
        for k, _ in enumerate(in_order(work, range(0, n, size), workers), start=1):
            tick(min(k * size, n))
    return out


def _table(
    out: Array, stress: Array, energy: Array, pressure: u.UnitBase, joule: u.UnitBase
) -> StabilityTable:
    return StabilityTable(
        required_friction_angle=np.rad2deg(out[:, columns.FRICTION]) * u.deg,
        required_cohesion=out[:, columns.COHESION] * stress * pressure,
        mean_pressure=out[:, columns.PRESSURE] * stress * pressure,
        level=np.where(np.isnan(out[:, columns.LEVEL]), -1, out[:, columns.LEVEL]).astype(int),
        curvature_at_yield=out[:, columns.CURVATURE],
        energy_second=out[:, columns.ENERGY_2] * energy * joule,
        energy_third=out[:, columns.ENERGY_3] * energy * joule,
        energy_barrier=out[:, columns.ENERGY_B] * energy * joule,
        strain_second=out[:, columns.STRAIN_2],
        strain_third=out[:, columns.STRAIN_3],
        strain_barrier=out[:, columns.STRAIN_B],
    )
