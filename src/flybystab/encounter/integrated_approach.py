"""Closest approach of an integrated orbit to a planet, with the path around it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from flybystab.constants import HOUR
from flybystab.errors import NoEncounter, NotConverged
from flybystab.orbit.closest_approach import (
    STATE,
    TIME,
    between,
    crossings,
    nearest_minimum,
    periapsis_time,
    relative,
    steps_into,
)
from flybystab.orbit.ephemeris import BODIES, Window
from flybystab.orbit.epochs import later, seconds
from flybystab.orbit.forces import model
from flybystab.orbit.ias15 import EPSILON, TIGHT, Flight
from flybystab.orbit.kepler import time_at_distance
from flybystab.orbit.nongravitational import NONE
from flybystab.orbit.orbit import Orbit
from flybystab.orbit.planets import Planet
from flybystab.orbit.search.acceleration import field
from flybystab.orbit.search.flight import SearchFlight
from flybystab.orbit.search.search_setup import LEAST_TOLERANCE
from flybystab.typing import Array

#: Crossings of the surface within this time of a closest approach belong to it, s.
_OWN = 2.0 * HOUR


@dataclass(frozen=True)
class Approach:
    """Closest approach in one integration.

    Attributes
    ----------
    t : float
        Time, s from the epoch of the window of the ephemeris.
    state : ndarray, shape (6,)
        Relative to the planet, m and m/s, ICRF.
    log : ndarray, shape (n, 10)
        Steps of the integration in the order of time, from the epoch of the orbit to the end of the search.
    forces : tuple of str
    """

    t: float
    state: Array
    log: Array
    forces: tuple[str, ...]

    @property
    def distance(self) -> float:
        """Distance between the centres, m."""
        return float(np.linalg.norm(self.state[:3]))


class Motion(Protocol):
    """An integration in progress: :class:`Flight` or :class:`SearchFlight`."""

    def to(self, t: float) -> Array:
        """State (m, m/s) at `t` s."""

    def log_to(self, t: float) -> Array:
        """All steps to `t` s."""


#: Starts an integration at a time (s) with a barycentric state (m, m/s).
Integrator = Callable[[float, Array], Motion]


def by_rebound(orbit: Orbit, window: Window, forces: tuple[str, ...], epsilon: float = EPSILON) -> Integrator:
    """Integration by rebound with the ephemeris itself."""
    flat = model(window, forces, orbit.nongrav)
    return lambda t, state: Flight(flat, t, state, epsilon)


def by_search(orbit: Orbit, window: Window, forces: tuple[str, ...], reach: float) -> Integrator:
    """Integration as in the search for encounters; for minima of distance within `reach` s of the window's epoch."""
    acting = field(window, [name for name in forces if name != "non-gravitational"])
    pushed = "non-gravitational" in forces and orbit.nongrav.active
    law = orbit.nongrav.parameters if pushed else NONE
    return lambda t, state: SearchFlight(acting, law, t, state, LEAST_TOLERANCE, (-reach, reach))


def approach_near(
    orbit: Orbit, window: Window, index: int, forces: tuple[str, ...], reach: float, fly: Integrator
) -> Approach | None:
    """The minimum of distance within ``reach`` s of the epoch of the window and nearest to it, or None."""
    start, state = seconds(orbit.epoch, window.epoch), orbit.barycentric(window)
    # Both directions start at the epoch of the orbit, which avoids the error of integrating back and forth.
    parts: list[Array] = []
    for direction in (-1.0, 1.0):
        if (direction * reach - start) * direction <= 0.0:
            continue
        flight = fly(start, state)
        # If the epoch is outside of the interval, the log has a row at the edge of the interval.
        stops = [s for s in (-direction * reach, direction * reach) if (s - start) * direction > 0.0]
        part = np.concatenate([flight.log_to(s)[(i > 0) :] for i, s in enumerate(stops)])
        parts.append(part[::-1] if direction < 0.0 else part[len(parts) :])
    log = np.concatenate(parts)
    low = int(np.searchsorted(log[:, TIME], -reach))
    hit = nearest_minimum(log[low : int(np.searchsorted(log[:, TIME], reach)) + 1], window, index, 0.0)
    if hit is None:
        return None
    t, _, step = hit
    step += low
    again = fly(log[step, TIME], log[step, STATE])
    t, state = periapsis_time(relative_to(again, window, index), t)
    return Approach(t, state, log, forces)


def independent_approach(
    orbit: Orbit, window: Window, index: int, forces: tuple[str, ...], reach: float
) -> Approach | None:
    """:func:`approach_near` by the integrator of the search.

    Where its step size collapses, as on a path through the centre of the Sun, by rebound with a smaller tolerance.
    """
    try:
        return approach_near(orbit, window, index, forces, reach, by_search(orbit, window, forces, reach))
    except NotConverged:
        return approach_near(orbit, window, index, forces, reach, by_rebound(orbit, window, forces, TIGHT))


