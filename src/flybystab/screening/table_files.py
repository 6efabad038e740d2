"""Tables as files, ECSV, Parquet or CSV, written row by row: memory does not grow with the number of rows.

A table grows in a temporary file (``NAME.part``), in Parquet by row groups. When complete it is synchronised to
disk and renamed, so that a file of the final name is always complete. The header of an ECSV file gives the number of
rows, and :func:`flybystab.screening.results.read_results` refuses a file with fewer.
"""

from __future__ import annotations

import io
import json
import os
import shutil
import stat
import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO, Protocol

from flybystab.errors import InvalidInput, OutputFailed
from flybystab.saving import DOCUMENT_UNITS, csv_cell, pyarrow, with_unit
from flybystab.screening.journal import sync_file, sync_folder
from flybystab.screening.results import FORMATS, Cell, Column, cell, empty_table

#: Rows of one Parquet row group.
ROW_GROUP = 10_000
#: Least free space where the output goes, bytes.
LEAST_SPACE = 64 * 2**20
#: Placeholder of the number of rows in the header of an ECSV file, which is written before the rows are known.
_ROWS = 999_999_999_999
#: Longest suffix of a file beside the output.
_LONGEST = ".journal"


def check_output(path: str | Path, formats: tuple[str, ...] = FORMATS) -> Path:
    """The path, if a result can be written there in one of the formats.

    Raises
    ------
    InvalidInput
        Wrong ending, no such directory, not an ordinary file, name too long, not writable, or less than
        `LEAST_SPACE` free. Existing files are left unchanged.
    MissingExtra
        A Parquet file without pyarrow.
    """
    out = Path(path)
    if "\0" in str(path):
        raise InvalidInput("output", repr(str(path)), "a file name without null characters")
    if out.suffix not in formats:
        raise InvalidInput("output", str(path), f"a file name that ends in {' or '.join(formats)}")
    try:
        longest = os.pathconf(out.parent, "PC_NAME_MAX") if hasattr(os, "pathconf") else 255
        if (size := len(os.fsencode(out.name + _LONGEST))) > longest:
            raise InvalidInput(
                "output", out.name, f"a name shorter by {size - longest} bytes: {_LONGEST} is added to it"
            )
        if out.is_dir():
            raise InvalidInput("output", str(path), "a file, not a directory")
        if out.exists() and not stat.S_ISREG(out.stat().st_mode):
            raise InvalidInput("output", str(path), "an ordinary file")
        with tempfile.NamedTemporaryFile(dir=out.parent, prefix=".flybystab-"):
            pass
        space = shutil.disk_usage(out.parent).free
    except OSError as error:
        raise InvalidInput("output", str(path), f"a file that can be written ({error.strerror})") from None
    if out.exists() and not os.access(out, os.W_OK):
        raise InvalidInput("output", str(path), "a file that can be written")
    if space < LEAST_SPACE:
        raise InvalidInput(
            "output", str(path), f"at least {LEAST_SPACE >> 20} MB free ({space >> 20} MB left)"
        )
    if out.suffix == ".parquet":
        pyarrow()
    return out


class _Format(Protocol):
    """Writer of the rows of a table."""

    def write(self, cells: Sequence[Cell]) -> None:
        """Append a row."""

    def close(self, *, finish: bool) -> None:
        """Close the file; without `finish` it need not be valid."""


class _Ecsv:
    def __init__(self, stream: BinaryIO, columns: Mapping[str, Column], meta: Mapping[str, object]) -> None:
        text = io.StringIO()
        empty_table(columns, {**meta, "rows": _ROWS}).write(text, format="ascii.ecsv", delimiter=",")
        header = text.getvalue().encode()
        self._place = header.index(b"rows: %d" % _ROWS) + len(b"rows: ")
        self._stream = stream
        self._stream.write(header)
        self._count = 0

    def write(self, cells: Sequence[Cell]) -> None:
        self._stream.write((",".join(map(csv_cell, cells)) + "\n").encode())
        self._count += 1

    def close(self, *, finish: bool) -> None:
        if finish:
            self._stream.flush()
            self._stream.seek(self._place)
            self._stream.write(f"{self._count:<{len(str(_ROWS))}d}".encode())


class _Csv:
    """Plain CSV: the unit in the name of each column, no metadata."""

    def __init__(self, stream: BinaryIO, columns: Mapping[str, Column], meta: Mapping[str, object]) -> None:
        units = {k: DOCUMENT_UNITS.get(k, c.unit) for k, c in columns.items() if c.unit is not None}
        self._factors = {
            i: columns[name].unit.to(unit)  # type: ignore[union-attr]
            for i, name in enumerate(columns)
            if (unit := units.get(name)) not in (None, columns[name].unit)
        }
        self._stream = stream
        self._put([with_unit(name, units[name]) if name in units else name for name in columns])

    def write(self, cells: Sequence[Cell]) -> None:
        factors = self._factors
        self._put(
            [x * factors[i] if i in factors and not isinstance(x, str) else x for i, x in enumerate(cells)]
        )

    def _put(self, cells: Sequence[Cell]) -> None:
        self._stream.write((",".join(map(csv_cell, cells)) + "\n").encode())

    def close(self, *, finish: bool) -> None:
        pass


