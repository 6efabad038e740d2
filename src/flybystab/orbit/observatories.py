"""Observers: the geocentre, a geodetic position, or one of some well-known MPC observatory codes.

Source of the codes: Minor Planet Center, list of observatory codes (longitude, rho cos phi', rho sin phi'). Only these
are included: for others give latitude, longitude and height.
"""

from __future__ import annotations

from typing import NamedTuple

import astropy.units as u
import numpy as np
from astropy.time import Time

from flybystab.constants import AU, R_EARTH
from flybystab.errors import InvalidInput, UnknownName
from flybystab.typing import Array


class Observer(NamedTuple):
    """A place on the Earth: name, geodetic latitude, east longitude (deg, WGS 84), height above the ellipsoid (m)."""

    name: str
    latitude: float
    longitude: float
    height: float


#: code: east longitude (deg), rho cos phi', rho sin phi' (equatorial radii of the Earth), name
_MPC: dict[str, tuple[float, float, float, str]] = {
    "000": (0.0, 0.62411, 0.77873, "Greenwich"),
    "005": (2.231, 0.659891, 0.748875, "Meudon"),
    "291": (248.4009, 0.84947, 0.52647, "Spacewatch II"),
    "309": (289.29569, 0.909943, -0.414336, "Cerro Paranal"),
    "474": (170.46496, 0.720773, -0.691079, "Mount John Observatory"),
    "568": (204.5278, 0.94171, 0.33725, "Maunakea"),
    "644": (243.14022, 0.836325, 0.546877, "Palomar Mountain"),
    "691": (248.39966, 0.849466, 0.526479, "Spacewatch"),
    "703": (249.26736, 0.845315, 0.533213, "Catalina Sky Survey"),
    "704": (253.34093, 0.831869, 0.553542, "Lincoln Laboratory ETS"),
    "705": (254.17942, 0.841945, 0.538563, "Apache Point"),
    "807": (289.1941, 0.86560, -0.49980, "Cerro Tololo"),
    "950": (342.1176, 0.87764, 0.47847, "La Palma"),
    "E12": (149.0642, 0.85563, -0.51621, "Siding Spring Survey"),
    "F51": (203.74409, 0.936241, 0.351543, "Pan-STARRS 1"),
    "W84": (289.19358, 0.865572, -0.499793, "Cerro Tololo-DECam"),
}
#: Every code that :func:`observer` knows; 500 is the geocentre.
CODES = ("500", *_MPC)


def observer(text: str) -> Observer | None:
    """The observer described by a text; None for the geocentre.

    Parameters
    ----------
    text : str
        An MPC code of ``CODES``, or geodetic latitude, east longitude (deg) and, optionally, height (m):
        ``"19.83,-155.47,4200"``.

    Raises
    ------
    UnknownName
        A code that is not included.
    InvalidInput
        Numbers out of range.
    """
    from astropy.coordinates import EarthLocation

    parts = text.split(",")
    if len(parts) == 1:
        code = text.strip().upper()
        if code == "500":
            return None
        if code not in _MPC:
            known = f"(embedded: {', '.join(CODES)}; for others give LAT,LON,ALT)"
            raise UnknownName("observatory code", text, [], known=known)
        longitude, across, along, name = _MPC[code]
        east = np.radians(longitude)
        place = EarthLocation.from_geocentric(
            R_EARTH * across * np.cos(east), R_EARTH * across * np.sin(east), R_EARTH * along, u.m
        )
        where = place.to_geodetic("WGS84")
        return Observer(f"{code} {name}", where.lat.deg, where.lon.deg, where.height.to_value(u.m))
    expected = "an MPC code, or LAT,LON[,ALT]: deg, deg east, m"
    try:
        values = [float(part) for part in parts]
    except ValueError:
        raise InvalidInput("observer", text, expected) from None
    if (
        len(values) not in (2, 3)
        or not np.isfinite(values).all()
        or abs(values[0]) > 90.0
        or abs(values[1]) > 360.0
    ):
        raise InvalidInput("observer", text, expected)
    latitude, longitude, height = (*values, 0.0)[:3]
    return Observer(f"{latitude:g}, {longitude:g}, {height:g} m", latitude, longitude, height)


def geographic(positions: Array, times: Time) -> Array:
    """East longitude and geodetic latitude (deg, WGS 84), shape (n, 2), below points near the Earth.

    Parameters
    ----------
    positions : ndarray, shape (n, 3)
        From the centre of the Earth, ICRF axes, m.
    times : Time, shape (n,)
        Rotation of the Earth by skyfield, with its built-in Delta T.
    """
    from skyfield.api import load, wgs84
    from skyfield.positionlib import Geocentric

    tt = times.tt
    moments = load.timescale(builtin=True).tt_jd(np.atleast_1d(tt.jd1), np.atleast_1d(tt.jd2))
    latitude, longitude = wgs84.latlon_of(Geocentric(positions.T / AU, t=moments))
    return np.column_stack([longitude.degrees, latitude.degrees])
