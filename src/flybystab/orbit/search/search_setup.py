"""Set-up of a search for encounters: span, forces, tolerance and initial states of the asteroids."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import astropy.units as u
import numpy as np
from astropy.time import Time

from flybystab.constants import DAY, YEAR
from flybystab.orbit.almanac import GRID, N_FAST, N_SLOW, SLOT
from flybystab.orbit.barycentre import barycentre_in
from flybystab.orbit.default_forces import TWIN_DISTANCE, TWIN_SPEED, default_forces
from flybystab.orbit.ephemeris import BELT, BODIES, N_BODIES, SUN, Ephemeris, Window
from flybystab.orbit.epochs import later, seconds
from flybystab.orbit.forces import FORCES
from flybystab.orbit.nongravitational import N_LAW
from flybystab.orbit.orbit import Orbit
from flybystab.orbit.planets import PLANETS, Planet
from flybystab.orbit.predictability import deviation_epoch
from flybystab.orbit.search.acceleration import Field, field
from flybystab.orbit.search.force_selection import reduced
from flybystab.orbit.search.track import Reach
from flybystab.typing import Array

_SPEED = u.m / u.s

#: Margin of the integration beyond the span, so that a minimum at its end is bracketed, s.
_MARGIN = 60.0
#: Tolerance over the allowed error, m: nine of ten distances of a search over a century are then within a tenth of the
#: default error (``python benchmarks/versions.py search``). Below the least tolerance rounding errors dominate.
_PER_ERROR, LEAST_TOLERANCE, _LARGEST_TOLERANCE = 1e-15, 1e-14, 1e-8
#: Largest tolerance where encounters amplify the errors of the integration.
_WITH_GROWTH = 1e-13


class SearchSpan(NamedTuple):
    """Span of a search.

    Attributes
    ----------
    middle : Time
        Origin of the times below.
    start, stop : float
        Ends of the span, s.
    begin, end : float
        Ends of the integration, s.
    window : Window
        The ephemeris over the span and the epochs of the orbits.
    """

    middle: Time
    start: float
    stop: float
    begin: float
    end: float
    window: Window


class SearchForces(NamedTuple):
    """Forces of a search.

    Attributes
    ----------
    names : tuple of str
        Names of the forces; those that are irrelevant for an asteroid are left out for it.
    everything : Field
        All forces, without the non-gravitational acceleration.
    own : dict of int to Field
        In place of `everything` for the orbits of massive asteroids, which do not attract themselves.
    laws : ndarray, shape (n, N_LAW)
        Non-gravitational acceleration of each asteroid: rows of
        :class:`flybystab.orbit.nongravitational.NonGravitationalParameters`.
    least : float
        Point masses and 1PN with a smaller estimated displacement are left out, m.
    always : ndarray of bool
        Bodies (fast and slow slots) that are never left out.
    """

    names: tuple[str, ...]
    everything: Field
    own: dict[int, Field]
    laws: Array
    least: float
    always: Array

    def of(self, i: int, shares: Array) -> Field:
        """The forces on asteroid `i`, from the estimated displacement by each force."""
        return reduced(self.own.get(i, self.everything), shares, self.least, self.always)


#: The window of an ephemeris extends to multiples of this fraction of the span, or of a year, from its middle, so that
#: asteroids of similar epochs have the same window, almanac and field.
_BLOCK = 0.25


@lru_cache(maxsize=4)
def _window(eph: Ephemeris, day: float, fraction: float, start: float, stop: float) -> Window:
    """The ephemeris over a search; cached, with its almanac, for the next asteroid of the same epoch."""
    return eph.window(Time(day, fraction, format="jd", scale="tdb"), start, stop)


@lru_cache(maxsize=8)
def _field(window: Window, names: tuple[str, ...]) -> Field:
    """The named forces; cached for the next asteroid of the same window."""
    return field(window, names)


def search_span(
    rows: list[tuple[str, Orbit]], start: Time, stop: Time, ephemeris: Ephemeris, growth: bool
) -> tuple[SearchSpan, Array]:
    """Span of a search, and the epochs of the orbits (s from its middle)."""
    middle, t_start, t_stop, first, last = _times(start, stop, ephemeris)
    epochs = _epochs(rows, middle)
    known = [seconds(deviation_epoch(orbit), middle) for _, orbit in rows] if growth else []
    begin, end = _integrated_span(t_start, t_stop, first, last)
    every = np.array([begin, end, *epochs, *known])
    low, high = _window_ends(every.min(), every.max(), t_start, t_stop, first, last)
    window = _window(ephemeris, middle.tdb.jd1, middle.tdb.jd2, float(low), float(high))
    return SearchSpan(middle, t_start, t_stop, begin, end, window), epochs


def groups_by_window(
    rows: list[tuple[str, Orbit]], start: Time, stop: Time, ephemeris: Ephemeris
) -> list[list[int]]:
    """Numbers of the orbits, in groups whose searches have the same window: that of each orbit searched alone."""
    middle, *times = _times(start, stop, ephemeris)
    epochs = _epochs(rows, middle)
    begin, end = _integrated_span(*times)
    ends = _window_ends(np.minimum(epochs, begin), np.maximum(epochs, end), *times)
    groups: dict[tuple[float, float], list[int]] = {}
    for i, pair in enumerate(zip(*(e.tolist() for e in ends), strict=True)):
        groups.setdefault(pair, []).append(i)
    return list(groups.values())


def _times(start: Time, stop: Time, ephemeris: Ephemeris) -> tuple[Time, float, float, float, float]:
    """Middle of a span; its start and stop, and those of the ephemeris, s from the middle."""
    middle = later(start, 0.5 * seconds(stop, start))
    zero = middle.tdb
    first, last = ((jd - zero.jd1 - zero.jd2) * DAY for jd in (ephemeris.start_jd, ephemeris.stop_jd))
    return middle, seconds(start, middle), seconds(stop, middle), float(first), float(last)


def _integrated_span(t_start: float, t_stop: float, first: float, last: float) -> tuple[float, float]:
    """Ends of the integration, s, from those of the span and of the ephemeris."""
    begin, end = t_start - _MARGIN, t_stop + _MARGIN
    if first <= t_start and t_stop <= last:
        begin, end = max(begin, first + 1e-3), min(end, last - 1e-3)
    return begin, end


def _window_ends(
    least: Array, largest: Array, t_start: float, t_stop: float, first: float, last: float
) -> tuple[Array, Array]:
    """Ends of the window, s, for searches with the given `least` and `largest` times; any shape."""
    block = max(_BLOCK * (t_stop - t_start), YEAR)
    low = block * np.floor((least + _MARGIN) / block) - _MARGIN
    high = block * np.ceil((largest - _MARGIN) / block) + _MARGIN
    return np.maximum(low, np.minimum(first, least)), np.minimum(high, np.maximum(last, largest))


def search_forces(
    rows: list[tuple[str, Orbit]],
    found: list[Planet],
    forces: tuple[str, ...] | None,
    least: float,
    window: Window,
    epochs: Array,
    states: Array,
) -> SearchForces:
    """Forces of a search: exactly `forces`, or by default all that are modelled for encounters with these planets."""
    chosen = forces
    if chosen is None:
        kinds = {orbit.nongrav.active: orbit for _, orbit in rows}
        used = {name for orbit in kinds.values() for name in default_forces(orbit, *(b.name for b in found))}
        chosen = tuple(name for name in FORCES if name in used)
    everything = _field(window, tuple(n for n in chosen if n != "non-gravitational"))
    always = np.zeros(N_FAST + N_SLOW, dtype=bool)
    for name in ("sun", *(b.name for b in found)):
        b = BODIES.index(name)
        always[SLOT[b] + N_FAST * GRID[b]] = True
    laws = np.zeros((len(rows), N_LAW))
    if "non-gravitational" in chosen:
        for i, (_, orbit) in enumerate(rows):
            if orbit.nongrav.active:
                laws[i] = orbit.nongrav.parameters
    # A massive asteroid does not attract itself.
    twins = {} if forces is not None else _twins(window, epochs, states)
    own = {
        i: _field(window, tuple(n for n in chosen if n not in ("non-gravitational", f"{name} point mass")))
        for i, name in twins.items()
    }
    return SearchForces(chosen, everything, own, laws, least, always)


def search_tolerance(accuracy: float, tolerance: float | None, growth: bool) -> float:
    """Tolerance of the integration, from the allowed error (m) if none is given."""
    if tolerance is not None:
        return max(float(tolerance), LEAST_TOLERANCE)
    largest = _WITH_GROWTH if growth else _LARGEST_TOLERANCE
    return min(max(_PER_ERROR * accuracy, LEAST_TOLERANCE), largest)


def reach_of(found: list[Planet], distances: Array) -> Reach:
    """Limits of encounters and impacts, from the planets of a search and the largest distance from each, m."""
    limits = np.zeros(len(BODIES))
    limits[[BODIES.index(b.name) for b in found]] = distances
    limits[SUN] = 0.0  # a perihelion is not an encounter
    return Reach(limits, np.array([PLANETS[name].impact_distance for name in BODIES]))


def _epochs(rows: list[tuple[str, Orbit]], origin: Time) -> Array:
    """Epochs, s (TDB) from `origin`; differences of whole days first, which avoids rounding."""
    zero = origin.tdb
    # Asteroids of a catalogue share few epochs, and reading a Time is slow.
    epochs = {id(orbit.epoch): orbit.epoch for _, orbit in rows}
    known = {key: (t.jd1, t.jd2) for key, t in epochs.items()}
    pairs = np.array([known[id(orbit.epoch)] for _, orbit in rows]).reshape(-1, 2)
    return ((pairs[:, 0] - zero.jd1) + (pairs[:, 1] - zero.jd2)) * DAY


def initial_states(rows: list[tuple[str, Orbit]], window: Window, epochs: Array) -> Array:
    """Barycentric states at the epochs, shape (n, 6), m and m/s."""
    out = np.empty((len(rows), 6))
    centres = np.array([orbit.centre for _, orbit in rows], dtype=object)
    for i, (_, orbit) in enumerate(rows):
        out[i, :3] = orbit.position.to_value(u.m)
        out[i, 3:] = orbit.velocity.to_value(_SPEED)
    barycentric = centres == "ssb"
    if barycentric.any():
        out[barycentric] += barycentre_in(window, epochs[barycentric])
    for centre in set(centres) - {"ssb"}:
        where = centres == centre
        out[where] += window.states(BODIES.index(centre), epochs[where])
    return out


def _twins(window: Window, epochs: Array, states: Array) -> dict[int, str]:
    """Indices and names of the orbits that belong to massive asteroids."""
    out = {}
    for k, name in enumerate(BELT, N_BODIES):
        away = states - window.states(k, epochs)
        near = (np.linalg.norm(away[:, :3], axis=1) < TWIN_DISTANCE) & (
            np.linalg.norm(away[:, 3:], axis=1) < TWIN_SPEED
        )
        out.update(dict.fromkeys(np.flatnonzero(near).tolist(), name))
    return out
