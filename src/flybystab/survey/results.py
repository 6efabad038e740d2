"""Result files of a screening: rows, the journal that survives a kill, ECSV and Parquet.

While a screening runs, every finished task is one line of a journal next to the output. A killed run leaves
at worst half a last line, which the next run drops; it then goes on with the tasks that are missing. At the
end, and on Ctrl-C, the journal is copied in task order into the output, row by row, so that memory does not
grow with the number of rows, and the output takes its name only when it is complete.
"""

from __future__ import annotations

import csv
import io
import json
import os
import shutil
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import astropy.units as u
import numpy as np
from astropy.table import MaskedColumn, QTable

from flybystab.errors import InvalidInput, MissingExtra

#: Rows of one Parquet row group.
ROW_GROUP = 10_000
#: Bytes that must be free where the output goes.
LEAST_SPACE = 64 * 2**20
FORMATS = (".ecsv", ".parquet")


class Column(NamedTuple):
    """A column of a result table: Python type, unit of floats, and what it is."""

    kind: type
    unit: u.UnitBase | None
    text: str


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
    probe = out.with_name(out.name + ".part")
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
        _pyarrow()
    return out


def _pyarrow() -> Any:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise MissingExtra("pyarrow", "parquet", "a Parquet file") from None
    return pyarrow


class Journal:
    """Finished tasks, one JSON line each, behind a first line that says which run they belong to.

    Parameters
    ----------
    path : Path
        Created if it is not there.
    header : mapping
        What the run computes; a journal with another header is refused.

    Attributes
    ----------
    where : dict of int to int
        Task -> offset of its line.

    Raises
    ------
    InvalidInput
        The file is the journal of another run, or not a journal, or another process writes to it.
    """

    def __init__(self, path: Path, header: Mapping[str, Any]) -> None:
        self.path = path
        self.where: dict[int, int] = {}
        wanted = json.dumps(header, sort_keys=True)
        if path.exists() and path.stat().st_size:
            self._recover(wanted)
        else:
            path.write_text(wanted + "\n", encoding="utf-8")
        # Unbuffered: what is written is in the hands of the system, and a full disk is noticed at once.
        self._file = path.open("ab", buffering=0)
        self._lock()

    def _lock(self) -> None:
        """Refuse a second process on the same journal."""
        try:
            import fcntl
        except ImportError:  # not on this system
            return
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            self._file.close()
            raise InvalidInput("journal", str(self.path), "no other run that writes to it now") from None
        except OSError:  # a file system without locks
            pass

    def _recover(self, wanted: str) -> None:
        with self.path.open("r+b") as stream:
            first, line = stream.readline(), wanted.encode() + b"\n"
            if first != line:
                if not line.startswith(first):
                    raise InvalidInput(
                        "journal",
                        str(self.path),
                        "this run's journal; another run is unfinished there"
                        f"{_difference(first, line)}. Start that one again to finish it, or remove the file",
                    )
                stream.seek(0)  # killed while it wrote its first line
                stream.write(line)
                stream.truncate()
                return
            end = stream.tell()
            for line in stream:
                try:
                    task = json.loads(line)["task"] if line.endswith(b"\n") else None
                except (ValueError, KeyError, TypeError):
                    task = None
                if task is None:
                    break
                self.where[int(task)] = end
                end += len(line)
            stream.truncate(end)

    def add(self, task: int, content: Mapping[str, Any]) -> None:
        """Write down a finished task; a task that is there already is not repeated."""
        if task in self.where:
            return
        line = memoryview(json.dumps({"task": task, **content}).encode() + b"\n")
        offset = self._file.seek(0, os.SEEK_END)
        while line:
            line = line[self._file.write(line) :]
        self.where[task] = offset

    def tasks(self) -> Iterator[dict[str, Any]]:
        """The finished tasks in their order, read one by one."""
        with self.path.open("rb") as stream:
            for task in sorted(self.where):
                stream.seek(self.where[task])
                yield json.loads(stream.readline())

    def close(self, *, remove: bool = False) -> None:
        """Close the file, and remove it if everything it holds is safe elsewhere."""
        self._file.close()
        if remove:
            self.path.unlink(missing_ok=True)


def _difference(theirs: bytes, ours: bytes) -> str:
    """In what another run's header differs, for a reader."""
    try:
        a, b = (json.loads(text).get("settings", {}) for text in (theirs, ours))
    except (ValueError, AttributeError):
        return ""
    keys = [k for k in b if a.get(k) != b[k]]
    if not a or not keys:
        return ""
    return ", with " + ", ".join(f"{k} = {a.get(k)} instead of {b[k]}" for k in keys[:3])


