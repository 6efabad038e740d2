"""One close passage of an asteroid by a planet, scripted or real: its path and the tide that it feels."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol

import astropy.units as u
import numpy as np
from astropy.time import Time
from astropy.units import Quantity
from numpy.typing import NDArray

from flybystab.constants import AU, DAY, HOUR
from flybystab.core.jit import kernel
from flybystab.core.tide import TidePanels, tide_j2, tide_panels, tide_point
from flybystab.errors import InvalidInput, NoEncounter
from flybystab.sky.approach import (
    PanelTrack,
    between,
    crossings,
    nearest_minimum,
    panel_track,
    periapsis_time,
    relative,
)
from flybystab.sky.b_plane import NORTH, checked, target_plane
from flybystab.sky.ephemeris import BODIES, Ephemeris, Window
from flybystab.sky.forces import FORCES, model, shares
from flybystab.sky.kepler import states_at_times, time_at_distance
from flybystab.sky.orbit import Orbit, _ephemeris, later, seconds
from flybystab.sky.planets import PLANETS, Planet, planet
from flybystab.sky.predictability import Neighbour, Predictability, neighbour, predictability
from flybystab.sky.reboundry import LOG_WIDTH, Flight
from flybystab.units import to_si

Array = NDArray[np.float64]

#: Time after the end of the encounter that the tide still covers, s: a body that flows can be followed.
TAIL = 100.0 * HOUR
#: Time to settle after an encounter, unless another is asked for, s.
SETTLE = 4.0 * HOUR


class Track(Protocol):
    """Motion of the asteroid relative to the planet."""

    def states(self, t: Array) -> Array:
        """Position (m) and velocity (m/s), shape (n, 6), at ``t`` s from closest approach, shape (n,)."""


@dataclass(frozen=True)
class KeplerTrack:
    """Two-body motion in the xy plane with periapsis on +x and angular momentum on +z.

    Attributes
    ----------
    gm : float
        Gravitational parameter, m3/s2.
    q : float
        Periapsis distance, m.
    f : float
        Eccentricity - 1 = q v_inf^2 / gm.
    """

    gm: float
    q: float
    f: float

    def states(self, t: Array) -> Array:
        """Position (m) and velocity (m/s), shape (n, 6), at ``t`` s from periapsis, shape (n,)."""
        s = states_at_times(self.gm, self.q, self.f, np.ascontiguousarray(t, dtype=float))
        out = np.zeros((s.shape[0], 6))
        out[:, [0, 1, 3, 4]] = s
        return out


@kernel
def planet_tide(gm: float, j2: float, radius: float, pole: Array, position: Array, out: Array) -> None:
    """Add to ``out[n, 6]`` the tide (s^-2) of a planet with J2 on a body ``position[n, 3]`` (m) from it."""
    for i in range(position.shape[0]):
        x, y, z = -position[i, 0], -position[i, 1], -position[i, 2]
        tide_point(gm, x, y, z, out[i])
        if j2 != 0.0:
            tide_j2(gm, j2, radius, pole[0], pole[1], pole[2], x, y, z, out[i])


@dataclass(frozen=True, eq=False)
class Encounter:
    """A close passage by one planet.

    Made by :meth:`hyperbolic` (scripted, frame ``"periapsis"``) or from a real orbit (frame ``"ICRF"``).
    Times are counted from closest approach.

    Attributes
    ----------
    planet : Planet
        The body encountered.
    time : Time or None
        Closest approach, TDB; None for a scripted encounter.
    distance : Quantity
        Distance between the centres at closest approach; of the unhindered orbit if it hits the planet.
    v_inf : Quantity
        Speed far from the planet, of the two-body orbit at closest approach; 0 for a bound one.
    v_periapsis : Quantity
        Relative speed at closest approach.
    start_distance : Quantity
        Distance at which the encounter starts, inbound.
    impact : bool
        Whether the orbit reaches the atmosphere or the surface.
    impact_level : str or None
        ``"surface"``, ``"atmosphere"`` (passes above the surface but below its top) or None.
    impact_time : float or None
        First contact with the top of the atmosphere (surface, if there is none), s from closest approach.
    frame : str
        ``"periapsis"``: x from the planet's centre toward periapsis, z along the orbital angular momentum;
        or ``"ICRF"``. The planet is the origin of both.
    forces : tuple of str
        What moves the asteroid and what makes its tide.
    left_out : tuple of (str, float)
        What was left out, each with its estimated largest share. Names that begin with "orbit:" concern the
        path: share of the acceleration (scripted) or displacement over distance (real); the others the tide.
    tide_error : float
        Largest difference between the stored tide and the exact one at points between the nodes, over the
        peak of the tide.
    t_start, t_stop : float
        Start, and orbit back at `start_distance` plus the time to settle, s from closest approach.
    t_periapsis : float
        Zero.
    tide : TidePanels
        Tidal tensor in `frame` against s from closest approach, from `t_start` to 100 h after `t_stop`.
        On an impact both it and the track end there, and `t_stop` is the time of it.
    distance_error, time_error : Quantity or None
        For a real orbit: change of distance and time of closest approach when the integration is made 100
        times tighter plus the change when every known force is on; infinite if the encounter vanishes then.
        The orbit's own uncertainty is not in it.
    ephemeris : str or None
        Where the planets of a real orbit are from; None for a scripted encounter.
    displacement : Quantity or None
        For a real orbit: how far a neighbour of the orbit is away at closest approach: one sigma of the
        covariance in the direction least known by then, or 1 m at the epoch where there is no covariance.
    growth : float or None
        That over the distance between the two at the epoch.
    neighbour : str
        What the neighbour is.
    predictability : Predictability or None
        What displacement and errors say of the encounter: ``determined``, ``uncertain`` or ``one of many``
        (:mod:`flybystab.sky.predictability`).
    """

    planet: Planet
    time: Time | None
    distance: Quantity
    v_inf: Quantity
    v_periapsis: Quantity
    start_distance: Quantity
    impact: bool
    impact_level: str | None
    impact_time: float | None
    frame: str
    forces: tuple[str, ...]
    left_out: tuple[tuple[str, float], ...]
    tide_error: float
    t_start: float
    t_stop: float
    tide: TidePanels = field(repr=False)
    track: Track = field(repr=False)
    t_periapsis: float = 0.0
    distance_error: Quantity | None = None
    time_error: Quantity | None = None
    displacement: Quantity | None = None
    growth: float | None = None
    neighbour: str = ""
    predictability: Predictability | None = None
    ephemeris: str | None = None

    def position(self, t: Array | float) -> Array:
        """Asteroid from the planet's centre, m, shape (n, 3), in `frame`, ``t`` s from closest approach."""
        return self.track.states(np.atleast_1d(np.asarray(t, dtype=float)))[:, :3]

    def velocity(self, t: Array | float) -> Array:
        """Velocity relative to the planet, m/s, shape (n, 3), in `frame`, ``t`` s from closest approach."""
        return self.track.states(np.atleast_1d(np.asarray(t, dtype=float)))[:, 3:]

    def radius(self, t: Array | float) -> Array:
        """Distance from the planet's centre, m, shape (n,), at ``t`` s from closest approach."""
        return np.sqrt(np.sum(self.position(t) ** 2, axis=1))

    @cached_property
    def periapsis_axes(self) -> Array:
        """Rotation matrix, `frame` -> periapsis frame: x to the asteroid, z along the angular momentum."""
        # A track that ends on the planet has no periapsis: that of the two-body orbit it ends on.
        ended = self.impact and self.t_stop < 0.0
        state = self.track.states(np.array([self.t_stop if ended else 0.0]))[0]
        r, v = state[:3], state[3:]
        h = np.cross(r, v)
        x = np.cross(v, h) / self.planet.gm - r / np.linalg.norm(r) if ended else r
        x, z = x / np.linalg.norm(x), h / np.linalg.norm(h)
        return np.stack([x, np.cross(z, x), z])

    def b_plane(self, north: Sequence[float] = NORTH) -> Quantity:
        """Target-plane coordinates ``(B.T, B.R)`` of the two-body hyperbola at closest approach, shape (2,).

        Parameters
        ----------
        north : sequence of float
            The direction N in `frame` (:mod:`flybystab.sky.b_plane`): +z, in ICRF the Earth's equator.

        Raises
        ------
        InvalidInput
            For a bound passage, which has no target plane, or if the asymptote points north.
        """
        when = 0.0 if self.impact_time is None else min(0.0, self.impact_time)
        b, v_inf = target_plane(self.track.states(np.array([when])), self.planet.gm, north)
        return (checked(b[0], float(v_inf[0]), north) * u.m).to(u.km)

    @classmethod
    def hyperbolic(
        cls,
        planet: str | Planet,
        periapsis: Quantity,
        v_inf: Quantity,
        start_distance: Quantity | None = None,
        settle: Quantity = SETTLE * u.s,
        j2: bool = False,
        pole: tuple[float, float, float] = (0.0, 0.0, 1.0),
    ) -> Encounter:
        """Scripted encounter on a two-body hyperbola, or parabola if ``v_inf`` is zero.

        Parameters
        ----------
        planet : str or Planet
            The body encountered.
        periapsis : Quantity
            Distance of closest approach from the planet's centre; inside the planet it is an impact, not
            an error.
        v_inf : Quantity
            Speed far from the planet, zero or more.
        start_distance : Quantity, optional
            Where the encounter starts; 10 planet radii by default, or 10 periapsis distances if larger.
        settle : Quantity
            Time added after the orbit is back at `start_distance`.
        j2 : bool
            Whether the planet's J2 adds to the tide. The orbit stays a two-body one.
        pole : tuple of float
            Direction of the planet's pole in the frame of the encounter, for `j2`; an equatorial prograde
            orbit by default.

        Raises
        ------
        UnitMismatch, InvalidInput, UnknownName
            For a bad argument, with its value.
        """
        body = _planet(planet)
        q = to_si(periapsis, u.m, "periapsis", low=0.0, open_low=True)
        v = to_si(v_inf, u.m / u.s, "v_inf", low=0.0)
        wait = to_si(settle, u.s, "settle", low=0.0)
        if start_distance is None:
            start = 10.0 * max(body.radius, q)
        else:
            start = to_si(start_distance, u.m, "start_distance")
            if start <= q:
                raise InvalidInput("start_distance", start_distance, f"more than the periapsis, {periapsis}")
        axis = _unit_vector(pole)

        f = q * v * v / body.gm
        speed = np.sqrt(body.gm * (2.0 + f) / q)
        track = KeplerTrack(body.gm, q, f)
        half = time_at_distance(body.gm, q, f, start)
        level = body.impact_level(q)
        entry = None
        if level is not None:
            entry = -float(time_at_distance(body.gm, q, f, min(body.impact_distance, start)))

        def tide(t: Array) -> Array:
            out = np.zeros((t.size, 6))
            planet_tide(body.gm, body.j2 if j2 else 0.0, body.radius, axis, track.states(t)[:, :3], out)
            return out

        stop = half + wait
        panels, error = tide_panels(tide, -half, stop + TAIL, q / speed)
        forces = ["orbit: two-body", f"tide: {body.name}"] + ([f"tide: {body.name} J2"] if j2 else [])
        return cls(
            planet=body,
            time=None,
            distance=(q * u.m).to(u.km),
            v_inf=(v * u.m / u.s).to(u.km / u.s),
            v_periapsis=(speed * u.m / u.s).to(u.km / u.s),
            start_distance=(start * u.m).to(u.km),
            impact=level is not None,
            impact_level=level,
            impact_time=entry,
            frame="periapsis",
            forces=tuple(forces),
            left_out=_left_out(body, q, j2),
            tide_error=error,
            t_start=-float(half),
            t_stop=float(stop),
            tide=panels,
            track=track,
        )

    @classmethod
    def from_orbit(
        cls,
        orbit: Orbit,
        planet: str | Planet,
        time: Time,
        *,
        error: Quantity = 0.1 * u.km,
        start_distance: Quantity | None = None,
        settle: Quantity = SETTLE * u.s,
        search: Quantity = 30 * u.d,
        within: Quantity | None = None,
        ephemeris: str | Ephemeris | None = None,
        forces: tuple[str, ...] | None = None,
    ) -> Encounter:
        """Encounter on a real orbit: rebound among the bodies of an ephemeris, with the tide along the way.

        Parameters
        ----------
        orbit : Orbit
            Or anything with an attribute ``orbit``.
        planet : str or Planet
            The body encountered.
        time : Time
            Near closest approach; the minimum of distance nearest to it counts.
        error : Quantity
            Displacement asked for: forces whose estimated share is larger are modelled, the rest is listed.
            Sources of tide are modelled down to a tenth of the relative error that this means for the tide.
        start_distance : Quantity, optional
            Where the encounter starts; by default 10 planet radii or, if larger, 10 times the distance
            but no more than the planet's Hill radius (and at least 1.5 times the closest distance). An orbit
            that comes from less far (a temporary capture) starts at its apoapsis.
        settle : Quantity
            Time added after the orbit is back at `start_distance`.
        search : Quantity
            How far from `time` to look for the closest approach.
        within : Quantity, optional
            Largest distance that counts as an encounter; by default 20 Hill radii, at most 1 au.
        ephemeris : str or Ephemeris, optional
            ``"de421"``, ``"de440"``; the best installed by default.
        forces : tuple of str, optional
            Exactly these forces, names as in ``flybystab.sky.forces.FORCES``, instead of choosing by `error`.

        Raises
        ------
        NoEncounter
            No minimum of distance below `within` near `time`.
        OutOfSpan
            The ephemeris does not cover the way.
        UnitMismatch, InvalidInput, UnknownName
        """
        path = getattr(orbit, "orbit", orbit)
        if not isinstance(path, Orbit):
            raise InvalidInput("orbit", orbit, "an Orbit, or an object with one as its attribute 'orbit'")
        if not isinstance(time, Time) or time.shape != ():
            raise InvalidInput("time", time, "one astropy Time")
        body = _planet(planet)
        if body.name not in BODIES or body.name == "sun":
            raise InvalidInput("planet", body.name, f"one of {', '.join(BODIES[1:])}")
        reach = to_si(search, u.s, "search", low=0.0, open_low=True)
        largest = far_enough(body) if within is None else to_si(within, u.m, "within", low=0.0, open_low=True)
        accuracy = to_si(error, u.m, "error", low=0.0, open_low=True)
        wait = to_si(settle, u.s, "settle", low=0.0)
        start = None if start_distance is None else to_si(start_distance, u.m, "start_distance", low=0.0)
        return _real(cls, path, body, time.tdb, accuracy, start, wait, reach, largest, ephemeris, forces)


