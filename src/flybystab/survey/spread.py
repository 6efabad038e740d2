"""How the uncertainty of an orbit enters the samples of a passage: each sample on a clone of its own.

Where the covariance with its correlations is known and the distance is uncertain enough to matter, sample k
meets the planet on clone k, followed with all forces: no linearisation. Elsewhere all samples share the
nominal passage, and the row says why.
"""

from __future__ import annotations

from typing import NamedTuple

import astropy.units as u
import numpy as np
from numpy.typing import NDArray

from flybystab.errors import FlybystabError
from flybystab.sky.distribution import EncounterDistribution, encounter_distribution
from flybystab.sky.encounter import far_enough
from flybystab.sky.orbit import later
from flybystab.sky.planets import planet
from flybystab.survey.draws import identity, stream
from flybystab.survey.passages import Passage

#: Five sigma of the distance matter beyond this share of it: the tide then changes by three times as much.
MATTERS = 1e-3
#: The linear map of the covariance gives the sigma while its nonlinearity is below this.
LINEAR = 0.1
#: Clones that tell the sigma where the map is not linear.
_PROBES = 16
#: How far from the nominal passage those of the clones are looked for.
_SEARCH = 30.0 * u.d


class Spread(NamedTuple):
    """The orbit's part in the samples of a passage.

    Attributes
    ----------
    passages : list of Passage or None
        One a sample; None where all samples share the nominal one.
    sigma : float
        1-sigma of the distance, m; nan where nothing is known.
    note : str
        Why the orbit is not drawn, for a reader; empty where it is, or where its error is too small to matter.
    """

    passages: list[Passage] | None
    sigma: float
    note: str

    def distances(self, passage: Passage, samples: int) -> NDArray[np.float64]:
        """Distance of each sample's passage, m."""
        if self.passages is None:
            return np.full(samples, passage.distance)
        return np.array([p.distance for p in self.passages])


def spread(passage: Passage, samples: int, seed: int) -> Spread:
    """The passages of the samples of one passage.

    Parameters
    ----------
    passage : Passage
        Of the nominal orbit.
    samples, seed : int
        Clone k depends on the seed, the asteroid and k alone: it is the same in every passage.
    """
    asteroid = passage.asteroid
    if passage.encounter is not None and passage.encounter.time is None:
        return Spread(None, np.nan, "scripted passage")
    covariance = asteroid.orbit.covariance
    if covariance is None:
        return Spread(None, np.nan, "orbit without errors (no covariance)")
    if not covariance.correlated:
        return Spread(None, np.nan, "orbit without errors (1-sigmas without correlations)")
    body = planet(passage.planet)
    key = int(stream(seed, "orbit", identity(asteroid)).integers(2**62))
    within = max(1.5 * passage.distance, far_enough(body))

    def found(n: int) -> EncounterDistribution:
        return encounter_distribution(
            asteroid.orbit,
            body.name,
            passage.time,
            n=n,
            seed=key,
            search=_SEARCH,
            within=within * u.m,
            threads=1,
        )

    try:
        few = found(min(samples, _PROBES))
        linear = few.linear
        if linear is not None and linear.nonlinearity < LINEAR:
            sigma = linear.distance_sigma
        elif few.found.sum() > 1:
            sigma = few.distance_sigma
        else:
            sigma = np.inf * u.km
        if 5.0 * sigma.to_value(u.m) < MATTERS * passage.distance:
            return Spread(None, float(sigma.to_value(u.m)), "")
        all_ = few if samples <= _PROBES else found(samples)
    except FlybystabError as error:
        return Spread(None, np.nan, f"orbit without errors ({type(error).__name__}: {error})")
    out = []
    for k in range(samples):
        here = bool(all_.found[k])
        # A clone that does not come near is judged at the edge of the search.
        distance = float(all_.distance[k].to_value(u.m)) if here else within
        v_inf = float(all_.v_inf[k].to_value(u.m / u.s)) if here else passage.v_inf
        time = later(all_.time, float(all_.time_offset[k].to_value(u.s))) if here else all_.time
        out.append(
            Passage(asteroid, passage.planet, time, distance, v_inf, orbit=all_.clones[k], missed=not here)
        )
    if not np.isfinite(sigma.to_value(u.m)):
        sigma = all_.distance_sigma if all_.found.sum() > 1 else np.nan * u.m
    return Spread(out, float(sigma.to_value(u.m)), "")
