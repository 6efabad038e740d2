"""Osculating elements of a heliocentric orbit and its state."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flybystab.constants import AU, DAY, OBLIQUITY_J2000
from flybystab.errors import InvalidInput
from flybystab.orbit.kepler import states_at_times, time_at_anomaly
from flybystab.orbit.planets import PLANETS
from flybystab.typing import Array

#: GM of the Sun for the osculating elements of JPL (DE440/441), m3/s2.
GM_SUN = PLANETS["sun"].gm
#: GM of the solar system, m3/s2, for barycentric elements: 2.96309274879932e-4 au3/d2, the sum of the masses of
#: DE440 with systems of satellites and 16 asteroids (``gm_total`` of Sorcha).
GM_TOTAL = 2.9630927487993194e-04 * AU**3 / DAY**2


def gm_of(centre: str) -> float:
    """GM for elements about a centre, m3/s2: that of the body, or of the solar system for ``"ssb"``."""
    return GM_TOTAL if centre == "ssb" else PLANETS[centre].gm


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
        GM of the Sun with which the elements were computed, m3/s2.
    """
    state = state_in_plane(q, e, i, node, peri, since, gm)
    turn = ecliptic_to_icrf()
    return np.concatenate([turn @ state[:3], turn @ state[3:]])


def state_in_plane(
    q: float, e: float, i: float, node: float, peri: float, since: float, gm: float = GM_SUN
) -> Array:
    """State with the axes of the plane to which the elements of :func:`state_from_elements` refer, shape (6,)."""
    x, y, vx, vy = states_at_times(gm, q, e - 1.0, np.array([since]))[0]
    cn, sn, ci, si = np.cos(node), np.sin(node), np.cos(i), np.sin(i)
    cw, sw = np.cos(peri), np.sin(peri)
    p = np.array([cn * cw - sn * sw * ci, sn * cw + cn * sw * ci, sw * si])
    w = np.array([-cn * sw - sn * cw * ci, -sn * sw + cn * cw * ci, cw * si])
    return np.concatenate([x * p + y * w, vx * p + vy * w])


@dataclass(frozen=True)
class GivenElements:
    """Elements as they were given: any set that defines an orbit, with None for those that were not given.

    Attributes
    ----------
    a, q : float or None
        Semi-major axis and perihelion distance, m.
    e : float or None
        Eccentricity.
    i, node, peri, M : float or None
        Inclination, longitude of the node, argument of perihelion and mean anomaly, rad.
    Tp : float or None
        Time since perihelion, s.
    """

    a: float | None = None
    q: float | None = None
    e: float | None = None
    i: float | None = None
    node: float | None = None
    peri: float | None = None
    M: float | None = None
    Tp: float | None = None

    def perihelion(self, gm: float) -> tuple[float, float, float, float, float, float]:
        """q, e, i, node, peri and the time since perihelion (m, rad, s).

        Parameters
        ----------
        gm : float
            m3/s2.

        Raises
        ------
        InvalidInput
            Elements are missing, given twice, or contradict each other.
        """
        at = {name: value for name, value in vars(self).items() if value is not None}
        named = ", ".join(at)
        missing = [n for n in ("e", "i", "node", "peri") if n not in at]
        if missing:
            raise InvalidInput("elements", named or "none", f"also {', '.join(missing)}")
        for one, other in (("a", "q"), ("M", "Tp")):
            if one in at and other in at:
                raise InvalidInput("elements", named, f"{one} or {other}, not both")
            if one not in at and other not in at:
                raise InvalidInput("elements", named, f"also {one} or {other}")
        e = at["e"]
        if e == 1.0 and not ("q" in at and "Tp" in at):
            raise InvalidInput(
                "elements", named, "q and Tp for a parabola (e = 1), which has neither a nor M"
            )
        if "a" in at:
            a = at["a"]
            if a == 0.0 or e < 0.0 or (a > 0.0) != (e < 1.0):
                raise InvalidInput("e", e, f"below 1 for a > 0, above 1 for a < 0 (a = {a:g} m)")
            q = a * (1.0 - e)
        else:
            q = at["q"]
            if q <= 0.0 or e < 0.0:
                raise InvalidInput("q, e", f"{q:g} m, {e:g}", "q above 0 and e of 0 or more")
            a = q / (1.0 - e) if e != 1.0 else np.inf
        since = at["Tp"] if "Tp" in at else at["M"] * np.sqrt(abs(a) ** 3 / gm)
        return q, e, at["i"], at["node"], at["peri"], float(since)


def elements_from_state(state: Array, gm: float = GM_SUN) -> tuple[float, float, float, float, float, float]:
    """Elements of the J2000 ecliptic from a heliocentric ICRF state: the inverse of :func:`state_from_elements`.

    Parameters
    ----------
    state : ndarray, shape (6,)
        m and m/s; any conic with angular momentum.
    gm : float
        m3/s2.

    Returns
    -------
    q, e, i, node, peri, since : float
        m, 1, rad and s. The node of an orbit in the ecliptic and the perihelion of a circle are zero. `since` is
        within half a revolution of perihelion.
    """
    turn = ecliptic_to_icrf().T
    x, v = turn @ state[:3], turn @ state[3:]
    r = float(np.linalg.norm(x))
    h = np.cross(x, v)
    momentum = float(np.linalg.norm(h))
    normal = h / momentum
    across = float(np.hypot(normal[0], normal[1]))
    i = float(np.arctan2(across, normal[2]))
    node = float(np.arctan2(normal[0], -normal[1])) % (2.0 * np.pi) if across > 0.0 else 0.0
    towards_node = np.array([np.cos(node), np.sin(node), 0.0])
    vector = np.cross(v, h) / gm - x / r
    e = float(np.linalg.norm(vector))
    perihelion = vector / e if e > 1e-15 else towards_node
    q = momentum**2 / gm / (1.0 + e)
    # 1 - e = q/a is accurate near the parabola, where 1 - |e| of the eccentricity vector cancels.
    inverse = 2.0 / r - float(v @ v) / gm
    f = -q * inverse if abs(q * inverse) < 0.01 else e - 1.0
    peri = np.arctan2(perihelion @ np.cross(normal, towards_node), perihelion @ towards_node) % (2.0 * np.pi)
    anomaly = float(np.arctan2(x @ np.cross(normal, perihelion), x @ perihelion))
    w = np.sqrt(q / (2.0 + f)) * np.tan(0.5 * anomaly)
    z = np.sqrt(abs(f) / q) * w
    ratio = (np.arctan(z) if f < 0.0 else np.arctanh(z)) / z if z else 1.0
    return q, 1.0 + f, i, node, float(peri), float(time_at_anomaly(gm, q, f, 2.0 * w * ratio))
