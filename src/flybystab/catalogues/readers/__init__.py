"""Readers of catalogue and orbit files, one module per publisher; the format is detected from the content.

A module of this package registers its function with :func:`reader`; a further format is one more module.
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
    """What is read from a format: a row of the table in ``docs/inputs.md``, which ``python docs/formats.py`` makes.

    Attributes
    ----------
    elements, covariance, nongravitational, physical : str
        Cells of the table.
    files : str
        Names of files, or what else shows that a file has the format.
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
        Shown in messages.
    identify : callable
        Whether a text has this format; it must not raise.
    read : callable
        Rows of a text; the second argument is the name of the file.
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
            "a file of orbits: an SPK kernel is a trajectory, made with forces that it does not name; "
            "fs.Encounter.from_spk(path, target, planet, time) follows it",
        )
    if re.match(rb"\s*CCSDS_OEM_VERS", raw):
        raise InvalidInput(
            "catalogue file",
            path,
            "a file of orbits: an orbit ephemeris message is a trajectory; fs.Encounter.from_oem(path, planet) "
            "follows it",
        )
    return decoded(raw, "catalogue file", path)


def decoded(raw: bytes, what: str, path: str | Path) -> str:
    """Text of the bytes of a file, with lines that end with a line feed, from the first that is not blank.

    The encoding is UTF-8 or, with a mark, UTF-16; otherwise Latin-1 if the text has no control characters.

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
    text = text.rstrip("\x1a")  # the end of a file in DOS
    return re.sub(r"\A(?:[ \t]*\n)+", "", text)


def header_of(text: str) -> Sequence[str]:
    """Column names of the first line of a CSV text; none if it is not a line of CSV."""
    if text[:1] in "{[":
        return []
    try:
        return [c.strip() for c in next(csv_rows(text.partition("\n")[0], "header", "text"), [])]
    except InvalidInput:
        return []


def rows_of(text: str, file: str) -> list[dict[str, str]]:
    """Rows of a CSV text without surrounding spaces.

    Raises
    ------
    InvalidInput
        A row has another number of cells than the header, a cell is too long, or the quoting is wrong.
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