def _planet(name: str | Planet) -> Planet:
    return planet(name)


def _unit_vector(pole: tuple[float, float, float]) -> Array:
    try:
        axis = np.asarray(pole, dtype=float)
        norm = float(np.linalg.norm(axis))
    except (TypeError, ValueError):
        norm = 0.0
    if not (np.isfinite(norm) and norm > 0.0 and axis.shape == (3,)):
        raise InvalidInput("pole", pole, "a direction: three finite numbers, not all zero")
    return axis / norm


def _left_out(body: Planet, q: float, j2: bool) -> tuple[tuple[str, float], ...]:
    """What a two-body encounter leaves out, each with its share at periapsis.

    J2: at most 6 J2 (a/q)^2 of the tide (over the pole) and 3 J2 (a/q)^2 of the acceleration. A source GM'
    at distance d: (GM'/GM) (q/d)^3 of both.
    """
    flat = body.j2 * (body.radius / q) ** 2
    out = [("orbit: " + body.name + " J2", 3.0 * flat)]
    if not j2:
        out.append((f"{body.name} J2", 6.0 * flat))
    if body.orbit_radius > 0.0:
        out.append(("sun", PLANETS["sun"].gm / body.gm * (q / body.orbit_radius) ** 3))
    pair = {"earth": "moon", "moon": "earth"}.get(body.name)
    if pair is not None:
        out.append((pair, PLANETS[pair].gm / body.gm * (q / 3.844e8) ** 3))
    return tuple(out)


