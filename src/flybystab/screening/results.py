"""Result tables of a screening in memory: their columns, and files read back with units and provenance."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import astropy.units as u
import numpy as np
from astropy.table import MaskedColumn, QTable

from flybystab.errors import InvalidInput, MissingExtra

FORMATS = (".ecsv", ".parquet")


class Column(NamedTuple):
    """A column of a result table: Python type, unit of floats, and what it is."""

    kind: type
    unit: u.UnitBase | None
    text: str


def pyarrow() -> Any:
    """The package pyarrow with its Parquet part.

    Raises
    ------
    MissingExtra
    """
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise MissingExtra("pyarrow", "parquet", "a Parquet file") from None
    return pyarrow


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
