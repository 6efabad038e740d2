"""A close encounter of an asteroid with a planet, and the inputs from which it is made."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import astropy.units as u
import numpy as np
from astropy.time import Time
from astropy.units import Quantity

from flybystab.arguments import check_arguments
from flybystab.constants import C_LIGHT
from flybystab.encounter.encounter_arguments import checked_start, unit_vector
from flybystab.encounter.encounter_path import EncounterPath
from flybystab.encounter.reach import SETTLE, far_enough
from flybystab.errors import InvalidInput
from flybystab.orbit.ephemeris import BODIES, Ephemeris
from flybystab.orbit.orbit import Orbit
from flybystab.orbit.planets import Planet
from flybystab.orbit.planets import planet as find_planet
from flybystab.units import checked_time, to_si

if TYPE_CHECKING:
    from flybystab.encounter.trajectory_files import Samples


class Encounter(EncounterPath):
    """A close encounter with one planet.

    An encounter is built on a two-body hyperbola (:meth:`hyperbolic`: a scripted encounter, frame ``"periapsis"``),
    from a heliocentric orbit (:meth:`from_orbit`, frame ``"ICRF"``) or from a sampled trajectory
    (:meth:`from_trajectory`, :meth:`from_spk`, :meth:`from_oem`). Times are counted from closest approach.

    Attributes
    ----------
    planet : Planet
        The body encountered.
    time : Time or None
        Closest approach, TDB; None for a scripted encounter.
    distance : Quantity
        Distance between the centres at closest approach; on an impact, that of the orbit without the planet's surface.
    v_inf : Quantity
        Hyperbolic excess speed of the two-body orbit at closest approach; 0 for a bound orbit.
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
        ``"ICRF"``; or ``"trajectory"``: that of a given trajectory. The planet is the origin of all.
    forces : tuple of str
        Forces on the path of the asteroid and sources of the tide.
    left_out : tuple of (str, float)
        Effects left out, each with its estimated largest relative size. Names that begin with "orbit:" concern the
        path: fraction of the acceleration (scripted) or displacement over distance (real orbit); the others the tide.
    tide_error : float
        Largest difference between the stored tide and the exact one at points between the nodes, over the
        peak of the tide.
    t_start, t_stop : float
        Start, and orbit back at `start_distance` plus the time to settle, s from closest approach.
    t_periapsis : float
        Zero.
    tide : TidePanels
        Tidal tensor in `frame` against s from closest approach, from `t_start` to 100 h after `t_stop`.
        On an impact the tide and the track end at the impact, whose time is `t_stop`.
    distance_error, time_error : Quantity or None
        For a real orbit: difference of distance and time of closest approach from those by a second integrator
        (:mod:`flybystab.orbit.search.flight`), plus their change with all known forces; infinite if there is then no
        encounter.
        After an earlier encounter the error of the force model is included
        (:attr:`flybystab.orbit.search.neighbours.Spread.model_error`). The uncertainty of the orbit is not.
    ephemeris : str or None
        Ephemeris of the planets for a real orbit; None for a scripted encounter.
    displacement : Quantity or None
        For a real orbit: displacement at closest approach (at the entry of an impact) for one sigma of the covariance
        in the least certain direction, or for 1 m at the epoch where there is no covariance.
    growth : float or None
        `displacement` over the displacement at the epoch.
    neighbour : str
        Description of the displacement.
    predictability : Predictability or None
        How well the encounter is predicted, from displacement and errors: ``determined``, ``uncertain``, ``one of
        many`` or ``unknown`` (:mod:`flybystab.orbit.predictability`).
    """

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
            Distance of closest approach from the planet's centre, at least 1 m; inside the planet it is an impact,
            not an error.
        v_inf : Quantity
            Hyperbolic excess speed, zero or more. Periapsis and `v_inf` may be arrays, which broadcast: the result is
            then an array of encounters.
        start_distance : Quantity, optional
            Distance at which the encounter starts; 10 planet radii by default, or 10 periapsis distances if larger.
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
        body = find_planet(planet)
        if np.ndim(periapsis) or np.ndim(v_inf):
            return _array(
                lambda q, v: cls.hyperbolic(planet, q, v, start_distance, settle, j2, pole), periapsis, v_inf
            )
        q = to_si(periapsis, u.m, "periapsis", low=1.0)
        v = to_si(v_inf, u.m / u.s, "v_inf", low=0.0, high=C_LIGHT)
        wait = to_si(settle, u.s, "settle", low=0.0)
        if start_distance is None:
            start = 10.0 * max(body.radius, q)
        else:
            start = to_si(start_distance, u.m, "start_distance")
            if start <= q:
                raise InvalidInput("start_distance", start_distance, f"more than the periapsis, {periapsis}")
        axis = unit_vector(pole)

        from flybystab.encounter.hyperbolic import scripted

        return scripted(cls, body, q, v, start, wait, j2, axis)

    @classmethod
    def from_trajectory(
        cls,
        times: Time | Quantity,
        positions: Quantity,
        velocities: Quantity,
        planet: str | Planet,
        *,
        start_distance: Quantity | None = None,
        settle: Quantity = SETTLE * u.s,
        j2: bool = False,
        pole: tuple[float, float, float] = (0.0, 0.0, 1.0),
    ) -> Encounter:
        """Encounter along a given trajectory.

        Between the samples the motion is a two-body orbit about the planet plus a cubic spline of the difference from
        it: exact for two-body motion, otherwise of fourth order in the spacing of the samples. The tide is that of the
        planet alone.

        Parameters
        ----------
        times : Time or Quantity, shape (n,)
            Increasing. With an astropy Time the frame is assumed to be ICRF (``frame == "ICRF"``); with a duration it
            is any frame that does not rotate (``frame == "trajectory"``).
        positions, velocities : Quantity, shape (n, 3)
            Of the asteroid relative to the centre of the planet. They must include a closest approach; with
            several, the nearest is used.
        planet : str or Planet
            The body encountered.
        start_distance : Quantity, optional
            Distance at which the encounter starts; as in :meth:`from_orbit`, but never before the first sample. After
            the last sample the two-body orbit is continued.
        settle, j2, pole
            As in :meth:`hyperbolic`; `pole` in the frame of the positions.

        Raises
        ------
        NoEncounter
            Without a closest approach between the first and the last sample.
        UnitMismatch, InvalidInput, UnknownName
        """
        body = find_planet(planet)
        wait = to_si(settle, u.s, "settle", low=0.0)
        start = checked_start(start_distance)
        axis = unit_vector(pole)
        from flybystab.encounter.from_trajectory import sampled, samples

        return sampled(cls, body, *samples(times, positions, velocities), start, wait, j2, axis)

    @classmethod
    @check_arguments
    def from_spk(
        cls,
        path: str | Path,
        target: int | str | None,
        planet: str | Planet,
        time: Time | str,
        *,
        start_distance: Quantity | None = None,
        settle: Quantity = SETTLE * u.s,
        search: Quantity = 30 * u.d,
        ephemeris: str | Ephemeris | None = None,
        j2: bool = False,
        pole: tuple[float, float, float] = (0.0, 0.0, 1.0),
    ) -> Encounter:
        """Encounter along the trajectory of an SPK kernel, of any type that SPICE reads (21, 13, 2, ...).

        Parameters
        ----------
        path : str or Path
            Binary kernel.
        target : int, str or None
            Number of the asteroid or identifier of NAIF; None for the only small body of the kernel.
        planet : str or Planet
            The body encountered. It comes from `ephemeris` unless the trajectory is relative to it.
        time : Time or str
            Near closest approach (text: TDB); the minimum of distance nearest to it is used.
        start_distance, settle, search, ephemeris
            As in :meth:`from_orbit`.
        j2, pole
            As in :meth:`from_trajectory`.

        Returns
        -------
        Encounter
            `distance_error` is that of the interpolation; the tide is that of the planet alone.

        Raises
        ------
        MissingExtra
            spiceypy (extra ``spk``) is not installed.
        NoEncounter, OutOfSpan, UnitMismatch, InvalidInput, UnknownName
        """
        time = checked_time(time, "time")
        body = find_planet(planet)
        start = checked_start(start_distance)
        reach = to_si(search, u.s, "search", low=0.0, open_low=True)
        from flybystab.encounter.trajectory_files import spk_samples

        found = spk_samples(path, target, body, time, reach, start, ephemeris)
        return cls._along(found, body, start, settle, j2, pole)

    @classmethod
    @check_arguments
    def from_oem(
        cls,
        path: str | Path,
        planet: str | Planet,
        *,
        start_distance: Quantity | None = None,
        settle: Quantity = SETTLE * u.s,
        ephemeris: str | Ephemeris | None = None,
        j2: bool = False,
        pole: tuple[float, float, float] = (0.0, 0.0, 1.0),
    ) -> Encounter:
        """Encounter along the samples of an orbit ephemeris message (CCSDS OEM, key-value notation).

        Parameters
        ----------
        path : str or Path
            Message with ICRF axes relative to the Sun, the barycentre of the solar system or a planet.
        planet, start_distance, settle, ephemeris, j2, pole
            As in :meth:`from_spk`.

        Returns
        -------
        Encounter
            `distance_error` is the change of the distance where every second sample is left out.

        Raises
        ------
        NoEncounter, OutOfSpan, UnitMismatch, InvalidInput, UnknownName
        """
        body = find_planet(planet)
        start = checked_start(start_distance)
        from flybystab.encounter.trajectory_files import oem_samples

        return cls._along(oem_samples(path, body, ephemeris), body, start, settle, j2, pole)

    @classmethod
    def _along(
        cls,
        found: Samples,
        body: Planet,
        start: float | None,
        settle: Quantity,
        j2: bool,
        pole: tuple[float, float, float],
    ) -> Encounter:
        """The encounter along the samples of a file."""
        from flybystab.encounter.from_trajectory import sampled

        wait = to_si(settle, u.s, "settle", low=0.0)
        axis = unit_vector(pole)
        out = sampled(cls, body, found.t, found.states, found.epoch, start, wait, j2, axis)
        return replace(out, distance_error=(found.error * u.m).to(u.km), ephemeris=found.ephemeris or None)

    @classmethod
    @check_arguments
    def from_orbit(
        cls,
        orbit: Orbit,
        planet: str | Planet,
        time: Time | str,
        *,
        error: Quantity = 0.1 * u.km,
        start_distance: Quantity | None = None,
        settle: Quantity = SETTLE * u.s,
        search: Quantity = 30 * u.d,
        within: Quantity | None = None,
        ephemeris: str | Ephemeris | None = None,
        forces: tuple[str, ...] | None = None,
    ) -> Encounter:
        """Encounter on a real orbit, integrated by rebound with the bodies of an ephemeris.

        Parameters
        ----------
        orbit : Orbit
            An orbit, or an object with one as its attribute ``orbit``.
        planet : str or Planet
            The body encountered.
        time : Time or str
            Near closest approach (text: TDB); the minimum of distance nearest to it is used.
        error : Quantity
            Allowed displacement: forces whose estimated displacement is larger are modelled, the others are listed.
            Sources of tide are modelled down to a tenth of the corresponding relative error of the tide.
        start_distance : Quantity, optional
            Distance at which the encounter starts; by default 10 planet radii or, if larger, 10 times the distance,
            but no more than the planet's Hill radius (and at least 1.5 times the closest distance). An orbit
            that does not reach so far (a temporary capture) starts at its apoapsis.
        settle : Quantity
            Time added after the orbit is back at `start_distance`.
        search : Quantity
            Largest difference between `time` and the closest approach.
        within : Quantity, optional
            Largest distance that counts as an encounter; by default 20 Hill radii, at most 1 au.
        ephemeris : str or Ephemeris, optional
            ``"de421"``, ``"de440"``; the best installed by default.
        forces : tuple of str, optional
            Exactly these forces, names as in ``flybystab.orbit.forces.FORCES``, instead of those chosen by `error`.

        Raises
        ------
        NoEncounter
            No minimum of distance below `within` near `time`.
        OutOfSpan
            The ephemeris does not cover the path.
        UnitMismatch, InvalidInput, UnknownName
        """
        path = getattr(orbit, "orbit", orbit)
        if not isinstance(path, Orbit):
            raise InvalidInput("orbit", orbit, "an Orbit, or an object with one as its attribute 'orbit'")
        time = checked_time(time, "time")
        body = find_planet(planet)
        if body.name not in BODIES or body.name == "sun":
            raise InvalidInput("planet", body.name, f"one of {', '.join(BODIES[1:])}")
        reach = to_si(search, u.s, "search", low=0.0, high=3.2e9, open_low=True)
        if forces is not None and not (
            isinstance(forces, tuple | list) and all(isinstance(f, str) for f in forces)
        ):
            raise InvalidInput("forces", forces, "a sequence of names of forces")
        largest = far_enough(body) if within is None else to_si(within, u.m, "within", low=0.0, open_low=True)
        accuracy = to_si(error, u.m, "error", low=0.0, open_low=True)
        wait = to_si(settle, u.s, "settle", low=0.0)
        start = checked_start(start_distance)
        from flybystab.encounter.from_orbit import followed

        return followed(cls, path, body, time.tdb, accuracy, start, wait, reach, largest, ephemeris, forces)


def _array(
    make: Callable[[Quantity, Quantity], Encounter], periapsis: Quantity, v_inf: Quantity
) -> Any:  # the type of a Quantity does not distinguish scalars from arrays
    """Array of encounters, of the shape to which the arrays of periapsis and speed broadcast."""
    q = to_si(periapsis, u.m, "periapsis", shape=None, low=1.0)
    v = to_si(v_inf, u.m / u.s, "v_inf", shape=None, low=0.0, high=C_LIGHT)
    try:
        q, v = np.broadcast_arrays(q, v)
    except ValueError:
        raise InvalidInput(
            "v_inf", f"shape {np.shape(v_inf)}", f"a shape that broadcasts with {np.shape(q)}"
        ) from None
    out = np.empty(q.shape, dtype=object)
    for k in np.ndindex(q.shape):
        out[k] = make(float(q[k]) * u.m, float(v[k]) * u.m / u.s)
    return out
