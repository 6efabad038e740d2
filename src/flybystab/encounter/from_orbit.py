"""An encounter on a real orbit: closest approach and path by rebound, with their errors."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import astropy.units as u
import numpy as np
from astropy.time import Time

from flybystab.constants import AU, DAY
from flybystab.core.ellipsoid.tide import TidePanels, tide_panels
from flybystab.encounter.approach_errors import ApproachErrors, approach_errors, horizon
from flybystab.encounter.encounter import Encounter
from flybystab.encounter.encounter_arguments import start_beyond
from flybystab.encounter.integrated_approach import (
    Approach,
    approach_near,
    by_rebound,
    check_no_impact_before,
    ends_of_encounter,
    first_contact_of,
    independent_approach,
    path_between,
    relative_to,
    state_in_log,
    two_body_periapsis,
)
from flybystab.encounter.reach import TAIL
from flybystab.encounter.tide_sources import chosen_sources, tide_of
from flybystab.errors import NoEncounter
from flybystab.orbit.closest_approach import STATE, TIME, PanelTrack, panel_track
from flybystab.orbit.default_forces import without_itself
from flybystab.orbit.ephemeris import BODIES, Ephemeris, Window
from flybystab.orbit.epochs import later, seconds
from flybystab.orbit.forces import FORCES, model, shares
from flybystab.orbit.ias15 import Flight
from flybystab.orbit.orbit import Orbit
from flybystab.orbit.orbit_arguments import as_ephemeris
from flybystab.orbit.planets import Planet
from flybystab.orbit.predictability import deviation_epoch, deviations_of, predictability
from flybystab.orbit.search.encounter_finder import starts_inside
from flybystab.typing import Array


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
    known = (n for n in FORCES if n != "non-gravitational" or orbit.nongrav.active)
    everything = without_itself(known, orbit, window)
    acting = forces or everything
    first = independent_approach(orbit, window, index, acting, reach)
    if first is not None:
        check_no_impact_before(orbit, body, window, first, epoch)
    beside = deviations_of(orbit, ephemeris)
    if first is None or first.distance > largest:
        closest = (
            "no minimum of distance" if first is None else f"{first.distance / AU:.4f} au at the closest"
        )
        raise NoEncounter(
            f"no encounter with {body.name} within {largest / AU:.4f} au and {reach / DAY:g} d of "
            f"{near.iso} TDB: {closest}{horizon(orbit, beside, window, acting, largest)}"
        )
    size = shares(window, *path_between(first.log, epoch, first.t), orbit.nongrav)
    if forces is None:
        forces = tuple(n for n in everything if size[n] >= accuracy)
    chosen = approach_near(orbit, window, index, forces, reach, by_rebound(orbit, window, forces))
    if chosen is None:
        raise NoEncounter(
            f"the closest approach to {body.name} vanishes with the forces {', '.join(forces)}"
            + horizon(orbit, beside, window, everything, largest)
        )
    # The same forces by the integrator of the search: their difference is the error of the integration.
    second: Approach | None = first
    if set(forces) != set(acting):
        second = independent_approach(orbit, window, index, forces, reach)
    contact = first_contact_of(chosen, window, index, body)
    when = chosen.t if contact is None else contact[0]
    errors = approach_errors(orbit, beside, window, chosen, second, first, when)
    return _around(cls, orbit, body, window, chosen, contact, accuracy, start, wait, size, errors)


class _Periapsis(NamedTuple):
    """Two-body orbit at closest approach: time (s), distance (m), v_inf^2 (m2/s2), speed (m/s); impact, entry (s)."""

    t: float
    q: float
    excess2: float
    speed: float
    level: str | None
    entry: float | None


def _periapsis(
    gm: float, body: Planet, approach: Approach, contact: tuple[float, Array] | None
) -> _Periapsis:
    """The closest approach, on an impact that of the two-body orbit through the first contact."""
    t, q, state, entry = approach.t, approach.distance, approach.state, None
    if contact is not None:
        entry, state = contact
        q, ahead = two_body_periapsis(gm, state)
        t = entry + ahead
    excess2 = float(state[3:] @ state[3:]) - 2.0 * gm / float(np.linalg.norm(state[:3]))
    return _Periapsis(t, q, excess2, float(np.sqrt(excess2 + 2.0 * gm / q)), body.impact_level(q), entry)


class _Span(NamedTuple):
    """Span of an encounter: distance at the start (m); start, stop and end of the track (s from the epoch)."""

    distance: float
    start: float
    stop: float
    end: float


def _span(
    log: Array, window: Window, index: int, body: Planet, at: _Periapsis, start: float | None, wait: float
) -> _Span:
    """From the distance `start` (m; None: the default), inbound, to the same distance outbound and `wait` s longer.

    An impact ends both the encounter and the track.
    """
    beyond = start_beyond(start, body, at.q)
    t_in, t_out = ends_of_encounter(log, window, index, beyond, at.t if at.entry is None else at.entry)
    distance = float(np.linalg.norm(state_in_log(log, window, index, t_in)[:3]))
    if at.entry is not None:
        return _Span(distance, t_in, at.entry, at.entry)
    return _Span(distance, t_in, t_out + wait, t_out + wait + TAIL)


def _panels(
    tide: Callable[[Array], Array], start: float, stop: float, tau: float
) -> tuple[TidePanels, float]:
    """Chebyshev panels of a tide, narrower until their error is below 1e-10 of the peak; and that error.

    The tide of the Moon varies faster than that of the Earth. Errors below 1e-10 are not resolved: they are those of
    the rounding of barycentric coordinates.
    """
    for width in (0.5, 0.25, 0.125, 0.0625):
        panels, miss = tide_panels(tide, start, stop, tau, width=width)
        if miss < 1e-10:
            break
    return panels, miss


class _Tide(NamedTuple):
    """Tide of an encounter: panels, their error over the peak, sources, and neglected sources with relative sizes."""

    panels: TidePanels
    error: float
    kept: list[str]
    dropped: list[tuple[str, float]]


def _tide(
    track: PanelTrack,
    window: Window,
    index: int,
    body: Planet,
    zero: float,
    span: _Span,
    tau: float,
    accuracy: float,
) -> _Tide:
    """The tide of the planet and of the sources above a relative `accuracy`, on the clock of closest approach.

    `zero` is the time of closest approach, s from the epoch of the window; `tau` the time scale of the panels, s.
    """
    sources, kept, dropped = chosen_sources(track, window, index, body, zero, span.start, span.stop, accuracy)
    axis = np.array(body.pole_at(window.epoch))
    panels, error = _panels(
        lambda t: tide_of(track, window, index, body, axis, zero, t, sources),
        span.start - zero,
        span.end - zero,
        tau,
    )
    return _Tide(panels, error, kept, dropped)


def _around(
    cls: type[Encounter],
    orbit: Orbit,
    body: Planet,
    window: Window,
    approach: Approach,
    contact: tuple[float, Array] | None,
    accuracy: float,
    start: float | None,
    wait: float,
    size: dict[str, float],
    errors: ApproachErrors,
) -> Encounter:
    """The encounter around a closest approach."""
    index = BODIES.index(body.name)
    at = _periapsis(float(window.gm[index]), body, approach, contact)
    span = _span(approach.log, window, index, body, at, start, wait)
    tau = max(at.q, 0.01 * body.radius) / at.speed
    row = max(int(np.searchsorted(approach.log[:, TIME], span.start, side="right")) - 1, 0)
    forces = model(window, approach.forces, orbit.nongrav)
    flight = Flight(forces, approach.log[row, TIME], approach.log[row, STATE])
    track = panel_track(relative_to(flight, window, index, at.t), span.start - at.t, span.end - at.t, tau)
    tide = _tide(track, window, index, body, at.t, span, tau, 0.1 * accuracy / at.q)
    return cls(
        planet=body,
        time=later(window.epoch, at.t),
        distance=(at.q * u.m).to(u.km),
        v_inf=(np.sqrt(max(at.excess2, 0.0)) * u.m / u.s).to(u.km / u.s),
        v_periapsis=(at.speed * u.m / u.s).to(u.km / u.s),
        start_distance=(span.distance * u.m).to(u.km),
        impact=at.entry is not None,
        impact_level=at.level,
        impact_time=None if at.entry is None else at.entry - at.t,
        frame="ICRF",
        forces=(*(f"orbit: {n}" for n in approach.forces), *(f"tide: {n}" for n in tide.kept)),
        left_out=(
            *((f"orbit: {n}", v / at.q) for n, v in size.items() if n not in approach.forces and v > 1e-6),
            *tide.dropped,
        ),
        tide_error=tide.error,
        t_start=span.start - at.t,
        t_stop=span.stop - at.t,
        tide=tide.panels,
        track=track,
        distance_error=(errors.distance * u.m).to(u.km),
        time_error=errors.time * u.s,
        displacement=(errors.displacement * u.m).to(u.km),
        growth=errors.growth,
        neighbour=errors.beside.label,
        predictability=predictability(
            max(at.q, body.impact_distance if at.level is not None else 0.0),
            errors.displacement,
            errors.model,
            errors.distance,
            errors.time * at.speed,
            known=errors.beside.known,
        ),
        ephemeris=window.name,
    )
