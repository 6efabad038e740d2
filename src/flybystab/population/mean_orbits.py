"""Mean orbits of the planets: semi-major axis, eccentricity, inclination to the J2000 ecliptic.

Standish & Williams, "Approximate positions of the planets" (JPL, elements at J2000, valid 1800-2050). Over a million
years eccentricities and inclinations vary, those of the Earth up to about 0.06 and 4 deg: pass other elements for
another epoch.
"""

from __future__ import annotations

import numpy as np

from flybystab.constants import AU
from flybystab.errors import UnknownName

#: Name: a (au), e, i (deg).
MEAN_ORBITS = {
    "mercury": (0.38709927, 0.20563593, 7.00497902),
    "venus": (0.72333566, 0.00677672, 3.39467605),
    "earth": (1.00000261, 0.01671123, 0.0),
    "moon": (1.00000261, 0.01671123, 0.0),
    "mars": (1.52371034, 0.09339410, 1.84969142),
    "jupiter": (5.20288700, 0.04838624, 1.30439695),
    "saturn": (9.53667594, 0.05386179, 2.48599187),
    "uranus": (19.18916464, 0.04725744, 0.77263783),
    "neptune": (30.06992276, 0.00859048, 1.77004347),
}


def mean_orbit(name: str) -> np.ndarray:
    """Semi-major axis (m), eccentricity, inclination (rad).

    Raises
    ------
    UnknownName
    """
    if name not in MEAN_ORBITS:
        raise UnknownName("mean orbit of", name, [], f"(known: {', '.join(MEAN_ORBITS)})")
    a, e, i = MEAN_ORBITS[name]
    return np.array([a * AU, e, np.radians(i)])
