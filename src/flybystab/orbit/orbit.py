"""Orbit of an asteroid: state at an epoch, non-gravitational acceleration, covariance, and its propagation."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import astropy.units as u
import numpy as np
from astropy.time import Time
from astropy.units import Quantity

from flybystab.arguments import check_arguments, check_kinds
from flybystab.constants import AU, DAY
from flybystab.errors import FlybystabWarning, Impact, InaccurateOrbit, InvalidInput, UnknownName
from flybystab.orbit.barycentre import barycentre_in, barycentre_of_de440
from flybystab.orbit.closest_approach import first_contact
from flybystab.orbit.covariance import PUSHES, Covariance
from flybystab.orbit.elements import (
    GM_SUN,
    ecliptic_to_icrf,
    gm_of,
    perihelion_of,
    state_from_elements,
    state_in_plane,
)
from flybystab.orbit.ephemeris import BELT, BODIES, N_BODIES, Ephemeris, Window, ephemeris
from flybystab.orbit.forces import FORCES, NonGravitational, model
from flybystab.orbit.ias15 import EPSILON, TIGHT, Flight
from flybystab.orbit.planets import PLANETS
from flybystab.orbit.state_transition import StateTransition, derivatives
from flybystab.typing import Array
from flybystab.units import brief, checked_time, to_si, whole

if TYPE_CHECKING:
    from flybystab.orbit.vector_function import OrbitVector

_AU_D2 = u.au / u.d**2
_SPEED = u.m / u.s
_ZERO = 0.0 * _AU_D2
_NO_DELAY, _NO_AREA = 0.0 * u.d, 0.0 * u.m**2 / u.kg
#: Difference of two integrations above which a warning is given, m.
_LARGE_ERROR = 1e3
#: An orbit within this distance (m) and relative speed (m/s) of a massive asteroid at its epoch is that asteroid's.
TWIN_DISTANCE, TWIN_SPEED = 1e8, 100.0
#: Largest semi-major axis of elements, m: far beyond the nearest stars.
_FARTHEST = 1e9 * AU


@dataclass(frozen=True, eq=False)
class Orbit:
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

    epoch: Time
    position: Quantity
    velocity: Quantity
    centre: str = "sun"
    nongrav: NonGravitational = field(default_factory=NonGravitational)
    name: str = ""
    covariance: Covariance | None = None

    def __post_init__(self) -> None:
        check_kinds(self, "epoch", "position", "velocity", "centre", "name", "covariance")

    @classmethod
    def from_elements(
        cls,
        epoch: Time,
        a: Quantity | None = None,
        e: float | None = None,
        i: Quantity | None = None,
        node: Quantity | None = None,
        peri: Quantity | None = None,
        M: Quantity | None = None,
        A1: Quantity = _ZERO,
        A2: Quantity = _ZERO,
        A3: Quantity = _ZERO,
        law: str | Sequence[float] = "asteroid",
        name: str = "",
        covariance: Covariance | None = None,
        *,
        q: Quantity | None = None,
        Tp: Time | None = None,
        centre: str = "sun",
        frame: str = "ecliptic",
        gm: Quantity | None = None,
        barycentre: str = "de440",
        DT: Quantity = _NO_DELAY,
        AMRAT: Quantity = _NO_AREA,
    ) -> Orbit:
        """Orbit from osculating elements: heliocentric, J2000 ecliptic and equinox (as JPL gives them) by default.

        Needed are e, i, node, peri, one of a and q, and one of M and Tp; q and Tp for a parabola.

        Parameters
        ----------
        epoch : Time
            Epoch of osculation; TDB is used.
        a, e : Quantity, float
            Semi-major axis and eccentricity: positive and below one, or negative and above one.
        i, node, peri, M : Quantity
            Inclination, longitude of the node, argument of perihelion, mean anomaly.
        q : Quantity
            Perihelion distance, in place of a.
        Tp : Time
            Time of perihelion, in place of M.
        centre : str
            ``"sun"``, ``"ssb"`` (barycentre of the solar system), or a body of the ephemeris.
        frame : {"ecliptic", "ICRF"}
            Plane of the elements: ecliptic or equator, of J2000.
        gm : Quantity, optional
            GM behind the elements; by default that of the centre, for ``"ssb"`` that of the solar system.
        barycentre : str
            As in :meth:`from_state`.
        A1, A2, A3 : Quantity
            Radial, transverse and normal non-gravitational acceleration at 1 au; a plain 0 means none.
        law : {"asteroid", "comet"} or sequence of five floats
            Dependence of A1, A2, A3 on the heliocentric distance: ``(1 au/r)^2``, sublimation of water ice, or the
            constants ALN, R0 (au), NM, NN, NK of ``g(r) = ALN (r/R0)^-NM [1 + (r/R0)^NN]^-NK``.
        name : str
            Shown in tables.
        covariance : Covariance, optional
            Of any set of elements at any epoch.
        DT : Quantity
            g is evaluated at the distance this time earlier; positive for a maximum after perihelion.
        AMRAT : Quantity
            Illuminated area over mass, for radiation pressure on an absorbing body.

        Raises
        ------
        UnitMismatch, InvalidInput, UnknownName
        """
        given: dict[str, float | None] = {
            "a": None if a is None else to_si(a, u.m, "a", low=-_FARTHEST, high=_FARTHEST),
            "q": None if q is None else to_si(q, u.m, "q", low=0.0, high=_FARTHEST),
            "e": None if e is None else to_si(e, u.dimensionless_unscaled, "e", low=0.0),
        }
        for value, n in ((i, "i"), (node, "node"), (peri, "peri"), (M, "M")):
            given[n] = None if value is None else to_si(_angle(value), u.rad, n)
        push = _nongrav(A1, A2, A3, law, DT, AMRAT)
        if isinstance(epoch, Time) and epoch.scale == "utc" and np.all(epoch.jd * 2.0 % 1.0 == 0.0):
            warnings.warn(
                "epoch is in UTC; elements are published in TDB or TT, which is 69 s ahead in 2026: "
                "Time(..., scale='tdb')",
                FlybystabWarning,
                stacklevel=2,
            )
        when, where, axes = _epoch(epoch), _centre(centre), _frame(frame)
        if Tp is not None:
            checked_time(Tp, "Tp")
            given["since"] = seconds(when, Tp)
        strength = gm_of(where) if gm is None else to_si(gm, u.m**3 / u.s**2, "gm", low=0.0, open_low=True)
        elements = perihelion_of(given, strength)
        of = state_from_elements if axes == "ecliptic" else state_in_plane
        return cls._at(when, of(*elements, strength), where, barycentre, push, name, covariance)

    @classmethod
    def _at(
        cls,
        epoch: Time,
        state: Array,
        centre: str,
        barycentre: str,
        nongrav: NonGravitational,
        name: str,
        covariance: Covariance | None,
    ) -> Orbit:
        """Orbit from a state (m, m/s, ICRF) relative to a centre, or to the barycentre of an ephemeris."""
        if centre == "ssb":
            state = state - barycentre_of_de440(str(barycentre).lower(), epoch, np.zeros(1))[0]
        r, v = Quantity(state[:3], u.m, copy=False), Quantity(state[3:], _SPEED, copy=False)
        return cls(epoch, r, v, centre, nongrav, name, covariance)

    @classmethod
    def _from_si_elements(
        cls,
        epoch: Time,
        elements: Sequence[float],
        nongrav: NonGravitational,
        name: str,
        covariance: Covariance | None,
    ) -> Orbit:
        """Orbit from a, e, i, node, peri, M in m and rad, without units: a catalogue takes a minute less."""
        a, e, i, node, peri, mean = elements
        if a == 0.0 or e < 0.0 or e == 1.0 or (a > 0.0) != (e < 1.0):
            raise InvalidInput("e", e, f"below 1 for a > 0, above 1 for a < 0 (a = {a:g} m)")
        since = mean * np.sqrt(abs(a) ** 3 / GM_SUN)
        state = state_from_elements(a * (1.0 - e), e, i, node, peri, since)
        r, v = Quantity(state[:3], u.m, copy=False), Quantity(state[3:], _SPEED, copy=False)
        return cls(epoch, r, v, nongrav=nongrav, name=name, covariance=covariance)

    @classmethod
    def from_state(
        cls,
        epoch: Time,
        position: Quantity,
        velocity: Quantity,
        centre: str = "sun",
        frame: str = "ICRF",
        A1: Quantity = _ZERO,
        A2: Quantity = _ZERO,
        A3: Quantity = _ZERO,
        law: str | Sequence[float] = "asteroid",
        name: str = "",
        covariance: Covariance | None = None,
        *,
        DT: Quantity = _NO_DELAY,
        AMRAT: Quantity = _NO_AREA,
        barycentre: str = "de440",
    ) -> Orbit:
        """Orbit from a state.

        Parameters
        ----------
        epoch : Time
            Epoch of the state; TDB is used.
        position, velocity : Quantity
            Shape (3,), relative to `centre`.
        centre : str
            ``"sun"``, ``"ssb"``, or a body of the ephemeris (``"earth"``, ``"moon"``, ...).
        frame : {"ICRF", "ecliptic"}
            Axes: ICRF (equator) or ecliptic of J2000.
        A1, A2, A3, law, name, covariance, DT, AMRAT
            As in :meth:`from_elements`.
        barycentre : str
            For ``"ssb"``: the ephemeris to whose barycentre the state belongs. States of Horizons, ASSIST and layup
            belong to DE440 or DE441; those of DE421 to DE438 differ by 115 km (:mod:`flybystab.orbit.barycentre`).

        Raises
        ------
        UnitMismatch, InvalidInput, UnknownName
        """
        r = to_si(position, u.m, "position", shape=(3,))
        v = to_si(velocity, u.m / u.s, "velocity", shape=(3,))
        if not np.any(r):
            raise InvalidInput("position", position, "a place away from the centre")
        where = _centre(centre)
        if _frame(frame) == "ecliptic":
            r, v = ecliptic_to_icrf() @ r, ecliptic_to_icrf() @ v
        push = _nongrav(A1, A2, A3, law, DT, AMRAT)
        return cls._at(_epoch(epoch), np.concatenate([r, v]), where, barycentre, push, name, covariance)

    @check_arguments
    def barycentric(self, window: Window) -> Array:
        """State at the epoch relative to the barycentre of the ephemeris of a window, shape (6,), m and m/s."""
        state = np.concatenate([self.position.to_value(u.m), self.velocity.to_value(u.m / u.s)])
        t = np.array([seconds(self.epoch, window.epoch)])
        if self.centre == "ssb":
            return state + barycentre_in(window, t)[0]
        return state + window.states(BODIES.index(self.centre), t)[0]

    @check_arguments
    def flight(
        self, window: Window, forces: tuple[str, ...] | None = None, epsilon: float = EPSILON
    ) -> Flight:
        """The asteroid in rebound at the epoch of the orbit; times are seconds from ``window.epoch``."""
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
            The two integrations differ by more than 1 km at `time`, as after a close passage that amplifies
            rounding errors. Errors of the elements and of the force model are not included.
        """
        where = _centre(centre)
        eph = _ephemeris(ephemeris)
        t = seconds(_epoch(time), self.epoch)
        window = eph.window(self.epoch, min(t, 0.0), max(t, 0.0))
        state = self.barycentric(window)
        if t != 0.0:
            state = self._propagated(window, t)
        at = np.array([t])
        state = (
            state
            - (barycentre_in(window, at) if where == "ssb" else window.states(BODIES.index(where), at))[0]
        )
        return (state[:3] * u.m).to(u.km), (state[3:] * u.m / u.s).to(u.km / u.s)

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
        eph = _ephemeris(ephemeris)
        t = seconds(_epoch(time), self.epoch)
        window = eph.window(self.epoch, min(t, 0.0), max(t, 0.0))
        if t != 0.0:
            self._propagated(window, t)
        forces = without_itself(default_forces(self, *BODIES), self, window)
        found, error = derivatives(
            model(window, forces, self.nongrav),
            self.nongrav.row,
            0.0,
            self.barycentric(window),
            window.states(BODIES.index("sun"), np.zeros(1))[0],
            t,
        )
        return StateTransition(self.epoch.tdb, later(self.epoch, t), found[:, :6], found[:, 6:], error)

    @check_arguments
    def covariance_at(self, time: Time, ephemeris: str | Ephemeris | None = None) -> Covariance:
        """Covariance of the heliocentric state at another time, to first order.

        Right where one sigma is small against the scale on which the forces change; after a close encounter compare
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
        there = deviated(self, known.epoch, np.zeros((1, 6)), np.zeros((1, len(PUSHES))), "", ephemeris)[0]
        change = there.state_transition(time, ephemeris)
        extra = [name for name in PUSHES if name in known.names]
        full = np.eye(6 + len(extra))
        full[:6, :6] = change.matrix
        full[:6, 6:] = change.parameters[:, [PUSHES.index(name) for name in extra]]
        matrix = full @ known.matrix @ full.T
        r, v = there.at(time, "sun", ephemeris)
        mean = np.concatenate([r.to_value(u.m), v.to_value(_SPEED), known.values[6:]])
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

        return OrbitVector(self, str(centre).lower(), _ephemeris(ephemeris))

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
        parameters, _ = covariance.samples(_count(n), whole(seed, "seed", 0))
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
        if not isinstance(self.covariance, Covariance):
            raise InvalidInput("covariance", self.covariance, f"a Covariance: {what} are drawn from it")
        return self.covariance

    def __repr__(self) -> str:
        known = "" if self.covariance is None else ", with covariance"
        named = f"{self.name}, " if self.name else ""
        return (
            f"<Orbit {named}{brief(np.linalg.norm(self.position), u.au)} from {self.centre} on "
            f"{self.epoch.tdb.iso[:10]} TDB{known}>"
        )


def deviated(
    orbit: Orbit,
    epoch: Time,
    states: Array,
    pushes: Array,
    label: str,
    ephemeris: str | Ephemeris | None,
    first: int = 0,
) -> tuple[Orbit, ...]:
    """Orbits that deviate from an orbit propagated to `epoch`.

    Parameters
    ----------
    states, pushes : ndarray, shapes (m, 6) and (m, 5)
        Deviations of the state (m, m/s) and of A1, A2, A3 (m/s2), DT (s), AMRAT (m2/kg).
    label : str
        Their names are this and a number, from `first` on.
    """
    position, velocity, centre = orbit.position, orbit.velocity, orbit.centre
    if abs(seconds(epoch, orbit.epoch)) > 1e-3:
        centre = "sun"
        position, velocity = orbit.at(epoch, centre, ephemeris)
    else:
        epoch = orbit.epoch
    r, v, old = position.to_value(u.m), velocity.to_value(u.m / u.s), orbit.nongrav
    mean = np.array([*old.a, old.delay, old.area_to_mass])
    return tuple(
        Orbit(
            epoch,
            (r + ds[:3]) * u.m,
            (v + ds[3:]) * u.m / u.s,
            centre,
            _changed(old, mean + da),
            f"{orbit.name} {label} {k}".strip(),
        )
        for k, (ds, da) in enumerate(zip(states, pushes, strict=True), first)
    )


def _changed(law: NonGravitational, values: Array) -> NonGravitational:
    """The law with other A1, A2, A3 (m/s2), DT (s), AMRAT (m2/kg)."""
    a1, a2, a3, delay, area = values.tolist()
    return NonGravitational((a1, a2, a3), law.law, delay, area)


def heliocentric(orbit: Orbit, ephemeris: str | Ephemeris | None = None) -> Array:
    """State of an orbit at its epoch relative to the Sun, shape (6,), m and m/s."""
    if orbit.centre == "sun":
        return np.concatenate([orbit.position.to_value(u.m), orbit.velocity.to_value(u.m / u.s)])
    window = _ephemeris(ephemeris).window(orbit.epoch, 0.0, 0.0)
    sun: Array = window.states(BODIES.index("sun"), np.zeros(1))[0]
    return orbit.barycentric(window) - sun


def default_forces(orbit: Orbit, *bodies: str) -> tuple[str, ...]:
    """All point masses, 1PN, J2 of Sun, Earth and `bodies`, J3, J4 of the Earth, the non-gravitational law if any."""
    flat = {"earth J3", "earth J4", *(f"{name} J2" for name in ("sun", "earth", *bodies))}
    return tuple(
        name
        for name in FORCES
        if name.endswith("point mass")
        or name == "1PN"
        or name in flat
        or (name == "non-gravitational" and orbit.nongrav.active)
    )


def massive_twin(window: Window, epoch: float, state: Array) -> str | None:
    """Name of the massive asteroid to which an orbit belongs, or None.

    The table of the massive asteroids has errors up to 60,000 km. An orbit is taken for that of a massive asteroid if
    it is within 100,000 km of it at less than 100 m/s; passages in the main belt are much faster.

    Parameters
    ----------
    epoch, state : float, ndarray
        Time (s from the epoch of the window) and barycentric state (m, m/s).
    """
    for i, name in enumerate(BELT, N_BODIES):
        away = state - window.states(i, np.array([epoch]))[0]
        if np.linalg.norm(away[:3]) < TWIN_DISTANCE and np.linalg.norm(away[3:]) < TWIN_SPEED:
            return name
    return None


def without_itself(forces: Iterable[str], orbit: Orbit, window: Window) -> tuple[str, ...]:
    """The forces without the point mass of the massive asteroid to which the orbit belongs."""
    twin = massive_twin(window, seconds(orbit.epoch, window.epoch), orbit.barycentric(window))
    return tuple(name for name in forces if name != f"{twin} point mass")


def seconds(time: Time, origin: Time) -> float:
    """Seconds (TDB) from `origin` to `time`, from the two-part Julian dates."""
    a, b = time.tdb, origin.tdb
    return float(((a.jd1 - b.jd1) + (a.jd2 - b.jd2)) * DAY)


def later(origin: Time, t: float) -> Time:
    """The time `t` s (TDB) after `origin`."""
    zero = origin.tdb
    return Time(zero.jd1, zero.jd2 + t / DAY, format="jd", scale="tdb")


def _ephemeris(name: str | Ephemeris | None) -> Ephemeris:
    return name if isinstance(name, Ephemeris) else ephemeris(name)


def _epoch(epoch: Any) -> Time:
    return checked_time(epoch, "epoch").tdb


def _centre(centre: Any) -> str:
    where = str(centre).lower()
    if where not in ("ssb", *BODIES):
        raise UnknownName("centre", str(centre), [], known=f"(known: ssb, {', '.join(BODIES)})")
    return where


def _frame(frame: Any) -> str:
    if str(frame).lower() not in ("icrf", "ecliptic"):
        raise UnknownName("frame", str(frame), [], known="(known: ICRF, ecliptic)")
    return str(frame).lower()


def _count(n: int) -> int:
    if isinstance(n, bool) or not isinstance(n, int | np.integer) or n < 1:
        raise InvalidInput("n", n, "a whole number of 1 or more")
    return int(n)


def _angle(value: Any) -> Any:
    return value.to(u.rad) if isinstance(value, Quantity) and value.unit.is_equivalent(u.rad) else value


def _nongrav(
    a1: Quantity, a2: Quantity, a3: Quantity, law: str | Sequence[float], delay: Quantity, area: Quantity
) -> NonGravitational:
    unit = u.m / u.s**2
    # A plain zero needs no unit.
    pairs = ((a1, "A1"), (a2, "A2"), (a3, "A3"))
    values = tuple(0.0 if isinstance(v, int | float) and v == 0 else to_si(v, unit, n) for v, n in pairs)
    try:
        text = law if isinstance(law, str) else " ".join(str(float(x)) for x in np.atleast_1d(law))
    except (TypeError, ValueError):
        raise InvalidInput("law", law, "a name, or the five numbers ALN, R0 (au), NM, NN, NK") from None
    out = NonGravitational(
        (values[0], values[1], values[2]),
        text,
        to_si(delay, u.s, "DT"),
        to_si(area, u.m**2 / u.kg, "AMRAT", low=0.0),
    )
    _ = out.constants  # refuses an unknown law
    return out
