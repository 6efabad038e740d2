"""Errors of orbits at their encounters, by state transition matrices, or by sigma points outside their linear range.

The variational equations (:mod:`flybystab.orbit.search.variational`) give the covariance at every later time in one
integration. The linear theory holds while the displacements are small compared with the distances over which the forces
change. Where they are not, the sigma points of the covariance are integrated instead.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import astropy.units as u
import numpy as np
from astropy.table import QTable
from numpy.typing import NDArray

from flybystab.constants import DAY, YEAR
from flybystab.core.numerics.jit import borrowed, kernel
from flybystab.core.numerics.rkn12 import N_STAGES
from flybystab.core.numerics.threads import in_order
from flybystab.orbit.covariance import NONGRAV_PARAMETERS
from flybystab.orbit.elements import GM_SUN
from flybystab.orbit.ephemeris import SUN, Window
from flybystab.orbit.epochs import seconds
from flybystab.orbit.kepler import two_body
from flybystab.orbit.nongravitational import NONE, NonGravitationalParameters, deviated, parameters_of
from flybystab.orbit.planets import planet
from flybystab.orbit.predictability import Deviations, predictability, undisturbed_error
from flybystab.orbit.search.acceleration import Field
from flybystab.orbit.search.steps import Room, advance, begin, empty_room
from flybystab.orbit.search.variational import carry_with_deviations
from flybystab.typing import Array

#: Differences (m) of two-body motion, tolerance of the search for the encounter in an interval, longest interval, s.
_STEP, _LOOSE, _INTERVAL = 1e4, 1e-10, 0.25 * YEAR
#: Tolerance of state transition matrices; it can be larger than for differences of orbits.
_FINE = 1e-11
#: Largest displacement for the linear theory, over the distance from the nearest body at any time before.
_LINEAR = 0.02
#: An interval contains an encounter if its transition matrix exceeds that of two-body motion by this factor.
AMPLIFIED = 2.0


@kernel
def carry(
    field: Field,
    law: NonGravitationalParameters,
    t0: float,
    y0: Array,
    times: Array,
    tolerance: float,
    room: Room,
    out: Array,
) -> int:
    """Write barycentric states (m, m/s) at ``times`` (s), in order away from ``t0``, into ``out[n, 6]``.

    Steps as in :func:`flybystab.orbit.search.track.track_encounters`. Returns the number written.
    """
    field, room = borrowed(field), borrowed(room)
    k = room.k
    y = y0.copy()
    new = np.empty(6)
    h = DAY
    t = t0
    begin(field, law, t, y, room)
    for n in range(times.size):
        while t != times[n]:
            t, h = advance(field, law, t, y, h, times[n], tolerance, room, new)
            if t != t:  # the step size collapsed
                return n
            y[:] = new
            k[0] = k[N_STAGES]
        out[n] = y
    return times.size


@kernel
def two_body_growth(state: Array, t: float) -> float:
    """Frobenius norm of the state transition matrix of two-body motion from a heliocentric state (m, m/s) over `t` s.

    Velocities count as m by the angular velocity v/r of the state.
    """
    speed = np.sqrt(state[3] ** 2 + state[4] ** 2 + state[5] ** 2)
    per = speed / np.sqrt(state[0] ** 2 + state[1] ** 2 + state[2] ** 2)
    there = two_body(GM_SUN, state, t)
    total = 0.0
    moved = state.copy()
    for j in range(6):
        moved[j] = state[j] + (_STEP if j < 3 else _STEP * per)
        other = two_body(GM_SUN, moved, t)
        moved[j] = state[j]
        for i in range(6):
            total += ((other[i] - there[i]) / (_STEP if i < 3 else _STEP * per)) ** 2
    return np.sqrt(total)


@dataclass(frozen=True)
class Spread:
    """Errors of an orbit at times of encounters, each of shape (n,).

    Attributes
    ----------
    displacement : ndarray
        One sigma in the direction of the largest error, m; inf if a displaced orbit could not be integrated.
    growth : ndarray
        Its ratio to the displacement at the epoch of the covariance.
    model_error : ndarray
        Displacement by ephemeris, masses, tolerance and neglected forces, m, amplified by the encounters before.
    passed : ndarray of bool
        True if there is such an encounter.
    """

    displacement: Array
    growth: Array
    model_error: Array
    passed: NDArray[np.bool_]


def spread(
    beside: Deviations,
    field: Field,
    law: NonGravitationalParameters,
    window: Window,
    times: Array,
    tolerance: float,
) -> Spread:
    """Errors of an orbit at `times` (s from the epoch of the window) with all forces of `field`.

    The displacement is the square root of the largest eigenvalue of the covariance of the position, propagated by the
    state transition matrix. Once it exceeds 2 % of the distance from the nearest body, the second moment of the sigma
    points about the orbit replaces the covariance. The error of the model before an encounter is amplified by the mean
    over displacements along the axes of phase space.

    Parameters
    ----------
    beside : Deviations
    field, law : Field, NonGravitationalParameters
        Forces.
    window : Window
    times : ndarray, shape (n,)
    tolerance : float
        Of a step.
    """
    start = seconds(beside.orbit.epoch, window.epoch)
    if law == NONE:  # no non-gravitational acceleration, but its parameters can have errors
        law = beside.orbit.nongrav.parameters
    states, parameters = beside.states.reshape(-1, 6), beside.parameters.reshape(-1, len(NONGRAV_PARAMETERS))
    # Half of the difference of a pair: a column of the root of the covariance, or the shift itself.
    ways = 0.5 * (beside.states[0] - beside.states[1])
    more = 0.5 * (beside.parameters[0] - beside.parameters[1])
    active = np.flatnonzero(np.abs(more).max(axis=0))
    displacement = np.full(times.size, np.inf)
    model_error = np.full(times.size, np.inf)
    for side in (times >= start, times < start):
        rows = np.flatnonzero(side)
        if not rows.size:
            continue
        grid, at = _grid(start, times[rows])
        base = np.full((grid.size, 6), np.nan)
        change = np.full((grid.size, 6, 6 + active.size), np.nan)
        units = np.eye(len(NONGRAV_PARAMETERS))[active]
        state = beside.orbit.barycentric(window)
        carry_with_deviations(field, law, start, state, grid, _FINE, empty_room(), units, base, change)
        sigma = _along(ways.T, more[:, active].T, change)
        encounters = _encounters(field, law, window, grid, base, change)
        linear = _sizes(sigma)
        displacement[rows] = linear[at]
        wide = [*np.flatnonzero(linear > _LINEAR * _clearance(window, grid, base))]
        wide += [p.interval + 1 for p in encounters if linear[p.interval] > _LINEAR * p.distance]
        bent = at >= min(wide, default=grid.size)
        if beside.scale == 1.0 and bent.any():  # a shift scaled to a metre is always linear
            displacement[rows[bent]] = _by_points(
                field, law, window, start, state, states, parameters, grid[at[bent]], tolerance
            )
        model_error[rows] = _grown_error(field, law, grid, change, encounters, at)
    displacement *= beside.scale
    shift = beside.scale * float(np.linalg.norm(ways[:, :3], 2))
    passed = model_error > undisturbed_error(times - start)
    return Spread(displacement, displacement / max(shift, 1.0), model_error, passed)


def _grid(start: float, times: Array) -> tuple[Array, NDArray[np.intp]]:
    """Times of matrices in order away from `start`, on one side of it, and where `times` are among them."""
    far = times[np.argmax(np.abs(times - start))]
    # Times that do not depend on the farthest one, so that neither does the error of the model.
    regular = start + np.sign(far - start) * np.arange(0.0, abs(far - start), _INTERVAL)
    grid = np.unique(np.concatenate([[start], regular, times]))
    grid = grid if far >= start else grid[::-1]
    return grid, np.searchsorted(np.abs(grid - start), np.abs(times - start))


def _along(states: Array, parameters: Array, change: Array) -> Array:
    """Deviations, shape (n, 6, m), at the times of matrices.

    Parameters
    ----------
    states, parameters : ndarray, shapes (6, m) and (q, m)
        Deviations at the start: state, and the parameters that have a column in `change`.
    change : ndarray, shape (n, 6, 6 + q)
        Deviations at the next time that result from unit deviations at each time.
    """
    out = np.empty((len(change), *states.shape))
    now = states
    for n, matrix in enumerate(change):
        now = matrix[:, :6] @ now + matrix[:, 6:] @ parameters
        out[n] = now
    return out


def _sizes(deviations: Array) -> Array:
    """Largest principal displacement, m, shape (n,), of deviations of shape (n, 6, m); inf if not finite."""
    out = np.full(len(deviations), np.inf)
    known = np.isfinite(deviations).all(axis=(1, 2))
    out[known] = np.linalg.norm(deviations[known, :3], 2, axis=(1, 2))
    return out


def _by_points(
    field: Field,
    law: NonGravitationalParameters,
    window: Window,
    start: float,
    state: Array,
    states: Array,
    parameters: Array,
    times: Array,
    tolerance: float,
) -> Array:
    """Largest principal displacement of sigma points at `times`, m, shape (n,)."""

    def follow(deviation: Array, more: Array) -> Array:
        out = np.full((times.size, 6), np.nan)
        carry(field, deviated(law, more), start, state + deviation, times, tolerance, empty_room(), out)
        return out[:, :3]

    base = follow(np.zeros(6), np.zeros(len(NONGRAV_PARAMETERS)))
    return _largest(np.array([follow(*point) for point in zip(states, parameters, strict=True)]) - base)


def _largest(gaps: Array) -> Array:
    """Largest principal displacement, shape (n,), of pairs of points, shape (2 k, n, 3); inf if one is not finite."""
    pairs = np.transpose(gaps, (1, 0, 2))
    out = np.full(len(pairs), np.inf)
    for k, points in enumerate(pairs):
        if np.isfinite(points).all():
            out[k] = np.linalg.norm(points, 2) / np.sqrt(2.0)
    return out


def _clearance(window: Window, t: Array, states: Array) -> Array:
    """Distance from the nearest body of the ephemeris, m, shape (n,)."""
    places = np.array([window.states(body, t)[:, :3] for body in range(len(window.gm))])
    return np.asarray(np.linalg.norm(states[:, :3] - places, axis=2).min(axis=0))


@dataclass(frozen=True)
class _Encounter:
    """An earlier encounter: its interval of the grid, and time, state and distance (s, m, m/s) just before it."""

    interval: int
    t: float
    state: Array
    distance: float


def _encounters(
    field: Field, law: NonGravitationalParameters, window: Window, grid: Array, base: Array, change: Array
) -> list[_Encounter]:
    """Intervals of the grid whose state transition matrix exceeds that of two-body motion by :data:`AMPLIFIED`."""
    helio = base - window.states(SUN, grid)
    out = []
    for i in range(grid.size - 1):
        per = np.linalg.norm(helio[i, 3:]) / np.linalg.norm(helio[i, :3])
        unit = np.array([1.0, 1.0, 1.0, per, per, per])
        matrix = change[i + 1, :, :6] * unit / unit[:, None]
        if np.linalg.norm(matrix) >= AMPLIFIED * two_body_growth(helio[i], grid[i + 1] - grid[i]):
            out.append(_Encounter(i, *_before_encounter(field, law, window, grid[i], grid[i + 1], base[i])))
    return out


def _grown_error(
    field: Field,
    law: NonGravitationalParameters,
    grid: Array,
    change: Array,
    encounters: Sequence[_Encounter],
    at: NDArray[np.intp],
) -> Array:
    """Error of the force model, m, at ``grid[at]``: the largest of the amplified errors before the encounters."""
    out = undisturbed_error(grid[at] - grid[0])
    for encounter in encounters:
        end = encounter.interval + 1
        rest = np.full((1, 6, 6), np.nan)
        there = np.empty((1, 6))
        nothing = np.zeros((0, len(NONGRAV_PARAMETERS)))
        when = grid[end : end + 1]
        carry_with_deviations(
            field, law, encounter.t, encounter.state, when, _FINE, empty_room(), nothing, there, rest
        )
        unit = np.ones(6)
        unit[3:] = np.linalg.norm(encounter.state[3:]) / np.linalg.norm(encounter.state[:3])
        since = _along(np.diag(unit), np.zeros((0, 6)), np.concatenate([rest, change[end + 1 :, :, :6]]))
        # Mean over directions in phase space.
        growth = np.linalg.norm(since[:, :3], axis=(1, 2)) / np.sqrt(6.0)
        growth[~np.isfinite(growth)] = np.inf
        later = at > encounter.interval
        grown = undisturbed_error(encounter.t - grid[0]) * growth[at[later] - end]
        out[later] = np.maximum(out[later], grown)
    return out


def _before_encounter(
    field: Field, law: NonGravitationalParameters, window: Window, begin: float, end: float, state: Array
) -> tuple[float, Array, float]:
    """Time (s) and state before the largest attraction by a planet in an interval, and the distance then (m)."""
    times = np.linspace(begin, end, 65)
    states = np.full((times.size, 6), np.nan)
    carry(field, law, begin, state, times, _LOOSE, empty_room(), states)
    pull, distance = np.zeros(times.size), np.full(times.size, np.inf)
    for body, gm in enumerate(window.gm):
        if body != SUN:
            away = np.linalg.norm(states[:, :3] - window.states(body, times)[:, :3], axis=1)
            distance = np.where(gm / away**2 > pull, away, distance)
            pull = np.maximum(pull, gm / away**2)
    nearest = int(np.nanargmax(pull))
    before = max(nearest - 1, 0)
    return float(times[before]), states[before], float(distance[nearest])


def add_growth(
    table: QTable,
    times: Array,
    beside: Mapping[int, Deviations],
    laws: Array,
    window: Window,
    field_of: Callable[[int], Field],
    tolerance: float,
    threads: int,
) -> None:
    """Add to a table of encounters ``displacement``, ``model_error`` (km), ``growth`` and ``predictability``.

    Displacement: :class:`Spread`, at closest approach or, for an impact, at the entry. Growth: displacement over that
    at the epoch. Model error: displacement by the errors of ephemeris and tolerance and by neglected forces.

    Parameters
    ----------
    table : QTable
        From :func:`flybystab.find_encounters`.
    times : ndarray
        Of the rows: closest approach, or entry of an impact, s from the epoch of the window.
    beside : mapping
        Deviations by number of the asteroid, for each asteroid in the table.
    laws : ndarray, shape (n, N_LAW)
        Non-gravitational acceleration of each asteroid: rows of
        :class:`flybystab.orbit.nongravitational.NonGravitationalParameters`.
    window, tolerance
        Of the search.
    field_of : callable
        Function from the number of an asteroid to the forces on it.
    """
    index = np.asarray(table["index"])
    out = np.full((3, len(table)), np.nan)

    def one(i: int) -> None:
        rows = np.flatnonzero(index == i)
        found = spread(beside[i], field_of(i), parameters_of(laws[i]), window, times[rows], tolerance)
        out[:, rows] = found.displacement, found.growth, found.model_error

    for _ in in_order(one, np.unique(index).tolist(), threads):
        pass
    scale = np.array([planet(name).impact_distance for name in table["planet"]])
    size = np.maximum(table["distance"].to_value(u.m), np.where(table["impact"], scale, 0.0))
    table["displacement"] = (out[0] * u.m).to(u.km)
    table["growth"] = out[1]
    table["model_error"] = (out[2] * u.m).to(u.km)
    table["predictability"] = np.array(
        [
            str(predictability(d, x, m, known=beside[i].known))
            for d, x, m, i in zip(size, out[0], out[2], index.tolist(), strict=True)
        ],
        dtype="U12",
    )
    table.meta["neighbours"] = sorted({n.label for n in beside.values()})
