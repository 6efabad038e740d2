"""Orbit of an asteroid: its propagation with all forces, and the orbits of its covariance."""

from __future__ import annotations

import warnings
from dataclasses import replace
from typing import TYPE_CHECKING

import astropy.units as u
import numpy as np
from astropy.time import Time
from astropy.units import Quantity

from flybystab.arguments import check_arguments
from flybystab.errors import Impact, InaccurateOrbit, InvalidInput
from flybystab.orbit.barycentre import barycentre_in
from flybystab.orbit.closest_approach import first_contact
from flybystab.orbit.covariance import NONGRAV_PARAMETERS, Covariance
from flybystab.orbit.default_forces import default_forces, without_itself
from flybystab.orbit.deviations import deviated
from flybystab.orbit.ephemeris import BODIES, Ephemeris, Window
from flybystab.orbit.epochs import checked_epoch, later, seconds
from flybystab.orbit.forces import model
from flybystab.orbit.ias15 import EPSILON, TIGHT, Flight
from flybystab.orbit.orbit_arguments import as_ephemeris, checked_centre, checked_count
from flybystab.orbit.osculating_state import OsculatingState
from flybystab.orbit.planets import PLANETS
from flybystab.orbit.state_transition import StateTransition, derivatives
from flybystab.typing import Array
from flybystab.units import whole

if TYPE_CHECKING:
    from flybystab.orbit.vector_function import OrbitVector

#: Difference of two integrations above which a warning is given, m.
_LARGE_ERROR = 1e3


