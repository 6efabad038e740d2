"""Settings of a screening, apart from the list of asteroids."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from numbers import Real

import astropy.units as u
import numpy as np
from astropy.time import Time
from astropy.units import Quantity

from flybystab._version import __version__
from flybystab.body.body import Material, refuse_cut_off
from flybystab.body.pile import checked_number
from flybystab.constants import AU
from flybystab.errors import InvalidInput
from flybystab.flybys.grains_flyby import warn_of_few
from flybystab.orbit.ephemeris import ephemeris
from flybystab.orbit.planets import planet
from flybystab.screening.priors import Population
from flybystab.typing import Document
from flybystab.units import checked_time, to_si, whole

#: Time limit of one asteroid, s, ten thousand times the median; beyond it the row has an error.
TIME_LIMIT = 600.0


@dataclass(frozen=True)
class Settings:
    """Settings of a screening, apart from the list of asteroids.

    Attributes
    ----------
    start, stop : float
        Julian dates, TDB.
    planets : tuple of str
    within : float
        Largest distance, m.
    samples, seed : int
    material : Material
        Of the catalogue body; yield surface and dilatancy also of the samples.
    population : Population
    tolerance : float
        Step tolerance of the dynamics.
    keep_samples : bool
        Also return the samples.
    time_limit : float
        Longest time to find the encounters of one asteroid and begin with its samples, s.
    grains : int
        Grains per pile for samples that the ellipsoid cannot follow to the end; 0 for none.
    """

    start: float
    stop: float
    planets: tuple[str, ...]
    within: float
    samples: int
    seed: int
    material: Material
    population: Population
    tolerance: float = 1e-7
    keep_samples: bool = False
    time_limit: float = TIME_LIMIT
    grains: int = 0

    def stated(self) -> Document:
        """All settings that determine the rows, as plain data."""
        m = self.material
        return {
            "start_jd_tdb": self.start,
            "stop_jd_tdb": self.stop,
            "planets": list(self.planets),
            "within_au": self.within / AU,
            "samples": self.samples,
            "seed": self.seed,
            "friction_angle_deg": float(np.rad2deg(m.phi)),
            "cohesion_Pa": m.c_pa,
            "yield_surface": m.yield_surface,
            "dilatancy": m.dilatancy,
            "brittle": m.brittle,
            "population": self.population.stated(),
            "tolerance": self.tolerance,
            "flybystab": __version__,
            **({"grains": self.grains} if self.grains else {}),
        }


def settings(
    start: Time | str,
    stop: Time | str,
    planets: Sequence[str] = ("earth",),
    within: Quantity = 0.05 * u.au,
    samples: int = 1,
    seed: int = 0,
    material: Material | None = None,
    population: Population | None = None,
    *,
    tolerance: float = 1e-7,
    keep_samples: bool = False,
    time_limit: float = TIME_LIMIT,
    grains: int | None = None,
) -> Settings:
    """Checked settings of a screening (arguments of :func:`flybystab.screen`, attributes of :class:`Settings`)."""
    for name, value, most in (("tolerance", tolerance, 0.1), ("time_limit", time_limit, np.inf)):
        if isinstance(value, bool) or not isinstance(value, Real) or not 0.0 < value <= most:
            raise InvalidInput(name, value, f"a number above 0, at most {most:g}")
    dates = []
    for name, date in (("start", start), ("stop", stop)):
        dates.append(float(checked_time(date, name).tdb.jd))
    if not dates[0] < dates[1]:
        raise InvalidInput("stop", stop, f"a date after start = {start}")
    for name, number, least in (("samples", samples, 1), ("seed", seed, 0)):
        if whole(number, name, least) >= 2**62:
            raise InvalidInput(name, number, "a whole number below 2^62")
    count = 0 if grains is None else checked_number(grains)
    if count:
        warn_of_few(count)
    ephemeris().check(*(Time(d, format="jd", scale="tdb") for d in dates))
    if not isinstance(material, Material | None):
        raise InvalidInput("material", material, "a Material, or None")
    if material is not None:
        refuse_cut_off(material, "a screening")
    if not isinstance(population, Population | None):
        raise InvalidInput("population", population, "a Population, or None")
    if not isinstance(planets, Iterable):
        raise InvalidInput("planets", planets, "a name or a sequence of names")
    names = (planets,) if isinstance(planets, str) else tuple(planets)
    if not names:
        raise InvalidInput("planets", planets, "at least one planet")
    return Settings(
        start=dates[0],
        stop=dates[1],
        planets=tuple(planet(p).name for p in names),
        within=to_si(within, u.m, "within", low=0.0, open_low=True),
        samples=int(samples),
        seed=int(seed),
        material=material or Material(),
        population=population or Population(),
        tolerance=tolerance,
        keep_samples=keep_samples,
        time_limit=float(time_limit),
        grains=count,
    )
