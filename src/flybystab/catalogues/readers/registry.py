"""The registry of readers: a format is one module of this package that registers its reader.

A reader says by the content of a file whether it has the format, whatever the name of the file, and turns it into rows
of a catalogue. All modules of the package are imported when a file is first read, so that a new one needs no entry
anywhere else.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Callable, Iterable
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, NamedTuple

from flybystab.errors import InvalidInput

if TYPE_CHECKING:
    from flybystab.orbit.covariance import Covariance

#: A catalogue row and the covariance of its orbit, where the file has one.
Entry = tuple[dict[str, str], "Covariance | None"]


Read = Callable[[str, str], Iterable[Entry]]


class Reader(NamedTuple):
    """A format.

    Attributes
    ----------
    name : str
    agency : str
        How the ``orbit_source`` of its rows begins; empty for the catalogue's own columns.
    recognises : callable
        ``recognises(text) -> bool``: whether the content has the format.
    read : callable
        ``read(text, file) -> iterable of (row, covariance)``; `file` is named in errors.
    """

    name: str
    agency: str
    recognises: Callable[[str], bool]
    read: Read


#: Registered readers by name.
READERS: dict[str, Reader] = {}


def register(name: str, agency: str, recognises: Callable[[str], bool]) -> Callable[[Read], Read]:
    """Decorator that registers a function ``read(text, file)`` as the reader of a format."""

    def add(read: Read) -> Read:
        READERS[name] = Reader(name, agency, recognises, read)
        return read

    return add


@cache
def load_readers() -> None:
    """Import every module of this package, so that its readers are registered."""
    package = import_module("flybystab.catalogues.readers")
    for module in sorted(pkgutil.iter_modules(package.__path__), key=lambda m: m.name):
        import_module(f"{package.__name__}.{module.name}")


def reader_of(text: str, file: str) -> Reader:
    """The reader whose format a text has.

    Raises
    ------
    InvalidInput
        No format is recognised; the message lists them.
    """
    load_readers()
    # the catalogue's own columns last: other tables share some of them
    for reader in sorted(READERS.values(), key=lambda r: not r.agency):
        if reader.recognises(text):
            return reader
    raise InvalidInput("catalogue file", file, f"one of the formats {', '.join(sorted(READERS))}")


def agencies() -> tuple[str, ...]:
    """Beginnings of the ``orbit_source`` of rows that were read from the tables of an agency."""
    load_readers()
    return tuple(sorted({f"{reader.agency} (" for reader in READERS.values() if reader.agency}))
