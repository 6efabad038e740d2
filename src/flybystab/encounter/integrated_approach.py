"""Closest approach of an integrated orbit to a planet, with the path around it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from flybystab.constants import HOUR
from flybystab.errors import NoEncounter
from flybystab.orbit.closest_approach import (
    STATE,
    TIME,
    between,
    crossings,
    nearest_minimum,
    periapsis_time,
    relative,
)
from flybystab.orbit.ephemeris import BODIES, Window
from flybystab.orbit.epochs import later, seconds
from flybystab.orbit.forces import model
from flybystab.orbit.ias15 import Flight
from flybystab.orbit.kepler import time_at_distance
from flybystab.orbit.orbit import Orbit
from flybystab.orbit.planets import Planet
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


def approach_near(
    orbit: Orbit, window: Window, index: int, forces: tuple[str, ...], reach: float, epsilon: float
) -> Approach | None:
    """The minimum of distance within ``reach`` s of the epoch of the window and nearest to it, or None."""
    start = seconds(orbit.epoch, window.epoch)
    # Both directions start at the epoch of the orbit, which avoids the error of integrating back and forth.
    parts: list[Array] = []
    for direction in (-1.0, 1.0):
        if (direction * reach - start) * direction <= 0.0:
            continue
        flight = orbit.flight(window, forces, epsilon)
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
    again = Flight(model(window, forces, orbit.nongrav), log[step, TIME], log[step, STATE], epsilon)
    t, state = periapsis_time(relative_to(again, window, index), t)
    return Approach(t, state, log, forces)


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


def relative_to(flight: Flight, window: Window, index: int, zero: float = 0.0) -> Callable[[float], Array]:
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
    found, _ = crossings(approach.log, window.head, window.data, window.gm, index, body.impact_distance, 8)
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
    inside, _ = crossings(log, *tables, level, 8)
    turning, _ = crossings(log, *tables, -1.0, 8)
    before = [log[0, TIME]] + [f[0] for f in (*inside, *turning) if f[0] < t and f[2] < 0.0]
    after = [log[-1, TIME]] + [f[0] for f in inside if f[0] > t and f[2] > 0.0]
    after += [f[0] for f in turning if f[0] > t and f[2] < 0.0]
    return float(max(before)), float(min(after))