class Orbit(OsculatingState):
    """State of an asteroid at an epoch, with its non-gravitational acceleration.

    Made by :meth:`from_elements` or :meth:`from_state`.

    Attributes
    ----------
    epoch : Time
        TDB.
    position, velocity : Quantity
        Shape (3,), ICRF axes, relative to `centre`.
    centre : str
        ``"ssb"`` (barycentre of the solar system of DE440), ``"sun"``, ``"earth"`` or another body.
    nongrav : NonGravitational
        A1, A2, A3, their dependence on distance, DT, and radiation pressure.
    name : str
        Free text, shown in tables.
    covariance : Covariance or None
        Of the elements; see :meth:`clones`.
    """

    @check_arguments
    def flight(
        self, window: Window, forces: tuple[str, ...] | None = None, epsilon: float = EPSILON
    ) -> Flight:
        """An integration by rebound that starts at the epoch of the orbit; times are seconds from ``window.epoch``."""
        if forces is not None and not (
            isinstance(forces, list | tuple) and all(isinstance(f, str) for f in forces)
        ):
            raise InvalidInput("forces", forces, "names of forces")
        chosen = forces if forces is not None else without_itself(default_forces(self, *BODIES), self, window)
        return Flight(
            model(window, chosen, self.nongrav),
            seconds(self.epoch, window.epoch),
            self.barycentric(window),
            epsilon,
        )

    @check_arguments
    def at(
        self, time: Time, centre: str = "sun", ephemeris: str | Ephemeris | None = None
    ) -> tuple[Quantity, Quantity]:
        """Position and velocity at another time, ICRF, relative to `centre`, with all forces.

        The orbit is integrated twice, with tolerances a factor of 100 apart; the tighter result is returned.

        Parameters
        ----------
        time : Time
            Any scale; TDB is used.
        centre : str
            ``"sun"``, ``"ssb"`` (the barycentre of DE440 with any ephemeris), or a body of the ephemeris.
        ephemeris : str or Ephemeris, optional
            The best one installed by default.

        Returns
        -------
        position, velocity : Quantity
            Shape (3,), km and km/s.

        Raises
        ------
        OutOfSpan
            The ephemeris does not cover the epoch or the time.
        Impact
            The asteroid hits the Sun, a planet or the Moon on the way.

        Warns
        -----
        InaccurateOrbit
            The two integrations differ by more than 1 km at `time`, as after a close encounter that amplifies
            rounding errors. Errors of the elements and of the force model are not included.
        """
        where = checked_centre(centre)
        window, t = self._window_to(time, ephemeris)
        state = self.barycentric(window)
        if t != 0.0:
            state = self._propagated(window, t)
        at = np.array([t])
        state = (
            state
            - (barycentre_in(window, at) if where == "ssb" else window.states(BODIES.index(where), at))[0]
        )
        return (state[:3] * u.m).to(u.km), (state[3:] * u.m / u.s).to(u.km / u.s)

    def _window_to(self, time: Time, ephemeris: str | Ephemeris | None) -> tuple[Window, float]:
        """Ephemeris from the epoch of the orbit to another time, and that time in s from the epoch."""
        t = seconds(checked_epoch(time), self.epoch)
        return as_ephemeris(ephemeris).window(self.epoch, min(t, 0.0), max(t, 0.0)), t

    def _propagated(self, window: Window, t: float) -> Array:
        """Barycentric state (m, m/s), shape (6,), at `t` s from the epoch of the window; errors as :meth:`at`."""
        flight = self.flight(window, epsilon=TIGHT)
        log = flight.log_to(t)
        hit = first_contact(log, window, np.array([PLANETS[name].impact_distance for name in BODIES]))
        if hit is not None:
            raise Impact(
                f"{self.name or 'the orbit'} hits {BODIES[hit[1]]} at {later(window.epoch, hit[0]).iso} TDB, before "
                f"{later(window.epoch, t).iso}"
            )
        error = float(np.linalg.norm(self.flight(window).to(t)[:3] - flight.state[:3]))
        if error > _LARGE_ERROR:
            warnings.warn(
                f"{self.name or 'the orbit'} at {later(window.epoch, t).iso} TDB: two integrations differ by "
                f"{error / 1e3:.3g} km",
                InaccurateOrbit,
                stacklevel=3,
            )
        return flight.state

    @check_arguments
    def state_transition(self, time: Time, ephemeris: str | Ephemeris | None = None) -> StateTransition:
        """Derivatives of the state at another time by the state at the epoch and the non-gravitational parameters.

        The variational equations are integrated with the orbit and all its forces, twice, with tolerances a factor of
        100 apart (:mod:`flybystab.orbit.state_transition`).

        Parameters
        ----------
        time : Time
            Any scale; TDB is used.
        ephemeris : str or Ephemeris, optional
            The best one installed by default.

        Returns
        -------
        StateTransition
            With the attributes `matrix`, `parameters` and `error`.

        Raises
        ------
        OutOfSpan
            The ephemeris does not cover the epoch or the time.
        Impact
            The asteroid hits the Sun, a planet or the Moon on the way.
        """
        window, t = self._window_to(time, ephemeris)
        if t != 0.0:
            self._propagated(window, t)
        forces = without_itself(default_forces(self, *BODIES), self, window)
        found, error = derivatives(
            model(window, forces, self.nongrav),
            self.nongrav.parameters,
            0.0,
            self.barycentric(window),
            window.states(BODIES.index("sun"), np.zeros(1))[0],
            t,
        )
        return StateTransition(self.epoch.tdb, later(self.epoch, t), found[:, :6], found[:, 6:], error)

    @check_arguments
    def covariance_at(self, time: Time, ephemeris: str | Ephemeris | None = None) -> Covariance:
        """Covariance of the heliocentric state at another time, to first order.

        Valid if one sigma is small compared with the scale on which the forces change; after a close encounter compare
        with :meth:`clones`.

        Parameters
        ----------
        time, ephemeris
            As in :meth:`state_transition`.

        Returns
        -------
        Covariance
            Of x, y, z, vx, vy, vz (ICRF) and of the non-gravitational parameters that were estimated.

        Raises
        ------
        InvalidInput
            The orbit has no covariance.
        OutOfSpan, Impact
        """
        known = self._known("a covariance at another time").as_state()
        there = deviated(
            self, known.epoch, np.zeros((1, 6)), np.zeros((1, len(NONGRAV_PARAMETERS))), "", ephemeris
        )[0]
        change = there.state_transition(time, ephemeris)
        extra = [name for name in NONGRAV_PARAMETERS if name in known.names]
        full = np.eye(6 + len(extra))
        full[:6, :6] = change.matrix
        full[:6, 6:] = change.parameters[:, [NONGRAV_PARAMETERS.index(name) for name in extra]]
        matrix = full @ known.matrix @ full.T
        r, v = there.at(time, "sun", ephemeris)
        mean = np.concatenate([r.to_value(u.m), v.to_value(u.m / u.s), known.values[6:]])
        return replace(
            known,
            epoch=change.time,
            values=mean,
            matrix=0.5 * (matrix + matrix.T),
            centre="sun",
            frame="ICRF",
        )

    @check_arguments
    def to_skyfield(self, centre: str = "sun", ephemeris: str | Ephemeris | None = None) -> OrbitVector:
        """Position as a vector function of skyfield, with all forces.

        Parameters
        ----------
        centre : {"sun", "ssb"}
            Origin of the vectors, ICRF.
        ephemeris : str or Ephemeris, optional
            For the forces. Use the same for the observer and light time; it is opened by
            :func:`flybystab.orbit.vector_function.ephemeris_file`.

        Returns
        -------
        skyfield.vectorlib.VectorFunction
            Add it to the Sun of an ephemeris file to observe it: ``file["sun"] + orbit.to_skyfield()``.
        """
        from flybystab.orbit.vector_function import OrbitVector

        return OrbitVector(self, str(centre).lower(), as_ephemeris(ephemeris))

    @check_arguments
    def clones(
        self,
        n: int,
        seed: int = 0,
        ephemeris: str | Ephemeris | None = None,
        first: int = 0,
        last: int | None = None,
    ) -> tuple[Orbit, ...]:
        """Orbits drawn from the covariance, at its epoch.

        The deviations from the mean of the covariance are added to this orbit, propagated to the epoch of the
        covariance with all forces if that differs. Estimated non-gravitational parameters are drawn with the elements.

        Parameters
        ----------
        n : int
            Number of clones.
        seed : int
            Clone k depends on the seed and k alone.
        ephemeris : str or Ephemeris, optional
            For the propagation to the epoch of the covariance.
        first, last : int
            Only numbers `first` to ``last - 1`` of the `n`.

        Raises
        ------
        InvalidInput
            The orbit has no covariance.
        OutOfSpan
            The ephemeris does not cover the epoch of the covariance.
        """
        covariance = self._known("clones")
        parameters, _ = covariance.samples(checked_count(n), whole(seed, "seed", 0))
        found = covariance.deviations(parameters[first:last])
        return deviated(self, covariance.epoch, *found, "clone", ephemeris, first)

    @check_arguments
    def sigma_points(self, ephemeris: str | Ephemeris | None = None) -> tuple[tuple[Orbit, ...], ...]:
        """Pairs of orbits, plus and minus one sigma along each principal axis of the correlations.

        Half of the difference of a pair at any later time is a column of F, and the covariance there is ``F F^T``
        to first order. Half of the sum less the nominal value is the second-order term.
        """
        covariance = self._known("sigma points")
        ways = covariance.factor.T
        steps = np.concatenate([covariance.values + ways, covariance.values - ways])
        found = deviated(self, covariance.epoch, *covariance.deviations(steps), "sigma point", ephemeris)
        return tuple(zip(found[: len(ways)], found[len(ways) :], strict=True))

    def _known(self, what: str) -> Covariance:
        """The covariance; raises InvalidInput, which names `what`, if there is none."""
        if not isinstance(self.covariance, Covariance):
            raise InvalidInput("covariance", self.covariance, f"a Covariance: {what} are drawn from it")
        return self.covariance
