"""An asteroid's orbit: a state at an epoch, its non-gravitational acceleration, and where that takes it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import astropy.units as u
import numpy as np
from astropy.time import Time
from astropy.units import Quantity
from numpy.typing import NDArray

from flybystab.constants import DAY, OBLIQUITY_J2000
from flybystab.errors import InvalidInput, UnknownName
from flybystab.sky.ephemeris import BODIES, Ephemeris, Window, ephemeris
from flybystab.sky.forces import FORCES, NonGravitational, model
from flybystab.sky.kepler import states_at_times
from flybystab.sky.planets import PLANETS
from flybystab.sky.reboundry import Flight
from flybystab.units import to_si

Array = NDArray[np.float64]

#: Sun's GM behind the osculating elements of JPL (DE440/441), m3/s2.
GM_SUN = PLANETS["sun"].gm

_AU_D2 = u.au / u.d**2
_ZERO = 0.0 * _AU_D2


def ecliptic_to_icrf() -> Array:
    """Rotation from the J2000 ecliptic of small-body elements to ICRF axes."""
    c, s = np.cos(OBLIQUITY_J2000), np.sin(OBLIQUITY_J2000)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def state_from_elements(
    q: float, e: float, i: float, node: float, peri: float, since: float, gm: float = GM_SUN
) -> Array:
    """Heliocentric ICRF state (m, m/s), shape (6,), from elements of the J2000 ecliptic.

    Parameters
    ----------
    q : float
        Perihelion distance, m.
    e : float
        Eccentricity; any conic.
    i, node, peri : float
        Inclination, longitude of the node, argument of perihelion, rad.
    since : float
        Time since perihelion, s.
    gm : float
        GM of the Sun that the elements were made with, m3/s2.
    """
    x, y, vx, vy = states_at_times(gm, q, e - 1.0, np.array([since]))[0]
    cn, sn, ci, si = np.cos(node), np.sin(node), np.cos(i), np.sin(i)
    cw, sw = np.cos(peri), np.sin(peri)
    p = np.array([cn * cw - sn * sw * ci, sn * cw + cn * sw * ci, sw * si])
    w = np.array([-cn * sw - sn * cw * ci, -sn * sw + cn * cw * ci, cw * si])
    turn = ecliptic_to_icrf()
    return np.concatenate([turn @ (x * p + y * w), turn @ (vx * p + vy * w)])


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
    covariance : object or None
        Uncertainty of the elements, carried along; nothing here samples it yet.
    """

    epoch: Time
    position: Quantity
    velocity: Quantity
    centre: str = "sun"
    nongrav: NonGravitational = field(default_factory=NonGravitational)
    name: str = ""
    covariance: Any = None

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
        covariance: Any = None,
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
            Radial, transverse and normal non-gravitational acceleration at 1 au.
        law : {"asteroid", "comet"}
            Dependence of A1, A2, A3 on distance.

        Raises
        ------
        UnitMismatch, InvalidInput, UnknownName
        """
        axis = to_si(a, u.m, "a")
        ecc = to_si(e, u.dimensionless_unscaled, "e", low=0.0)
        if axis == 0.0 or ecc == 1.0 or (axis > 0.0) != (ecc < 1.0):
            raise InvalidInput("e", e, f"below 1 for a > 0, above 1 for a < 0 (a = {a})")
        angles = [
            to_si(v, u.rad, n)
            for v, n in ((_angle(i), "i"), (_angle(node), "node"), (_angle(peri), "peri"), (_angle(M), "M"))
        ]
        since = angles[3] * np.sqrt(abs(axis) ** 3 / GM_SUN)
        state = state_from_elements(axis * (1.0 - ecc), ecc, angles[0], angles[1], angles[2], since)
        return cls(
            epoch=_epoch(epoch),
            position=state[:3] * u.m,
            velocity=state[3:] * u.m / u.s,
            nongrav=_nongrav(A1, A2, A3, law),
            name=name,
            covariance=covariance,
        )

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
        covariance: Any = None,
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
        if frame.lower() == "ecliptic":
            r, v = ecliptic_to_icrf() @ r, ecliptic_to_icrf() @ v
        elif frame.upper() != "ICRF":
            raise UnknownName("frame", frame, [], known="(known: ICRF, ecliptic)")
        return cls(_epoch(epoch), r * u.m, v * u.m / u.s, where, _nongrav(A1, A2, A3, law), name, covariance)

    def barycentric(self, window: Window) -> Array:
        """State at the epoch relative to the barycentre of the solar system, shape (6,), m and m/s."""
        state = np.concatenate([self.position.to_value(u.m), self.velocity.to_value(u.m / u.s)])
        if self.centre == "ssb":
            return state
        return (
            state + window.states(BODIES.index(self.centre), np.array([seconds(self.epoch, window.epoch)]))[0]
        )

    def flight(self, window: Window, forces: tuple[str, ...] | None = None, epsilon: float = 1e-9) -> Flight:
        """The asteroid in rebound at the epoch of the orbit; times are seconds from ``window.epoch``."""
        chosen = forces if forces is not None else default_forces(self)
        return Flight(
            model(window, chosen, self.nongrav),
            seconds(self.epoch, window.epoch),
            self.barycentric(window),
            epsilon,
        )

    def at(self, time: Time, centre: str = "sun", ephemeris: str | None = None) -> tuple[Quantity, Quantity]:
        """Position and velocity at another time, ICRF, relative to `centre`, with all forces.

        Raises
        ------
        OutOfSpan
            Where the ephemeris ends.
        """
        eph = _ephemeris(ephemeris)
        t = seconds(_epoch(time), self.epoch)
        window = eph.window(self.epoch, min(t, 0.0), max(t, 0.0))
        state = self.flight(window).to(t) if t != 0.0 else self.barycentric(window)
        where = str(centre).lower()
        if where != "ssb":
            if where not in BODIES:
                raise UnknownName("centre", centre, [], known=f"(known: ssb, {', '.join(BODIES)})")
            state = state - window.states(BODIES.index(where), np.array([t]))[0]
        return (state[:3] * u.m).to(u.km), (state[3:] * u.m / u.s).to(u.km / u.s)


def default_forces(orbit: Orbit, *bodies: str) -> tuple[str, ...]:
    """All point masses, Sun 1PN, J2 of Sun, Earth and `bodies`, and A1, A2, A3 if the orbit has them."""
    flat = {f"{name} J2" for name in ("sun", "earth", *bodies)}
    return tuple(
        name
        for name in FORCES
        if name.endswith("point mass")
        or name == "sun 1PN"
        or name in flat
        or (name == "non-gravitational" and any(orbit.nongrav.a))
    )


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
    if not isinstance(epoch, Time) or epoch.shape != () or not np.isfinite(epoch.jd):
        raise InvalidInput("epoch", epoch, "one astropy Time")
    return epoch.tdb


def _angle(value: Any) -> Any:
    return value.to(u.rad) if isinstance(value, Quantity) and value.unit.is_equivalent(u.rad) else value


def _nongrav(a1: Quantity, a2: Quantity, a3: Quantity, law: str) -> NonGravitational:
    unit = u.m / u.s**2
    values = tuple(to_si(v, unit, n) for v, n in ((a1, "A1"), (a2, "A2"), (a3, "A3")))
    out = NonGravitational((values[0], values[1], values[2]), law)
    _ = out.constants  # refuses an unknown law
    return out
