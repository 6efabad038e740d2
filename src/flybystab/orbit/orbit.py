"""An asteroid's orbit: a state at an epoch, its non-gravitational acceleration, and where that takes it."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import astropy.units as u
import numpy as np
from astropy.time import Time
from astropy.units import Quantity

from flybystab.constants import DAY
from flybystab.errors import FlybystabWarning, Impact, InaccurateOrbit, InvalidInput, UnknownName
from flybystab.orbit.closest_approach import first_contact
from flybystab.orbit.covariance import Covariance
from flybystab.orbit.elements import GM_SUN, ecliptic_to_icrf, state_from_elements
from flybystab.orbit.ephemeris import BELT, BODIES, EPHEMERIDES, N_BODIES, Ephemeris, Window, ephemeris
from flybystab.orbit.forces import FORCES, NonGravitational, model
from flybystab.orbit.ias15 import EPSILON, TIGHT, Flight
from flybystab.orbit.planets import PLANETS
from flybystab.typing import Array
from flybystab.units import brief, checked_time, to_si, whole

if TYPE_CHECKING:
    from flybystab.orbit.vector_function import OrbitVector

_AU_D2 = u.au / u.d**2
_SPEED = u.m / u.s
_ZERO = 0.0 * _AU_D2
#: Difference of two integrations that is worth a warning, m.
_LARGE_ERROR = 1e3
#: Closer and slower than this at its epoch an orbit is that of a massive asteroid itself, m and m/s.
TWIN_DISTANCE, TWIN_SPEED = 1e8, 100.0


@dataclass(frozen=True, eq=False)
class Orbit:
    """A state at an epoch, with what else moves the asteroid.

    Made by :meth:`from_elements` or :meth:`from_state`.

    Attributes
    ----------
    epoch : Time
        TDB.
    position, velocity : Quantity
        Shape (3,), ICRF axes, relative to `centre`.
    centre : str
        ``"ssb"`` (barycentre of the solar system), ``"sun"``, ``"earth"`` or another body.
    nongrav : NonGravitational
        A1, A2, A3 and their law of distance.
    name : str
        Free text, shown in tables.
    covariance : Covariance or None
        How well the elements are known; see :meth:`clones`.
    """

    epoch: Time
    position: Quantity
    velocity: Quantity
    centre: str = "sun"
    nongrav: NonGravitational = field(default_factory=NonGravitational)
    name: str = ""
    covariance: Covariance | None = None

    @classmethod
    def from_elements(
        cls,
        epoch: Time,
        a: Quantity,
        e: float,
        i: Quantity,
        node: Quantity,
        peri: Quantity,
        M: Quantity,
        A1: Quantity = _ZERO,
        A2: Quantity = _ZERO,
        A3: Quantity = _ZERO,
        law: str = "asteroid",
        name: str = "",
        covariance: Covariance | None = None,
    ) -> Orbit:
        """Orbit from heliocentric osculating elements, J2000 ecliptic and equinox (as JPL gives them).

        Parameters
        ----------
        epoch : Time
            Epoch of osculation; TDB is used.
        a, e : Quantity, float
            Semi-major axis and eccentricity: positive and below one, or negative and above one.
        i, node, peri, M : Quantity
            Inclination, longitude of the node, argument of perihelion, mean anomaly.
        A1, A2, A3 : Quantity
            Radial, transverse and normal non-gravitational acceleration at 1 au; a plain 0 means none.
        law : {"asteroid", "comet"}
            Dependence of A1, A2, A3 on distance.
        name : str
            Shown in tables.
        covariance : Covariance, optional
            Of any set of elements at any epoch.

        Raises
        ------
        UnitMismatch, InvalidInput, UnknownName
        """
        axis = to_si(a, u.m, "a")
        ecc = to_si(e, u.dimensionless_unscaled, "e", low=0.0)
        angles = [
            to_si(v, u.rad, n)
            for v, n in ((_angle(i), "i"), (_angle(node), "node"), (_angle(peri), "peri"), (_angle(M), "M"))
        ]
        push = _nongrav(A1, A2, A3, law)
        if isinstance(epoch, Time) and epoch.scale == "utc" and np.all(epoch.jd * 2.0 % 1.0 == 0.0):
            warnings.warn(
                "epoch is in UTC; elements are published in TDB or TT, which is 69 s ahead in 2026: "
                "Time(..., scale='tdb')",
                FlybystabWarning,
                stacklevel=2,
            )
        return cls._from_si_elements(_epoch(epoch), (axis, ecc, *angles), push, name, covariance)

    @classmethod
    def _from_si_elements(
        cls,
        epoch: Time,
        elements: Sequence[float],
        nongrav: NonGravitational,
        name: str,
        covariance: Covariance | None,
    ) -> Orbit:
        """Orbit from a, e, i, node, peri, M in m and rad: units on a whole catalogue would cost a minute."""
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
        law: str = "asteroid",
        name: str = "",
        covariance: Covariance | None = None,
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
        A1, A2, A3, law, name, covariance
            As in :meth:`from_elements`.

        Raises
        ------
        UnitMismatch, InvalidInput, UnknownName
        """
        r = to_si(position, u.m, "position", shape=(3,))
        v = to_si(velocity, u.m / u.s, "velocity", shape=(3,))
        if not np.any(r):
            raise InvalidInput("position", position, "a place away from the centre")
        where = str(centre).lower()
        if where not in ("ssb", *BODIES):
            raise UnknownName("centre", str(centre), [], known=f"(known: ssb, {', '.join(BODIES)})")
        if str(frame).lower() == "ecliptic":
            r, v = ecliptic_to_icrf() @ r, ecliptic_to_icrf() @ v
        elif str(frame).upper() != "ICRF":
            raise UnknownName("frame", str(frame), [], known="(known: ICRF, ecliptic)")
        return cls(_epoch(epoch), r * u.m, v * u.m / u.s, where, _nongrav(A1, A2, A3, law), name, covariance)

    def barycentric(self, window: Window) -> Array:
        """State at the epoch relative to the barycentre of the solar system, shape (6,), m and m/s."""
        state = np.concatenate([self.position.to_value(u.m), self.velocity.to_value(u.m / u.s)])
        if self.centre == "ssb":
            check_barycentre(window)
            return state
        return (
            state + window.states(BODIES.index(self.centre), np.array([seconds(self.epoch, window.epoch)]))[0]
        )

    def flight(
        self, window: Window, forces: tuple[str, ...] | None = None, epsilon: float = EPSILON
    ) -> Flight:
        """The asteroid in rebound at the epoch of the orbit; times are seconds from ``window.epoch``."""
        chosen = forces if forces is not None else without_itself(default_forces(self, *BODIES), self, window)
        return Flight(
            model(window, chosen, self.nongrav),
            seconds(self.epoch, window.epoch),
            self.barycentric(window),
            epsilon,
        )

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
            ``"sun"``, ``"ssb"``, or a body of the ephemeris.
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
        where = str(centre).lower()
        if where not in ("ssb", *BODIES):
            raise UnknownName("centre", str(centre), [], known=f"(known: ssb, {', '.join(BODIES)})")
        eph = _ephemeris(ephemeris)
        t = seconds(_epoch(time), self.epoch)
        window = eph.window(self.epoch, min(t, 0.0), max(t, 0.0))
        state = self.barycentric(window)
        if t != 0.0:
            state = self._propagated(window, t)
        if where != "ssb":
            state = state - window.states(BODIES.index(where), np.array([t]))[0]
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

    def to_skyfield(self, centre: str = "sun", ephemeris: str | Ephemeris | None = None) -> OrbitVector:
        """The path as a vector function of skyfield, with all forces.

        Parameters
        ----------
        centre : {"sun", "ssb"}
            Origin of the vectors, ICRF.
        ephemeris : str or Ephemeris, optional
            Of the forces, and for light time: open the same with
            :func:`flybystab.orbit.vector_function.ephemeris_file`.

        Returns
        -------
        skyfield.vectorlib.VectorFunction
            Add it to the Sun of an ephemeris file to observe it: ``file["sun"] + orbit.to_skyfield()``.
        """
        from flybystab.orbit.vector_function import OrbitVector

        return OrbitVector(self, str(centre).lower(), _ephemeris(ephemeris))

    def clones(
        self,
        n: int,
        seed: int = 0,
        ephemeris: str | Ephemeris | None = None,
        first: int = 0,
        last: int | None = None,
    ) -> tuple[Orbit, ...]:
        """Orbits drawn from the covariance, at its epoch.

        The deviations from the mean of the covariance are added to this orbit, taken to the epoch of the
        covariance with all forces where that differs; A1, A2, A3 are drawn along where they were estimated.

        Parameters
        ----------
        n : int
            How many.
        seed : int
            Clone k depends on the seed and k alone.
        ephemeris : str or Ephemeris, optional
            For the way to the epoch of the covariance.
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

    def sigma_points(self, ephemeris: str | Ephemeris | None = None) -> tuple[tuple[Orbit, ...], ...]:
        """Pairs of orbits, plus and minus one sigma along each principal axis of the correlations.

        Half of the difference that a pair makes anywhere is a column F of the linear map: the covariance
        there is ``F F^T``. Half of their sum less the nominal measures what the linear map leaves out.
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
    """An orbit taken to `epoch`, plus deviations of the state (m, 6) and of A1, A2, A3 (m, 3) there; SI.

    They are named by `label` and their numbers from `first` on.
    """
    position, velocity, centre = orbit.position, orbit.velocity, orbit.centre
    if abs(seconds(epoch, orbit.epoch)) > 1e-3:
        centre = "sun"
        position, velocity = orbit.at(epoch, centre, ephemeris)
    else:
        epoch = orbit.epoch
    r, v, a = position.to_value(u.m), velocity.to_value(u.m / u.s), np.array(orbit.nongrav.a)
    return tuple(
        Orbit(
            epoch,
            (r + ds[:3]) * u.m,
            (v + ds[3:]) * u.m / u.s,
            centre,
            NonGravitational(tuple((a + da).tolist()), orbit.nongrav.law),
            f"{orbit.name} {label} {k}".strip(),
        )
        for k, (ds, da) in enumerate(zip(states, pushes, strict=True), first)
    )


