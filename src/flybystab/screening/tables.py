"""Tables of encounters as files: ECSV with vector columns, Parquet or CSV with scalar columns."""

from __future__ import annotations

from pathlib import Path

import astropy.units as u
import numpy as np
from astropy.table import QTable
from astropy.time import Time
from astropy.units import Quantity

from flybystab.result_table import ecsv_content
from flybystab.screening.results import WRITTEN, Column
from flybystab.screening.table_files import check_output, write_rows, write_whole


def write_table(table: QTable, path: str | Path) -> None:
    """Write a table in the format of its suffix, with units and provenance.

    In Parquet and CSV a time becomes text (ISO, TDB) and a vector three columns ``name_x``, ``name_y``, ``name_z``
    (an array of another length ``name_1``, ``name_2``, ...);
    :func:`flybystab.screening.results.read_results` reads ECSV and Parquet.
    CSV has the unit in the name of each column and no provenance.

    Raises
    ------
    InvalidInput
        The file cannot be written.
    MissingExtra
        A Parquet file without pyarrow.
    """
    out = check_output(path, WRITTEN)
    if out.suffix == ".ecsv":
        write_whole(ecsv_content(table).decode(), out)
        return
    columns: dict[str, Column] = {}
    values: dict[str, np.ndarray] = {}
    for name in table.colnames:
        column = table[name]
        unit: u.UnitBase | None = None
        if isinstance(column, Time):
            column, name = column.tdb.isot, f"{name}_tdb"
        elif isinstance(column, Quantity):
            unit = None if column.unit == u.dimensionless_unscaled else column.unit
            column = column.value
        array = np.asarray(column)
        if array.ndim == 1:
            parts = {name: array}
        else:
            labels = "xyz" if array.shape[1] == 3 else [str(k + 1) for k in range(array.shape[1])]
            parts = {f"{name}_{label}": array[:, k] for k, label in enumerate(labels)}
        kind = {"f": float, "i": int, "b": bool}.get(array.dtype.kind, str)
        for key, part in parts.items():
            columns[key], values[key] = Column(kind, unit, ""), part
    rows = (dict(zip(values, cells, strict=True)) for cells in zip(*values.values(), strict=True))
    write_rows(rows, out, columns, table.meta)
