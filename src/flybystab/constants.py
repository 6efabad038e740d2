"""Physical constants in SI units, each with its source.

Bodies of the solar system (GM, radius, J2, pole) live in :mod:`flybystab.orbit.planets`.
"""

from __future__ import annotations

#: Newtonian constant of gravitation, m3 kg-1 s-2 (CODATA 2018).
G = 6.6743e-11

#: Astronomical unit, m (IAU 2012 Resolution B2, exact).
AU = 149_597_870_700.0

#: Speed of light, m/s (SI, exact).
C_LIGHT = 299_792_458.0

#: Day, s.
DAY = 86_400.0
#: Julian year, s.
YEAR = 365.25 * DAY

#: Hour, s.
HOUR = 3_600.0

#: Obliquity of the ecliptic at J2000, rad: 84381.448 arcsec (IAU 1976), the angle that JPL uses to define
#: the "J2000 ecliptic" frame of small-body elements.
OBLIQUITY_J2000 = 84381.448 / 3600.0 * 3.141592653589793 / 180.0

#: Equatorial radius of the Earth, m (WGS 84).
R_EARTH = 6_378_137.0

#: Geocentric gravitational constant including the atmosphere, m3/s2 (IERS 2010, TCG-compatible).
GM_EARTH = 3.986004418e14
