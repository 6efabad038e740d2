"""Observed arcs: middle of the arc, and whether it is limited to one opposition."""

from __future__ import annotations

from datetime import date

#: Longest arc (d) that is taken as one opposition if the number of oppositions is not given.
_ONE_OPPOSITION = 300


def _day(text: str) -> date | None:
    """Date of ``2004-03-15``, ``2004-03-15.12`` or ``2004-Mar-15``; None for anything else."""
    months = ("Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec")
    plain = text.strip().partition(".")[0]
    for k, month in enumerate(months, start=1):
        plain = plain.replace(f"-{month}-", f"-{k:02d}-")
    try:
        return date.fromisoformat(plain)
    except ValueError:
        return None


def arc_columns(first: object, last: object) -> dict[str, str]:
    """Columns ``observed_jd`` and ``single_opposition`` from the first and the last date of observation.

    Parameters
    ----------
    first, last : object
        Dates as text; the result is empty if either is unknown.
    """
    begin, end = _day(str(first or "")), _day(str(last or ""))
    if begin is None or end is None or end < begin:
        return {}
    days = (end - begin).days
    middle = begin.toordinal() + 1721424.5 + 0.5 * days
    return {"observed_jd": repr(middle), "single_opposition": "Y" if days < _ONE_OPPOSITION else "N"}
