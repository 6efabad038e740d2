"""Apparent place of an asteroid: direction, distance, rate of motion, magnitude, altitude and azimuth.

Light time, aberration, deflection of light, precession, nutation and the Earth's rotation are skyfield's, with its
built-in tables (nothing is downloaded); the path is that of :mod:`flybystab.orbit.vector_function`.
"""

from __future__ import annotations

from functools import lru_cache

import astropy.units as u
import numpy as np
from astropy.table import QTable
from astropy.time import Time
from skyfield.api import load, wgs84
from skyfield.timelib import Time as SkyfieldTime
from skyfield.timelib import Timescale

from flybystab.orbit.ephemeris import Ephemeris, ephemeris
from flybystab.orbit.observatories import Observer
from flybystab.orbit.orbit import Orbit
from flybystab.orbit.vector_function import ephemeris_file
from flybystab.typing import Array

#: Half of the interval over which the rate of motion is taken, d.
_HALF = 30.0 / 86400.0
#: Default slope of the phase function.
SLOPE = 0.15


@lru_cache(maxsize=1)
def timescale() -> Timescale:
    """The time scale of skyfield with its built-in leap seconds and Delta T."""
    return load.timescale(builtin=True)


def skyfield_times(time: Time, shift: float = 0.0) -> SkyfieldTime:
    """Times in skyfield, `shift` days later; whole and fractional days are passed separately."""
    tt = time.tt
    return timescale().tt_jd(np.atleast_1d(tt.jd1), np.atleast_1d(tt.jd2) + shift)


def phase_function(phase: Array, slope: float) -> Array:
    """Brightness relative to zero phase angle (rad) in the H, G system (Bowell et al. 1989)."""
    half = np.tan(0.5 * np.asarray(phase))
    return (1.0 - slope) * np.exp(-3.33 * half**0.63) + slope * np.exp(-1.87 * half**1.22)


def sky_positions(
    orbit: Orbit,
    times: Time,
    observer: Observer | None = None,
    magnitude: float | None = None,
    slope: float | None = None,
    eph: str | Ephemeris | None = None,
) -> QTable:
    """Observed positions of an asteroid.

    Parameters
    ----------
    orbit : Orbit
    times : Time
        Shape (n,).
    observer : Observer, optional
        The geocentre by default.
    magnitude, slope : float, optional
        H (mag) and G of the phase function; without H no magnitude. G is 0.15 by default.
    eph : str or Ephemeris, optional
        The best one installed by default.

    Returns
    -------
    QTable
        ``time``; ``ra``, ``dec`` (deg): apparent place, true equator and equinox of date; ``ra_icrf``, ``dec_icrf``
        (deg): astrometric place (light time only), ICRF; ``distance`` (from the observer) and ``sun_distance`` (au), at
        the time when the light left; ``ra_rate`` (times cos dec) and ``dec_rate`` (arcsec/min): rates of the apparent
        place; ``phase`` (deg, Sun-asteroid-observer), ``elongation`` (deg, Sun-observer-asteroid); ``V`` (mag);
        ``altitude``, ``azimuth`` (deg, from north through east; without refraction) of an observer on the ground.

    Raises
    ------
    OutOfSpan
        A time that the ephemeris does not cover.
    """
    chosen = eph if isinstance(eph, Ephemeris) else ephemeris(eph)
    chosen.check(times.min() - _HALF * u.d, times.max() + _HALF * u.d)
    file = ephemeris_file(chosen)
    place = file["earth"]
    if observer is not None:
        place = place + wgs84.latlon(observer.latitude, observer.longitude, elevation_m=observer.height)
    target = file["sun"] + orbit.to_skyfield(ephemeris=chosen)
    moment = skyfield_times(times)
    at = place.at(moment)
    astrometric = at.observe(target)
    apparent = astrometric.apparent()
    ra, dec, distance = apparent.radec(epoch="date")
    ra_icrf, dec_icrf, _ = astrometric.radec()
    away = astrometric.xyz.au
    # The Sun from the asteroid when the light left it.
    left = timescale().tt_jd(moment.whole, moment.tt_fraction - astrometric.light_time)
    from_sun = orbit.to_skyfield(ephemeris=chosen).at(left).xyz.au
    r, delta = np.linalg.norm(from_sun, axis=0), np.linalg.norm(away, axis=0)
    phase = np.arccos(np.clip(np.sum(away * from_sun, axis=0) / (r * delta), -1.0, 1.0))
    ends = []
    for shift in (-_HALF, _HALF):
        there = place.at(skyfield_times(times, shift)).observe(target).apparent().radec(epoch="date")
        ends.append((there[0].radians, there[1].radians))
    east = np.remainder(ends[1][0] - ends[0][0] + np.pi, 2.0 * np.pi) - np.pi
    per_minute = np.degrees(1.0) * 3600.0 / (2.0 * _HALF * 1440.0)
    out = QTable()
    out["time"] = times
    out["ra"], out["dec"] = ra._degrees * u.deg, dec.degrees * u.deg
    out["ra_icrf"], out["dec_icrf"] = ra_icrf._degrees * u.deg, dec_icrf.degrees * u.deg
    out["distance"], out["sun_distance"] = distance.au * u.au, r * u.au
    out["ra_rate"] = east * np.cos(dec.radians) * per_minute * u.arcsec / u.min
    out["dec_rate"] = (ends[1][1] - ends[0][1]) * per_minute * u.arcsec / u.min
    out["phase"] = np.degrees(phase) * u.deg
    out["elongation"] = at.observe(file["sun"]).apparent().separation_from(apparent).degrees * u.deg
    out["V"] = np.full(len(out), np.nan) * u.mag
    if magnitude is not None and np.isfinite(magnitude):
        g = SLOPE if slope is None or not np.isfinite(slope) else slope
        out["V"] = (magnitude + 5.0 * np.log10(r * delta) - 2.5 * np.log10(phase_function(phase, g))) * u.mag
    if observer is not None:
        altitude, azimuth, _ = apparent.altaz()
        out["altitude"], out["azimuth"] = altitude.degrees * u.deg, azimuth.degrees * u.deg
    out.meta = {
        "observer": "geocentre" if observer is None else observer.name,
        "ephemeris": chosen.name,
        "frame": "ra, dec: true equator and equinox of date; ra_icrf, dec_icrf: ICRF",
    }
    return out