def empty_table(columns: Mapping[str, Column], meta: Mapping[str, Any]) -> QTable:
    """A table without rows."""
    table = QTable()
    for name, c in columns.items():
        values: Any = np.array([], dtype="U1" if c.kind is str else c.kind)
        table[name] = values * c.unit if c.unit is not None else values
        table[name].info.description = c.text
    table.meta = dict(meta)
    return table


def table_of(
    rows: Iterable[Mapping[str, Any]], columns: Mapping[str, Column], meta: Mapping[str, Any]
) -> QTable:
    """A table of rows held in memory."""
    found = list(rows)
    table = QTable()
    for name, c in columns.items():
        values: Any = np.array(
            [_cell(r.get(name), c.kind) for r in found], dtype=str if c.kind is str else c.kind
        )
        table[name] = values * c.unit if c.unit is not None else values
        table[name].info.description = c.text
    table.meta = dict(meta)
    return table


def _cell(value: Any, kind: type) -> Any:
    if value is None:
        return {float: np.nan, int: -1, bool: False, str: ""}[kind]
    return kind(value)


def write_rows(
    rows: Iterable[Mapping[str, Any]], path: Path, columns: Mapping[str, Column], meta: Mapping[str, Any]
) -> int:
    """Write rows as they come into an ECSV or Parquet file; returns their number. Memory stays flat."""
    part = path.with_name(path.name + ".part")
    try:
        count = (_write_parquet if path.suffix == ".parquet" else _write_ecsv)(rows, part, columns, meta)
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)
    return count


def _write_ecsv(
    rows: Iterable[Mapping[str, Any]], path: Path, columns: Mapping[str, Column], meta: Mapping[str, Any]
) -> int:
    header = io.StringIO()
    empty_table(columns, meta).write(header, format="ascii.ecsv", delimiter=",")
    count = 0
    with path.open("w", newline="", encoding="utf-8") as stream:
        stream.write(header.getvalue())
        writer = csv.writer(stream, lineterminator="\n")
        for row in rows:
            writer.writerow([_cell(row.get(name), c.kind) for name, c in columns.items()])
            count += 1
    return count


def _write_parquet(
    rows: Iterable[Mapping[str, Any]], path: Path, columns: Mapping[str, Column], meta: Mapping[str, Any]
) -> int:
    pa = _pyarrow()
    types = {float: pa.float64(), int: pa.int64(), bool: pa.bool_(), str: pa.string()}
    schema = pa.schema(
        [
            pa.field(
                name,
                types[c.kind],
                metadata={
                    "unit": "" if c.unit is None else c.unit.to_string("vounit"),
                    "description": c.text,
                },
            )
            for name, c in columns.items()
        ],
        metadata={"flybystab": json.dumps(dict(meta))},
    )
    count = 0
    with pa.parquet.ParquetWriter(path, schema, compression="zstd") as writer:
        group: list[Mapping[str, Any]] = []

        def put() -> None:
            data = {n: [_cell(r.get(n), c.kind) for r in group] for n, c in columns.items()}
            writer.write_table(pa.table(data, schema=schema))
            group.clear()

        for row in rows:
            group.append(row)
            count += 1
            if len(group) == ROW_GROUP:
                put()
        if group or not count:
            put()
    return count


def read_results(path: str | Path) -> QTable:
    """A result file, ECSV or Parquet, as a table with units and its provenance in ``meta``.

    Raises
    ------
    InvalidInput
        The file cannot be read.
    """
    file = Path(path)
    if file.suffix not in FORMATS:
        raise InvalidInput("result file", str(path), f"a file name that ends in {' or '.join(FORMATS)}")
    try:
        if file.suffix == ".parquet":
            return _read_parquet(file)
        table = QTable.read(file, format="ascii.ecsv")
        for name in table.colnames:  # an empty text counts as missing in ECSV
            if isinstance(table[name], MaskedColumn) and table[name].dtype.kind == "U":
                about = table[name].info.description
                table[name] = table[name].filled("")
                table[name].info.description = about
        return table
    except MissingExtra:
        raise
    except Exception as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise InvalidInput("result file", str(path), f"a readable result file ({reason})") from None


def _read_parquet(path: Path) -> QTable:
    pa = _pyarrow()
    data = pa.parquet.read_table(path)
    table = QTable()
    for name in data.column_names:
        values: Any = data[name].to_numpy(zero_copy_only=False)
        if values.dtype == object:
            values = values.astype(str)
        about = data.schema.field(name).metadata or {}
        unit = about.get(b"unit", b"").decode()
        table[name] = values * u.Unit(unit) if unit else values
        table[name].info.description = about.get(b"description", b"").decode()
    table.meta = json.loads((data.schema.metadata or {}).get(b"flybystab", b"{}"))
    return table
