"""How well an encounter is known: what the errors of an orbit and of the force model become until then.

After a close passage two tracks part by orders of magnitude (a metre before the 2029 passage of Apophis is 5 km a
year later). The errors of the orbit are those of its covariance: plus and minus one sigma along its principal axes
are followed to the encounter with all forces (:mod:`flybystab.orbit.search.neighbours`). The error of the force model
(ephemeris, masses, tolerance, forces left out) is that of undisturbed orbits, grown past the passages on the way.
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
#: and the time, s, after which it grows in proportion: passages with DE421 and DE440 are 0.2 km apart after 0 to 5 yr,
#: 0.5 km after 5 to 10, 0.8 km after 10 to 20, 1.4 km after 20 to 40 and 3.2 km after 40 to 80 yr (medians;
#: ``python benchmarks/orbit_errors.py model``).
MODEL_ERROR, _MODEL_TIME = 100.0, 2.0 * YEAR
#: Shift of an orbit without a covariance, m; the result is scaled to one metre. Rounding is far smaller.
_SHIFT = 1e3


class Predictability(StrEnum):
    """What the possible displacement of the asteroid says of an encounter.

    ``determined``: below a tenth of the closest distance. ``uncertain``: below the distance itself: there is such an
    encounter, but its digits are not reliable. ``one of many``: as large as the distance or larger, or the encounter
    does not happen on the displaced orbit: it is one of many possible. ``unknown``: no error of the orbit is known,
    and a shift of a metre (or that of its printed digits) and the error of the model are below a tenth of the distance.
    """

    DETERMINED = "determined"
    UNCERTAIN = "uncertain"
    ONE_OF_MANY = "one of many"
    UNKNOWN = "unknown"


def predictability(distance: float, *displacements: float, known: bool = True) -> Predictability:
    """Class of the largest of the displacements at closest approach (m; inf: no such encounter).

    `known` is False for an orbit without errors: the best class is then ``unknown``.
    """
    worst = max(displacements)
    if worst < 0.1 * distance:
        return Predictability.DETERMINED if known else Predictability.UNKNOWN
    return Predictability.UNCERTAIN if worst < distance else Predictability.ONE_OF_MANY


def undisturbed_error(t: Array) -> Array:
    """Error of the force model, m, `t` s from the epoch of an orbit without close passages on the way."""
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
