"""Conversion of elements and states in orbit files to catalogue rows.

Rows contain heliocentric elements with axes of the J2000 ecliptic. States relative to another centre or with other axes
are converted.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache

import numpy as np

from flybystab.constants import AU, DAY
from flybystab.errors import InvalidInput
from flybystab.typing import Array

#: Julian date of MJD 0, d.
MJD = 2400000.5
#: Names of the elements in the order of the catalogue columns, and of the components of a state.
KEPLERIAN = ("a", "e", "i", "node", "peri", "M")
COMETARY = ("q", "e", "i", "node", "peri", "tp")
CARTESIAN = ("x", "y", "z", "vx", "vy", "vz")
#: Column of a catalogue for each Keplerian element.
COLUMN_OF: Mapping[str, str] = dict(
    zip(KEPLERIAN, ("a_au", "e", "i_deg", "node_deg", "peri_deg", "M_deg"), strict=True)
)
#: One degree, rad.
DEGREE = np.pi / 180.0
#: Largest semi-major axis in a row, au; for larger ones q and the time of perihelion lose fewer digits.
_LARGEST_AXIS = 1e5


def julian(text: str) -> tuple[float, float]:
    """Whole and fractional day of a printed Julian date, so that differences keep all printed digits."""
    whole, _, fraction = text.strip().partition(".")
    return float(whole), float("0." + (fraction or "0"))


def number(text: object, name: str, file: str) -> float:
    """Convert a text of a file to a finite number.

    Raises
    ------
    InvalidInput
    """
    try:
        value = float(str(text).strip().lower().replace("d", "e"))
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise InvalidInput(name, text, f"a finite number in {file}")
    return value


def epoch_row(jd: float) -> dict[str, str]:
    """Column of the epoch; TT and TDB, which differ by less than 2 ms, are not distinguished."""
    return {"epoch_jd_tdb": repr(float(jd))}


def perihelion_row(jd: float, elements: Sequence[float], since: float) -> dict[str, str]:
    """Columns of an orbit given by its perihelion distance and time.

    Parameters
    ----------
    jd : float
        Epoch, TDB.
    elements : sequence of float
        q, e, i, node, peri; au and deg.
    since : float
        Days from the perihelion to the epoch.
    """
    from flybystab.orbit.elements import GM_SUN

    q, e, i, node, peri = (float(x) for x in elements)
    row = epoch_row(jd) | {"e": repr(e), "i_deg": repr(i), "node_deg": repr(node), "peri_deg": repr(peri)}
    axis = q / (1.0 - e) if e != 1.0 else np.inf
    if abs(axis) > _LARGEST_AXIS:
        return row | {"q_au": repr(q), "tp_jd_tdb": repr(jd - since)}
    mean = since * DAY * np.sqrt(GM_SUN / abs(axis * AU) ** 3) / DEGREE
    return row | {"a_au": repr(axis), "M_deg": repr(float(mean))}


def since_perihelion(mean: float, axis: float) -> float:
    """Days since perihelion for a mean anomaly (deg) and a semi-major axis (au)."""
    from flybystab.orbit.elements import GM_SUN

    return float(mean * DEGREE * np.sqrt(abs(axis * AU) ** 3 / GM_SUN) / DAY)


def axis_of(motion: float) -> float:
    """Semi-major axis (au) for a mean motion (deg/d)."""
    from flybystab.orbit.elements import GM_SUN

    return float(np.cbrt(GM_SUN / (motion * DEGREE / DAY) ** 2) / AU)


def equatorial_to_ecliptic(right_ascension: float, declination: float) -> tuple[float, float]:
    """Ecliptic longitude and latitude (deg, J2000) of a direction given by right ascension and declination (deg)."""
    from flybystab.orbit.elements import ecliptic_to_icrf

    alpha, delta = right_ascension * DEGREE, declination * DEGREE
    at = np.array([np.cos(delta) * np.cos(alpha), np.cos(delta) * np.sin(alpha), np.sin(delta)])
    x, y, z = ecliptic_to_icrf().T @ at
    return float(np.arctan2(y, x) / DEGREE) % 360.0, float(np.arcsin(z) / DEGREE)


def state_row(jd: float, state: Array) -> dict[str, str]:
    """Columns of the osculating elements of a heliocentric ICRF state (m, m/s)."""
    from flybystab.orbit.elements import elements_from_state

    q, e, i, node, peri, since = elements_from_state(state)
    angles = (i / DEGREE, node / DEGREE, peri / DEGREE)
    return perihelion_row(jd, (q / AU, e, *angles), since / DAY)


def elements_row(
    jd: float, names: Sequence[str], texts: Sequence[str], values: Sequence[float] | Array
) -> dict[str, str]:
    """Columns of a heliocentric orbit from any set of elements with axes of the J2000 ecliptic.

    Parameters
    ----------
    jd : float
        Epoch, TDB.
    names, values : sequences
        Elements as in :func:`state_of`.
    texts : sequence of str
        The elements as printed; Keplerian elements are copied with all digits.
    """
    if set(names) == set(KEPLERIAN):
        return epoch_row(jd) | {COLUMN_OF[n]: t for n, t in zip(names, texts, strict=True)}
    if set(names) == set(COMETARY):
        at = dict(zip(names, values, strict=True))
        return perihelion_row(jd, [at[n] for n in COMETARY[:5]], -at["tp"])
    return state_row(jd, state_of(names, values))


def rotated(state: Array, *, to_ecliptic: bool = False) -> Array:
    """Rotate states, shape (6, ...), from ecliptic to ICRF axes, or back with `to_ecliptic`."""
    from flybystab.orbit.elements import ecliptic_to_icrf

    turn = ecliptic_to_icrf().T if to_ecliptic else ecliptic_to_icrf()
    return np.concatenate([turn @ state[:3], turn @ state[3:]])


@lru_cache(maxsize=4096)
def _centre_offset(jd: float, centre: str, barycentre: str) -> tuple[float, ...]:
    import astropy.units as u
    from astropy.time import Time

    from flybystab.orbit.orbit import Orbit
    from flybystab.orbit.osculating_state import heliocentric

    one = np.array([AU, 0.0, 0.0, 0.0, 0.0, 0.0])
    whole = np.floor(jd)
    orbit = Orbit.from_state(
        Time(whole, jd - whole, format="jd", scale="tdb"),
        one[:3] * u.m,
        one[3:] * u.m / u.s,
        centre=centre,
        barycentre=barycentre,
    )
    return tuple(float(x) for x in heliocentric(orbit) - one)


def heliocentric_state(jd: float, state: Array, centre: str, barycentre: str = "de440") -> Array:
    """State (m, m/s, ICRF axes) relative to the Sun, from a state relative to another centre.

    Parameters
    ----------
    jd : float
        Time, TDB.
    state : ndarray, shape (6,)
    centre, barycentre : str
        As in :meth:`flybystab.Orbit.from_state`.
    """
    return state if centre == "sun" else state + np.array(_centre_offset(jd, centre, barycentre))


def state_of(names: Sequence[str], values: Sequence[float] | Array, gm: float | None = None) -> Array:
    """State (m, m/s, ICRF axes) from elements with ecliptic axes, in au, au/d, days and degrees.

    Parameters
    ----------
    names : sequence of str
        Names of a set in :data:`flybystab.orbit.covariance.SETS`; here a cartesian state has ecliptic axes.
    values : sequence of float
        Elements; ``tp`` is the time of perihelion minus the epoch.
    gm : float, optional
        GM of the centre, m3/s2; by default that of the Sun.
    """
    from flybystab.orbit.covariance import keplerian_angles
    from flybystab.orbit.elements import GM_SUN, state_from_elements

    mu = GM_SUN if gm is None else gm
    at = dict(zip(names, values, strict=True))
    if "x" in at:
        return rotated(np.array([*(at[c] * AU for c in "xyz"), *(at["v" + c] * AU / DAY for c in "xyz")]))
    if "h" in at:
        h, k, p, q, longitude = (np.array([at[c]]) for c in ("h", "k", "P", "Q", "L"))
        e, i, node, peri, mean = (float(x[0]) for x in keplerian_angles(h, k, p, q, longitude * DEGREE))
    else:
        e, i, node, peri = at["e"], *(at[c] * DEGREE for c in ("i", "node", "peri"))
        mean = at.get("M", 0.0) * DEGREE
    if "q" in at:
        q, since = at["q"] * AU, -at["tp"] * DAY
    else:
        q, since = at["a"] * AU * (1.0 - e), mean * np.sqrt(abs(at["a"] * AU) ** 3 / mu)
    return np.array(state_from_elements(q, e, i, node, peri, since, mu))
