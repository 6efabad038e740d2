"""Errors of a closest approach: of the integration, of the force model and of the orbit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flybystab.constants import AU
from flybystab.encounter.integrated_approach import Approach
from flybystab.orbit.ephemeris import Window
from flybystab.orbit.orbit import Orbit
from flybystab.orbit.predictability import Deviations, Predictability, predictability
from flybystab.orbit.search.acceleration import field
from flybystab.orbit.search.neighbours import Spread, spread

#: Tolerance of the displaced orbits.
_TOLERANCE = 1e-14


@dataclass(frozen=True)
class ApproachErrors:
    """Errors of a closest approach.

    Attributes
    ----------
    distance, time : float
        Numerical errors of distance (m) and time (s).
    model : float
        Displacement by the error of the force model, m.
    displacement, growth : float
        Displacement by the error of the orbit, m, and its ratio to that at the epoch.
    beside : Deviations
        The displaced orbits.
    """

    distance: float
    time: float
    model: float
    displacement: float
    growth: float
    beside: Deviations


def horizon(orbit: Orbit, beside: Deviations, window: Window, forces: tuple[str, ...], largest: float) -> str:
    """Addition to a message of no encounter if the orbit cannot be predicted to that time; empty otherwise."""
    found = errors_at(orbit, beside, window, forces, 0.0)
    gap = max(float(found.displacement[0]), float(found.model_error[0]))
    if predictability(largest, gap) is Predictability.DETERMINED:
        return ""
    what = beside.label if found.displacement[0] == gap else "the error of the force model"
    return (
        f"; the orbit cannot be predicted that far: {what} at {beside.orbit.epoch.iso[:10]} is "
        f"{gap / AU:.2g} au at this time"
    )


def approach_errors(
    orbit: Orbit,
    beside: Deviations,
    window: Window,
    chosen: Approach,
    second: Approach | None,
    full: Approach,
    t: float,
) -> ApproachErrors:
    """Errors of an approach.

    Parameters
    ----------
    chosen : Approach
        By rebound.
    second, full : Approach
        By the integrator of the search: with the same forces, and with all. The numerical error is the difference of
        the two integrators plus that by the forces left out; infinite if there is no `second`. The first is the
        distance of the two positions at closest approach, since the difference of two distances can vanish by chance;
        it counts twice where forces are left out, since it is also the error of the second.
    t : float
        Closest approach, or first contact on an impact, s from the epoch of the window.
    """
    gap, lag = np.inf, np.inf
    if second is not None:
        times = 1.0 if second is full else 2.0
        apart = float(np.linalg.norm(chosen.state[:3] - second.state[:3]))
        gap = times * apart + abs(second.distance - full.distance)
        lag = times * abs(chosen.t - second.t) + abs(second.t - full.t)
    found = errors_at(orbit, beside, window, chosen.forces, t)
    model_error = float(found.model_error[0])
    # After an earlier encounter, which amplifies it, the error of the force model is included.
    common = model_error if found.passed[0] else 0.0
    return ApproachErrors(
        distance=gap + common,
        time=lag + common / float(np.linalg.norm(chosen.state[3:])),
        model=model_error,
        displacement=float(found.displacement[0]),
        growth=float(found.growth[0]),
        beside=beside,
    )


def errors_at(orbit: Orbit, beside: Deviations, window: Window, forces: tuple[str, ...], t: float) -> Spread:
    """Errors of the orbit at `t` s from the epoch of the window."""
    law = orbit.nongrav.parameters
    if "non-gravitational" not in forces:
        law = law._replace(a1=0.0, a2=0.0, a3=0.0, pressure=0.0)
    acting = field(window, [name for name in forces if name != "non-gravitational"])
    return spread(beside, acting, law, window, np.array([t]), _TOLERANCE)
