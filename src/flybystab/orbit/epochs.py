"""Differences of times, and the times at which states are given, in TDB."""

from __future__ import annotations

import warnings

import numpy as np
from astropy.time import Time

from flybystab.constants import DAY
from flybystab.errors import FlybystabWarning
from flybystab.units import checked_time


def seconds(time: Time, origin: Time) -> float:
    """Seconds (TDB) from `origin` to `time`, from the two-part Julian dates."""
    a, b = time.tdb, origin.tdb
    return float(((a.jd1 - b.jd1) + (a.jd2 - b.jd2)) * DAY)


def later(origin: Time, t: float) -> Time:
    """The time `t` s (TDB) after `origin`."""
    zero = origin.tdb
    return Time(zero.jd1, zero.jd2 + t / DAY, format="jd", scale="tdb")


def warn_of_utc(time: object, name: str, *, stacklevel: int, any_time: bool = False) -> None:
    """Warn of a time in UTC, the default of astropy; orbits are published in TDB or TT.

    Parameters
    ----------
    time : object
        Argument of the user; anything but a Time is ignored.
    name : str
    stacklevel : int
        That of the caller of this function, as of :func:`warnings.warn`.
    any_time : bool
        By default only times at midnight or noon cause a warning, as of published epochs.
    """
    if not isinstance(time, Time) or time.scale != "utc":
        return
    if any_time or np.all(time.jd * 2.0 % 1.0 == 0.0):
        warnings.warn(
            f"{name} is in UTC; orbits are published in TDB or TT, which is 69 s ahead in 2026: "
            "Time(..., scale='tdb')",
            FlybystabWarning,
            stacklevel=stacklevel + 1,
        )


def checked_epoch(epoch: object) -> Time:
    """An epoch in TDB.

    Raises
    ------
    InvalidInput
        It is not a single time.
    """
    return checked_time(epoch, "epoch").tdb
