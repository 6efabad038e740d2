"""Quantity <-> SI floats, converted once, at the boundary of the package."""

from __future__ import annotations

import re
from datetime import UTC, date, datetime
from typing import overload

import astropy.units as u
import numpy as np
from astropy.time import Time
from astropy.units import Quantity
from numpy.typing import ArrayLike

from flybystab.constants import R_EARTH
from flybystab.errors import InvalidInput, UnitMismatch
from flybystab.typing import Array


@overload
def to_si(
    value: object,
    unit: u.UnitBase,
    name: str,
    *,
    shape: tuple[()] = ...,
    low: float = ...,
    high: float = ...,
    open_low: bool = ...,
    open_high: bool = ...,
) -> float: ...


@overload
def to_si(
    value: object,
    unit: u.UnitBase,
    name: str,
    *,
    shape: tuple[int, ...] | None,
    low: float = ...,
    high: float = ...,
    open_low: bool = ...,
    open_high: bool = ...,
) -> Array: ...


def to_si(
    value: object,
    unit: u.UnitBase,
    name: str,
    *,
    shape: tuple[int, ...] | None = (),
    low: float = -np.inf,
    high: float = np.inf,
    open_low: bool = False,
    open_high: bool = False,
) -> float | Array:
    """SI value of a quantity after checks.

    Parameters
    ----------
    value : Quantity
        Value given by the user; a bare number is an error unless `unit` is dimensionless.
    unit : Unit
        The SI unit to convert to.
    name : str
        Name used in error messages.
    shape : tuple of int or None
        Required shape; ``()`` for a scalar, None for any.
    low, high : float
        Allowed range in `unit`, closed unless `open_low` or `open_high`.

    Returns
    -------
    float or ndarray
        A float for ``shape=()``, else an array of float64.

    Raises
    ------
    UnitMismatch
        Wrong dimension, or no unit at all.
    InvalidInput
        Wrong shape, masked (missing), not finite, or out of range.
    """
    given = value
    if not isinstance(given, Quantity):
        if unit != u.dimensionless_unscaled:
            raise UnitMismatch(name, value, f"a Quantity in {unit}, e.g. {name} = 1 * u.Unit('{unit}')")
        try:
            given = np.asarray(value, dtype=float) * u.dimensionless_unscaled
        except (TypeError, ValueError, OverflowError):
            raise InvalidInput(name, value, "a number") from None
    if np.any(getattr(given, "mask", False)):
        raise InvalidInput(name, value, "values without gaps: some are masked (missing)")
    if np.iscomplexobj(given.value):
        raise InvalidInput(name, value, "real numbers")
    try:
        # A copy: later changes of the caller's array have no effect.
        array: Array = np.array(given.to_value(unit), dtype=float)
    except u.UnitConversionError:
        raise UnitMismatch(name, value, f"a unit that converts to {unit}") from None
    except (TypeError, ValueError):
        raise InvalidInput(name, value, "numbers") from None
    if shape is not None and array.shape != shape:
        raise InvalidInput(name, value, "a scalar" if shape == () else f"an array of shape {shape}")
    if not np.all(np.isfinite(array)):
        raise InvalidInput(name, value, "finite numbers")
    too_low = array <= low if open_low else array < low
    too_high = array >= high if open_high else array > high
    if np.any(too_low) or np.any(too_high):
        raise InvalidInput(name, value, allowed(low, high, open_low, open_high, str(unit)))
    return float(array) if shape == () else array


def allowed(low: float, high: float, open_low: bool = False, open_high: bool = False, unit: str = "") -> str:
    """Text of an allowed range: ``a value in [0, 90) deg``, ``a value above 0 m``."""
    end = f" {unit}".rstrip()
    if high == np.inf and low > -np.inf:
        return f"a value {'above' if open_low else 'of at least'} {low:g}{end}"
    return f"a value in {'(' if open_low else '['}{low:g}, {high:g}{')' if open_high else ']'}{end}"


def whole(value: object, name: str, least: int) -> int:
    """The value as an int; it must be a whole number of at least `least`.

    Raises
    ------
    InvalidInput
        For anything else, booleans included.
    """
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < least:
        raise InvalidInput(name, value, f"a whole number, {least} or more")
    return int(value)