class _Parquet:
    def __init__(self, stream: BinaryIO, columns: Mapping[str, Column], meta: Mapping[str, object]) -> None:
        self._pa = pa = pyarrow()
        types = {float: pa.float64(), int: pa.int64(), bool: pa.bool_(), str: pa.string()}
        units = {name: "" if c.unit is None else c.unit.to_string("vounit") for name, c in columns.items()}
        self._schema = pa.schema(
            [
                pa.field(name, types[c.kind], metadata={"unit": units[name], "description": c.text})
                for name, c in columns.items()
            ],
            metadata={"flybystab": json.dumps(dict(meta))},
        )
        self._stream = stream
        self._writer = pa.parquet.ParquetWriter(self._stream, self._schema, compression="zstd")
        self._group: list[list[Cell]] = [[] for _ in columns]
        self._groups = 0

    def write(self, cells: Sequence[Cell]) -> None:
        for column, value in zip(self._group, cells, strict=True):
            column.append(value)
        if len(self._group[0]) >= ROW_GROUP:
            self._put()

    def _put(self) -> None:
        arrays = [self._pa.array(c, f.type) for c, f in zip(self._group, self._schema, strict=True)]
        self._writer.write_table(self._pa.table(arrays, schema=self._schema))
        self._stream.flush()
        self._groups += 1
        for column in self._group:
            column.clear()

    def close(self, *, finish: bool) -> None:
        try:
            if finish:
                if self._group[0] or not self._groups:
                    self._put()
                self._writer.close()
        finally:
            with suppress(OSError, ValueError, self._pa.ArrowException):
                self._writer.close()  # otherwise it would be closed again by the garbage collector


class TableFile:
    """A table being written; as a context manager it is finished on exit, and discarded on an exception.

    Parameters
    ----------
    path : Path
        Final name, ``.ecsv``, ``.parquet`` or ``.csv``.
    columns : mapping of str to Column
    meta : mapping
        Provenance.
    replace : bool
        Replace a file of that name. A file that appears, or changes, while the table is written is never replaced.

    Attributes
    ----------
    count : int
        Rows so far.
    part : Path
        The file that grows: ``NAME.part``, or ``NAME.1.part`` and so on where that name is taken.
    """

    def __init__(
        self,
        path: Path,
        columns: Mapping[str, Column],
        meta: Mapping[str, object],
        *,
        replace: bool = True,
    ) -> None:
        self.path = path
        self.count = 0
        self._kinds = [(name, c.kind) for name, c in columns.items()]
        self._replaced = _identity(path) if replace else None
        self.part, self._stream = _new_file(path)
        self._inode = os.fstat(self._stream.fileno()).st_ino
        made: dict[str, Callable[..., _Format]] = {".csv": _Csv, ".parquet": _Parquet}
        try:
            self._file: _Format = made.get(path.suffix, _Ecsv)(self._stream, columns, meta)
        except BaseException:
            self._remove()
            raise

    def write(self, row: Mapping[str, object]) -> None:
        """Append a row; missing values are empty."""
        self._file.write([cell(row.get(name), kind) for name, kind in self._kinds])
        self.count += 1

    def finish(self) -> None:
        """Synchronise the table to disk and rename it to its final name.

        Raises
        ------
        OutputFailed
            Another program has made or changed a file of that name meanwhile; it is kept.
        """
        try:
            self._file.close(finish=True)
            self._stream.flush()
            sync_file(self._stream.fileno())
            self._stream.close()
            move_into_place(self.part, self.path, self._replaced)
        finally:
            self._remove()

    def discard(self) -> None:
        """Remove the partial file."""
        with suppress(OSError, ValueError):  # a buffer may find no space; the stream may be closed
            self._file.close(finish=False)
        self._remove()

    def _remove(self) -> None:
        with suppress(OSError):
            self._stream.close()
        with suppress(OSError):
            if self.part.lstat().st_ino == self._inode:
                self.part.unlink()

    def __enter__(self) -> TableFile:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is None:
            self.finish()
        else:
            self.discard()


def _new_file(path: Path) -> tuple[Path, BinaryIO]:
    """A temporary file beside `path` that did not exist before."""
    for k in range(1000):
        part = path.with_name(f"{path.name}{f'.{k}' if k else ''}.part")
        with suppress(FileExistsError):
            return part, part.open("xb")
    raise OutputFailed(f"{path}.part to {path}.999.part exist: remove those that are not needed")


def _identity(path: Path) -> tuple[int, ...] | None:
    """Device, inode, size and time of a file, which tell whether it has changed; None without a file."""
    try:
        found = path.lstat()
    except OSError:
        return None
    return found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns


def move_into_place(part: Path, path: Path, replaced: tuple[int, ...] | None) -> None:
    """Rename a complete file, unless a file other than `replaced` has its name meanwhile.

    Raises
    ------
    OutputFailed
    """
    taken = f"{path} was made or changed by another program while this table was computed, and is kept"
    if replaced is None:
        try:
            os.link(part, path)  # fails if the name is taken, unlike a rename
        except FileExistsError:
            raise OutputFailed(taken) from None
        except OSError:  # a file system without hard links
            if os.path.lexists(path):
                raise OutputFailed(taken) from None
            os.replace(part, path)
    elif _identity(path) not in (replaced, None):
        raise OutputFailed(taken)
    else:
        os.replace(part, path)
    sync_folder(path.parent)


def write_rows(
    rows: Iterable[Mapping[str, object]],
    path: Path,
    columns: Mapping[str, Column],
    meta: Mapping[str, object],
    *,
    replace: bool = True,
) -> int:
    """Write rows from an iterator to an ECSV, Parquet or CSV file; returns their number."""
    with TableFile(path, columns, meta, replace=replace) as file:
        for row in rows:
            file.write(row)
    return file.count


def write_whole(text: str, path: Path) -> None:
    """Write a text file through a temporary one: it is either complete or absent."""
    replaced = _identity(path)
    part, stream = _new_file(path)
    try:
        with stream:
            stream.write(text.encode())
            stream.flush()
            sync_file(stream.fileno())
        move_into_place(part, path, replaced)
    finally:
        part.unlink(missing_ok=True)
