"""Predictability of an encounter: the errors of an orbit and of the force model, propagated to the encounter.

A close encounter amplifies deviations by orders of magnitude (a metre before the 2029 encounter of Apophis becomes 5 km
a year later). The errors of the orbit are those of its covariance: deviations of plus and minus one sigma along its
principal axes are integrated to the encounter with all forces (:mod:`flybystab.orbit.search.neighbours`). The error of
the force model (ephemeris, masses, tolerance, neglected forces) is that of orbits without close encounters, amplified
by the encounters before the one in question.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from astropy.time import Time

from flybystab.constants import YEAR
from flybystab.orbit.covariance import NONGRAV_PARAMETERS, Covariance
from flybystab.orbit.deviations import deviated
from flybystab.orbit.ephemeris import Ephemeris
from flybystab.orbit.orbit import Orbit
from flybystab.typing import Array

#: Error of the model before any encounter, m: the median against JPL's approaches of 2020 (``flybystab bench sky``),
#: and the time, s, after which it grows linearly: encounters with DE421 and DE440 are 0.2 km apart after 0 to 5 yr,
#: 0.5 km after 5 to 10, 0.8 km after 10 to 20, 1.4 km after 20 to 40 and 3.2 km after 40 to 80 yr (medians;
#: ``python benchmarks/orbit_errors.py model``).
MODEL_ERROR, _MODEL_TIME = 100.0, 2.0 * YEAR
#: Shift of an orbit without a covariance, m; the result is scaled to one metre. Rounding is far smaller.
_SHIFT = 1e3


class Predictability(StrEnum):
    """Class of an encounter by the ratio of the displacement of the asteroid to the closest distance ``d``.

    ``determined``: displacement below ``d/10``. ``uncertain``: below ``d``; there is an encounter, but its distance is
    not accurate. ``one of many``: ``d`` or larger, or there is no such encounter on the displaced orbit; it is one of
    many possible encounters. ``unknown``: the error of the orbit is not known, and the displacements by the error of
    the model and by an initial shift of a metre (or the rounding of the printed elements) are below ``d/10``.
    """

    DETERMINED = "determined"
    UNCERTAIN = "uncertain"
    ONE_OF_MANY = "one of many"
    UNKNOWN = "unknown"


def predictability(distance: float, *displacements: float, known: bool = True) -> Predictability:
    """Class of the largest of the displacements at closest approach (m; inf: no such encounter).

    `known` is False if the error of the orbit is not known: the best class is then ``unknown``.
    """
    worst = max(displacements)
    if worst < 0.1 * distance:
        return Predictability.DETERMINED if known else Predictability.UNKNOWN
    return Predictability.UNCERTAIN if worst < distance else Predictability.ONE_OF_MANY


def undisturbed_error(t: Array) -> Array:
    """Error of the force model, m, `t` s from the epoch of an orbit without close encounters in between."""
    return MODEL_ERROR * np.maximum(1.0, np.abs(t) / _MODEL_TIME)


@dataclass(frozen=True, eq=False)
class Deviations:
    """Sigma points of an orbit: plus and minus one sigma along each principal axis of its correlations.

    Attributes
    ----------
    orbit : Orbit
        The orbit at the epoch of its covariance.
    states, parameters : ndarray, shapes (2, n, 6) and (2, n, 5)
        Differences from the orbit: state (m, m/s, ICRF axes), and A1, A2, A3 (m/s2), DT (s), AMRAT (m2/kg); first
        plus, then minus.
    label : str
        Description.
    known : bool
        False where the orbit has no covariance, so that a shift of one metre away from the Sun takes the place of
        sigma, or one that is not reliable (:attr:`Covariance.reliable`).
    scale : float
        Factor from the points to one sigma or one metre.
    """

    orbit: Orbit
    states: Array
    parameters: Array
    label: str
    known: bool = True
    scale: float = 1.0


def deviation_epoch(orbit: Orbit) -> Time:
    """Epoch of the deviations of an orbit: that of its covariance, if it has one."""
    return orbit.covariance.epoch if isinstance(orbit.covariance, Covariance) else orbit.epoch


def deviations_of(orbit: Orbit, ephemeris: str | Ephemeris | None = None) -> Deviations:
    """The sigma points of an orbit by its covariance, or a shift away from the Sun without one."""
    covariance = orbit.covariance
    if not isinstance(covariance, Covariance):
        r = orbit.position.to_value("m")
        out = np.concatenate([_SHIFT * r / np.linalg.norm(r), np.zeros(3)])
        points = np.array([out, -out])[:, None]
        return Deviations(
            orbit,
            points,
            np.zeros((2, 1, len(NONGRAV_PARAMETERS))),
            "1 m away from the Sun",
            False,
            1.0 / _SHIFT,
        )
    there = deviated(
        orbit, covariance.epoch, np.zeros((1, 6)), np.zeros((1, len(NONGRAV_PARAMETERS))), "there", ephemeris
    )[0]
    found = [covariance.deviations(covariance.values + sign * covariance.factor.T) for sign in (1.0, -1.0)]
    states, parameters = (np.array(x) for x in zip(*found, strict=True))
    label = "one sigma in the direction least known" + (f", {covariance.caveat}" if covariance.caveat else "")
    return Deviations(there, states, parameters, label, covariance.reliable)