def far_enough(body: Planet) -> float:
    """Distance that still counts as an encounter, m."""
    return min(20.0 * hill_radius(body), AU)


def hill_radius(body: Planet) -> float:
    """Hill radius ``d (GM / 3 GM_primary)^(1/3)``, m; the Moon's primary is the Earth."""
    if body.name == "moon":
        return float(3.844e8 * (body.gm / (3.0 * PLANETS["earth"].gm)) ** (1.0 / 3.0))
    return float(body.orbit_radius * (body.gm / (3.0 * PLANETS["sun"].gm)) ** (1.0 / 3.0))


def usual_start(body: Planet, q: float) -> float:
    """Distance, m, at which an encounter with closest distance `q` (m) on a real orbit starts and ends."""
    return max(10.0 * body.radius, 1.5 * q, min(10.0 * q, hill_radius(body)))


@dataclass(frozen=True)
class _Passage:
    """Closest approach on one integration: time (s), relative state, log of steps, step of it, way from the epoch."""

    t: float
    state: Array
    log: Array
    step: int
    way: Array
    forces: tuple[str, ...]

    @property
    def distance(self) -> float:
        return float(np.linalg.norm(self.state[:3]))


def _passage(
    orbit: Orbit, window: Window, index: int, forces: tuple[str, ...], reach: float, epsilon: float
) -> _Passage | None:
    """The minimum of distance nearest to the epoch of the window, or None."""
    flight = orbit.flight(window, forces, epsilon)
    before = flight.t
    way = flight.log_to(-reach) if before != -reach else np.empty((0, LOG_WIDTH))
    log = flight.log_to(reach)
    hit = nearest_minimum(log, window, index, 0.0)
    if hit is None:
        return None
    t, _, step = hit
    again = Flight(model(window, forces, orbit.nongrav), log[step, 0], log[step, 1:7], epsilon)
    t, state = periapsis_time(_relative_to(again, window, index), t)
    if before < -reach:
        log = np.concatenate([way[:-1], log])
        step += len(way) - 1
    if before <= -reach:
        way = log
    elif before < t:
        way = log[max(int(np.searchsorted(log[:, 0], before)) - 1, 0) :]
    else:
        way = way[::-1]
    return _Passage(t, state, log, step, way, forces)


