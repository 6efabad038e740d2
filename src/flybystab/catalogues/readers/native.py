"""CSV files with the columns of the embedded catalogue (``data/README.md``)."""

from __future__ import annotations

from difflib import get_close_matches
from typing import TYPE_CHECKING

from flybystab.catalogues.designations import is_comet
from flybystab.catalogues.readers import READERS, header_of, rows_of
from flybystab.catalogues.readers.sbdb import comet_orbit
from flybystab.catalogues.record import TEXTS, UNITS
from flybystab.errors import InvalidInput, UnknownName
from flybystab.files import parse_json

if TYPE_CHECKING:
    from flybystab.catalogues.readers import Entry


def read_native(text: str, file: str) -> list[Entry]:
    """Rows of a catalogue; this format is assumed if a text has none of the registered formats.

    Raises
    ------
    InvalidInput, UnknownName
    """
    if message := _message(text, file):
        raise InvalidInput("catalogue file", file, f"an orbit, not the answer {message!r}")
    columns = header_of(text)
    known = (*TEXTS, *UNITS)
    if any(";" in c or "\t" in c for c in columns):
        shown = ", ".join(columns)
        shown = shown if len(shown) <= 60 else shown[:60] + " ..."
        raise InvalidInput("columns", shown, f"commas between the columns of {file}, no semicolons or tabs")
    if text.strip() and not set(known) & set(columns):
        raise InvalidInput(
            "catalogue file",
            file,
            f"the columns of the catalogue, or a file of one of {', '.join(READERS.names)}",
        )
    for c in columns:
        if c not in known:
            raise UnknownName("column", c, get_close_matches(c, known, cutoff=0.6), f"(in {file})")
    if not {"name", "designation", "number"} & set(columns):
        raise InvalidInput("columns", columns, f"at least one of name, designation, number in {file}")
    return [(_with_law(row), None) for row in rows_of(text, file)]


def _message(text: str, file: str) -> str:
    """Message in a JPL answer without an orbit, such as for an unknown or ambiguous name; empty for other texts."""
    if not text.lstrip().startswith("{") or '"message"' not in text:
        return ""
    answer = parse_json(text, "catalogue file", file)
    return str(answer.get("message") or "") if isinstance(answer, dict) else ""


def _with_law(row: dict[str, str]) -> dict[str, str]:
    """The row, with the law of comets for A1, A2, A3 if it states no law and its name or class is that of a comet."""
    if row.get("nongrav_law") or not any(row.get(f"{n}_au_d2") for n in ("A1", "A2", "A3")):
        return row
    names = (row.get("designation", ""), row.get("name", ""))
    comet = comet_orbit(row.get("orbit_class", ""), "") or any(is_comet(n) for n in names)
    return row | {"nongrav_law": "comet"} if comet else row
