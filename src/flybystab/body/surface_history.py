"""Slope and effective acceleration on every facet of a shape, as functions of time.

On each facet the effective acceleration of loose material is ``g = grad U + (K_t - Omega^2 - Omegadot) x``
(:mod:`flybystab.body.shape_slope`). Its component along the outward normal determines whether material lifts off; its
angle to the inward normal is the slope.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import astropy.units as u
import numpy as np
from astropy.units import Quantity
from numpy.typing import NDArray

from flybystab.body.body import Body
from flybystab.body.shape import Shape
from flybystab.body.shape_slope import field_matrix, gravity_at_facets
from flybystab.body.surface_slope import SlopeChange, spin_and_tide
from flybystab.errors import InvalidInput
from flybystab.tabular import Tabular
from flybystab.typing import Array
from flybystab.units import brief, to_si


@dataclass(frozen=True, eq=False)
class SurfaceHistory(Tabular):
    """The surface of a rigid shape at ``m`` instants; ``f`` facets.

    Attributes
    ----------
    shape : Shape
    time : Quantity, shape (m,)
        Of the instants; in an encounter from closest approach, s.
    slope : Quantity, shape (m, f)
        Angle between the outward normal and the reversed effective acceleration, deg.
    acceleration : Quantity, shape (m, f)
        Magnitude of the effective acceleration, m/s2.
    outward : Quantity, shape (m, f)
        Its component along the outward normal, m/s2; negative where it holds material down.
    closest : int
        Row of the closest approach, or of the strongest tide.
    """

    shape: Shape
    time: Quantity
    slope: Quantity
    acceleration: Quantity
    outward: Quantity
    closest: int

    _dimensions: ClassVar[tuple[str, ...]] = ("time", "facet")
    _left_out: ClassVar[tuple[str, ...]] = ("shape",)

    def _grid(self) -> tuple[int, ...]:
        return self.slope.shape

    def __len__(self) -> int:
        return len(self.time)

    def __repr__(self) -> str:
        facets = self.slope.shape[1]
        rise, fall = brief(self.rise.max()), brief(self.fall.max())
        return f"<SurfaceHistory {len(self)} instants, {facets} facets: slopes rise by {rise}, fall by {fall} at most>"

    @property
    def change(self) -> Quantity:
        """Slope minus that at the first instant, shape (m, f), deg."""
        return self.slope - self.slope[0]

    @property
    def rise(self) -> Quantity:
        """Largest increase of the slope of each facet over its first value, shape (f,), deg."""
        return self.change.max(axis=0)

    @property
    def fall(self) -> Quantity:
        """Largest decrease, shape (f,), deg, positive."""
        return -self.change.min(axis=0)

    @property
    def extremes(self) -> SlopeChange:
        """Slope at the first instant, least and greatest slope of each facet."""
        return SlopeChange(
            self.shape.centroids,
            self.shape.facet_area,
            self.slope[0],
            self.slope.min(axis=0),
            self.slope.max(axis=0),
        )

    def share_past(self, repose: Quantity) -> Array:
        """Fraction of the area steeper than an angle of repose at each instant, shape (m,)."""
        limit = to_si(repose, u.deg, "repose", low=0.0, high=180.0)
        return self._shares(self.slope.value > limit)

    @property
    def share_lifted(self) -> Array:
        """Fraction of the area whose effective acceleration points outward at each instant, shape (m,)."""
        return self._shares(self.outward.value > 0.0)

    def refreshed(self, *, repose: Quantity | None = None, rise: Quantity | None = None) -> NDArray[np.bool_]:
        """Facets on which loose material is expected to move, shape (f,).

        Parameters
        ----------
        repose : Quantity, optional
            Facets that are below this angle at the first instant and exceed it later.
        rise : Quantity, optional
            Facets whose slope rises by more than this angle. With both, facets that meet either condition.
        """
        if repose is None and rise is None:
            raise InvalidInput("repose", repose, "an angle of repose, a rise of the slope, or both")
        out = np.zeros(self.slope.shape[1], dtype=bool)
        if repose is not None:
            limit = to_si(repose, u.deg, "repose", low=0.0, high=180.0)
            out |= (self.slope.value[0] <= limit) & (self.slope.value.max(axis=0) > limit)
        if rise is not None:
            out |= self.rise.value > to_si(rise, u.deg, "rise", low=0.0, high=180.0)
        return out

    def share_refreshed(self, *, repose: Quantity | None = None, rise: Quantity | None = None) -> float:
        """Fraction of the area on those facets (arguments: :meth:`refreshed`)."""
        return float(self._shares(self.refreshed(repose=repose, rise=rise)[None])[0])

    def fields(self) -> dict[str, Quantity]:
        """Slopes before, at closest approach and after, and largest rise and fall, for :meth:`Shape.write`."""
        return {
            "slope_before": self.slope[0],
            "slope_closest": self.slope[self.closest],
            "slope_after": self.slope[-1],
            "rise": self.rise,
            "fall": self.fall,
            "outward_acceleration_closest": self.outward[self.closest],
        }

    def _shares(self, masks: NDArray[np.bool_]) -> Array:
        area = self.shape.facet_area.value
        return np.asarray(masks @ area / area.sum())


def shape_history(
    shape: Shape, body: Body, time: Quantity, spin: Quantity, tide: Quantity, *, closest: int | None = None
) -> SurfaceHistory:
    """Slope and effective acceleration on all facets of a rigid shape.

    Parameters
    ----------
    shape : Shape
    body : Body
        Density and inertia ratios, e.g. of :meth:`Body.from_shape`; its own spin is not used.
    time : Quantity, shape (m,)
    spin : Quantity, shape (m, 3)
        Angular velocity, principal frame.
    tide : Quantity, shape (m, 3, 3) or (m, 6)
        Tidal tensors, or ``xx, yy, zz, xy, xz, yz``, principal frame, s^-2.
    closest : int, optional
        Row of the closest approach; that of the largest tide by default.

    Returns
    -------
    SurfaceHistory
    """
    t = to_si(time, u.s, "time", shape=None)
    w, k = spin_and_tide(spin, tide)
    if np.shape(t) != (len(w),):
        raise InvalidInput("time", np.shape(t), f"shape ({len(w)},), one for each spin")
    gravity = gravity_at_facets(shape, body)
    points, normals = shape.centroids.value, shape.normals
    slope, size, outward = (np.empty((len(w), len(points))) for _ in range(3))
    for i in range(len(w)):
        g = gravity + points @ field_matrix(body, w[i], k[i]).T
        size[i] = np.linalg.norm(g, axis=1)
        outward[i] = np.einsum("ni,ni->n", normals, g)
        slope[i] = np.arctan2(np.linalg.norm(np.cross(normals, g), axis=1), -outward[i])
    row = int(np.argmax(np.abs(k).max(axis=1))) if closest is None else closest
    acceleration = u.m / u.s**2
    return SurfaceHistory(
        shape, t * u.s, np.rad2deg(slope) * u.deg, size * acceleration, outward * acceleration, row
    )
