"""When a compiled kernel on disk is out of date.

numba keeps a kernel until the file that defines it changes. A kernel also contains the kernels that it calls, with
their constants, from other files: after an update of the package it could run code of the previous version. Here the
stamp of a kernel of this package is the digest of all files from which it is compiled. An index of kernels that names
a class which the updated package no longer has is out of date too.
"""

from __future__ import annotations

import hashlib
import re
from functools import cache
from pathlib import Path
from typing import Any

from numba.core.caching import FunctionCache, IndexDataCacheFile

#: The directory of the package, and its name.
ROOT = Path(__file__).resolve().parents[2]
_IMPORT = re.compile(
    rf"^[ \t]*(?:from[ \t]+({ROOT.name}[\w.]*)[ \t]+import[ \t]*(\([^)]*\)|[^\n]*)|import[ \t]+({ROOT.name}[\w.]*))",
    re.MULTILINE,
)


def _file(module: str) -> Path | None:
    """Source file of a module of this package; None where the name is not a module."""
    place = ROOT.joinpath(*module.split(".")[1:])
    return next((p for p in (place.with_suffix(".py"), place / "__init__.py") if p.is_file()), None)


@cache
def imports(file: Path) -> frozenset[Path]:
    """Files of this package that a file of it imports, anywhere in it."""
    modules = []
    for module, names, plain in _IMPORT.findall(file.read_text(encoding="utf-8")):
        modules.append(module or plain)
        modules += [f"{module}.{name}" for name in re.findall(r"\w+", names)]
    return frozenset(found for m in modules if (found := _file(m)) is not None)


@cache
def sources(file: Path) -> tuple[Path, ...]:
    """A file of this package and all that it imports, directly or not, sorted."""
    known, new = {file}, [file]
    while new:
        more = imports(new.pop()) - known
        known |= more
        new += more
    return tuple(sorted(known))


@cache
def stamp(file: Path) -> str:
    """Digest of the `sources` of a file."""
    digest = hashlib.sha256()
    for source in sources(file):
        digest.update(str(source.relative_to(ROOT)).encode() + b"\0")
        digest.update(hashlib.sha256(source.read_bytes()).digest())
    return digest.hexdigest()


def _stamped(locator: Any) -> Any:
    """A locator with the same directories, for files of this package only, whose stamp is `stamp`."""

    class Stamped(locator):
        @classmethod
        def from_function(cls, py_func: Any, py_file: str) -> Any:
            file = Path(py_file).resolve()
            if ROOT not in file.parents:
                return None
            found = super().from_function(py_func, py_file)
            if found is not None:
                found.source = file
            return found

        def get_source_stamp(self) -> Any:
            return stamp(self.source)

    Stamped.__name__ = f"Stamped{locator.__name__}"
    return Stamped


def _load_index(cache_file: Any) -> dict[Any, Any]:
    """The kernels in an index file; none where an index of this package names a class that no longer exists."""
    try:
        return _load(cache_file)
    except (AttributeError, ImportError):
        if isinstance(cache_file._source_stamp, str):  # a `stamp`; numba's own are tuples
            return {}
        raise


_index: Any = IndexDataCacheFile
_load = _index._load_index


def watch() -> None:
    """Make numba use the `stamp` for every kernel of this package; kernels of other packages are unaffected."""
    locators: list[Any] = FunctionCache._impl_class._locator_classes
    if not any(c.__name__.startswith("Stamped") for c in locators):
        locators[:0] = [_stamped(c) for c in locators]
        _index._load_index = _load_index