def _path(way: Array, start: float, stop: float) -> tuple[Array, Array]:
    """Times from `start` to `stop` (s, either order) and barycentric states, along a log, dense enough to sum."""
    low, high = min(start, stop), max(start, stop)
    inside = way[(way[:, 0] > low) & (way[:, 0] < high), 0]
    t = np.unique(np.concatenate([np.linspace(low, high, 129), inside]))
    t = t[(t >= way[0, 0]) & (t <= way[-1, 0])]
    states = np.empty((t.size, 6))
    for n, time in enumerate(t):
        k = min(max(int(np.searchsorted(way[:, 0], time, side="right")) - 1, 0), len(way) - 2)
        between(way, k, float(time), states[n])
    return (t, states) if start <= stop else (t[::-1], states[::-1])


def _relative_to(flight: Flight, window: Window, index: int, zero: float = 0.0) -> Callable[[float], Array]:
    def state_at(t: float) -> Array:
        return flight.to(t + zero) - window.states(index, np.array([t + zero]))[0]

    return state_at


def _real(
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
    index = BODIES.index(body.name)
    beside = neighbour(orbit, near, ephemeris)
    epoch = seconds(orbit.epoch, near)
    epochs = (epoch, seconds(beside.orbit.epoch, near))
    window = _ephemeris(ephemeris).window(
        near, min(*epochs, -reach), max(*epochs, reach + wait + TAIL + 10.0 * DAY)
    )
    everything = tuple(n for n in FORCES if n != "non-gravitational" or any(orbit.nongrav.a))
    first = _passage(orbit, window, index, forces or everything, reach, 1e-9)
    if first is None or first.distance > largest:
        closest = (
            "no minimum of distance" if first is None else f"{first.distance / AU:.4f} au at the closest"
        )
        raise NoEncounter(
            f"no encounter with {body.name} within {largest / AU:.4f} au and {reach / DAY:g} d of "
            f"{near.iso} TDB: {closest}{_horizon(orbit, beside, window, forces or everything, largest)}"
        )
    size = shares(window, *_path(first.way, epoch, first.t), orbit.nongrav)
    if forces is None:
        forces = tuple(n for n in everything if size[n] >= accuracy)
    chosen = _passage(orbit, window, index, forces, reach, 1e-9)
    if chosen is None:
        raise NoEncounter(
            f"the closest approach to {body.name} vanishes with the forces {', '.join(forces)}"
            + _horizon(orbit, beside, window, everything, largest)
        )
    tight = _passage(orbit, window, index, forces, reach, 1e-11)
    gaps = [
        (abs(chosen.distance - other.distance), abs(chosen.t - other.t)) if other else (np.inf, np.inf)
        for other in (first, tight)
    ]
    place = chosen.state[:3] + window.states(index, np.array([chosen.t]))[0, :3]
    there = beside.orbit.flight(window, forces).to(chosen.t)[:3]
    growth = _Growth(
        distance=gaps[0][0] + gaps[1][0],
        time=gaps[0][1] + gaps[1][1],
        displacement=float(np.linalg.norm(there - place)),
        beside=beside,
    )
    return _around(cls, orbit, body, window, chosen, accuracy, start, wait, reach, size, growth)


@dataclass(frozen=True)
class _Growth:
    """What other runs made of a closest approach: distance (m), time (s), displacement of the neighbour (m)."""

    distance: float
    time: float
    displacement: float
    beside: Neighbour


def _horizon(orbit: Orbit, beside: Neighbour, window: Window, forces: tuple[str, ...], largest: float) -> str:
    """What to add to "no encounter" where the orbit cannot be followed that far, else nothing."""
    places = [o.flight(window, forces).to(0.0)[:3] for o in (orbit, beside.orbit)]
    gap = float(np.linalg.norm(places[0] - places[1]))
    if predictability(largest, gap) is Predictability.DETERMINED:
        return ""
    return (
        f"; the orbit cannot be predicted that far: {beside.label} at {beside.orbit.epoch.iso[:10]} is "
        f"{gap / AU:.2g} au there, so that an encounter at this time is one of many possible"
    )


def _around(
    cls: type[Encounter],
    orbit: Orbit,
    body: Planet,
    window: Window,
    passage: _Passage,
    accuracy: float,
    start: float | None,
    wait: float,
    reach: float,
    size: dict[str, float],
    growth: _Growth,
) -> Encounter:
    """The encounter around a closest approach."""
    index = BODIES.index(body.name)
    gm = float(window.gm[index])
    zero, q, state = passage.t, passage.distance, passage.state
    level = body.impact_level(q)
    entry = None
    log, head, data = passage.log, window.head, window.data
    if level is not None:
        found, steps = crossings(log, head, data, window.gm, index, body.impact_distance, 8)
        row = np.flatnonzero((found[:, 0] < zero) & (found[:, 2] < 0.0))[-1]
        entry = float(found[row, 0])
        state = np.empty(6)
        relative(log, int(steps[row]), head, data, window.gm, index, entry, state)
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

    sources, kept, dropped = _sources(track, window, index, body, zero, t_in, stop, 0.1 * accuracy / q)
    axis = np.array(body.pole)

    def tide(t: Array) -> Array:
        return _tide(track, window, index, body, axis, zero, t, sources)

    for width in (
        0.5,
        0.25,
        0.125,
        0.0625,
    ):  # a passage by the Moon on the way is narrower than the encounter
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
        growth=growth.displacement / growth.beside.shift,
        neighbour=growth.beside.label,
        predictability=predictability(
            max(q, body.impact_distance if level is not None else 0.0),
            growth.displacement,
            growth.distance,
            growth.time * v_p,
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


@kernel
def _add_tides(gm: Array, places: Array, use: Array, out: Array) -> None:
    """Add to ``out[n, 6]`` the tides (s^-2) of the bodies at ``places[n, 10, 3]`` (m from the asteroid)."""
    for i in range(places.shape[0]):
        for b in range(places.shape[1]):
            if use[b]:
                tide_point(gm[b], places[i, b, 0], places[i, b, 1], places[i, b, 2], out[i])


def _places(track: PanelTrack, window: Window, index: int, zero: float, t: Array) -> Array:
    """Bodies as seen from the asteroid, m, shape (n, 10, 3), ICRF axes, at `t` s from closest approach."""
    near = track.states(t)[:, :3]
    time = t + zero
    centre = window.states(index, time)[:, :3]
    out = np.empty((t.size, len(BODIES), 3))
    for b in range(len(BODIES)):
        # The encountered planet itself without the detour through the barycentre: no digit is lost.
        out[:, b] = -near if b == index else (window.states(b, time)[:, :3] - centre) - near
    return out


def _tide(
    track: PanelTrack,
    window: Window,
    index: int,
    body: Planet,
    axis: Array,
    zero: float,
    t: Array,
    sources: tuple[Array, bool],
) -> Array:
    out = np.zeros((t.size, 6))
    places = _places(track, window, index, zero, t)
    _add_tides(window.gm, places, sources[0], out)
    if sources[1]:
        flat = np.zeros((t.size, 6))
        planet_tide(window.gm[index], body.j2, body.radius, axis, -places[:, index], flat)
        point = np.zeros((t.size, 6))
        planet_tide(window.gm[index], 0.0, body.radius, axis, -places[:, index], point)
        out += flat - point
    return out


def _sources(
    track: PanelTrack,
    window: Window,
    index: int,
    body: Planet,
    zero: float,
    t_in: float,
    stop: float,
    threshold: float,
) -> tuple[tuple[Array, bool], list[str], list[tuple[str, float]]]:
    """Which bodies make tide above `threshold` of the peak: switches, names; those left out with shares."""
    t = np.unique(np.concatenate([np.linspace(t_in - zero, stop - zero, 33), [min(0.0, stop - zero)]]))
    places = _places(track, window, index, zero, t)
    size = 2.0 * window.gm / np.sum(places**2, axis=2) ** 1.5
    share = size.max(axis=0) / size[:, index].max()
    q = float(np.sqrt(np.sum(places[:, index] ** 2, axis=1).min()))
    flat = 6.0 * body.j2 * (body.radius / q) ** 2
    use = share >= threshold
    use[index] = True
    kept = [n for n, on in zip(BODIES, use, strict=True) if on]
    dropped = [(n, float(v)) for n, v, on in zip(BODIES, share, use, strict=True) if not on]
    if flat >= threshold:
        kept.append(f"{body.name} J2")
    else:
        dropped.append((f"{body.name} J2", flat))
    return (use, flat >= threshold), kept, dropped
