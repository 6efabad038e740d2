"""An encounter along a given trajectory: samples of position and velocity relative to the planet."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import astropy.units as u
import numpy as np
from astropy.time import Time
from astropy.units import Quantity
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import brentq

from flybystab.core.ellipsoid.tide import TidePanels, tide_panels
from flybystab.core.numerics.jit import kernel
from flybystab.encounter.encounter import Encounter
from flybystab.encounter.encounter_arguments import start_beyond
from flybystab.encounter.hyperbolic import left_out
from flybystab.encounter.reach import TAIL
from flybystab.encounter.tide_sources import planet_tide
from flybystab.errors import InvalidInput, NoEncounter
from flybystab.orbit.kepler import two_body
from flybystab.orbit.planets import Planet
from flybystab.typing import Array
from flybystab.units import to_si

#: Largest accepted :func:`_mismatch`. Three samples of a parabola over 60 radii have 0.82, minutes for seconds 0.98.
_LARGEST_MISMATCH = 0.95


@dataclass(frozen=True, eq=False)
class SampledTrack:
    """Motion through samples: a two-body orbit plus the cubic Hermite spline of the difference from it.

    The orbit is that of the sample nearest to the planet, so that two-body motion is exact for any spacing of the
    samples. After the last sample its two-body orbit is continued.

    Attributes
    ----------
    gm : float
        m3/s2.
    state : ndarray (6,)
        Of the orbit at `time`, m and m/s.
    time : float
        s from closest approach.
    last, last_state : float, ndarray (6,)
        The last sample.
    difference : CubicHermiteSpline
        Of the positions, m.
    """

    gm: float
    state: Array
    time: float
    last: float
    last_state: Array
    difference: CubicHermiteSpline

    def states(self, t: Array) -> Array:
        """Position (m) and velocity (m/s), shape (n, 6), at ``t`` s from closest approach, shape (n,)."""
        t = np.ascontiguousarray(t, dtype=float)
        after = t > self.last
        out = _two_body_states(self.gm, self.state, t - self.time)
        out[:, :3] += self.difference(t)
        out[:, 3:] += self.difference(t, 1)
        if after.any():
            out[after] = _two_body_states(self.gm, self.last_state, t[after] - self.last)
        return out


@kernel
def _two_body_states(gm: float, state: Array, t: Array) -> Array:
    """States, shape (n, 6), at times after a state."""
    out = np.empty((t.size, 6))
    for i in range(t.size):
        out[i] = two_body(gm, state, t[i])
    return out


def samples(
    times: Time | Quantity, positions: Quantity, velocities: Quantity
) -> tuple[Array, Array, Time | None]:
    """Checked samples: times (s, from the first), states (n, 6) in SI, and the epoch of the first, if known."""
    epoch = None
    if isinstance(times, Time):
        if times.ndim != 1 or not len(times):
            raise InvalidInput("times", times, "an array of times")
        epoch = times[0].tdb
        t = np.asarray((times.tdb - epoch).to_value(u.s), dtype=float)
    else:
        t = to_si(times, u.s, "times", shape=None)
    if t.ndim != 1 or len(t) < 3 or np.any(np.diff(t) <= 0.0):
        raise InvalidInput("times", times, "three or more increasing times")
    r = to_si(positions, u.m, "positions", shape=(len(t), 3))
    v = to_si(velocities, u.m / u.s, "velocities", shape=(len(t), 3))
    if np.any(np.linalg.norm(r, axis=1) == 0.0):
        raise InvalidInput("positions", positions, "positions away from the centre of the planet")
    mismatch = _mismatch(t, r, v)
    if mismatch > _LARGEST_MISMATCH:
        raise InvalidInput(
            "velocities",
            velocities,
            "the rates of change of the positions (check units, frame and direction of time): in the median interval "
            f"they differ by {mismatch:.0%}",
        )
    return t, np.concatenate([r, v], axis=1), epoch


def _mismatch(t: Array, r: Array, v: Array) -> float:
    """Median over the intervals of the difference between mean velocity and displacement over time, over the larger."""
    chord, mean = np.diff(r, axis=0) / np.diff(t)[:, None], 0.5 * (v[1:] + v[:-1])
    size = np.maximum(np.linalg.norm(chord, axis=1), np.linalg.norm(mean, axis=1))
    return float(np.median(np.linalg.norm(chord - mean, axis=1) / np.maximum(size, 1e-300)))


def sampled(
    cls: type[Encounter],
    body: Planet,
    t: Array,
    states: Array,
    epoch: Time | None,
    start: float | None,
    wait: float,
    j2: bool,
    axis: Array,
) -> Encounter:
    """The encounter along checked samples; as checked by :meth:`Encounter.from_trajectory`, in SI."""
    track, zero = _track(body, t, states)
    first, last = float(t[0]) - zero, float(t[-1]) - zero
    r, v = (part.copy() for part in np.split(track.states(np.zeros(1))[0], 2))
    q, speed = float(np.linalg.norm(r)), float(np.linalg.norm(v))
    start = start_beyond(start, body, q)

    def radius(time: float) -> float:
        return float(np.linalg.norm(track.states(np.array([time]))[0, :3]))

    t_in = _crossing(radius, first, 0.0, start)
    t_out = _crossing(radius, last, 0.0, start)
    level = body.impact_level(q)
    entry = None if level is None else _crossing(radius, t_in, 0.0, body.impact_distance)
    stop = t_out + wait

    panels, error = _panels(track, body, j2, axis, t_in, stop + TAIL, q / speed)
    v_inf2 = speed * speed - 2.0 * body.gm / q
    return cls(
        planet=body,
        time=None if epoch is None else epoch + zero * u.s,
        distance=(q * u.m).to(u.km),
        v_inf=(np.sqrt(max(v_inf2, 0.0)) * u.m / u.s).to(u.km / u.s),
        v_periapsis=(speed * u.m / u.s).to(u.km / u.s),
        start_distance=(radius(t_in) * u.m).to(u.km),
        impact=level is not None,
        impact_level=level,
        impact_time=entry,
        frame="trajectory" if epoch is None else "ICRF",
        forces=(
            f"orbit: given trajectory, {len(t)} samples",
            f"tide: {body.name}",
            *([f"tide: {body.name} J2"] if j2 else []),
        ),
        left_out=tuple(row for row in left_out(body, q, j2) if not row[0].startswith("orbit:")),
        tide_error=error,
        t_start=t_in,
        t_stop=stop,
        tide=panels,
        track=track,
    )


def _panels(
    track: SampledTrack, body: Planet, j2: bool, axis: Array, start: float, stop: float, tau: float
) -> tuple[TidePanels, float]:
    """Chebyshev panels of the tide along a track, narrower until their error is below 1e-10 of the peak; that error."""

    def tide(time: Array) -> Array:
        out = np.zeros((time.size, 6))
        planet_tide(body.gm, body.j2 if j2 else 0.0, body.radius, axis, track.states(time)[:, :3], out)
        return out

    for width in (0.5, 0.25, 0.125, 0.0625):  # the third derivative of the spline jumps at every sample
        panels, error = tide_panels(tide, start, stop, tau, width=width)
        if error < 1e-10:
            break
    return panels, error


def _track(body: Planet, t: Array, states: Array) -> tuple[SampledTrack, float]:
    """The track, and the time of closest approach on the clock of the samples."""
    radial = np.einsum("ij,ij->i", states[:, :3], states[:, 3:])
    turns = np.flatnonzero((radial[:-1] < 0.0) & (radial[1:] >= 0.0))
    if not len(turns):
        raise NoEncounter(
            f"the trajectory has no closest approach to {body.name} between its first and last sample"
        )
    distance = np.linalg.norm(states[:, :3], axis=1)
    k = int(turns[np.argmin(np.minimum(distance[turns], distance[turns + 1]))])
    nearest = k if distance[k] < distance[k + 1] else k + 1

    def track(zero: float) -> SampledTrack:
        clock = t - zero
        orbit = _two_body_states(body.gm, states[nearest].copy(), clock - clock[nearest])
        d = states - orbit
        spline = CubicHermiteSpline(clock, d[:, :3], d[:, 3:])
        return SampledTrack(
            body.gm,
            states[nearest].copy(),
            float(clock[nearest]),
            float(clock[-1]),
            states[-1].copy(),
            spline,
        )

    about = track(0.0)

    def radial_speed(time: float) -> float:
        state = about.states(np.array([time]))[0]
        return float(state[:3] @ state[3:])

    zero = float(t[k + 1]) if radial[k + 1] == 0.0 else float(brentq(radial_speed, t[k], t[k + 1], xtol=1e-9))
    return track(zero), zero


def _crossing(radius: Callable[[float], float], outer: float, inner: float, level: float) -> float:
    """Time between an outer and an inner one at which the distance is `level`; the outer one if it is not reached."""
    if radius(outer) <= level:
        return outer
    return float(brentq(lambda time: radius(time) - level, outer, inner, xtol=1e-9))
