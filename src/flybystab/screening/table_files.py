"""Tables as files, ECSV or Parquet, written row by row: memory does not grow with the number of rows.

A table grows under a temporary name (``.part``), in Parquet by row groups, and takes its own name when it is finished:
what has that name can be read.
"""

from __future__ import annotations

import csv
import io
import json
import os
import shutil
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Protocol

from flybystab.errors import InvalidInput
from flybystab.screening.results import FORMATS, Column, cell, empty_table, pyarrow

#: Rows of one Parquet row group.
ROW_GROUP = 10_000
#: Bytes that must be free where the output goes.
LEAST_SPACE = 64 * 2**20


def check_output(path: str | Path) -> Path:
    """The path, if a result can be written there.

    Raises
    ------
    InvalidInput
        Wrong ending, no such directory, not writable, or hardly any space left: said before hours are spent.
    MissingExtra
        A Parquet file without pyarrow.
    """
    out = Path(path)
    if out.suffix not in FORMATS:
        raise InvalidInput("output", str(path), f"a file name that ends in {' or '.join(FORMATS)}")
    if out.is_dir():
        raise InvalidInput("output", str(path), "a file, not a directory")
    probe = out.with_name(out.name + ".probe")
    try:
        with probe.open("ab"):
            pass
        probe.unlink()
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
    """A file that takes rows."""

    def write(self, cells: list[Any]) -> None:
        """Append a row."""

    def close(self, *, finish: bool) -> None:
        """Close the file; without `finish` it need not be valid."""


class _Ecsv:
    def __init__(self, path: Path, columns: Mapping[str, Column], meta: Mapping[str, Any]) -> None:
        header = io.StringIO()
        empty_table(columns, meta).write(header, format="ascii.ecsv", delimiter=",")
        self._stream = path.open("w", newline="", encoding="utf-8")
        self._stream.write(header.getvalue())
        self._writer = csv.writer(self._stream, lineterminator="\n")

    def write(self, cells: list[Any]) -> None:
        self._writer.writerow(cells)

    def close(self, *, finish: bool) -> None:
        self._stream.close()


class _Parquet:
    def __init__(self, path: Path, columns: Mapping[str, Column], meta: Mapping[str, Any]) -> None:
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
        self._stream = path.open("wb")
        self._writer = pa.parquet.ParquetWriter(self._stream, self._schema, compression="zstd")
        self._group: list[list[Any]] = [[] for _ in columns]
        self._groups = 0

    def write(self, cells: list[Any]) -> None:
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
                self._writer.close()  # lest it tries again when it is collected
            self._stream.close()


class TableFile:
    """A table in the making; as a context manager it is finished at the end, and discarded on an exception.

    Parameters
    ----------
    path : Path
        Its name when it is finished, ``.ecsv`` or ``.parquet``; a file of that name is replaced then.
    columns : mapping of str to Column
    meta : mapping
        Provenance.

    Attributes
    ----------
    count : int
        Rows so far.
    """

    def __init__(self, path: Path, columns: Mapping[str, Column], meta: Mapping[str, Any]) -> None:
        self.path = path
        self.count = 0
        self._kinds = [(name, c.kind) for name, c in columns.items()]
        self._part = path.with_name(path.name + ".part")
        made: type[_Ecsv] | type[_Parquet] = _Parquet if path.suffix == ".parquet" else _Ecsv
        try:
            self._file: _Format = made(self._part, columns, meta)
        except BaseException:
            self._part.unlink(missing_ok=True)
            raise

    def write(self, row: Mapping[str, Any]) -> None:
        """Append a row; what it has no value for is empty."""
        self._file.write([cell(row.get(name), kind) for name, kind in self._kinds])
        self.count += 1

    def finish(self) -> None:
        """Close the file and give it its name."""
        try:
            self._file.close(finish=True)
            os.replace(self._part, self.path)
        finally:
            self._part.unlink(missing_ok=True)

    def discard(self) -> None:
        """Remove what was written."""
        with suppress(OSError):  # what is left in a buffer may have no room, and is not wanted
            self._file.close(finish=False)
        self._part.unlink(missing_ok=True)

    def __enter__(self) -> TableFile:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is None:
            self.finish()
        else:
            self.discard()


def write_rows(
    rows: Iterable[Mapping[str, Any]], path: Path, columns: Mapping[str, Column], meta: Mapping[str, Any]
) -> int:
    """Write rows as they come into an ECSV or Parquet file; returns their number."""
    with TableFile(path, columns, meta) as file:
        for row in rows:
            file.write(row)
    return file.count
