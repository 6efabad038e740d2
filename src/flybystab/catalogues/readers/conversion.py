"""Conversion of elements and states in orbit files to catalogue rows.

Rows contain heliocentric elements with axes of the J2000 ecliptic. States relative to another centre or with other axes
are converted.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from flybystab.constants import AU, DAY
from flybystab.errors import InvalidInput
from flybystab.typing import Array

if TYPE_CHECKING:
    from astropy.time import Time

    from flybystab.orbit.covariance import Covariance

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
#: Displacement (m) below which rounding errors of the printed elements are neglected.
_NEGLIGIBLE = 1e3


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


def cartesian_covariance(
    jd: float,
    names: Sequence[str],
    values: Sequence[float],
    matrix: Array,
    source: str,
    *,
    gm: float | None = None,
    correlated: bool = True,
    caveat: str = "",
) -> Covariance:
    """Covariance of the state with ICRF axes, from that of elements (au, days, degrees) to first order.

    The arguments are those of :func:`state_of`; A1, A2, A3 (au/d2), DT (d), AMRAT (m2/kg) may follow the elements.
    """
    from flybystab.orbit.covariance import NONGRAV_PARAMETERS, SETS, Covariance

    extra = [n for n in names if n in NONGRAV_PARAMETERS]
    elements = [n for n in names if n not in NONGRAV_PARAMETERS]
    middle = np.array(values[: len(elements)], dtype=float)
    jacobian = np.zeros((6 + len(extra), len(names)))
    sigma = np.sqrt(np.diag(matrix))
    for k in range(len(elements)):
        step = np.zeros(len(elements))
        # The step balances rounding errors against the truncation error of the central difference.
        step[k] = max(1e-6 * abs(middle[k]), min(float(sigma[k]), 1e-3), 1e-9)
        difference = state_of(elements, middle + step, gm) - state_of(elements, middle - step, gm)
        jacobian[:6, k] = difference / (2.0 * step[k])
    scale = np.array([_SI[_UNITS[n]] for n in extra])
    jacobian[6:, len(elements) :] = np.diag(scale)
    mean = np.concatenate(
        [state_of(elements, middle, gm), np.array(values[len(elements) :], dtype=float) * scale]
    )
    return Covariance(
        _time(jd),
        (*SETS["cartesian"], *extra),
        mean,
        _symmetric(jacobian @ matrix @ jacobian.T),
        source,
        correlated,
        caveat,
    )


def _symmetric(matrix: Array) -> Array:
    return np.asarray(0.5 * (matrix + matrix.T))


@lru_cache(maxsize=4096)
def _time(jd: float) -> Time:
    from astropy.time import Time

    whole = np.floor(jd)
    return Time(whole, jd - whole, format="jd", scale="tdb")


_UNITS: Mapping[str, str] = (
    dict.fromkeys(("a", "q", "x", "y", "z"), "au")
    | dict.fromkeys(("vx", "vy", "vz"), "au/d")
    | dict.fromkeys(("i", "node", "peri", "M", "L"), "deg")
    | dict.fromkeys(("e", "h", "k", "P", "Q"), "")
    | dict.fromkeys(("A1", "A2", "A3"), "au/d2")
    | {"tp": "d", "DT": "d", "AMRAT": "m2/kg"}
)

#: SI value of each unit.
_SI: Mapping[str, float] = {
    "au": AU, "au/d": AU / DAY, "deg": DEGREE, "": 1.0, "au/d2": AU / DAY**2, "d": DAY, "m2/kg": 1.0,
}  # fmt: skip


def covariance_of(
    jd: float,
    names: Sequence[str],
    values: Sequence[float],
    matrix: Array,
    source: str,
    file: str,
    *,
    correlated: bool = True,
) -> Covariance:
    """Covariance of heliocentric elements with ecliptic axes, in au, days, degrees, au/d2 and m2/kg.

    A cartesian state has ecliptic axes as well.

    Raises
    ------
    InvalidInput
        The matrix is not a covariance.
    """
    from flybystab.orbit.covariance import Covariance

    matrix = np.asarray(matrix, dtype=float)
    scale = np.sqrt(np.abs(np.outer(np.diag(matrix), np.diag(matrix))))
    if matrix.shape != (len(names),) * 2 or np.any(np.abs(matrix - matrix.T) > 1e-6 * scale):
        raise InvalidInput("covariance", matrix.shape, f"a symmetric matrix of {', '.join(names)} in {file}")
    matrix = _symmetric(matrix)  # printed digits of the two halves may differ
    if "x" in names:
        return cartesian_covariance(jd, names, values, matrix, source, correlated=correlated)
    unit = np.array([_SI[_UNITS[n]] for n in names])
    return Covariance(
        _time(jd), tuple(names), np.array(values) * unit, matrix * np.outer(unit, unit), source, correlated
    )


def printed_covariance(
    jd: float, names: Sequence[str], texts: Sequence[str], offset: float, source: str, gm: float | None = None
) -> Covariance | None:
    """Covariance of the rounding errors of printed elements; None if they displace the asteroid by less than 1 km.

    Each element is uniformly distributed within half a unit of its last digit. All angles are given the largest number
    of decimals among them, since some tables omit trailing zeros. The error of the orbit itself is not included.

    Parameters
    ----------
    jd : float
        Epoch.
    names, texts : sequences of str
        Elements as in :func:`state_of`, as printed.
    offset : float
        Number to be subtracted from the printed ``tp``.
    """
    values = [float(t) - (offset if n == "tp" else 0.0) for n, t in zip(names, texts, strict=True)]
    _check_conic(dict(zip(names, values, strict=True)), source)
    sigma = printed_sigmas(names, texts)
    if _displacement(names, values, sigma) < _NEGLIGIBLE:
        return None
    from flybystab.orbit.covariance import DIGITS

    what, caveat = f"digits of {source}", DIGITS
    if gm is not None or "x" in names:
        matrix = np.diag(sigma**2)
        return cartesian_covariance(jd, names, values, matrix, what, gm=gm, correlated=False, caveat=caveat)
    from flybystab.orbit.covariance import Covariance

    scale = np.array([_SI[_UNITS[n]] for n in names])
    return Covariance(
        _time(jd), tuple(names), np.array(values) * scale, np.diag((sigma * scale) ** 2), what, False, caveat
    )


def _check_conic(at: Mapping[str, float], source: str) -> None:
    """Raise InvalidInput for an eccentricity that is inconsistent with the axis or the perihelion distance."""
    e = at.get("e", 0.0)
    if e < 0.0 or at.get("q", 1.0) <= 0.0 or ("a" in at and (at["a"] == 0.0 or (at["a"] > 0.0) != (e < 1.0))):
        given = ", ".join(f"{n} = {at[n]:g}" for n in ("a", "q", "e") if n in at)
        raise InvalidInput(
            "elements", given, f"e of 0 or more, below 1 for a > 0, above 1 for a < 0, q > 0 in {source}"
        )


def _displacement(names: Sequence[str], values: Sequence[float], sigma: Array) -> float:
    """Displacement (m) of the asteroid that results from errors of the elements; an estimate of its order."""
    at = dict(zip(names, sigma, strict=True))
    if "x" in at:
        return float(np.linalg.norm([at[c] for c in "xyz"])) * AU
    size = abs(dict(zip(names, values, strict=True)).get("a", 1.0)) * AU
    lengths = [at[c] * AU for c in ("a", "q") if c in at] + [at[c] * size for c in "ehkPQ" if c in at]
    angles = [at[c] * DEGREE * size for c in ("i", "node", "peri", "M", "L") if c in at]
    return float(np.linalg.norm([*lengths, *angles, at.get("tp", 0.0) * DAY * 3e4]))


def printed_sigmas(names: Sequence[str], texts: Sequence[str]) -> Array:
    """1-sigma errors of elements that are uniformly distributed within half a unit of their last printed digit."""
    decimals = [decimals_of(t) for t in texts]
    angular = [d for n, d in zip(names, decimals, strict=True) if _UNITS[n] == "deg"]
    shown = [max(angular) if _UNITS[n] == "deg" else d for n, d in zip(names, decimals, strict=True)]
    return np.asarray(0.5 * 10.0 ** -np.array(shown, dtype=float) / np.sqrt(3.0))


def decimals_of(text: str) -> int:
    """Number of decimals of a printed number, taking its exponent into account."""
    mantissa, _, exponent = text.strip().lower().partition("e")
    return len(mantissa.partition(".")[2]) - int(exponent or 0)
