"""Readers of catalogue and orbit files, one module per publisher; the format is detected from the content.

A module registers its function with :func:`reader`; adding a format means adding a module.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from flybystab.catalogues.registry import Formats
from flybystab.errors import InvalidInput
from flybystab.files import csv_rows, read_bytes

if TYPE_CHECKING:
    from flybystab.orbit.covariance import Covariance

    #: A catalogue row and the published covariance of its orbit, if there is one.
    Entry = tuple[dict[str, str], Covariance | None]

#: Frame and time scale of the elements of every row.
FRAME = "heliocentric, ecliptic J2000, TDB"


@dataclass(frozen=True)
class Contents:
    """Content that is read from a format: a row of the table in ``docs/inputs.md``, made by ``docs/formats.py``.

    Attributes
    ----------
    elements, covariance, nongravitational, physical : str
        Cells of the table.
    files : str
        Usual names of such files, or another feature by which they are known.
    """

    elements: str
    covariance: str
    nongravitational: str
    physical: str
    files: str = ""


@dataclass(frozen=True)
class Reader:
    """A file format.

    Attributes
    ----------
    name : str
        Name in messages.
    identify : callable
        Whether a text has this format; must not raise.
    read : callable
        Returns the rows of a text; the second argument is the name of the file.
    contents : Contents
    """

    name: str
    identify: Callable[[str], bool]
    read: Callable[[str, str], list[Entry]]
    contents: Contents


#: The formats, in the order in which they are tried.
READERS: Formats[Reader] = Formats(__name__)

_Read = Callable[[str, str], "list[Entry]"]


def reader(name: str, identify: Callable[[str], bool], contents: Contents) -> Callable[[_Read], _Read]:
    """Register the decorated function as the reader of a format."""

    def register(read: _Read) -> _Read:
        READERS.add(Reader(name, identify, read, contents))
        return read

    return register


def text_of(path: str | Path) -> str:
    """Text of a file, decompressed if it is gzipped.

    Raises
    ------
    InvalidInput
        The file cannot be read, or is a binary SPK kernel.
    """
    raw = read_bytes(path, "catalogue file")
    if raw[:4] == b"DAF/":
        raise InvalidInput(
            "catalogue file",
            path,
            "a file of orbits; an SPK kernel contains a trajectory without its force model: use "
            "fs.Encounter.from_spk(path, target, planet, time)",
        )
    if re.match(rb"\s*CCSDS_OEM_VERS", raw):
        raise InvalidInput(
            "catalogue file",
            path,
            "a file of orbits; an orbit ephemeris message contains a trajectory: use "
            "fs.Encounter.from_oem(path, planet)",
        )
    return decoded(raw, "catalogue file", path)


def decoded(raw: bytes, what: str, path: str | Path) -> str:
    """Text of a file from its bytes, with line feeds as line ends and without blank lines at the beginning.

    The encoding is UTF-8, or UTF-16 with a byte order mark; otherwise Latin-1 if the text has no control characters.

    Raises
    ------
    InvalidInput
    """
    try:
        text = raw.decode("utf-16" if raw[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig")
    except UnicodeDecodeError as error:
        text = raw.decode("latin-1")
        if re.search(r"[\x00-\x08\x0e-\x1f\x7f-\x9f]", text):
            raise InvalidInput(what, path, f"a readable text file ({error})") from None
    if "\r" in text:
        text = text.replace("\r\n", "\n").replace("\r", "\n")
    text = text.rstrip("\x1a")  # end-of-file mark of DOS
    return re.sub(r"\A(?:[ \t]*\n)+", "", text)


def header_of(text: str) -> Sequence[str]:
    """Column names in the first line of a CSV text; empty if it is not valid CSV."""
    if text[:1] in "{[":
        return []
    try:
        return [c.strip() for c in next(csv_rows(text.partition("\n")[0], "header", "text"), [])]
    except InvalidInput:
        return []


def rows_of(text: str, file: str) -> list[dict[str, str]]:
    """Rows of a CSV text by column name; spaces around the cells are removed.

    Raises
    ------
    InvalidInput
        The number of cells in a row differs from that in the header, a cell is too long, or quotes are unbalanced.
    """
    rows = csv_rows(text, "catalogue file", file)
    columns = [c.strip() for c in next(rows, [])]
    out = []
    for line, row in enumerate(rows, start=2):
        if not any(cell.strip() for cell in row):
            continue
        if len(row) != len(columns):
            raise InvalidInput("row", f"line {line} of {file}", f"{len(columns)} cells, as in the header")
        out.append({k: v.strip() for k, v in zip(columns, row, strict=True)})
    return out