def path_between(log: Array, start: float, stop: float) -> tuple[Array, Array]:
    """Times from `start` to `stop` (s, either order) and barycentric states along a log, dense enough for sums."""
    low, high = min(start, stop), max(start, stop)
    inside = log[(log[:, TIME] > low) & (log[:, TIME] < high), TIME]
    t = np.unique(np.concatenate([np.linspace(low, high, 129), inside]))
    t = t[(t >= log[0, TIME]) & (t <= log[-1, TIME])]
    states = np.empty((t.size, 6))
    for n, time in enumerate(t):
        k = min(max(int(np.searchsorted(log[:, TIME], time, side="right")) - 1, 0), len(log) - 2)
        between(log, k, float(time), states[n])
    return (t, states) if start <= stop else (t[::-1], states[::-1])


def relative_to(flight: Motion, window: Window, index: int, zero: float = 0.0) -> Callable[[float], Array]:
    """State of a flight relative to a body as a function of the time, s from `zero`."""

    def state_at(t: float) -> Array:
        return flight.to(t + zero) - window.states(index, np.array([t + zero]))[0]

    return state_at


def first_contact_of(
    approach: Approach, window: Window, index: int, body: Planet
) -> tuple[float, Array] | None:
    """Time (s) and relative state of the first contact with atmosphere or surface; None for an approach above them."""
    if body.impact_level(approach.distance) is None:
        return None
    tables = (window.head, window.data, window.gm, index)
    found, steps = crossings(approach.log, *tables, body.impact_distance, 8)
    row = np.flatnonzero((found[:, 0] < approach.t) & (found[:, 2] < 0.0))[-1]
    state = np.empty(6)
    relative(approach.log, int(steps[row]), *tables, float(found[row, 0]), state)
    return float(found[row, 0]), state


def check_no_impact_before(
    orbit: Orbit, body: Planet, window: Window, approach: Approach, epoch: float
) -> None:
    """Raise NoEncounter if the asteroid hits the planet between its epoch and a closest approach."""
    index = BODIES.index(body.name)
    tables, log = (window.head, window.data, window.gm, index), approach.log
    near = [log[k : k + 2] for k in steps_into(log, *tables, body.impact_distance)]
    found = np.concatenate(
        [np.empty((0, 3)), *(crossings(pair, *tables, body.impact_distance, 8)[0] for pair in near)]
    )
    low, high = sorted((epoch, approach.t))
    hits = found[(found[:, 0] > low) & (found[:, 0] < high) & (np.abs(found[:, 0] - approach.t) > _OWN), 0]
    if hits.size:
        first = hits[np.argmin(np.abs(hits - epoch))]
        raise NoEncounter(
            f"{orbit.name or 'the orbit'} hits {body.name} at {later(window.epoch, float(first)).iso} TDB, between "
            f"its epoch {orbit.epoch.tdb.iso[:10]} and the time given"
        )


def two_body_periapsis(gm: float, state: Array) -> tuple[float, float]:
    """Periapsis distance (m) and time to it (s) of the two-body orbit through an inbound state."""
    r = float(np.linalg.norm(state[:3]))
    v2 = float(state[3:] @ state[3:])
    h2 = float(np.sum(np.cross(state[:3], state[3:]) ** 2))
    energy = v2 - 2.0 * gm / r  # v_inf^2
    # q from h^2 = q (2 gm + q v_inf^2), without cancellation
    q = h2 / (gm + np.sqrt(gm * gm + h2 * energy))
    q = max(q, 1.0)
    return float(q), float(time_at_distance(gm, q, q * energy / gm, r))


def state_in_log(log: Array, window: Window, index: int, t: float) -> Array:
    """State relative to a body at `t` within a log, shape (6,)."""
    k = min(max(int(np.searchsorted(log[:, TIME], t, side="right")) - 1, 0), len(log) - 2)
    out = np.empty(6)
    relative(log, k, window.head, window.data, window.gm, index, t, out)
    return out


def ends_of_encounter(log: Array, window: Window, index: int, level: float, t: float) -> tuple[float, float]:
    """Last time before `t` and first after it at distance `level`, or at an apoapsis or an end of the log."""
    tables = (window.head, window.data, window.gm, index)
    middle, size = int(np.searchsorted(log[:, TIME], t)), 32
    while True:
        low, high = max(middle - size, 0), min(middle + size, len(log))
        inside, _ = crossings(log[low:high], *tables, level, 8)
        turning, _ = crossings(log[low:high], *tables, -1.0, 8)
        before = [f[0] for f in (*inside, *turning) if f[0] < t and f[2] < 0.0]
        after = [f[0] for f in inside if f[0] > t and f[2] > 0.0]
        after += [f[0] for f in turning if f[0] > t and f[2] < 0.0]
        if (before or low == 0) and (after or high == len(log)):
            return float(max(before, default=log[0, TIME])), float(min(after, default=log[-1, TIME]))
        size *= 8