def heliocentric(orbit: Orbit, ephemeris: str | Ephemeris | None = None) -> Array:
    """State of an orbit at its epoch relative to the Sun, shape (6,), m and m/s."""
    if orbit.centre == "sun":
        return np.concatenate([orbit.position.to_value(u.m), orbit.velocity.to_value(u.m / u.s)])
    window = _ephemeris(ephemeris).window(orbit.epoch, 0.0, 0.0)
    sun: Array = window.states(BODIES.index("sun"), np.zeros(1))[0]
    return orbit.barycentric(window) - sun


def default_forces(orbit: Orbit, *bodies: str) -> tuple[str, ...]:
    """All point masses, 1PN, J2 of Sun, Earth and `bodies`, and A1, A2, A3 if the orbit has them."""
    flat = {f"{name} J2" for name in ("sun", "earth", *bodies)}
    return tuple(
        name
        for name in FORCES
        if name.endswith("point mass")
        or name == "1PN"
        or name in flat
        or (name == "non-gravitational" and any(orbit.nongrav.a))
    )


def check_barycentre(window: Window) -> None:
    """Warn that a barycentric state is read with an ephemeris whose barycentre differs from that of DE430 to DE441."""
    source = EPHEMERIDES.get(window.name)
    if source is not None and not source.kuiper_belt:
        warnings.warn(
            f"a barycentric state with {window.name.upper()}, whose barycentre is 115 km from that of DE430 to DE441 "
            "(Horizons, ASSIST): take DE440, or give the state relative to the Sun",
            InaccurateOrbit,
            stacklevel=3,
        )


