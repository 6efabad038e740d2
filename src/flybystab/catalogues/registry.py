"""Registry of file formats, to which the modules of a package of readers add theirs."""

from __future__ import annotations

import importlib
import pkgutil
import sys
from collections.abc import Callable, Iterator
from typing import Generic, Protocol, TypeVar


class Format(Protocol):
    """A file format that is recognised from the content of a file."""

    @property
    def name(self) -> str:
        """Name in messages."""

    @property
    def identify(self) -> Callable[[str], bool]:
        """Whether a text has this format; must not raise."""


F = TypeVar("F", bound=Format)


class Formats(Generic[F]):
    """The formats of a package by name; its modules are imported on first use.

    Parameters
    ----------
    package : str
        Name of the package whose modules register formats.
    """

    def __init__(self, package: str) -> None:
        self.package = package
        self._found: dict[str, F] = {}
        self._imported: set[str] = set()

    def add(self, entry: F) -> None:
        """Register a format, replacing any of the same name."""
        self._found[entry.name] = entry

    def _load(self) -> None:
        for module in pkgutil.iter_modules(sys.modules[self.package].__path__):
            if module.name not in self._imported:
                importlib.import_module(f"{self.package}.{module.name}")
                self._imported.add(module.name)

    def __iter__(self) -> Iterator[F]:
        self._load()
        return iter(tuple(self._found.values()))

    def __getitem__(self, name: str) -> F:
        self._load()
        return self._found[name]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the formats, in the order in which they are tried."""
        return tuple(entry.name for entry in self)

    def of(self, text: str) -> F | None:
        """The format of a text; None if it has no known format."""
        return next((entry for entry in self if entry.identify(text)), None)
