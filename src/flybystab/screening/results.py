"""Result tables of a screening in memory: their columns, and files read back with units and provenance."""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple

import astropy.units as u
import numpy as np
from astropy.table.meta import get_header_from_yaml

from flybystab.errors import InvalidInput, MissingExtra
from flybystab.result_table import ResultTable, read_table
from flybystab.saving import pyarrow
from flybystab.typing import Document

#: Formats of tables that are read back, and all that tables are written in.
FORMATS = (".ecsv", ".parquet")
WRITTEN = (*FORMATS, ".csv")

#: A value in a result table.
Cell = float | int | bool | str
#: Value of an empty cell by the type of its column.
_EMPTY: dict[type, Cell] = {float: np.nan, int: -1, bool: False, str: ""}


class Column(NamedTuple):
    """A column of a result table: Python type, unit of floats, description."""

    kind: type
    unit: u.UnitBase | None
    text: str


def empty_table(columns: Mapping[str, Column], meta: Mapping[str, object]) -> ResultTable:
    """A table without rows."""
    table = ResultTable()
    for name, c in columns.items():
        values: np.ndarray = np.array([], dtype="U1" if c.kind is str else c.kind)
        table[name] = values * c.unit if c.unit is not None else values
        table[name].info.description = c.text
    table.meta = dict(meta)
    return table


def table_of(
    rows: Iterable[Mapping[str, object]], columns: Mapping[str, Column], meta: Mapping[str, object]
) -> ResultTable:
    """A table of rows held in memory."""
    found = list(rows)
    table = ResultTable()
    for name, c in columns.items():
        values: np.ndarray = np.array(
            [cell(r.get(name), c.kind) for r in found], dtype=str if c.kind is str else c.kind
        )
        table[name] = values * c.unit if c.unit is not None else values
        table[name].info.description = c.text
    table.meta = dict(meta)
    return table


def cell(value: object, kind: type) -> Cell:
    """A value of a column's kind; None becomes nan, -1, False or an empty text."""
    if value is None:
        return _EMPTY[kind]
    found: Cell = kind(value)
    return found


def read_results(path: str | Path) -> ResultTable:
    """A result file, ECSV or Parquet, as a table with units and its provenance in ``meta``.

    Raises
    ------
    InvalidInput
        The file cannot be read, or has fewer rows than its header says.
    """
    if Path(path).suffix not in FORMATS:
        raise InvalidInput("result file", str(path), f"a file name that ends in {' or '.join(FORMATS)}")
    return read_table(path, "result file")


def read_meta(path: Path) -> Document:
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
