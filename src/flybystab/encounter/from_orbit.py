"""An encounter on a real orbit: closest approach and path by rebound, with their errors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import astropy.units as u
import numpy as np
from astropy.time import Time

from flybystab.constants import AU, DAY, HOUR
from flybystab.core.ellipsoid.tide import tide_panels
from flybystab.encounter.encounter import Encounter
from flybystab.encounter.reach import TAIL, usual_start
from flybystab.encounter.tide_sources import chosen_sources, tide_of
from flybystab.errors import InvalidInput, NoEncounter
from flybystab.orbit.closest_approach import (
    between,
    crossings,
    nearest_minimum,
    panel_track,
    periapsis_time,
    relative,
)
from flybystab.orbit.default_forces import without_itself
from flybystab.orbit.ephemeris import BODIES, Ephemeris, Window
from flybystab.orbit.epochs import later, seconds
from flybystab.orbit.forces import FORCES, model, shares
from flybystab.orbit.ias15 import EPSILON, TIGHT, Flight
from flybystab.orbit.kepler import time_at_distance
from flybystab.orbit.orbit import Orbit
from flybystab.orbit.orbit_arguments import as_ephemeris
from flybystab.orbit.planets import Planet
from flybystab.orbit.predictability import (
    Deviations,
    Predictability,
    deviation_epoch,
    deviations_of,
    predictability,
)
from flybystab.orbit.search.acceleration import field
from flybystab.orbit.search.encounter_finder import starts_inside
from flybystab.orbit.search.neighbours import Spread, spread
from flybystab.typing import Array

#: Crossings of the surface within this time of a closest approach belong to it, s.
_OWN = 2.0 * HOUR
#: Tolerance of the displaced orbits.
_TOLERANCE = 1e-14


@dataclass(frozen=True)
class _Passage:
    """Closest approach on one integration: time (s), relative state, log from the epoch on, and its step there."""

    t: float
    state: Array
    log: Array
    step: int
    forces: tuple[str, ...]

    @property
    def distance(self) -> float:
        return float(np.linalg.norm(self.state[:3]))


def _passage(
    orbit: Orbit, window: Window, index: int, forces: tuple[str, ...], reach: float, epsilon: float
) -> _Passage | None:
    """The minimum of distance within ``reach`` s of the epoch of the window and nearest to it, or None."""
    start = seconds(orbit.epoch, window.epoch)
    # Both directions start at the epoch of the orbit, which avoids the error of an integration forth and back.
    parts: list[Array] = []
    for direction in (-1.0, 1.0):
        if (direction * reach - start) * direction <= 0.0:
            continue
        flight = orbit.flight(window, forces, epsilon)
        # From an epoch outside of the interval: a row of the log at its edge.
        stops = [s for s in (-direction * reach, direction * reach) if (s - start) * direction > 0.0]
        part = np.concatenate([flight.log_to(s)[(i > 0) :] for i, s in enumerate(stops)])
        parts.append(part[::-1] if direction < 0.0 else part[len(parts) :])
    log = np.concatenate(parts)
    low = int(np.searchsorted(log[:, 0], -reach))
    hit = nearest_minimum(log[low : int(np.searchsorted(log[:, 0], reach)) + 1], window, index, 0.0)
    if hit is None:
        return None
    t, _, step = hit
    step += low
    again = Flight(model(window, forces, orbit.nongrav), log[step, 0], log[step, 1:7], epsilon)
    t, state = periapsis_time(_relative_to(again, window, index), t)
    return _Passage(t, state, log, step, forces)


def _path(log: Array, start: float, stop: float) -> tuple[Array, Array]:
    """Times from `start` to `stop` (s, either order) and barycentric states, along a log, dense enough to sum."""
    low, high = min(start, stop), max(start, stop)
    inside = log[(log[:, 0] > low) & (log[:, 0] < high), 0]
    t = np.unique(np.concatenate([np.linspace(low, high, 129), inside]))
    t = t[(t >= log[0, 0]) & (t <= log[-1, 0])]
    states = np.empty((t.size, 6))
    for n, time in enumerate(t):
        k = min(max(int(np.searchsorted(log[:, 0], time, side="right")) - 1, 0), len(log) - 2)
        between(log, k, float(time), states[n])
    return (t, states) if start <= stop else (t[::-1], states[::-1])


def _relative_to(flight: Flight, window: Window, index: int, zero: float = 0.0) -> Callable[[float], Array]:
    def state_at(t: float) -> Array:
        return flight.to(t + zero) - window.states(index, np.array([t + zero]))[0]

    return state_at


def followed(
    cls: type[Encounter],
    orbit: Orbit,
    body: Planet,
    near: Time,
    accuracy: float,
    start: float | None,
    wait: float,
    reach: float,
    largest: float,
    ephemeris: str | Ephemeris | None,
    forces: tuple[str, ...] | None,
) -> Encounter:
    """The encounter nearest to a time; arguments as checked by :meth:`Encounter.from_orbit`, in SI."""
    index = BODIES.index(body.name)
    epoch = seconds(orbit.epoch, near)
    epochs = (epoch, seconds(deviation_epoch(orbit), near))
    window = as_ephemeris(ephemeris).window(
        near, min(*epochs, -reach), max(*epochs, reach + wait + TAIL + 10.0 * DAY)
    )
    away = orbit.barycentric(window) - window.states(index, np.array([epoch]))[0]
    if np.linalg.norm(away[:3]) < body.impact_distance:
        raise starts_inside(orbit.name, orbit.epoch, body)
    acting = (n for n in FORCES if n != "non-gravitational" or orbit.nongrav.active)
    everything = without_itself(acting, orbit, window)
    first = _passage(orbit, window, index, forces or everything, reach, EPSILON)
    if first is not None:
        _check_way(orbit, body, window, first, epoch)
    beside = deviations_of(orbit, ephemeris)
    if first is None or first.distance > largest:
        closest = (
            "no minimum of distance" if first is None else f"{first.distance / AU:.4f} au at the closest"
        )
        raise NoEncounter(
            f"no encounter with {body.name} within {largest / AU:.4f} au and {reach / DAY:g} d of "
            f"{near.iso} TDB: {closest}{_horizon(orbit, beside, window, forces or everything, largest)}"
        )
    size = shares(window, *_path(first.log, epoch, first.t), orbit.nongrav)
    if forces is None:
        forces = tuple(n for n in everything if size[n] >= accuracy)
    chosen = _passage(orbit, window, index, forces, reach, EPSILON)
    if chosen is None:
        raise NoEncounter(
            f"the closest approach to {body.name} vanishes with the forces {', '.join(forces)}"
            + _horizon(orbit, beside, window, everything, largest)
        )
    tight = _passage(orbit, window, index, forces, reach, TIGHT)
    gaps = [
        (abs(chosen.distance - other.distance), abs(chosen.t - other.t)) if other else (np.inf, np.inf)
        for other in (first, tight)
    ]
    contact = _contact(chosen, window, index, body)
    when = chosen.t if contact is None else contact[0]
    found = _spread(orbit, beside, window, forces, when)
    model_error = float(found.model_error[0])
    common = model_error if found.passed[0] else 0.0
    growth = _Growth(
        distance=gaps[0][0] + gaps[1][0] + common,
        time=gaps[0][1] + gaps[1][1] + common / float(np.linalg.norm(chosen.state[3:])),
        model=model_error,
        displacement=float(found.displacement[0]),
        growth=float(found.growth[0]),
        beside=beside,
    )
    return _around(cls, orbit, body, window, chosen, contact, accuracy, start, wait, size, growth)


def _spread(orbit: Orbit, beside: Deviations, window: Window, forces: tuple[str, ...], t: float) -> Spread:
    """Errors of the orbit at `t` s from the epoch of the window."""
    law = orbit.nongrav.parameters
    if "non-gravitational" not in forces:
        law = law._replace(a1=0.0, a2=0.0, a3=0.0, pressure=0.0)
    acting = field(window, [name for name in forces if name != "non-gravitational"])
    return spread(beside, acting, law, window, np.array([t]), _TOLERANCE)


def _contact(passage: _Passage, window: Window, index: int, body: Planet) -> tuple[float, Array] | None:
    """Time (s) and relative state of the first contact with atmosphere or surface; None for a passage outside."""
    if body.impact_level(passage.distance) is None:
        return None
    tables = (window.head, window.data, window.gm, index)
    found, steps = crossings(passage.log, *tables, body.impact_distance, 8)
    row = np.flatnonzero((found[:, 0] < passage.t) & (found[:, 2] < 0.0))[-1]
    state = np.empty(6)
    relative(passage.log, int(steps[row]), *tables, float(found[row, 0]), state)
    return float(found[row, 0]), state


def _check_way(orbit: Orbit, body: Planet, window: Window, passage: _Passage, epoch: float) -> None:
    """Raise NoEncounter if the asteroid hits the planet between its epoch and a closest approach."""
    index = BODIES.index(body.name)
    found, _ = crossings(passage.log, window.head, window.data, window.gm, index, body.impact_distance, 8)
    low, high = sorted((epoch, passage.t))
    hits = found[(found[:, 0] > low) & (found[:, 0] < high) & (np.abs(found[:, 0] - passage.t) > _OWN), 0]
    if hits.size:
        first = hits[np.argmin(np.abs(hits - epoch))]
        raise NoEncounter(
            f"{orbit.name or 'the orbit'} hits {body.name} at {later(window.epoch, float(first)).iso} TDB, between "
            f"its epoch {orbit.epoch.tdb.iso[:10]} and the time given"
        )


@dataclass(frozen=True)
class _Growth:
    """Errors of a closest approach: numerical ones of distance (m) and time (s), of the model and of the orbit (m)."""

    distance: float
    time: float
    model: float
    displacement: float
    growth: float
    beside: Deviations


def _horizon(
    orbit: Orbit, beside: Deviations, window: Window, forces: tuple[str, ...], largest: float
) -> str:
    """Addition to the message "no encounter" where the orbit is not predictable that far; empty otherwise."""
    found = _spread(orbit, beside, window, forces, 0.0)
    gap = max(float(found.displacement[0]), float(found.model_error[0]))
    if predictability(largest, gap) is Predictability.DETERMINED:
        return ""
    what = beside.label if found.displacement[0] == gap else "the error of the force model"
    return (
        f"; the orbit cannot be predicted that far: {what} at {beside.orbit.epoch.iso[:10]} is "
        f"{gap / AU:.2g} au at this time"
    )


def _around(
    cls: type[Encounter],
    orbit: Orbit,
    body: Planet,
    window: Window,
    passage: _Passage,
    contact: tuple[float, Array] | None,
    accuracy: float,
    start: float | None,
    wait: float,
    size: dict[str, float],
    growth: _Growth,
) -> Encounter:
    """The encounter around a closest approach."""
    index = BODIES.index(body.name)
    gm = float(window.gm[index])
    zero, q, state = passage.t, passage.distance, passage.state
    level = body.impact_level(q)
    entry = None
    log = passage.log
    if contact is not None:
        entry, state = contact
        q, ahead = _two_body_periapsis(gm, state)
        zero = entry + ahead
        level = body.impact_level(q)
    speed2 = float(state[3:] @ state[3:]) - 2.0 * gm / float(np.linalg.norm(state[:3]))
    v_p = float(np.sqrt(speed2 + 2.0 * gm / q))
    tau = max(q, 0.01 * body.radius) / v_p
    if start is None:
        start = usual_start(body, q)
    elif start <= q:
        raise InvalidInput("start_distance", start * u.m, f"more than the closest approach, {q:.6g} m")
    t_in, t_out = _ends(passage.log, window, index, start, zero if entry is None else entry)
    start = float(np.linalg.norm(_log_state(passage.log, window, index, t_in)[:3]))
    stop = t_out + wait if entry is None else entry
    end = stop + TAIL if entry is None else entry
    row = max(int(np.searchsorted(log[:, 0], t_in, side="right")) - 1, 0)
    flight = Flight(model(window, passage.forces, orbit.nongrav), log[row, 0], log[row, 1:7])
    track = panel_track(_relative_to(flight, window, index, zero), t_in - zero, end - zero, tau)

    sources, kept, dropped = chosen_sources(track, window, index, body, zero, t_in, stop, 0.1 * accuracy / q)
    axis = np.array(body.pole_at(window.epoch))

    def tide(t: Array) -> Array:
        return tide_of(track, window, index, body, axis, zero, t, sources)

    for width in (
        0.5,
        0.25,
        0.125,
        0.0625,
    ):  # an encounter with the Moon is shorter than that with the planet
        panels, miss = tide_panels(tide, t_in - zero, end - zero, tau, width=width)
        if miss < 1e-10:  # below lies the rounding of barycentric coordinates
            break
    return cls(
        planet=body,
        time=later(window.epoch, zero),
        distance=(q * u.m).to(u.km),
        v_inf=(np.sqrt(max(speed2, 0.0)) * u.m / u.s).to(u.km / u.s),
        v_periapsis=(v_p * u.m / u.s).to(u.km / u.s),
        start_distance=(start * u.m).to(u.km),
        impact=entry is not None,
        impact_level=level,
        impact_time=None if entry is None else entry - zero,
        frame="ICRF",
        forces=(*(f"orbit: {n}" for n in passage.forces), *(f"tide: {n}" for n in kept)),
        left_out=(
            *((f"orbit: {n}", v / q) for n, v in size.items() if n not in passage.forces and v > 1e-6),
            *dropped,
        ),
        tide_error=miss,
        t_start=t_in - zero,
        t_stop=stop - zero,
        tide=panels,
        track=track,
        distance_error=(growth.distance * u.m).to(u.km),
        time_error=growth.time * u.s,
        displacement=(growth.displacement * u.m).to(u.km),
        growth=growth.growth,
        neighbour=growth.beside.label,
        predictability=predictability(
            max(q, body.impact_distance if level is not None else 0.0),
            growth.displacement,
            growth.model,
            growth.distance,
            growth.time * v_p,
            known=growth.beside.known,
        ),
        ephemeris=window.name,
    )


def _two_body_periapsis(gm: float, state: Array) -> tuple[float, float]:
    """Periapsis distance (m) and time to it (s) of the two-body orbit through an inbound state."""
    r = float(np.linalg.norm(state[:3]))
    v2 = float(state[3:] @ state[3:])
    h2 = float(np.sum(np.cross(state[:3], state[3:]) ** 2))
    energy = v2 - 2.0 * gm / r  # v_inf^2
    # q from h^2 = q (2 gm + q v_inf^2), without cancellation
    q = h2 / (gm + np.sqrt(gm * gm + h2 * energy))
    q = max(q, 1.0)
    return float(q), float(time_at_distance(gm, q, q * energy / gm, r))


def _log_state(log: Array, window: Window, index: int, t: float) -> Array:
    """State relative to a body at `t` within a log, shape (6,)."""
    k = min(max(int(np.searchsorted(log[:, 0], t, side="right")) - 1, 0), len(log) - 2)
    out = np.empty(6)
    relative(log, k, window.head, window.data, window.gm, index, t, out)
    return out


def _ends(log: Array, window: Window, index: int, level: float, t: float) -> tuple[float, float]:
    """Last time before `t` and first after it at distance `level`, or at an apoapsis or an end of the log."""
    tables = (window.head, window.data, window.gm, index)
    inside, _ = crossings(log, *tables, level, 8)
    turning, _ = crossings(log, *tables, -1.0, 8)
    before = [log[0, 0]] + [f[0] for f in (*inside, *turning) if f[0] < t and f[2] < 0.0]
    after = [log[-1, 0]] + [f[0] for f in inside if f[0] > t and f[2] > 0.0]
    after += [f[0] for f in turning if f[0] > t and f[2] < 0.0]
    return float(max(before)), float(min(after))