#: Months in the dates of JPL and CNEOS.
_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
#: Year, month, day with decimals, time of day, scale.
_DATE = re.compile(
    r"(?P<year>[+-]?\d{4,5})(-(?P<month>\d{1,2}|[A-Za-z]{3})(-(?P<day>\d{1,2})(?P<part>\.\d+)?)?)?"
    r"([T ]\s*(?P<clock>\d{1,2}:\d{2}(:\d{2}(\.\d*)?)?)(?P<zulu>Z)?)?\s*(?P<scale>TDB|TT|TAI|UTC)?",
    re.IGNORECASE,
)
_JULIAN = re.compile(r"JD\s*(\d+)(\.\d*)?\s*(TDB|TT|TAI|UTC)?", re.IGNORECASE)
DATES = "a date such as 2029-04-13, 2029-Apr-13 21:46, 2029-04 or JD 2462240.4, read as TDB"


def parsed_time(text: str) -> Time:
    """The time of a text, in TDB if it does not end in another scale or in the Z of UTC.

    Dates with months as numbers or names (2029-04-13, 2029-Apr-13), with decimals of the day or a time of day, a
    month or a year alone (its beginning), and Julian dates after "JD".

    Raises
    ------
    ValueError
        Another text.
    """
    plain = text.strip()
    if julian := _JULIAN.fullmatch(plain):
        day, part, scale = julian.groups()
        return Time(float(day), float(part or 0.0), format="jd", scale=(scale or "tdb").lower())
    found = _DATE.fullmatch(plain)
    if (
        found is None
        or (found["clock"] and (not found["day"] or found["part"]))
        or (found["zulu"] and found["scale"])
    ):
        return Time(plain, scale="tdb")  # another format of astropy
    month = (found["month"] or "1").lower()
    number = _MONTHS.index(month) + 1 if month.isalpha() else int(month)
    scale = "utc" if found["zulu"] else (found["scale"] or "tdb").lower()
    clock = found["clock"] or "00:00"
    time = Time(f"{found['year']}-{number:02d}-{int(found['day'] or 1):02d} {clock:0>5}", scale=scale)
    return time + float(found["part"]) * u.d if found["part"] else time


def checked_time(value: object, name: str) -> Time:
    """The time given, as an astropy Time that converts to TDB without tables of the Earth's rotation.

    Text is read as in :func:`parsed_time`. Dates of Python, numpy and pandas without a time zone are read as TDB too;
    those with one are converted from UTC.

    Raises
    ------
    InvalidInput
        Neither one Time nor a date, of a local scale or UT1, or not within the Julian dates -1e7 and 1e7.
    """
    given = value
    if isinstance(value, datetime) and value.tzinfo is not None:
        value = f"{value.astimezone(UTC):%Y-%m-%d %H:%M:%S.%f} UTC"
    elif isinstance(value, date):  # a datetime too
        value = value.isoformat()
    elif isinstance(value, np.datetime64):
        value = str(value)
    if isinstance(value, str):
        try:
            value = parsed_time(value)
        except ValueError:
            raise InvalidInput(name, given, f"{DATES}, or an astropy Time") from None
    if not isinstance(value, Time) or value.shape != ():
        raise InvalidInput(name, value, "one astropy Time, or a date such as 2029-04-13 (TDB)")
    if value.scale in ("local", "ut1"):
        raise InvalidInput(name, f"a Time of scale {value.scale}", "the scale tdb, tt, tai or utc")
    if not abs(value.jd) <= 1e7:
        raise InvalidInput(name, f"JD {value.jd:g}", "a Julian date within 1e7 days of zero")
    return value


def brief(value: Quantity, unit: u.UnitBase | None = None) -> str:
    """A quantity in few characters, for one-line descriptions of objects: ``14030 km``, ``1 x 2 m``."""
    quantity = value if unit is None else value.to(unit)
    numbers = " x ".join(f"{x:.0f}" if 1e4 <= abs(x) < 1e7 else f"{x:.4g}" for x in np.ravel(quantity.value))
    return f"{numbers} {quantity.unit.to_string()}".replace(" / ", "/").rstrip()


def counted(names: ArrayLike) -> str:
    """Number of occurrences of each name, most frequent first: ``12 INTACT, 3 RESHAPED``."""
    kinds, counts = np.unique(np.asarray(names), return_counts=True)
    return ", ".join(f"{counts[k]} {kinds[k]}" for k in np.argsort(-counts, kind="stable"))


def number_of(count: int, noun: str) -> str:
    """A count with its noun: ``1 encounter``, ``2 encounters``."""
    return f"{count:d} {noun}" + ("" if count == 1 else "s")


def frozen(value: Quantity) -> Quantity:
    """A read-only copy in the same unit, for objects that must not change."""
    copy = Quantity(value, copy=True)
    copy.setflags(write=False)
    return copy


#: Equatorial radius of the Earth as a quantity, for scripts: ``periapsis=2.2 * fs.R_earth``.
R_earth = (R_EARTH / 1000.0) * u.km
