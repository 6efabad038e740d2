"""Tables with the columns of the catalogue itself (CSV)."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from difflib import get_close_matches

from flybystab.catalogues.readers.common import header, rows
from flybystab.catalogues.readers.registry import Entry, register
from flybystab.catalogues.record import TEXTS, UNITS
from flybystab.errors import InvalidInput, UnknownName


def _resembles(text: str) -> bool:
    """Whether the first line has a column of the catalogue, or one that is spelled like it."""
    known = [*TEXTS, *UNITS]
    return any(c in known or get_close_matches(c, known, n=1, cutoff=0.6) for c in header(text))


@register("catalogue (CSV)", "", _resembles)
def read(text: str, file: str) -> Iterator[Entry]:
    """Rows of a table.

    Raises
    ------
    InvalidInput, UnknownName
        A column that is not one of the catalogue's, or no column that names the asteroids.
    """
    columns = list(csv.DictReader(io.StringIO(text, newline="")).fieldnames or [])
    for c in columns:
        if c not in UNITS and c not in TEXTS:
            known = [*TEXTS, *UNITS]
            if ";" in c or "\t" in c:
                raise InvalidInput("columns", c, f"commas between the columns of {file}")
            raise UnknownName("column", c, get_close_matches(c, known, cutoff=0.6), f"(in {file})")
    if not {"name", "designation", "number"} & set(columns):
        raise InvalidInput("columns", columns, f"at least one of name, designation, number in {file}")
    for row in rows(text, file):
        yield row, None
