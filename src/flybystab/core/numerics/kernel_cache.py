"""Invalidation of compiled kernels on disk.

numba keeps a kernel until the file that defines it changes. A kernel also contains the kernels that it calls, with
their constants, from other files: after an update of the package, code of the previous version could run. Here the
stamp of a kernel of this package is the digest of all files from which it is compiled. An index of kernels, also of
other packages, that names a class of this package which no longer exists counts as out of date, too. Files of this
package that are damaged (cut off, or changed by something else) are written anew.

The environment variable FLYBYSTAB_KERNELS names a folder in which installations share their kernels: there a kernel is
found by its stamp, not by the place of its source. numba itself loads a kernel only with the version that compiled it
and for the same type of processor, so that a folder may also be shared between machines.
"""

from __future__ import annotations

import hashlib
import os
import pickle
import re
import shutil
from functools import cache
from pathlib import Path
from typing import Any

from numba.core.caching import FunctionCache, IndexDataCacheFile, InTreeCacheLocator

#: The directory of the package, and its name.
ROOT = Path(__file__).resolve().parents[2]
_IMPORT = re.compile(
    rf"^[ \t]*(?:from[ \t]+({ROOT.name}[\w.]*)[ \t]+import[ \t]*(\([^)]*\)|[^\n]*)|import[ \t]+({ROOT.name}[\w.]*))",
    re.MULTILINE,
)


#: Versions of the kernels of a file that are kept in a shared folder.
KEPT = 8


@cache
def _files() -> dict[str, Path]:
    """Source files of the package by their path in it, without the suffix."""
    found = {}
    for folder, _, names in os.walk(ROOT):
        prefix = folder[len(str(ROOT)) + 1 :].replace(os.sep, "/")
        for name in names:
            if name.endswith(".py"):
                found[f"{prefix}/{name[:-3]}".lstrip("/")] = Path(folder, name)
    return found


@cache
def _file(module: str) -> Path | None:
    """Source file of a module of this package; None where the name is not a module."""
    place = "/".join(module.split(".")[1:])
    return _files().get(place) or _files().get(f"{place}/__init__".lstrip("/"))


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


@cache
def _inside(file: str) -> Path | None:
    """The path of a source file of this package; None for others."""
    path = Path(file).resolve()
    return path if ROOT in path.parents else None


#: Folders in which kernels can be written.
_WRITABLE: set[str] = set()


def _stamped(locator: Any) -> Any:
    """A locator with the same directories, for files of this package only, whose stamp is `stamp`."""

    class Stamped(locator):
        @classmethod
        def from_function(cls, py_func: Any, py_file: str) -> Any:
            source = _inside(py_file)
            if source is None:
                return None
            found = super().from_function(py_func, py_file)
            if found is not None:
                found.source = source
            return found

        def ensure_cache_path(self) -> None:
            """Once for each folder, not for each kernel."""
            folder = self.get_cache_path()
            if folder not in _WRITABLE:
                super().ensure_cache_path()
                _WRITABLE.add(folder)

        def get_source_stamp(self) -> Any:
            return stamp(self.source)

    Stamped.__name__ = f"Stamped{locator.__name__}"
    return Stamped


class _Shared(InTreeCacheLocator):
    """Folder of a module and a stamp in the one that FLYBYSTAB_KERNELS names."""

    def __init__(self, py_func: Any, py_file: str) -> None:
        super().__init__(py_func, py_file)
        source = Path(py_file).resolve()
        module = ".".join(source.relative_to(ROOT).with_suffix("").parts)
        self._cache_path = str(Path(os.environ["FLYBYSTAB_KERNELS"]) / module / stamp(source)[:16])

    @classmethod
    def from_function(cls, py_func: Any, py_file: str) -> Any:
        return super().from_function(py_func, py_file) if os.environ.get("FLYBYSTAB_KERNELS") else None

    def ensure_cache_path(self) -> None:
        """Mark this version of the kernels as used, and remove the least recently used ones."""
        super().ensure_cache_path()
        os.utime(self._cache_path)
        versions = sorted(Path(self._cache_path).parent.iterdir(), key=lambda p: p.stat().st_mtime)
        for old in versions[:-KEPT]:
            shutil.rmtree(old, ignore_errors=True)


def _is_own(cache_file: Any) -> bool:
    """True for kernels of this package: they have a `stamp`, those of others a tuple."""
    return isinstance(cache_file._source_stamp, str)


def _load_index(cache_file: Any) -> dict[Any, Any]:
    """The kernels in an index file; none where it is damaged, or names a class of this package that is gone."""
    try:
        return _load(cache_file)
    except (AttributeError, ImportError) as error:
        # Kernels of others may have classes of this package as arguments.
        if _is_own(cache_file) or ROOT.name in str(error):
            return {}
        raise
    except _DAMAGED:
        if _is_own(cache_file):
            return {}
        raise


def _load_data(cache_file: Any, name: str) -> Any:
    """A kernel from its file. An OSError, after which numba compiles it anew, if the file is damaged."""
    try:
        return _data(cache_file, name)
    except (AttributeError, ImportError, *_DAMAGED) as error:
        if _is_own(cache_file):
            raise OSError(f"{name} is damaged") from error
        raise


#: Errors of reading a file that is cut off or has been changed.
_DAMAGED = (pickle.UnpicklingError, EOFError, ValueError, KeyError, IndexError, TypeError, MemoryError)

_index: Any = IndexDataCacheFile
_load, _data = _index._load_index, _index._load_data


def watch() -> None:
    """Make numba use the `stamp` for every kernel of this package; kernels of other packages are unaffected."""
    locators: list[Any] = FunctionCache._impl_class._locator_classes
    if not any(c.__name__.startswith("Stamped") for c in locators):
        locators[:0] = [_stamped(c) for c in (_Shared, *locators)]
        _index._load_index, _index._load_data = _load_index, _load_data
