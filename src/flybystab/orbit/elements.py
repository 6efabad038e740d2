"""Osculating elements of a heliocentric orbit and its state."""

from __future__ import annotations

import numpy as np

from flybystab.constants import OBLIQUITY_J2000
from flybystab.orbit.kepler import states_at_times
from flybystab.orbit.planets import PLANETS
from flybystab.typing import Array

#: Sun's GM behind the osculating elements of JPL (DE440/441), m3/s2.
GM_SUN = PLANETS["sun"].gm


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
