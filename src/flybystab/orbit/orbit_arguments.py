"""Arguments from which orbits are made, checked and converted to SI."""

from __future__ import annotations

from collections.abc import Sequence

import astropy.units as u
import numpy as np
from astropy.time import Time
from astropy.units import Quantity

from flybystab.constants import AU
from flybystab.errors import InvalidInput, UnknownName
from flybystab.orbit.elements import GivenElements
from flybystab.orbit.ephemeris import BODIES, Ephemeris, ephemeris
from flybystab.orbit.epochs import seconds
from flybystab.orbit.forces import NonGravitational
from flybystab.units import checked_time, to_si

#: Defaults of the non-gravitational parameters.
NO_ACCELERATION, NO_DELAY, NO_AREA = 0.0 * u.au / u.d**2, 0.0 * u.d, 0.0 * u.m**2 / u.kg
#: Largest semi-major axis of elements, m: far beyond the nearest stars.
_FARTHEST = 1e9 * AU


def as_ephemeris(name: str | Ephemeris | None) -> Ephemeris:
    """An ephemeris by name, the best one installed for None; an opened one is returned unchanged."""
    return name if isinstance(name, Ephemeris) else ephemeris(name)


def checked_centre(centre: object) -> str:
    """Name of a centre in lower case: ``"ssb"`` or a body of the ephemeris.

    Raises
    ------
    UnknownName
    """
    where = str(centre).lower()
    if where not in ("ssb", *BODIES):
        raise UnknownName("centre", str(centre), [], known=f"(known: ssb, {', '.join(BODIES)})")
    return where


def checked_frame(frame: object) -> str:
    """``"icrf"`` or ``"ecliptic"``; the equator of J2000 is another name of the ICRF here.

    Raises
    ------
    UnknownName
    """
    text = str(frame).lower()
    if text in ("equator", "equatorial"):
        return "icrf"
    if text not in ("icrf", "ecliptic"):
        raise UnknownName("frame", str(frame), [], known="(known: ICRF, equator, ecliptic)")
    return text


def checked_count(n: object) -> int:
    """A number of clones.

    Raises
    ------
    InvalidInput
        It is not a whole number of 1 or more.
    """
    if isinstance(n, bool) or not isinstance(n, int | np.integer) or n < 1:
        raise InvalidInput("n", n, "a whole number of 1 or more")
    return int(n)


def given_elements(
    epoch: Time,
    a: Quantity | None,
    q: Quantity | None,
    e: float | None,
    angles: dict[str, Quantity | None],
    time_of_perihelion: Time | None,
) -> GivenElements:
    """Elements in SI; None stays None.

    Parameters
    ----------
    epoch : Time
        TDB.
    angles : dict
        ``i``, ``node``, ``peri`` and ``M``.

    Raises
    ------
    UnitMismatch, InvalidInput
    """
    limits = {"i": (0.0, np.pi * (1.0 + 1e-15))}
    si = {}
    for name, value in angles.items():
        low, high = limits.get(name, (-np.inf, np.inf))
        si[name] = None if value is None else to_si(_angle(value), u.rad, name, low=low, high=high)
    perihelion = None if time_of_perihelion is None else checked_time(time_of_perihelion, "Tp")
    return GivenElements(
        a=None if a is None else to_si(a, u.m, "a", low=-_FARTHEST, high=_FARTHEST),
        q=None if q is None else to_si(q, u.m, "q", low=0.0, high=_FARTHEST),
        e=None if e is None else to_si(e, u.dimensionless_unscaled, "e", low=0.0),
        **si,
        Tp=None if perihelion is None else seconds(epoch, perihelion),
    )


def _angle(value: object) -> object:
    """Angle in rad: degrees are equivalent to radians, and to a plain number only in radians."""
    return value.to(u.rad) if isinstance(value, Quantity) and value.unit.is_equivalent(u.rad) else value


def non_gravitational(
    a1: Quantity, a2: Quantity, a3: Quantity, law: str | Sequence[float], delay: Quantity, area: Quantity
) -> NonGravitational:
    """Non-gravitational acceleration from the arguments of :meth:`flybystab.Orbit.from_elements`.

    Raises
    ------
    UnitMismatch, InvalidInput, UnknownName
    """
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
    _ = out.constants  # raises UnknownName for an unknown law
    return out
