"""Barycentres of the solar system of different ephemerides.

DE440 and DE441 include 30 bodies and a ring of the Kuiper belt (Park et al. 2021, AJ 161, 105), which shifts their
barycentre by 115 to 136 km from that of older ephemerides. States relative to the barycentre are those of DE440 and
DE441 in this package, as of Horizons, ASSIST and layup. For an older ephemeris they are shifted by the difference of
the two positions of the Sun relative to its barycentre, a polynomial of time for DE421. From 1900 to 2052 it is within
0.09 km and 2e-6 m/s of the files of DE440 and DE421 in each coordinate (``tests/orbit/test_barycentre.py``).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.polynomial import chebyshev

from flybystab.constants import DAY
from flybystab.errors import InvalidInput, UnknownName
from flybystab.orbit.ephemeris import EPHEMERIDES
from flybystab.typing import Array

if TYPE_CHECKING:
    from astropy.time import Time

    from flybystab.orbit.ephemeris import Window

#: Ephemerides whose barycentre includes the Kuiper belt, and older ones, which agree with DE421 within a few km
#: (DE430: 0.3 km in 2015).
WITH_BELT = ("de440", "de441")
WITHOUT_BELT = ("de421", "de430", "de431", "de432", "de433", "de434", "de435", "de436", "de438")
#: Middle and half of the span of the polynomial, days from J2000.
_MIDDLE, _HALF = -8674.6875, 27667.6875
#: Sun of DE440 less Sun of DE421, each relative to its barycentre: Chebyshev coefficients (m, ICRF).
_SUNS = np.array(
    [
        [-108851.6, 5586.7, 1478.3, -175.4, 318.9, -81.5],
        [-43419.8, -5876.6, 4439.4, -1684.8, 162.6, 25.2],
        [22270.4, -45427.6, 2202.9, 485.9, -10.9, 57.5],
    ]
).T
_RATES = chebyshev.chebder(_SUNS) / (_HALF * DAY)


def barycentre_of_de440(name: str, epoch: Time, t: Array) -> Array:
    """Barycentre of DE440 relative to that of another ephemeris, shape (n, 6), m and m/s, ICRF.

    Parameters
    ----------
    name : str
        Name of the other ephemeris.
    epoch : Time
        Origin of time.
    t : ndarray, shape (n,)
        s (TDB) from it.

    Raises
    ------
    InvalidInput
        A time before 1900 or after 2052 for an ephemeris without the Kuiper belt.
    UnknownName
    """
    source = EPHEMERIDES.get(name)
    known = name in WITH_BELT + WITHOUT_BELT
    if source is None and not known:
        raise UnknownName("ephemeris", name, [], known=f"(known: {', '.join(WITH_BELT + WITHOUT_BELT)})")
    out = np.zeros((len(t), 6))
    if source.kuiper_belt if source is not None else name in WITH_BELT:
        return out
    zero = epoch.tdb
    days = (zero.jd1 - 2451545.0) + zero.jd2 + np.asarray(t) / DAY
    x = (days - _MIDDLE) / _HALF
    if np.any(np.abs(x) > 1.0):
        raise InvalidInput(
            "time",
            f"{zero.jyear + float(t[np.argmax(np.abs(x))]) / DAY / 365.25:.1f}",
            f"1900 to 2052 for a barycentric state with {name.upper()}; give the state relative to the Sun",
        )
    out[:, :3] = -chebyshev.chebval(x, _SUNS).T
    out[:, 3:] = -chebyshev.chebval(x, _RATES).T
    return out


def barycentre_in(window: Window, t: Array) -> Array:
    """Barycentre of DE440 relative to that of the ephemeris of a window, at s from the epoch of the window."""
    return barycentre_of_de440(window.name, window.epoch, t)
