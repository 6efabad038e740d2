"""Result tables of a screening in memory: their columns, and files read back with units and provenance."""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import astropy.units as u
import numpy as np
from astropy.table import MaskedColumn, QTable
from astropy.table.meta import get_header_from_yaml

from flybystab.errors import FlybystabError, InvalidInput, MissingExtra
from flybystab.files import read_bytes
from flybystab.saving import pyarrow

#: Formats of tables that are read back, and all that tables are written in.
FORMATS = (".ecsv", ".parquet")
WRITTEN = (*FORMATS, ".csv")
#: Largest ECSV file that is read, bytes: the reader needs several times as much memory.
RESULT_LIMIT = 4 * 2**30


class Column(NamedTuple):
    """A column of a result table: Python type, unit of floats, description."""

    kind: type
    unit: u.UnitBase | None
    text: str


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
            [cell(r.get(name), c.kind) for r in found], dtype=str if c.kind is str else c.kind
        )
        table[name] = values * c.unit if c.unit is not None else values
        table[name].info.description = c.text
    table.meta = dict(meta)
    return table


def cell(value: Any, kind: type) -> Any:
    """A value of a column's kind; None becomes nan, -1, False or an empty text."""
    if value is None:
        return {float: np.nan, int: -1, bool: False, str: ""}[kind]
    return kind(value)


def read_results(path: str | Path) -> QTable:
    """A result file, ECSV or Parquet, as a table with units and its provenance in ``meta``.

    Raises
    ------
    InvalidInput
        The file cannot be read, or has fewer rows than its header says.
    """
    file = Path(path)
    if file.suffix not in FORMATS:
        raise InvalidInput("result file", str(path), f"a file name that ends in {' or '.join(FORMATS)}")
    try:
        if file.suffix == ".parquet":
            return _read_parquet(file)
        content = read_bytes(file, "result file", RESULT_LIMIT)
        table = QTable.read(content.decode(), format="ascii.ecsv")
        _check_complete(table, content, path)
        for name in table.colnames:  # an empty text counts as missing in ECSV
            if isinstance(table[name], MaskedColumn) and table[name].dtype.kind == "U":
                about = table[name].info.description
                table[name] = table[name].filled("")
                table[name].info.description = about
        return table
    except FlybystabError:
        raise
    except Exception as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise InvalidInput("result file", str(path), f"a readable result file ({reason})") from None


def _check_complete(table: QTable, content: bytes, path: str | Path) -> None:
    """Refuse a truncated table: the header gives the number of rows, and the last line must end with a newline."""
    rows = table.meta.get("rows")
    if isinstance(rows, int) and (rows != len(table) or not content.endswith(b"\n")):
        raise InvalidInput(
            "result file",
            str(path),
            f"the {rows:,} rows that its header gives; {len(table):,} are there: the file was cut off",
        )


def read_meta(path: Path) -> dict[str, Any]:
    """Provenance of a result file, without its rows; empty if it has none."""
    try:
        if path.suffix == ".parquet":
            meta = pyarrow().parquet.read_schema(path).metadata or {}
            return dict(json.loads(meta.get(b"flybystab", b"{}")))
        with path.open(encoding="utf-8") as stream:
            header = list(itertools.takewhile(lambda line: line.startswith("# "), stream))
        return dict(get_header_from_yaml(line[2:].rstrip("\n") for line in header[1:]).get("meta", {}))
    except MissingExtra:
        raise
    except Exception:
        return {}


def _read_parquet(path: Path) -> QTable:
    pa = pyarrow()
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
