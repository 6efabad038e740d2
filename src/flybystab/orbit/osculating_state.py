"""State of an asteroid at an epoch, from osculating elements or from a position and a velocity."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Self

import astropy.units as u
import numpy as np
from astropy.time import Time
from astropy.units import Quantity

from flybystab.arguments import check_arguments, check_kinds
from flybystab.errors import InvalidInput
from flybystab.orbit.barycentre import barycentre_in, barycentre_of_de440
from flybystab.orbit.covariance import Covariance
from flybystab.orbit.elements import (
    GM_SUN,
    ecliptic_to_icrf,
    gm_of,
    state_from_elements,
    state_in_plane,
)
from flybystab.orbit.ephemeris import BODIES, Ephemeris, Window
from flybystab.orbit.epochs import checked_epoch, seconds, warn_of_utc
from flybystab.orbit.forces import NonGravitational
from flybystab.orbit.orbit_arguments import (
    NO_ACCELERATION,
    NO_AREA,
    NO_DELAY,
    as_ephemeris,
    checked_centre,
    checked_frame,
    given_elements,
    non_gravitational,
)
from flybystab.typing import Array
from flybystab.units import brief, to_si

_SPEED = u.m / u.s


@dataclass(frozen=True, eq=False)
class OsculatingState:
    """Position and velocity at an epoch, with non-gravitational acceleration and covariance.

    The attributes are described in :class:`flybystab.Orbit`, which adds the propagation.
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
        A1: Quantity = NO_ACCELERATION,
        A2: Quantity = NO_ACCELERATION,
        A3: Quantity = NO_ACCELERATION,
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
        DT: Quantity = NO_DELAY,
        AMRAT: Quantity = NO_AREA,
    ) -> Self:
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
            GM of the elements; by default that of the centre, for ``"ssb"`` that of the solar system.
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
        warn_of_utc(epoch, "epoch", stacklevel=2)
        warn_of_utc(Tp, "Tp", stacklevel=2, any_time=True)
        when, where, axes = checked_epoch(epoch), checked_centre(centre), checked_frame(frame)
        given = given_elements(when, a, q, e, {"i": i, "node": node, "peri": peri, "M": M}, Tp)
        nongrav = non_gravitational(A1, A2, A3, law, DT, AMRAT)
        strength = gm_of(where) if gm is None else to_si(gm, u.m**3 / u.s**2, "gm", low=0.0, open_low=True)
        of = state_from_elements if axes == "ecliptic" else state_in_plane
        state = of(*given.perihelion(strength), strength)
        return cls._at(when, state, where, barycentre, nongrav, name, covariance)

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
    ) -> Self:
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
    ) -> Self:
        """Orbit from a, e, i, node, peri, M as floats in m and rad, which saves a minute for a whole catalogue."""
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
        A1: Quantity = NO_ACCELERATION,
        A2: Quantity = NO_ACCELERATION,
        A3: Quantity = NO_ACCELERATION,
        law: str | Sequence[float] = "asteroid",
        name: str = "",
        covariance: Covariance | None = None,
        *,
        DT: Quantity = NO_DELAY,
        AMRAT: Quantity = NO_AREA,
        barycentre: str = "de440",
    ) -> Self:
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
        where = checked_centre(centre)
        if checked_frame(frame) == "ecliptic":
            r, v = ecliptic_to_icrf() @ r, ecliptic_to_icrf() @ v
        nongrav = non_gravitational(A1, A2, A3, law, DT, AMRAT)
        state = np.concatenate([r, v])
        warn_of_utc(epoch, "epoch", stacklevel=2)
        return cls._at(checked_epoch(epoch), state, where, barycentre, nongrav, name, covariance)

    @check_arguments
    def barycentric(self, window: Window) -> Array:
        """State at the epoch relative to the barycentre of the ephemeris of a window, shape (6,), m and m/s."""
        state = np.concatenate([self.position.to_value(u.m), self.velocity.to_value(u.m / u.s)])
        t = np.array([seconds(self.epoch, window.epoch)])
        if self.centre == "ssb":
            return state + barycentre_in(window, t)[0]
        return state + window.states(BODIES.index(self.centre), t)[0]

    def __repr__(self) -> str:
        known = "" if self.covariance is None else ", with covariance"
        named = f"{self.name}, " if self.name else ""
        return (
            f"<Orbit {named}{brief(np.linalg.norm(self.position), u.au)} from {self.centre} on "
            f"{self.epoch.tdb.iso[:10]} TDB{known}>"
        )


def heliocentric(orbit: OsculatingState, ephemeris: str | Ephemeris | None = None) -> Array:
    """State of an orbit at its epoch relative to the Sun, shape (6,), m and m/s."""
    if orbit.centre == "sun":
        return np.concatenate([orbit.position.to_value(u.m), orbit.velocity.to_value(u.m / u.s)])
    window = as_ephemeris(ephemeris).window(orbit.epoch, 0.0, 0.0)
    sun: Array = window.states(BODIES.index("sun"), np.zeros(1))[0]
    return orbit.barycentric(window) - sun
