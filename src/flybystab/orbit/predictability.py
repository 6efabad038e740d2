"""How well an encounter is known: what becomes of a neighbouring track.

After a close passage two tracks part by orders of magnitude (a metre before the 2029 passage of Apophis is
5 km a year later). Whether a later encounter is still the encounter of this asteroid, or one of many that it
may have, is decided by following a neighbour of the orbit to it: one sigma of the covariance along the
direction that moves the asteroid most by then, or, for an orbit of which no error is known, one metre away from the
Sun.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import astropy.units as u
import numpy as np
from astropy.time import Time

from flybystab.constants import AU
from flybystab.orbit.covariance import Covariance
from flybystab.orbit.elements import GM_SUN
from flybystab.orbit.ephemeris import Ephemeris, Window
from flybystab.orbit.kepler import two_body
from flybystab.orbit.orbit import Orbit, deviated, heliocentric, seconds
from flybystab.typing import Array

#: Error of the model before any encounter, m: the median against JPL's approaches of 2020 (``flybystab bench sky``).
MODEL_ERROR = 100.0


class Predictability(StrEnum):
    """What a displacement of the asteroid says of an encounter.

    ``determined``: below a tenth of the closest distance. ``uncertain``: below the distance itself: there is
    such an encounter, its digits do not hold. ``one of many``: as large as the distance or larger, or the
    encounter does not happen on the other track: this encounter is one of many possible.
    """

    DETERMINED = "determined"
    UNCERTAIN = "uncertain"
    ONE_OF_MANY = "one of many"


def predictability(distance: float, *displacements: float) -> Predictability:
    """Judgement of displacements of the asteroid at closest approach (m; inf: the passage is gone)."""
    worst = max(displacements)
    if worst < 0.1 * distance:
        return Predictability.DETERMINED
    return Predictability.UNCERTAIN if worst < distance else Predictability.ONE_OF_MANY


@dataclass(frozen=True, eq=False)
class Neighbour:
    """An orbit beside another.

    Attributes
    ----------
    orbit : Orbit
    shift : float
        How far it is away at its epoch, m: a metre at least, where it only moves otherwise.
    label : str
        What the shift is, in words.
    """

    orbit: Orbit
    shift: float
    label: str


def neighbour_epoch(orbit: Orbit) -> Time:
    """The epoch of the neighbours of an orbit: that of its covariance, if it has one."""
    return orbit.covariance.epoch if isinstance(orbit.covariance, Covariance) else orbit.epoch


def neighbour(orbit: Orbit, time: Time, ephemeris: str | Ephemeris | None = None) -> Neighbour:
    """The neighbour by which an encounter at `time` is judged.

    With a covariance: one sigma along the direction in which two-body motion with A1 and the drift that A2 makes
    leave the asteroid most uncertain at `time`. Planets are left out of this choice of a direction alone.
    """
    covariance = orbit.covariance
    if not isinstance(covariance, Covariance):
        r = orbit.position.to_value(u.m)
        out = np.concatenate([r / np.linalg.norm(r), np.zeros(3)])
        beside = deviated(orbit, orbit.epoch, out[None], np.zeros((1, 3)), "neighbour", ephemeris)[0]
        return Neighbour(beside, 1.0, "1 m away from the Sun")
    t = seconds(time, covariance.epoch)
    there = deviated(orbit, covariance.epoch, np.zeros((1, 6)), np.zeros((1, 3)), "there", ephemeris)[0]
    middle = heliocentric(there, ephemeris)
    ends = []
    for sign in (1.0, -1.0):
        states, pushes = covariance.deviations(covariance.values + sign * covariance.factor.T)
        ends.append(_later(middle + states, pushes, t))
    # rows: displacement by each principal way; the first left singular vector mixes the ways to the largest
    weight = np.linalg.svd(ends[0] - ends[1])[0][:, 0]
    states, pushes = covariance.deviations((covariance.values + covariance.factor @ weight)[None])
    beside = deviated(there, covariance.epoch, states, pushes, "neighbour", ephemeris)[0]
    label = "one sigma in the direction least known" + (f", {covariance.caveat}" if covariance.caveat else "")
    return Neighbour(beside, max(float(np.linalg.norm(states[0, :3])), 1.0), label)


def quiet_growth(orbit: Orbit, beside: Neighbour, times: Array, ephemeris: str | Ephemeris | None) -> Array:
    """Growth of the displacement of a neighbour if no planet pulled, at least 1; `times` are s from its epoch."""
    epoch = beside.orbit.epoch
    if orbit.epoch != epoch:
        orbit = deviated(orbit, epoch, np.zeros((1, 6)), np.zeros((1, 3)), "there", ephemeris)[0]
    pair = (orbit, beside.orbit)
    states, pushes = (
        np.array([heliocentric(o, ephemeris) for o in pair]),
        np.array([o.nongrav.a for o in pair]),
    )
    gaps = [np.linalg.norm(np.subtract(*_later(states, pushes, float(t)))) for t in times]
    return np.maximum(np.array(gaps) / beside.shift, 1.0)


def common_error(
    orbit: Orbit,
    beside: Neighbour,
    window: Window,
    forces: tuple[str, ...],
    t: float,
    displacement: float,
    ephemeris: str | Ephemeris | None,
) -> float:
    """What all runs have in common (ephemeris, masses) at `t` (s), grown past earlier encounters, m.

    The growth is that of the neighbour from where planets begin to part it from the orbit (by more than twice
    what the Sun alone does) to `t`. Zero where they do not.
    """
    start = seconds(beside.orbit.epoch, window.epoch)
    times = np.linspace(start, t, 65)[1:]
    quiet = quiet_growth(orbit, beside, times - start, ephemeris)
    if displacement < 2.0 * beside.shift * quiet[-1]:
        return 0.0
    flights = [o.flight(window, forces) for o in (orbit, beside.orbit)]
    gaps = np.array(
        [np.linalg.norm(np.subtract(*(f.to(float(time))[:3] for f in flights))) for time in times]
    )
    parted = int(np.argmax(gaps > 2.0 * beside.shift * quiet))
    return MODEL_ERROR * displacement / beside.shift / float(quiet[parted])


def _later(states: Array, pushes: Array, t: float) -> Array:
    """Two-body positions (m), shape (m, 3), `t` s after heliocentric states (m, 6), with changes of A1, A2, A3.

    A1 weakens the Sun's pull by ``A1 (1 au)^2``. A2 drifts the semi-major axis by
    ``2 A2 (1 - e^2)/n (1 au/p)^2`` (Farnocchia et al. 2013, inverse square), hence the place along the orbit by
    ``-3/2 A2 p alpha^2 (1 au/p)^2 t^2 / n`` in time, alpha = 1/a. A3 has no secular part along the orbit.
    """
    out = np.empty((len(states), 3))
    for k, (state, push) in enumerate(zip(states, pushes, strict=True)):
        gm = GM_SUN - push[0] * AU**2
        there = two_body(gm, state, t)
        alpha = 2.0 / np.linalg.norm(state[:3]) - state[3:] @ state[3:] / gm
        p = np.sum(np.cross(state[:3], state[3:]) ** 2) / gm
        late = 0.0
        if alpha > 0.0:
            late = -1.5 * push[1] * p * alpha**2 * (AU / p) ** 2 * t * t / np.sqrt(gm * alpha**3)
        out[k] = there[:3] + late * there[3:]
    return out
