"""Surface slopes of a body, and how an encounter changes them.

The slope is the angle between the outward normal and the reversed effective acceleration (self-gravity,
centrifugal, Euler, tide). Where it exceeds the angle of repose, loose material slides. Studies of Apophis
publish these quantities. The body here is a smooth ellipsoid: a real surface has relief in addition.
"""

from __future__ import annotations

from dataclasses import dataclass

import astropy.units as u
import numpy as np
from astropy.units import Quantity
from numpy.typing import NDArray

from flybystab.body.body import Body
from flybystab.body.equilibrium import tide_components
from flybystab.constants import G
from flybystab.core.ellipsoid.surface_slope import effective_field, slopes, slopes_through
from flybystab.errors import InvalidInput
from flybystab.tabular import Tabular
from flybystab.typing import Array
from flybystab.units import brief, to_si


@dataclass(frozen=True, repr=False)
class SurfaceSlopes(Tabular):
    """Slopes over a surface.

    Attributes
    ----------
    points : Quantity, shape (n, 3)
        On the surface, body axes, m.
    area : Quantity, shape (n,)
        Of the patch around each point, m2.
    slope : Quantity, shape (n,)
        deg; above 90 material is lifted off.
    """

    points: Quantity
    area: Quantity
    slope: Quantity

    def share_above(self, angle: Quantity) -> float:
        """Fraction of the area whose slope passes an angle of repose."""
        limit = to_si(angle, u.deg, "angle", low=0.0, high=180.0)
        return _share(self.slope.value > limit, self.area.value)


@dataclass(frozen=True)
class SlopeChange(Tabular):
    """Slopes over a surface through an encounter.

    Attributes
    ----------
    points, area : Quantity
        As in :class:`SurfaceSlopes`.
    before : Quantity, shape (n,)
        Slope at the first instant, deg.
    least, greatest : Quantity, shape (n,)
        Over all instants, deg.
    """

    points: Quantity
    area: Quantity
    before: Quantity
    least: Quantity
    greatest: Quantity

    def __repr__(self) -> str:
        return f"<SlopeChange {len(self.before)} points: {brief(self.largest_change)} at most>"

    @property
    def largest_change(self) -> Quantity:
        """Largest departure of any point's slope from its slope before, deg."""
        return self.change.max()

    @property
    def change(self) -> Quantity:
        """Largest departure at each point, deg."""
        return np.maximum(self.greatest - self.before, self.before - self.least)

    def share_passing(self, angle: Quantity) -> float:
        """Fraction of the area that was below an angle of repose and passes it during the encounter."""
        limit = to_si(angle, u.deg, "angle", low=0.0, high=180.0)
        passing = (self.before.value <= limit) & (self.greatest.value > limit)
        return _share(passing, self.area.value)

    @property
    def share_lifted(self) -> float:
        """Fraction of the area whose slope passes 90 deg at some instant: material is lifted off."""
        return _share(self.greatest.value > 90.0, self.area.value)


def surface_points(body: Body, count: int = 4000) -> tuple[Array, Array]:
    """Points (n, 3), m, over the ellipsoid and the areas (n,), m2, of their patches.

    A Fibonacci lattice on the unit sphere, stretched to the ellipsoid: the patch of the direction ``n`` has
    ``a1 a2 a3 |S^(-1/2) n|`` times the area on the sphere.
    """
    if not (isinstance(count, (int, np.integer)) and count >= 10):
        raise InvalidInput("count", count, "an integer of at least 10")
    i = np.arange(count) + 0.5
    z = 1.0 - 2.0 * i / count
    longitude = np.pi * (1.0 + np.sqrt(5.0)) * i
    r = np.sqrt(1.0 - z * z)
    n = np.column_stack([r * np.cos(longitude), r * np.sin(longitude), z])
    area = 4.0 * np.pi / count * np.prod(body.axes) * np.linalg.norm(n / body.axes, axis=1)
    return n * body.axes, area


def surface_slopes(body: Body, tide: Quantity | None = None, *, count: int = 4000) -> SurfaceSlopes:
    """Slopes over the surface of a body at its spin, in an optional tide.

    Parameters
    ----------
    body : Body
        With any spin vector; for a tumbling body the Euler acceleration is included.
    tide : Quantity, shape (3, 3), optional
        Tidal tensor in body axes, s^-2.
    count : int
        Points on the surface.

    Returns
    -------
    SurfaceSlopes
    """
    points, area = surface_points(body, count)
    field = np.empty((3, 3))
    effective_field(body.axes**2, np.pi * G * body.rho, body.omega, tide_components(tide), field)
    out = np.empty(count)
    slopes(body.axes**2, field, points, out)
    return SurfaceSlopes(points * u.m, area * u.m**2, np.rad2deg(out) * u.deg)


def spin_and_tide(spin: Quantity, tide: Quantity) -> tuple[Array, Array]:
    """Angular velocities (m, 3), rad/s, and tidal tensors (m, 6), s^-2, at the same instants, checked."""
    with u.set_enabled_equivalencies(u.dimensionless_angles()):
        w = to_si(spin, u.rad / u.s, "spin", shape=None)
    k = to_si(tide, u.s**-2, "tide", shape=None)
    if w.ndim != 2 or w.shape[1] != 3 or len(w) < 1:
        raise InvalidInput("spin", np.shape(w), "shape (m, 3)")
    if k.shape == (len(w), 3, 3):
        k = np.stack([k[:, i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))], axis=-1)
    if k.shape != (len(w), 6):
        raise InvalidInput("tide", np.shape(tide), f"shape ({len(w)}, 3, 3) or ({len(w)}, 6)")
    return w, k


def slope_change(body: Body, spin: Quantity, tide: Quantity, *, count: int = 4000) -> SlopeChange:
    """Slopes over the surface of a rigid body through an encounter.

    Parameters
    ----------
    body : Body
        Its shape and density; its own spin is not used.
    spin : Quantity, shape (m, 3)
        Angular velocity at ``m`` instants, body axes.
    tide : Quantity, shape (m, 3, 3) or (m, 6)
        Tidal tensors at the same instants, body axes, s^-2; six components are ``xx, yy, zz, xy, xz, yz``.
        The first instant is "before".
    count : int
        Points on the surface.

    Returns
    -------
    SlopeChange
    """
    w, k = spin_and_tide(spin, tide)
    points, area = surface_points(body, count)
    s = body.axes**2
    rate = np.pi * G * body.rho
    before, least, greatest = np.empty(count), np.empty(count), np.empty(count)
    field = np.empty((3, 3))
    effective_field(s, rate, w[0], k[0], field)
    slopes(s, field, points, before)
    slopes_through(s, rate, np.ascontiguousarray(w), np.ascontiguousarray(k), points, least, greatest)
    degrees = [np.rad2deg(v) * u.deg for v in (before, least, greatest)]
    return SlopeChange(points * u.m, area * u.m**2, *degrees)


def _share(mask: NDArray[np.bool_], area: Array) -> float:
    return float(area[mask].sum() / area.sum())
