"""Integration of one orbit by RKN12(10) with its steps recorded, with the interface of that by rebound.

A second, independent integrator (:class:`flybystab.orbit.ias15.Flight` is the first): bodies from an almanac instead of
the ephemeris, another method, about 15 times as fast.
"""

from __future__ import annotations

import numpy as np

from flybystab.constants import DAY
from flybystab.core.numerics.jit import borrowed, kernel
from flybystab.core.numerics.rkn12 import N_STAGES
from flybystab.errors import NotConverged
from flybystab.orbit.closest_approach import ACCELERATION, LOG_WIDTH, STATE, TIME
from flybystab.orbit.ias15 import not_finite
from flybystab.orbit.nongravitational import NonGravitationalParameters
from flybystab.orbit.search.acceleration import Field
from flybystab.orbit.search.steps import Room, advance, begin, empty_room
from flybystab.orbit.search.track import MAX_STEPS
from flybystab.typing import Array

#: Longest step where the log is searched for minima of distance, s.
_LONGEST = 2.0 * DAY
_EVERYWHERE = (-np.inf, np.inf)


@kernel
def steps_to(
    field: Field,
    law: NonGravitationalParameters,
    t0: float,
    y0: Array,
    stop: float,
    fine: tuple[float, float],
    longest: float,
    tolerance: float,
    room: Room,
    out: Array,
) -> int:
    """Write the steps from ``t0`` (s) to ``stop`` into ``out[n, LOG_WIDTH]``, a log of steps from ``t0`` on.

    Steps that start between the two times ``fine`` are at most ``longest`` s long. Returns the number of rows: less
    than needed, so that the last is not at ``stop``, if ``out`` is too short or the step size collapsed.
    """
    field, room = borrowed(field), borrowed(room)
    k = room.k
    y = y0.copy()
    new = np.empty(6)
    h = DAY
    t = t0
    begin(field, law, t, y, room)
    for n in range(out.shape[0]):
        row = out[n]
        row[TIME] = t
        for j in range(6):
            row[STATE.start + j] = y[j]
        for j in range(3):
            row[ACCELERATION + j] = k[0, 3 + j]
        if t == stop:
            return n + 1
        if fine[0] <= t <= fine[1]:
            h = min(h, longest)
        t, h = advance(field, law, t, y, h, stop, tolerance, room, new)
        if t != t:
            return n + 1
        y[:] = new
        k[0] = k[N_STAGES]
    return out.shape[0]


class SearchFlight:
    """Integration of one orbit by RKN12(10); times, states and logs as those of :class:`flybystab.orbit.ias15.Flight`.

    Parameters
    ----------
    field, law : Field, NonGravitationalParameters
        Forces.
    t : float
        Start, s.
    state : ndarray, shape (6,)
        Barycentric position (m) and velocity (m/s) at `t`.
    tolerance : float
        Error of a step, in units of 1.5e11 m and 30 km/s.
    fine : tuple of float, optional
        Times (s) between which the log has a step every two days at least.
    """

    def __init__(
        self,
        field: Field,
        law: NonGravitationalParameters,
        t: float,
        state: Array,
        tolerance: float,
        fine: tuple[float, float] = _EVERYWHERE,
    ) -> None:
        self._forces = field, law
        self._tolerance = tolerance
        self._fine = fine
        self._room = empty_room()
        self.t, self.state = float(t), np.array(state)

    def to(self, t: float) -> Array:
        """Integrate to time `t`, s; returns the state there, shape (6,)."""
        self.log_to(t, 64)
        return self.state

    def log_to(self, t: float, rows: int = 1024) -> Array:
        """Integrate to time `t`; returns all steps: time, position, velocity, acceleration, shape (n, 10), SI.

        Raises
        ------
        NotConverged
            The step size collapsed, or `MAX_STEPS` steps were taken.
        """
        while True:
            out = np.empty((rows, LOG_WIDTH))
            count = steps_to(
                *self._forces,
                self.t,
                self.state,
                float(t),
                self._fine,
                _LONGEST,
                self._tolerance,
                self._room,
                out,
            )
            if out[count - 1, TIME] == t:
                break
            if count < rows or not np.isfinite(out[count - 1]).all():
                raise not_finite(t)
            if rows > MAX_STEPS:
                raise NotConverged(
                    f"{MAX_STEPS:,} steps taken to {out[-1, TIME] / DAY:.6g} d of {t / DAY:.6g} d"
                )
            rows *= 4
        self.t, self.state = float(t), out[count - 1, STATE].copy()
        return out[:count]
