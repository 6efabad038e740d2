"""Differences of times, and the times at which states are given, in TDB."""

from __future__ import annotations

from astropy.time import Time

from flybystab.constants import DAY
from flybystab.units import checked_time


def seconds(time: Time, origin: Time) -> float:
    """Seconds (TDB) from `origin` to `time`, from the two-part Julian dates."""
    a, b = time.tdb, origin.tdb
    return float(((a.jd1 - b.jd1) + (a.jd2 - b.jd2)) * DAY)


def later(origin: Time, t: float) -> Time:
    """The time `t` s (TDB) after `origin`."""
    zero = origin.tdb
    return Time(zero.jd1, zero.jd2 + t / DAY, format="jd", scale="tdb")


def checked_epoch(epoch: object) -> Time:
    """An epoch in TDB.

    Raises
    ------
    InvalidInput
        It is not a single time.
    """
    return checked_time(epoch, "epoch").tdb
