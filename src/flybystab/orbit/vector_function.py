"""Orbits as vector functions of skyfield, which can be observed like any planet.

An orbit becomes a function of time relative to the Sun (NAIF 10) or to the barycentre of the solar system (0), ICRF.
``ephemeris_file(...)["sun"] + orbit.to_skyfield()`` is a target for ``observe``, as a comet of skyfield is. The path is
that of :meth:`flybystab.orbit.orbit.Orbit.at`: all forces, IAS15 at the tighter tolerance.
"""

from __future__ import annotations

import numpy as np
from skyfield.api import load_file
from skyfield.jpllib import SpiceKernel
from skyfield.timelib import Time
from skyfield.vectorlib import VectorFunction

from flybystab.constants import AU, DAY
from flybystab.errors import InvalidInput
from flybystab.orbit.closest_approach import STATE, TIME
from flybystab.orbit.default_forces import default_forces, without_itself
from flybystab.orbit.ephemeris import BODIES, SUN, Ephemeris, Window, ephemeris
from flybystab.orbit.forces import model
from flybystab.orbit.ias15 import TIGHT, Flight
from flybystab.orbit.orbit import Orbit
from flybystab.typing import Array

#: NAIF numbers of the possible centres of a path.
CENTRES = {"sun": 10, "ssb": 0}
#: The ephemeris is read this far beyond the requested times, s: light time and its iteration stay inside.
_MARGIN = 10.0 * DAY


def ephemeris_file(name: str | Ephemeris | None = None) -> SpiceKernel:
    """The file of an ephemeris as skyfield opens it, for observers and other targets.

    Parameters
    ----------
    name : str or Ephemeris, optional
        The best one installed by default.

    Returns
    -------
    skyfield.jpllib.SpiceKernel
    """
    return load_file(str((name if isinstance(name, Ephemeris) else ephemeris(name)).path))


def whole_and_fraction(t: Time) -> tuple[Array, Array]:
    """TDB of skyfield times as whole and fractional Julian dates, without loss of digits."""
    return np.atleast_1d(np.asarray(t.whole, dtype=float)), np.atleast_1d(
        np.asarray(t.tdb_fraction, dtype=float)
    )


def shaped(states: Array, t: Time) -> tuple[Array, Array, None, None]:
    """States (m, m/s), shape (n, 6), in the form of skyfield: au and au/d, shape (3,) or (3, n)."""
    r, v = states[:, :3].T / AU, states[:, 3:].T * (DAY / AU)
    if np.ndim(t.tt) == 0:
        r, v = r[:, 0], v[:, 0]
    return r, v, None, None


class OrbitVector(VectorFunction):
    """The path of an orbit, integrated to the requested times.

    Parameters
    ----------
    orbit : Orbit
    centre : {"sun", "ssb"}
    eph : Ephemeris
    """

    def __init__(self, orbit: Orbit, centre: str, eph: Ephemeris) -> None:
        if centre not in CENTRES:
            raise InvalidInput("centre", centre, f"one of {', '.join(CENTRES)}")
        self.center = CENTRES[centre]
        self.target = orbit.name or "asteroid"
        self.ephemeris = eph
        self._orbit = orbit
        self._window: Window | None = None
        #: Log of integration steps before (-1) and after (1) the epoch.
        self._logs: dict[float, Array] = {}

    @property
    def target_name(self) -> str:
        """Name of the asteroid."""
        return str(self.target)

    def _cover(self, low: float, high: float) -> Window:
        """Integrate as far as times from `low` to `high` (s from the epoch of the orbit); the ephemeris there."""
        window = self._window
        if window is None or low < window.start or high > window.stop:
            eph, zero = self.ephemeris, self._orbit.epoch.tdb
            ends = [(jd - zero.jd1 - zero.jd2) * DAY for jd in (eph.start_jd, eph.stop_jd)]
            start, stop = min(low, 0.0), max(high, 0.0)
            if window is not None:
                start, stop = min(start, window.start), max(stop, window.stop)
            start = max(start - _MARGIN, min(ends[0] + 1.0, start))
            stop = min(stop + _MARGIN, max(ends[1] - 1.0, stop))
            window = self._window = eph.window(self._orbit.epoch, start, stop)
            self._logs = {
                side: self._orbit.flight(window, epsilon=TIGHT).log_to(end)
                for side, end in ((-1.0, start), (1.0, stop))
                if end != 0.0
            }
        return window

    def states(self, t: Array) -> Array:
        """Barycentric states (m, m/s), shape (n, 6), at `t` s (TDB) from the epoch of the orbit."""
        window = self._cover(float(t.min()), float(t.max()))
        out = np.empty((t.size, 6))
        forces = without_itself(default_forces(self._orbit, *BODIES), self._orbit, window)
        flat = model(window, forces, self._orbit.nongrav)
        for side in (-1.0, 1.0):
            which = np.flatnonzero(t * side >= 0.0 if side > 0.0 else t < 0.0)
            if which.size == 0:
                continue
            order = which[np.argsort(side * t[which])]
            log = self._logs[side]
            row = max(int(np.searchsorted(side * log[:, TIME], side * t[order[0]], side="right")) - 1, 0)
            flight = Flight(flat, float(log[row, TIME]), log[row, STATE], TIGHT)
            for i in order:
                out[i] = flight.to(float(t[i])) if t[i] != flight.t else flight.state
        return out

    def _at(self, t: Time) -> tuple[Array, Array, None, None]:
        whole, fraction = whole_and_fraction(t)
        zero = self._orbit.epoch.tdb
        seconds = ((whole - zero.jd1) + (fraction - zero.jd2)) * DAY
        states = self.states(seconds)
        if self.center == CENTRES["sun"]:
            assert self._window is not None
            states = states - self._window.states(SUN, seconds)
        return shaped(states, t)
