"""Distance from a planet within which an encounter refreshes a given fraction of the surface of a shape."""

from __future__ import annotations

from dataclasses import dataclass

import astropy.units as u
import numpy as np
from astropy.units import Quantity

from flybystab.body.body import Body, check_settled
from flybystab.body.shape import Shape
from flybystab.encounter.encounter import Encounter
from flybystab.flybys.spin_sample import spin_states
from flybystab.flybys.surface_change import check_shape
from flybystab.flybys.surface_history import surface_history
from flybystab.orbit.planets import Planet, planet
from flybystab.progress import Progressing, progress_bar
from flybystab.tabular import Record
from flybystab.typing import Array
from flybystab.units import brief, to_si, whole

#: Periapsis distances searched: the least over that of an impact, the largest in radii of the planet.
LEAST, MOST = 1.001, 60.0
#: Bisections of the logarithm of that interval: the distance is found to 0.1 %.
BISECTIONS = 12
#: Instants of each encounter.
INSTANTS = 60


@dataclass(frozen=True, eq=False)
class RefreshDistance(Record):
    """Distance within which encounters refresh a given fraction of the surface.

    Attributes
    ----------
    planet : Planet
    distance : Quantity
        Largest periapsis distance at which at least that fraction is refreshed, km; nan if no encounter outside the
        planet refreshes that fraction.
    area : float
        Given fraction of the area, as the mean over the attitudes.
    low, high : Quantity
        Distances for the attitudes that refresh the smallest and the largest area, km.
    attitudes : int
    """

    planet: Planet
    distance: Quantity
    area: float
    low: Quantity
    high: Quantity
    attitudes: int

    @property
    def radii(self) -> float:
        """The distance in radii of the planet."""
        return float(self.distance.to_value(u.m)) / self.planet.radius

    def __repr__(self) -> str:
        return (
            f"<RefreshDistance {self.planet.name}: {100 * self.area:g} % of the area within {brief(self.distance)} "
            f"({self.radii:.3g} radii)>"
        )


def refresh_distance(
    body: Body,
    shape: Shape,
    planet_name: str | Planet = "earth",
    *,
    v_inf: Quantity = 12.0 * u.km / u.s,
    area: float = 0.1,
    repose: Quantity | None = None,
    rise: Quantity | None = None,
    attitudes: int = 8,
    seed: int = 0,
    progress: Progressing = None,
) -> RefreshDistance:
    """Periapsis distance within which an encounter refreshes a given fraction of the surface.

    Parameters
    ----------
    body : Body
        Density and spin; `shape` is its true shape (:meth:`Body.from_shape`).
    shape : Shape
    planet_name : str or Planet
    v_inf : Quantity
        Hyperbolic excess speed.
    area : float
        Fraction of the area, above 0 and below 1.
    repose, rise : Quantity, optional
        Criterion by which a facet counts as refreshed (:meth:`SurfaceHistory.refreshed`); a rise of 2 deg if neither is
        given.
    attitudes : int
        Isotropic attitudes at the start.
    seed : int
    progress : bool or function, optional
        Whether to show a bar (:mod:`flybystab.progress`); after two seconds on a terminal by default.

    Returns
    -------
    RefreshDistance

    Notes
    -----
    The body is treated as rigid at every distance. Where it yields as a whole, its surface is refreshed in any case.
    The rise of the slope that sets regolith in motion is not known: the distance depends on that choice.
    """
    check_settled(body)
    check_shape(shape, body)
    home = planet(planet_name)
    share = to_si(area, u.dimensionless_unscaled, "area", low=0.0, high=1.0, open_low=True, open_high=True)
    if repose is None and rise is None:
        rise = 2.0 * u.deg
    rotations = spin_states(body, whole(attitudes, "attitudes", 1), seed).rotations

    def fractions(radii: float) -> Array:
        encounter = Encounter.hyperbolic(home, radii * home.radius * u.m, v_inf)
        return np.array(
            [
                surface_history(body, encounter, a, shape=shape, instants=INSTANTS).share_refreshed(
                    repose=repose, rise=rise
                )
                for a in rotations
            ]
        )

    found: dict[float, Array] = {}

    def root(statistic: str) -> float:
        """Largest distance, in radii, at which a statistic of the fractions reaches the given fraction."""
        low, high = LEAST * home.impact_distance / home.radius, MOST
        for step in range(BISECTIONS + 1):
            radii = low if step == 0 else float(np.sqrt(low * high))
            if radii not in found:
                found[radii] = fractions(radii)
                tick(min(len(found), 3 * BISECTIONS))
            reached = float(getattr(np, statistic)(found[radii])) >= share
            if step == 0:
                if not reached:
                    return np.nan
            elif reached:
                low = radii
            else:
                high = radii
        return float(np.sqrt(low * high))

    with progress_bar(progress, 3 * BISECTIONS, "distances", "refreshing distance") as tick:
        middle, least, most = (root(s) * home.radius / 1e3 * u.km for s in ("mean", "min", "max"))
    return RefreshDistance(home, middle, float(share), least, most, len(rotations))
