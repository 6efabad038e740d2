"""Line of variations: orbits along the direction of largest uncertainty, and their encounters with a planet.

An orbit is given by standard normal variables z of the covariance (Milani et al. 2005). Between the epoch and the first
encounter that makes the line curve strongly, the state is a smooth function of the position on the line. Some orbits
are integrated to that time, and all others start there from a spline. In a search around 2182 for an orbit of 2011
with an encounter in 2135 this saves three quarters of the time.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import astropy.units as u
import numpy as np
from astropy.time import Time
from scipy.interpolate import CubicSpline

from flybystab.constants import DAY, YEAR
from flybystab.core.numerics.threads import in_order, worker_count
from flybystab.errors import InvalidInput
from flybystab.orbit.covariance import NONGRAV_PARAMETERS, Covariance
from flybystab.orbit.default_forces import default_forces, without_itself
from flybystab.orbit.deviations import deviated
from flybystab.orbit.ephemeris import BODIES, SUN, Ephemeris
from flybystab.orbit.epochs import later, seconds
from flybystab.orbit.orbit import Orbit
from flybystab.orbit.orbit_arguments import as_ephemeris
from flybystab.orbit.planets import Planet
from flybystab.orbit.search.acceleration import field
from flybystab.orbit.search.encounter_finder import find_encounters
from flybystab.orbit.search.neighbours import carry
from flybystab.orbit.search.steps import empty_room
from flybystab.result_table import ResultTable
from flybystab.typing import Array

#: Encounters of consecutive orbits belong together if they are less than this apart, s.
TOGETHER = 10.0 * DAY
#: Deviations of the elements from which those of the state follow, in standard deviations.
_SMALL = 1e-2
#: Nodes of the spline along the line, and its largest error over the displacement by one sigma. Integrations differ by
#: 1e-3 sigma for Bennu, whose sigma is 11 m at the epoch; a shift of the line by that amount is negligible.
_NODES, _SPLINE = 65, 5e-3
#: Largest ratio of the distances between nodes: beyond an encounter the derivatives vary along the line.
_EVEN = 1.25
#: Interval of the candidate times, s, and tolerance of the integration to them. The tolerance is at the rounding error:
#: differences of neighbouring orbits of Bennu, 0.1 m at the epoch, are smooth only then.
_PAUSE, _FINE = 0.5 * YEAR, 1e-16


class _Ahead(NamedTuple):
    """States at a time near the span, as a function of the standard normal variables z.

    Attributes
    ----------
    orbit : Orbit
        Of z = 0, at that time.
    along : CubicSpline
        State (m, m/s) less that of z = 0 by position on the line.
    across : ndarray, shape (6, n)
        Derivatives of the state by z at z = 0.
    """

    orbit: Orbit
    along: CubicSpline
    across: Array

    def deviations(self, z: Array, way: Array) -> Array:
        """States less that of z = 0, shape (m, 6); `way` is the direction of the line."""
        sigma = z @ way
        return np.asarray(self.along(sigma) + (z - sigma[:, None] * way) @ self.across.T)


class LineOfVariations:
    """Orbits of standard normal variables z, and their encounters with one planet in a span.

    Parameters
    ----------
    orbit : Orbit
        With a covariance.
    body : Planet
    start, stop : Time
        The span.
    sigmas : float
        Half length of the line, in standard deviations.
    eph, workers
        As of :func:`flybystab.find_encounters`.

    Attributes
    ----------
    way : ndarray, shape (n,)
        Direction of the line, a unit vector: that of largest uncertainty of the position at the end of the span that
        is farther from the epoch.

    Raises
    ------
    InvalidInput
        No covariance, or the line leaves the conics.
    """

    def __init__(
        self,
        orbit: Orbit,
        body: Planet,
        start: Time,
        stop: Time,
        sigmas: float,
        eph: str | Ephemeris | None,
        workers: int | None,
    ) -> None:
        covariance = orbit.covariance
        if not isinstance(covariance, Covariance):
            raise InvalidInput(
                "covariance", covariance, "a Covariance: the line of variations is that of one"
            )
        self.covariance, self.body, self.eph, self.workers = covariance, body, eph, workers
        nothing = np.zeros((1, 6)), np.zeros((1, len(NONGRAV_PARAMETERS)))
        self.orbit = deviated(orbit, covariance.epoch, *nothing, "there", eph)[0]
        self.ahead: _Ahead | None = None
        ends = [seconds(time, covariance.epoch) for time in (start, stop)]
        far = max(ends, key=abs)
        self._window = as_ephemeris(eph).window(covariance.epoch, min(far, 0.0), max(far, 0.0))
        times = np.sign(far) * np.append(np.arange(_PAUSE, abs(far), _PAUSE), abs(far))
        change = self._derivatives(times)
        self.way = np.asarray(np.linalg.svd(change[-1, :3])[2][0])
        before = ends[0] * ends[1] > 0.0
        if before and (early := np.abs(times) < min(map(abs, ends))).any():
            self.ahead = self._ahead(sigmas, times[early], change)

    def _at_epoch(self, z: Array) -> tuple[Array, Array]:
        """Deviations of the state and of the non-gravitational parameters at the epoch of the covariance."""
        parameters = self.covariance.values + z @ self.covariance.factor.T
        possible = self.covariance._possible(parameters)
        if not possible.all():
            raise InvalidInput(
                "sigmas",
                f"{np.linalg.norm(z[~possible], axis=1).min():.3g}",
                "fewer standard deviations: this far from the nominal orbit the elements are not those of a conic",
            )
        return self.covariance.deviations(parameters)

    def _carried(self, z: Array, times: Array) -> Array:
        """Barycentric states (m, m/s), shape (m, times, 6), of the orbits of z; nan where an integration failed."""
        orbits = deviated(self.orbit, self.covariance.epoch, *self._at_epoch(z), "node", self.eph)
        window = self._window
        forces = without_itself(default_forces(self.orbit, *BODIES), self.orbit, window)
        acting = field(window, [name for name in forces if name != "non-gravitational"])

        def carried(orbit: Orbit) -> Array:
            out = np.full((times.size, 6), np.nan)
            carry(
                acting,
                orbit.nongrav.parameters,
                0.0,
                orbit.barycentric(window),
                times,
                _FINE,
                empty_room(),
                out,
            )
            return out

        return np.array(list(in_order(carried, orbits, worker_count(self.workers))))

    def _derivatives(self, times: Array) -> Array:
        """Derivatives of the state by z at z = 0, shape (times, 6, n), up to the last time that all orbits reach."""
        pairs = _SMALL * np.eye(len(self.covariance.names))
        plus, minus = np.split(self._carried(np.concatenate([pairs, -pairs]), times), 2)
        change = (0.5 * (plus - minus) / _SMALL).transpose(1, 2, 0)
        lost = ~np.isfinite(change).all(axis=(1, 2))
        return np.asarray(change[: int(np.argmax(lost))] if lost.any() else change)

    def _ahead(self, sigmas: float, times: Array, change: Array) -> _Ahead | None:
        """The last of the times at which a spline describes the line; None without one.

        The spline through every second node has to give the others within `_SPLINE` of the displacement by one sigma,
        and the distances between nodes have to be equal within a factor of `_EVEN`.
        """
        nodes = np.linspace(-sigmas, sigmas, _NODES)
        states = self._carried(nodes[:, None] * self.way, times)
        for k in range(min(times.size, len(change)) - 1, -1, -1):
            places = states[:, k, :3]
            if not np.isfinite(places).all():
                continue
            rest = CubicSpline(nodes[::2], places[::2])(nodes[1::2]) - places[1::2]
            gaps = np.linalg.norm(np.diff(places, axis=0), axis=1)
            if gaps.max() > _EVEN * gaps.min():
                continue
            if np.linalg.norm(rest, axis=1).max() < _SPLINE * gaps.min() / (nodes[1] - nodes[0]):
                break
        else:
            return None
        middle = states[_NODES // 2, k]
        state = middle - self._window.states(SUN, times[k : k + 1])[0]
        base = replace(
            self.orbit,
            epoch=later(self.covariance.epoch, float(times[k])),
            position=state[:3] * u.m,
            velocity=state[3:] * (u.m / u.s),
            centre="sun",
            covariance=None,
        )
        return _Ahead(base, CubicSpline(nodes, states[:, k] - middle), change[k])

    def orbits(self, z: Array) -> tuple[Orbit, ...]:
        """Orbits of z, shape (m, n)."""
        states, pushes = self._at_epoch(z)
        if self.ahead is None:
            return deviated(self.orbit, self.covariance.epoch, states, pushes, "variation", self.eph)
        base = self.ahead.orbit
        return deviated(base, base.epoch, self.ahead.deviations(z, self.way), pushes, "variation", self.eph)

    def encounters(self, z: Array, start: Time, stop: Time, within: float) -> ResultTable:
        """Encounters of the orbits of z, shape (m, n)."""
        orbits = self.orbits(z)
        table = find_encounters(
            orbits, start, stop, [self.body.name], within * u.m, ephemeris=self.eph, workers=self.workers
        )
        return table[table["planet"] == self.body.name]

    def near(self, z: Array, time: Time, within: float) -> Array:
        """Time (s from `time`), distance (m), b (m), v_inf (m/s) of the encounter nearest to a time, or nan."""
        table = self.encounters(z, later(time, -TOGETHER), later(time, TOGETHER), within)
        out = np.full((len(z), 5), np.nan)
        late = np.array([seconds(t, time) for t in table["time"]])
        for row in np.argsort(-np.abs(late)):
            one = table[row]
            place = [one[k].to_value(u.m) for k in ("distance", "b_t", "b_r")]
            out[one["index"]] = late[row], *place, one["v_inf"].to_value(u.m / u.s)
        return out
