"""Covariances of orbits from orbit files: published matrices, 1-sigma errors and the digits of printed elements.

Covariances of elements keep their elements. Those of a state, or of elements relative to another centre, are converted
to the covariance of a state with ICRF axes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from flybystab.catalogues.readers.conversion import DEGREE, number, state_of
from flybystab.constants import AU, DAY
from flybystab.errors import InvalidInput
from flybystab.typing import Array

if TYPE_CHECKING:
    from astropy.time import Time

    from flybystab.orbit.covariance import Covariance

#: Displacement (m) below which rounding errors of the printed elements are neglected.
_NEGLIGIBLE = 1e3
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


def sigmas_of(texts: Sequence[object], names: Sequence[str], file: str) -> Array | None:
    """1-sigma errors as numbers, shape (n,); None if all are zero, by which some programs denote unknown errors.

    Raises
    ------
    InvalidInput
        A value is negative or not a finite number.
    """
    out = np.array([number(t, f"sigma of {n}", file) for t, n in zip(texts, names, strict=True)])
    if np.any(out < 0.0):
        k = int(np.argmax(out < 0.0))
        raise InvalidInput(f"sigma of {names[k]}", texts[k], f"a 1-sigma of zero or more in {file}")
    return out if np.any(out > 0.0) else None


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


def _symmetric(matrix: Array) -> Array:
    return np.asarray(0.5 * (matrix + matrix.T))


@lru_cache(maxsize=4096)
def _time(jd: float) -> Time:
    from astropy.time import Time

    whole = np.floor(jd)
    return Time(whole, jd - whole, format="jd", scale="tdb")
