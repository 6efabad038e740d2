"""Orbital uncertainty in the samples of an encounter: each sample moves on its own clone of the orbit.

Where the full covariance is known and the uncertainty of the distance is significant, sample k uses clone k of the
orbit, integrated with all forces and without linearisation. Otherwise all samples share the nominal encounter, and the
row gives the reason. The choice between the two is made with a few clones; the others are drawn and integrated
together with their samples.
"""

from __future__ import annotations

from typing import NamedTuple

import astropy.units as u
import numpy as np
from astropy.time import Time

from flybystab.catalogues.asteroid import identity
from flybystab.encounter.distribution import clone_encounters, encounter_distribution
from flybystab.encounter.reach import far_enough
from flybystab.errors import FlybystabError
from flybystab.orbit.epochs import later
from flybystab.orbit.planets import planet
from flybystab.screening.draws import stream
from flybystab.screening.encounters import CloseApproach
from flybystab.typing import Array

#: Clones are used if five sigma of the distance exceed this fraction of it; the relative change of the tide is three
#: times as large.
MATTERS = 1e-3
#: Largest nonlinearity at which sigma is taken from the linear map of the covariance.
LINEAR = 0.1
#: Number of clones from which sigma is estimated where the linear map is not accurate.
_PROBES = 16
#: Largest difference in time between the encounter of a clone and the nominal one.
_SEARCH = 30.0 * u.d


class Clones(NamedTuple):
    """The clones of an asteroid in one encounter, drawn and integrated on demand.

    Attributes
    ----------
    approach : CloseApproach
        Of the nominal orbit.
    time : Time
        Its closest approach.
    within : float
        Largest distance of an encounter, m. A clone that stays farther away is evaluated at this distance.
    samples, key : int
        Number of clones, and seed: clone k depends on `key` and k only.
    """

    approach: CloseApproach
    time: Time
    within: float
    samples: int
    key: int

    def close_approaches(self, first: int, last: int) -> list[CloseApproach]:
        """Encounters of clones `first` to ``last - 1``; that of one clone does not depend on the others."""
        p = self.approach
        clones = p.asteroid.orbit.clones(self.samples, self.key, first=first, last=last)
        offset, distance, v_inf = clone_encounters(
            clones, p.planet, self.time, search=_SEARCH, within=self.within * u.m, workers=1
        )
        out = []
        for k, orbit in enumerate(clones):
            if np.isfinite(distance[k]):
                time = later(self.time, float(offset[k]))
                out.append(
                    CloseApproach(
                        p.asteroid, p.planet, time, float(distance[k]), float(v_inf[k]), orbit=orbit
                    )
                )
            else:
                far = self.within, p.v_inf
                out.append(CloseApproach(p.asteroid, p.planet, self.time, *far, orbit=orbit, missed=True))
        return out

    def sigma(self, distance: Array) -> float:
        """Standard deviation of the distances of the samples, m, without clones that stay beyond `within`."""
        near = distance[distance < self.within]
        return float(near.std(ddof=1)) if len(near) > 1 else np.nan


class OrbitSampling(NamedTuple):
    """Contribution of the orbital uncertainty to the samples of an encounter.

    Attributes
    ----------
    clones : Clones or None
        One per sample; None where all samples share the nominal encounter.
    sigma : float
        1-sigma of the distance, m; nan if unknown, or if only the full set of clones gives it.
    note : str
        Reason why the orbit is not sampled; empty where it is, or where its error is insignificant.
    """

    clones: Clones | None
    sigma: float
    note: str


def orbit_sampling(approach: CloseApproach, samples: int, seed: int) -> OrbitSampling:
    """Decide whether each sample of an encounter has its own orbit, and prepare the clones.

    Parameters
    ----------
    approach : CloseApproach
        Of the nominal orbit.
    samples, seed : int
        Clone k depends on the seed, the asteroid and k only: it is the same in every encounter.
    """
    asteroid = approach.asteroid
    if approach.encounter is not None and approach.encounter.time is None:
        return OrbitSampling(None, np.nan, "scripted encounter")
    covariance = asteroid.orbit.covariance
    if covariance is None:
        return OrbitSampling(None, np.nan, "orbit without errors (no covariance)")
    if not covariance.correlated:
        known = "1-sigmas" if covariance.caveat == "without correlations" else "known only"
        return OrbitSampling(None, np.nan, f"orbit without errors ({known} {covariance.caveat})")
    body = planet(approach.planet)
    key = int(stream(seed, "orbit", identity(asteroid)).integers(2**62))
    within = max(1.5 * approach.distance, far_enough(body))
    try:
        few = encounter_distribution(
            asteroid.orbit,
            body.name,
            approach.time,
            n=min(samples, _PROBES),
            seed=key,
            search=_SEARCH,
            within=within * u.m,
            workers=1,
        )
    except FlybystabError as error:
        return OrbitSampling(None, np.nan, f"orbit without errors ({type(error).__name__}: {error})")
    linear = few.linear
    if linear is not None and linear.nonlinearity < LINEAR:
        sigma = float(linear.distance_sigma.to_value(u.m))
    elif few.found.sum() > 1:
        sigma = float(few.distance_sigma.to_value(u.m))
    else:
        sigma = np.nan
    if 5.0 * sigma < MATTERS * approach.distance:
        return OrbitSampling(None, sigma, "")
    return OrbitSampling(Clones(approach, few.time, within, samples, key), sigma, "")