def massive_twin(window: Window, epoch: float, state: Array) -> str | None:
    """The massive asteroid that an orbit is itself the orbit of, or None.

    The table of the massive asteroids is good to 60,000 km: what starts within 100,000 km of one of them, at less than
    100 m/s, is taken for it. A passage as slow as that does not happen in the main belt.

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
    """The forces without the pull of the massive asteroid that the orbit belongs to."""
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
    checked_time(epoch, "epoch")
    return epoch.tdb


def _count(n: int) -> int:
    if isinstance(n, bool) or not isinstance(n, int | np.integer) or n < 1:
        raise InvalidInput("n", n, "a whole number of 1 or more")
    return int(n)


def _angle(value: Any) -> Any:
    return value.to(u.rad) if isinstance(value, Quantity) and value.unit.is_equivalent(u.rad) else value


def _nongrav(a1: Quantity, a2: Quantity, a3: Quantity, law: str) -> NonGravitational:
    unit = u.m / u.s**2
    # A plain zero is no push in any unit.
    pairs = ((a1, "A1"), (a2, "A2"), (a3, "A3"))
    values = tuple(0.0 if isinstance(v, int | float) and v == 0 else to_si(v, unit, n) for v, n in pairs)
    out = NonGravitational((values[0], values[1], values[2]), law)
    _ = out.constants  # refuses an unknown law
    return out
