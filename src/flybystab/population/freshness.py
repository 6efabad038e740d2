"""Probability that the surface of an asteroid is fresh: refreshed by an encounter within the time of space weathering.

Near-Earth asteroids with unweathered surfaces are those that could come close to a planet recently (Binzel et al. 2010,
Nature 463, 331; Nesvorny et al. 2010, Icarus 209, 510; DeMeo et al. 2014, Icarus 227, 112): refreshing distances of 5
to 16 Earth radii and weathering within 1 Myr explain their number. Encounters are computed as far back as the orbit is
predictable; before that they are modelled as a Poisson process with the mean rate of the orbit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import astropy.units as u
import numpy as np
from astropy.table import QTable
from astropy.time import Time
from astropy.units import Quantity

from flybystab.arguments import check_arguments
from flybystab.catalogues.asteroid import Asteroid
from flybystab.errors import InvalidInput
from flybystab.orbit.search.encounter_finder import find_encounters
from flybystab.population.rates import Orbits, encounter_rates
from flybystab.tabular import Record
from flybystab.typing import Array
from flybystab.units import checked_time, to_si, whole

#: Weathering time by default, yr.
WEATHERING = 1e6 * u.yr


@dataclass(frozen=True, eq=False)
class Freshness(Record):
    """Probability that a surface is fresh, and the encounters that refresh it.

    Attributes
    ----------
    probability : float
        That the surface was refreshed within the weathering time.
    rate : Quantity
        Mean rate of refreshing encounters on the present orbit, all planets, 1/yr.
    span : Quantity
        Time before `now` over which encounters were followed, yr.
    followed : QTable
        The refreshing encounters in that time; ``index`` is the number of the clone.
    share_followed : float
        Fraction of the possible orbits with such an encounter younger than the weathering time: 0 or 1 without clones.
    clones : int
        Number of possible orbits; zero for the nominal orbit alone.
    """

    probability: float
    rate: Quantity
    span: Quantity
    followed: QTable
    share_followed: float = 0.0
    clones: int = 0

    def __repr__(self) -> str:
        return (
            f"<Freshness {self.probability:.3g}: {len(self.followed)} refreshing encounters followed, "
            f"{self.rate.to_value(1 / u.Myr):.3g} per Myr beyond>"
        )


def fresh_probability(ages: Sequence[Array], span: float, rate: float, weathering: float) -> float:
    """Probability of a refreshing encounter within the weathering time.

    Parameters
    ----------
    ages : sequence of ndarray
        Times since the refreshing encounters that were followed, yr, for each possible orbit.
    span : float
        Time over which they were followed, yr.
    rate : float
        Mean rate of such encounters before that, 1/yr.
    weathering : float
        Time after which a surface is weathered, yr.

    Returns
    -------
    float
        Mean over the orbits of 1 for those with an encounter younger than the weathering time and of ``1 - exp(-rate
        (weathering - span))`` for the others.
    """
    if not len(ages):
        raise InvalidInput("ages", ages, "at least one possible orbit")
    beyond = -np.expm1(-rate * max(weathering - span, 0.0))
    return float(np.mean([1.0 if np.any(np.asarray(a) <= weathering) else beyond for a in ages]))


@check_arguments
def freshness(
    asteroid: Asteroid,
    distances: Mapping[str, Quantity],
    *,
    weathering: Quantity = WEATHERING,
    now: Time | str | None = None,
    span: Quantity = 100.0 * u.yr,
    clones: int = 0,
    seed: int = 0,
) -> Freshness:
    """Probability that the surface of an asteroid is fresh.

    Parameters
    ----------
    asteroid : Asteroid
    distances : mapping of str to Quantity
        Refreshing distance of each planet (:func:`flybystab.flybys.refresh_distance.refresh_distance`).
    weathering : Quantity
        Time of space weathering; 1 Myr by default, an upper limit of the literature.
    now : Time, optional
        Epoch of the elements by default.
    span : Quantity
        Time over which the orbit is followed back. The ephemeris must cover it. Without clones the nominal orbit should
        be known over it: choose it shorter for a poor orbit.
    clones : int
        Number of orbits drawn from the covariance and followed back instead of the nominal one: the probability is the
        mean over them, so that an encounter is weighted with the fraction of the orbits that have it.
    seed : int
        Random seed of the clones.

    Returns
    -------
    Freshness

    Notes
    -----
    The rate is that of the present orbit with circulating angles; over 1 Myr the orbit itself changes. Encounters are
    not the only process that refreshes surfaces.
    """
    if not isinstance(asteroid, Asteroid):
        raise InvalidInput("asteroid", asteroid, "an Asteroid")
    if not distances:
        raise InvalidInput("distances", distances, "at least one planet with its refreshing distance")
    end = checked_time(asteroid.epoch if now is None else now, "now")
    years = to_si(span, u.yr, "span", low=0.0, open_low=True)
    aged = to_si(weathering, u.yr, "weathering", low=0.0, open_low=True)
    names = list(distances)
    limits = [to_si(distances[n], u.m, f"distances[{n!r}]", low=0.0, open_low=True) for n in names]
    count = whole(clones, "clones", 0)
    orbits = list(asteroid.orbit.clones(count, seed)) if count else [asteroid.orbit]
    table = find_encounters(orbits, end - years * u.yr, end, planets=names, within=np.array(limits) * u.m)
    table = table[table["planet"] != "sun"]
    age = (end - table["time"]).to_value(u.yr) if len(table) else np.zeros(0)
    number = np.asarray(table["index"], dtype=int)
    ages = [age[number == k] for k in range(len(orbits))]
    rates = [
        float(encounter_rates([asteroid], n, periapsis=q * u.m).rate[0].to_value(1 / u.yr))
        for n, q in zip(names, limits, strict=True)
    ]
    total = float(np.sum(rates))
    probability = fresh_probability(ages, years, total, aged)
    share = float(np.mean([np.any(a <= aged) for a in ages]))
    return Freshness(probability, total / u.yr, years * u.yr, table, share, count)


@check_arguments
def fresh_fraction(
    population: Orbits,
    radii: Mapping[str, float],
    *,
    weathering: Quantity = WEATHERING,
    workers: int | None = None,
) -> float:
    """Fraction of a population whose surfaces were refreshed by an encounter within the weathering time.

    Parameters
    ----------
    population : table, or sequence of Orbit or Asteroid
        As in :func:`flybystab.encounter_rates`.
    radii : mapping of str to float
        Refreshing distance of each planet in its radii.
    weathering : Quantity
        Time of space weathering.
    workers : int, optional
        Threads.

    Returns
    -------
    float
        Weighted mean of ``1 - exp(-rate weathering)``, with the rates of the present orbits.
    """
    if not radii:
        raise InvalidInput("radii", radii, "at least one planet with its refreshing distance")
    aged = to_si(weathering, u.yr, "weathering", low=0.0, open_low=True)
    rate, weight = np.zeros(()), np.ones(())
    for name, factor in radii.items():
        limit = to_si(factor, u.dimensionless_unscaled, f"radii[{name!r}]", low=1.0)
        found = encounter_rates(population, name, workers=workers)
        found = found.within(limit * found.planet.radius * u.m)
        rate, weight = rate + found.rate.to_value(1 / u.yr), found.weight
    if not np.sum(weight) > 0.0:
        raise InvalidInput("population", population, "a population with orbits")
    return float(np.average(-np.expm1(-rate * aged), weights=weight))
