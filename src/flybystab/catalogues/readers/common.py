"""Helpers of several readers."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from typing import Any

from flybystab.errors import InvalidInput

#: Frame and time scale of the elements of every row.
FRAME = "heliocentric, ecliptic J2000, TDB"


def header(text: str) -> set[str]:
    """Column names in the first line of a CSV text."""
    return {c.strip() for c in next(csv.reader(io.StringIO(text[: 1 << 16])), [])}


def rows(text: str, file: str) -> Iterator[dict[str, str]]:
    """Rows of a CSV text, cells stripped.

    Raises
    ------
    InvalidInput
        A row has another number of cells than the header.
    """
    reader = csv.DictReader(io.StringIO(text, newline=""))
    columns = list(reader.fieldnames or [])
    for line, row in enumerate(reader, start=2):
        if None in row or None in row.values():
            raise InvalidInput("row", f"line {line} of {file}", f"{len(columns)} cells, as in the header")
        yield {k.strip(): v.strip() for k, v in row.items()}


def julian_date(day: float) -> Any:
    """A Julian date, TDB."""
    from astropy.time import Time

    return Time(day, format="jd", scale="tdb")


def metres(text: str, name: str, file: str) -> str:
    """A length in km as text in m."""
    try:
        return f"{1000.0 * float(text):.10g}"
    except ValueError:
        raise InvalidInput(name, text, f"a number in {file}") from None
