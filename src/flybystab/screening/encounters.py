"""Encounters of asteroids with planets, integrated only where bounds on the tide do not decide the verdict."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol, runtime_checkable

import astropy.units as u
import numpy as np
from astropy.time import Time

from flybystab.catalogues.catalogue import Asteroid
from flybystab.constants import AU
from flybystab.core.ellipsoid.yield_bound import tide_size
from flybystab.encounter.encounter import Encounter
from flybystab.encounter.reach import SETTLE, far_enough, usual_start
from flybystab.errors import NoEncounter
from flybystab.orbit.orbit import Orbit
from flybystab.orbit.planets import PLANETS, planet
from flybystab.screening.settings import Settings

if TYPE_CHECKING:
    from flybystab.orbit.search.encounter_finder import Approach

#: Distance from the Earth (m) below which no bound on the Moon's tide holds without its position.
FAR_FROM_EARTH = 3 * 3.844e8
_MOON_PERIGEE, _MOON_APOGEE = 3.56e8, 4.067e8
#: Lower bound on perihelion over mean distance of the planets (Mercury: 0.794).
_PERIHELION = 0.79
_SQRT6 = np.sqrt(6.0)


@dataclass
class CloseApproach:
    """A close approach found by the search; the encounter and its tide are computed on first use.

    Attributes
    ----------
    asteroid : Asteroid
    planet : str
    time : Time
        Closest approach.
    distance, v_inf : float
        m, m/s.
    encounter : Encounter or None
        Set once it has been integrated; given for a scripted one.
    orbit : Orbit or None
        A clone, instead of the asteroid's own orbit.
    missed : bool
        The clone stays farther away than `distance` and has no encounter.
    """

    asteroid: Asteroid
    planet: str
    time: Time
    distance: float
    v_inf: float
    encounter: Encounter | None = None
    orbit: Orbit | None = None
    missed: bool = False

    @property
    def key(self) -> tuple[str, str]:
        """Key of the encounter in the random streams."""
        return self.planet, f"{self.time.tdb.jd:.1f}"

    def bounds(self) -> tuple[float, float]:
        """Bounds on the tide, as of :func:`tide_size`, from distance and speed alone; infinite where unknown.

        The encounter lasts from the distance D = `usual_start` inbound to D outbound and SETTLE longer. The
        acceleration of the asteroid away from the planet is at most ``kappa r`` with ``kappa = 2 GM_sun/d^3``, d the
        least distance from the Sun, plus, at the Earth, the Moon's acceleration of both. With E the two-body energy,
        ``(r^2)''/2 = 2 E + GM/r + r.a``, and E changes by ``int a.v dt``. Along a path from q to D
        ``int r ds < 0.7 D^2`` and ``int ds < 1.2 D``. So ``(r^2)''/2 >= v_inf^2 (1 - eps)`` with the `eps`
        below: there is one minimum, ``r^2 >= q^2 + (1 - eps) v_inf^2 t^2``, hence the time to D and
        ``int GM/r^3 dt <= 2 GM/(q^2 v_inf sqrt(1 - eps))``.
        """
        body = planet(self.planet)
        q, v = self.distance, self.v_inf
        nothing = np.inf, np.inf
        if self.planet == "moon" or q < 3.0 * body.radius or not v > 0.0:
            return nothing
        if self.planet == "earth" and q < FAR_FROM_EARTH:
            return nothing
        reach = usual_start(body, q)
        nearest = _PERIHELION * body.orbit_radius - reach
        if nearest < 0.3 * body.orbit_radius:
            return nothing
        others = PLANETS["sun"].gm / nearest**3
        eps = 1.9 * 2.0 * others * reach**2 / v**2
        if self.planet == "earth":
            moon = PLANETS["moon"].gm
            others += moon / (q - _MOON_APOGEE) ** 3
            eps += 3.4 * reach * (moon / _MOON_PERIGEE**2 + moon / (q - _MOON_APOGEE) ** 2) / v**2
        if eps > 0.75:
            return nothing
        slow = v * np.sqrt(1.0 - eps)
        # J2 adds at most 6 J2 (R/q)^2.
        near = body.gm * (1.0 + 6.0 * body.j2 * (body.radius / q) ** 2)
        peak = near / q**3 + others
        impulse = 2.0 * near / (q * q * slow) + others * (2.0 * reach / slow + SETTLE)
        # 2 percent for the other planets and for the difference between the found and the integrated distance.
        return float(1.02 * _SQRT6 * peak), float(1.02 * _SQRT6 * impulse)

    def meet(self) -> Encounter:
        """The encounter, integrated with all forces."""
        if self.missed:
            raise NoEncounter(
                f"the clone has no encounter within {self.distance / AU:.3g} au of {self.planet}"
            )
        if self.encounter is None:
            self.encounter = Encounter.from_orbit(
                self.orbit or self.asteroid.orbit,
                self.planet,
                self.time,
                within=max(1.5 * self.distance, far_enough(planet(self.planet))) * u.m,
            )
        return self.encounter

    def close_bounds(self) -> tuple[float, float]:
        """Bounds on the tide of the integrated encounter."""
        e = self.meet()
        return tide_size(e.tide, e.t_start, e.t_stop)


#: Function that finds the encounters of an asteroid; worker processes import it.
Finder = Callable[[Asteroid, Settings], list[CloseApproach]]


@runtime_checkable
class BatchFinder(Protocol):
    """A finder that searches for many asteroids at once, which a screening then uses.

    Worker processes unpickle it.
    """

    def __call__(self, asteroid: Asteroid, settings: Settings) -> list[CloseApproach]:
        """Encounters of an asteroid."""

    def batch(
        self, asteroids: Sequence[Asteroid], settings: Settings
    ) -> Sequence[list[CloseApproach] | Exception]:
        """For each asteroid its encounters, or the error of its search.

        If it raises an error itself, or takes longer than the time limit of one asteroid, the asteroids are searched
        one by one.
        """


class OrbitSearch:
    """Finder of the encounters on the orbit of an asteroid, in order of time."""

    def __call__(self, asteroid: Asteroid, settings: Settings) -> list[CloseApproach]:
        """Encounters of an asteroid."""
        from flybystab.orbit.search.encounter_finder import approaches

        return _in_order(asteroid, approaches(asteroid.orbit, *_search(settings)))

    def batch(
        self, asteroids: Sequence[Asteroid], settings: Settings
    ) -> list[list[CloseApproach] | Exception]:
        """For each asteroid its encounters, or the error of its search."""
        from flybystab.orbit.search.encounter_finder import approaches_each

        found = approaches_each([a.orbit for a in asteroids], *_search(settings))
        return [
            f if isinstance(f, Exception) else _in_order(a, f) for a, f in zip(asteroids, found, strict=True)
        ]


#: The default finder.
close_approaches = OrbitSearch()


def _search(settings: Settings) -> tuple[Time, Time, Sequence[str], float]:
    """Span, planets and largest distance (m) of a search."""
    start, stop = (Time(jd, format="jd", scale="tdb") for jd in (settings.start, settings.stop))
    return start, stop, settings.planets, settings.within


def _in_order(asteroid: Asteroid, found: Sequence[Approach]) -> list[CloseApproach]:
    """Close approaches of an asteroid in order of time."""
    if len(found) > 1:
        found = sorted(found, key=lambda a: (a.time.tdb.jd, a.planet))
    return [CloseApproach(asteroid, a.planet, a.time, a.distance, a.v_inf) for a in found]
