"""Sun, planets, Moon and Pluto: mass, figure, pole and impact distance.

A new body is one new entry in ``_TABLE``; :mod:`flybystab.orbit` derives everything else from it. Three bodies are
special: the Sun (the centre of two-body motion and of non-gravitational accelerations) and the pair of Earth and Moon,
whose series are their barycentre and the Moon from the Earth; the Earth's pole is that of date.

Sources
-------
GM: DE440 (Park et al. 2021), the planet alone, not its system, for Mars outwards (JPL satellite
ephemerides: MAR097, JUP365, SAT427, URA111, NEP095; Pluto: Brozovic et al. 2015); Earth: IERS 2010.
Radius and pole: IAU Working Group on Cartographic Coordinates and Rotational Elements 2009 and 2015
(Archinal et al. 2011, 2018), equatorial radii, pole at J2000; Earth: WGS 84; Sun: IAU 2015 Resolution B3.
J3 and J4 of the Earth: DE440.
J2: Mercury: Mazarico et al. 2014; Venus: Konopliv et al. 1999; Earth, Moon, Sun: DE440; Mars: Konopliv et
al. 2016; Jupiter: Iess et al. 2018; Saturn: Iess et al. 2019; Uranus: Jacobson 2014; Neptune: Jacobson
2009. Each is scaled to the radius of the table.
Mean orbits: Simon et al. 1994 (semi-major axes); Standish & Williams, "Approximate positions of the planets", JPL
(eccentricities and inclinations at J2000, valid 1800-2050).
Atmosphere: Earth: Karman line (FAI); Venus, Mars, Jupiter: entry interfaces of the Pioneer Venus
probes (200 km), of the Mars landers (125 km) and of the Galileo probe (450 km above 1 bar). Saturn,
Uranus and Neptune have no agreed interface: the 1-bar radius is used.
"""

from __future__ import annotations

import difflib
from dataclasses import dataclass

import astropy.units as u
import numpy as np
from astropy.time import Time
from astropy.units import Quantity

from flybystab.constants import AU, GM_EARTH, R_EARTH, YEAR
from flybystab.errors import InvalidInput, UnknownName
from flybystab.orbit.epochs import later
from flybystab.units import to_si


@dataclass(frozen=True)
class Planet:
    """A body of the solar system, SI units.

    Attributes
    ----------
    name : str
        Lower-case English name.
    gm : float
        Gravitational parameter, m3/s2.
    radius : float
        Equatorial radius, m; 1-bar level for the giant planets.
    j2 : float
        Second zonal harmonic for `radius`, dimensionless.
    pole : tuple of float
        Unit vector of the rotation pole at J2000, ICRF.
    atmosphere : float
        Height of the top of the atmosphere above `radius`, m; zero without one.
    target : int
        NAIF number of the ephemeris target (a system barycentre from Mars outwards).
    orbit_radius : float
        Semi-major axis of the orbit around the Sun (Moon: that of the Earth), m; zero for the Sun.
    series : tuple of int, optional
        NAIF numbers (centre, target) of the series of its position in an ephemeris. Such a body attracts asteroids
        and can be encountered on a real orbit; with None only hyperbolic encounters are possible.
    relativity : bool
        True if it is a source of 1PN terms (:mod:`flybystab.orbit.relativity`).
    j3, j4 : float
        Third and fourth zonal harmonic for `radius`, dimensionless; zero: not modelled.
    orbit_eccentricity, orbit_inclination : float
        Of the mean orbit around the Sun (Moon: that of the Earth); inclination to the ecliptic of J2000, rad.
    """

    name: str
    gm: float
    radius: float
    j2: float
    pole: tuple[float, float, float]
    atmosphere: float
    target: int
    orbit_radius: float
    series: tuple[int, int] | None = None
    relativity: bool = False
    j3: float = 0.0
    j4: float = 0.0
    orbit_eccentricity: float = 0.0
    orbit_inclination: float = 0.0

    def __post_init__(self) -> None:
        for name in ("gm", "radius"):
            to_si(getattr(self, name), u.one, name, low=0.0, open_low=True)
        for name in ("atmosphere", "orbit_radius"):
            to_si(getattr(self, name), u.one, name, low=0.0)

    @property
    def impact_distance(self) -> float:
        """Distance from the centre below which an encounter is an impact, m: atmosphere or surface."""
        return self.radius + self.atmosphere

    def impact_level(self, distance: float) -> str | None:
        """Lowest level reached at periapsis distance `distance` (m): ``"surface"``, ``"atmosphere"`` or None."""
        if distance < self.radius:
            return "surface"
        return "atmosphere" if distance < self.impact_distance else None

    def pole_at(self, time: Time) -> tuple[float, float, float]:
        """Unit vector of the rotation pole, ICRF.

        The pole of the Earth moves by 0.56 deg a century (IAU 2006 precession, Capitaine et al. 2003: X = 2004.19" T -
        0.43" T^2, Y = -22.41" T^2, nutation of 9" left out): after the 2029 encounter of Apophis the effect is 3 km
        within a year. The other poles are fixed, with errors of up to 0.1 deg a century.
        """
        if self.name != "earth":
            return self.pole
        t = (time.tdb.jd - 2451545.0) / 36525.0
        x, y = (
            np.radians((2004.191898 * t - 0.4297829 * t * t) / 3600.0),
            np.radians(-22.4072747 * t * t / 3600.0),
        )
        return float(x), float(y), float(np.sqrt(1.0 - x * x - y * y))

    def pole_motion(self, time: Time) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        """The pole at `time` (:meth:`pole_at`) and its rate, 1/s, by a difference over a year."""
        now = self.pole_at(time)
        if self.name != "earth":
            return now, (0.0, 0.0, 0.0)
        before, after = (self.pole_at(later(time, sign * 0.5 * YEAR)) for sign in (-1.0, 1.0))
        x, y, z = ((b - a) / YEAR for a, b in zip(before, after, strict=True))
        return now, (x, y, z)

    def __repr__(self) -> str:
        return f"<Planet {self.name}, radius {self.radius / 1e3:.0f} km>"


def _direction(ra: float, dec: float) -> tuple[float, float, float]:
    """Unit vector of right ascension and declination in degrees."""
    a, d = np.radians(ra), np.radians(dec)
    return float(np.cos(d) * np.cos(a)), float(np.cos(d) * np.sin(a)), float(np.sin(d))


def _body(
    name: str,
    gm: float,
    radius: float,
    j2: float,
    pole: tuple[float, float],
    atmosphere: float,
    target: int,
    orbit_radius: float,
    series: tuple[int, int],
    relativity: bool = False,
    j3: float = 0.0,
    j4: float = 0.0,
) -> Planet:
    """One entry of the table: GM in km3/s2, lengths in km, pole (ra, dec) in deg, radius of the orbit in au."""
    eccentricity, inclination = _MEAN_ORBIT.get(name, (0.0, 0.0))
    return Planet(
        name,
        gm * 1e9,
        radius * 1e3,
        j2,
        _direction(*pole),
        atmosphere * 1e3,
        target,
        orbit_radius * AU,
        series,
        relativity,
        j3,
        j4,
        eccentricity,
        float(np.radians(inclination)),
    )


#: Eccentricity and inclination to the ecliptic of J2000 (deg) of the mean orbits.
_MEAN_ORBIT = {
    "mercury": (0.20563593, 7.00497902),
    "venus": (0.00677672, 3.39467605),
    "earth": (0.01671123, 0.0),
    "moon": (0.01671123, 0.0),
    "mars": (0.09339410, 1.84969142),
    "jupiter": (0.04838624, 1.30439695),
    "saturn": (0.05386179, 2.48599187),
    "uranus": (0.04725744, 0.77263783),
    "neptune": (0.00859048, 1.77004347),
    "pluto": (0.24882730, 17.14001206),
}

_TABLE = (
    _body("sun", 132712440041.279419, 695700.0, 2.1961e-7, (286.13, 63.87), 0.0, 10, 0.0, (0, 10), True),
    _body("mercury", 22031.868551, 2440.53, 5.0322e-5, (281.0103, 61.4155), 0.0, 1, 0.387098, (0, 1)),
    _body("venus", 324858.592, 6051.8, 4.4044e-6, (272.76, 67.16), 200.0, 2, 0.723332, (0, 2), True),
    _body(
        "earth",
        GM_EARTH * 1e-9,
        R_EARTH * 1e-3,
        1.08262539e-3,
        (0.0, 90.0),
        100.0,
        399,
        1.000001,
        (0, 3),
        True,
        -2.532410e-6,
        -1.619898e-6,
    ),
    _body(
        "moon",
        4902.800118,
        1737.4,
        2.03215685e-4 * (1738.0 / 1737.4) ** 2,
        (266.93, 65.65),
        0.0,
        301,
        1.000001,
        (3, 301),
    ),
    _body("mars", 42828.37362, 3396.19, 1.9566e-3, (317.68143, 52.88650), 125.0, 4, 1.523679, (0, 4)),
    _body(
        "jupiter",
        126686531.9,
        71492.0,
        1.4696572e-2,
        (268.056595, 64.495303),
        450.0,
        5,
        5.202603,
        (0, 5),
        True,
    ),
    _body(
        "saturn",
        37931206.234,
        60268.0,
        1.6290573e-2 * (60330.0 / 60268.0) ** 2,
        (40.589, 83.537),
        0.0,
        6,
        9.554909,
        (0, 6),
        True,
    ),
    _body("uranus", 5793951.256, 25559.0, 3.51068e-3, (257.311, -15.175), 0.0, 7, 19.218446, (0, 7)),
    _body(
        "neptune",
        6835099.97,
        24764.0,
        3.40843e-3 * (25225.0 / 24764.0) ** 2,
        (299.334, 42.950),
        0.0,
        8,
        30.110387,
        (0, 8),
    ),
    _body("pluto", 869.6, 1188.3, 0.0, (132.993, -6.163), 0.0, 9, 39.482117, (0, 9)),
)

#: All bodies by name.
PLANETS: dict[str, Planet] = {body.name: body for body in _TABLE}


def planet(name: str | Planet) -> Planet:
    """The body of that name.

    Parameters
    ----------
    name : str or Planet
        English name, any case. A `Planet` is returned unchanged, so that a hypothetical one can be used.

    Raises
    ------
    UnknownName
        With near matches.
    """
    if isinstance(name, Planet):
        return name
    if not isinstance(name, str):
        raise InvalidInput("planet", name, "the name of a planet or a Planet")
    key = name.strip().lower()
    if key in PLANETS:
        return PLANETS[key]
    near = difflib.get_close_matches(key, list(PLANETS), n=3, cutoff=0.5)
    raise UnknownName("planet", name, near, known=f"(known: {', '.join(PLANETS)})")


#: Equatorial radius of the Earth as a Quantity.
R_earth: Quantity = R_EARTH * u.m
