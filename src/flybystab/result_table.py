"""Tables of encounters, verdicts and bounds: a QTable with the methods of the other results, and its files.

:func:`flybystab.find_encounters`, :func:`flybystab.screen`, :func:`flybystab.infer` and
:func:`flybystab.virtual_impactors` return a :class:`ResultTable`.
"""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Self

import numpy as np
from astropy.table import MaskedColumn, QTable
from astropy.time import Time
from astropy.units import Quantity, Unit, dimensionless_unscaled

from flybystab import saving
from flybystab._version import __version__
from flybystab.arguments import check_arguments
from flybystab.encoding import decoded, encoded
from flybystab.errors import FlybystabError, InvalidInput, UnknownName
from flybystab.files import read_bytes
from flybystab.tabular import table_html
from flybystab.typing import Document

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pandas import DataFrame
    from pyarrow import Schema

__all__ = ["ResultTable", "read_table"]

#: Columns that a notebook shows, by kind of table; names that a table does not have are left out.
SHOWN = {
    "encounters with verdicts": (
        "asteroid", "planet", "time_tdb", "distance", "v_inf", "verdict", "margin", "friction_rise", "p_intact",
        "p_yield",
    ),
    "encounters": (
        "asteroid", "planet", "time", "distance", "distance_sigma", "v_rel", "v_inf", "b_t", "impact", "p_impact",
    ),
    "possible impacts": ("time", "distance", "sigma", "stretching", "width", "probability", "v_inf"),
    "bounds on the material": (
        "density", "cohesion", "friction_equilibrium", "friction_any_attitude", "friction_every_attitude",
    ),
}  # fmt: skip
#: Columns by which a kind of table is known.
KNOWN_BY = {
    "encounters with verdicts": {"asteroid", "time_tdb", "distance", "verdict", "margin", "friction_rise"},
    "encounters": {"asteroid", "planet", "time", "distance", "impact"},
    "possible impacts": {"time", "sigma", "probability"},
    "bounds on the material": {"density", "cohesion", "friction_equilibrium"},
}  # fmt: skip
#: Formats whose reader restores the table.
READ = (".ecsv", ".parquet", ".json", ".nc")
#: Largest ECSV file that is read, bytes: the reader needs several times as much memory.
LARGEST = 4 * 2**30


class ResultTable(QTable):
    """A :class:`~astropy.table.QTable` that can be saved, plotted and converted like any other result.

    Slices, copies and stacked tables are of this class too. A notebook shows the ten main columns; the others are in
    the table (``table.colnames``), and ``print(table)`` and ``show_in_notebook()`` are those of astropy.
    """

    def kind(self) -> str:
        """Kind of the rows, from their columns: a key of :data:`SHOWN`, or an empty text."""
        names = set(self.colnames)
        return next((kind for kind, columns in KNOWN_BY.items() if columns <= names), "")

    def to_table(self) -> QTable:
        """The same columns as a plain QTable."""
        return QTable(self)

    def to_dict(self) -> dict[str, list[object]]:
        """Lists by column, with the unit in the name; infinite and undefined numbers are None, times are text (TDB)."""
        return saving.listed(_scalars(self, 3)[0])

    @check_arguments
    def to_pandas(self, index: str | None = None, **options: object) -> DataFrame:
        """DataFrame with the unit in the name of each column; vectors become columns ``_x``, ``_y``, ``_z``.

        Parameters
        ----------
        index : str, optional
            Column of the frame that becomes its index.
        options
            Ignored: those of :meth:`astropy.table.Table.to_pandas`.

        Raises
        ------
        UnknownName
            The frame has no such column.
        """
        import pandas

        columns, about = _scalars(self, 3)
        for name in about["times"]:
            columns[f"{name}_tdb"] = np.asarray(columns[f"{name}_tdb"], dtype="datetime64[ms]")
        frame = pandas.DataFrame(saving.flat(columns))
        if index is not None and index not in frame.columns:
            raise UnknownName("column", index, [], f"(known: {', '.join(frame.columns)})")
        return frame if index is None else frame.set_index(index)

    @check_arguments
    def save(self, path: str | Path, *, overwrite: bool = False) -> Path:
        """Write to ``.ecsv``, ``.parquet`` (extra ``parquet``), ``.json``, ``.nc`` (extra ``xarray``) or ``.csv``.

        All but ``.csv``, which has no metadata, give the same table back by :meth:`read`, to rounding (times to
        0.1 ms). The commands ``flybystab show`` and ``flybystab atlas`` read ``.ecsv`` and ``.parquet``.

        Raises
        ------
        InvalidInput
            Another suffix, a file that exists (without `overwrite`), or one that cannot be written.
        MissingExtra
        """
        return saving.written(path, _WRITERS, overwrite, self)

    @classmethod
    @check_arguments
    def read(cls, path: str | Path, *args: object, **kwargs: object) -> Self:
        """The table in a file that :meth:`save` or a command wrote; with further arguments as ``QTable.read``.

        Raises
        ------
        InvalidInput
            The file cannot be read, or was cut off.
        """
        if args or kwargs:
            return super().read(path, *args, **kwargs)
        return cls(read_table(path), copy=False)

    def plot(self, axes: Axes | None = None, **options: object) -> Axes:
        """Plot into matplotlib axes, new ones by default; returns the axes.

        Parameters
        ----------
        axes : matplotlib Axes, optional
        options
            ``column`` of a table of bounds: the friction angle that is shown.

        Raises
        ------
        InvalidInput
            The table lacks the columns of every kind that has a figure.
        """
        # by name: plots import the results that they show
        return import_module("flybystab.plots.results").plot_result(self, axes, **options)

    def _repr_html_(self) -> str:
        kind = self.kind()
        shown = [n for n in SHOWN.get(kind, ()) if n in self.colnames]
        title = f"{len(self)} {kind or 'rows'}"
        return table_html(self, shown, title, "columns of the table")


def _scalars(table: QTable, digits: int) -> tuple[saving.Columns, Document]:
    """Columns of scalars, in the units of documents, and what :func:`_joined` needs to restore the table.

    Times become text (ISO, TDB) with `digits` decimals of the second, vectors three columns.
    """
    columns: saving.Columns = {}
    times, vectors, texts = [], {}, {}
    for name in table.colnames:
        column = table[name]
        if text := column.info.description:
            texts[name] = text
        if isinstance(column, Time):
            moments = column.tdb.copy()
            moments.precision = digits
            columns[f"{name}_tdb"] = np.asarray(moments.isot, dtype=str)
            times.append(name)
            continue
        if isinstance(column, Quantity):
            if column.unit == dimensionless_unscaled:
                column = column.value
            elif name in saving.DOCUMENT_UNITS:
                column = column.to(saving.DOCUMENT_UNITS[name])
        else:
            column = np.asarray(column)
        if column.ndim == 2 and column.shape[1] == 3:
            parts = [f"{name}_{axis}" for axis in "xyz"]
            vectors[name] = parts
            columns |= {part: column[:, k] for k, part in enumerate(parts)}
        else:
            columns[name] = column
    return columns, {"times": times, "vectors": vectors, "descriptions": texts}


def _document(table: QTable) -> tuple[saving.Columns, Document]:
    """Columns and metadata of a file in plain types."""
    columns, about = _scalars(table, 9)
    units = {
        name: table[name].unit.to_string()
        for name in table.colnames
        if name in saving.DOCUMENT_UNITS and isinstance(table[name], Quantity)
    }
    meta = {str(k): encoded(v) for k, v in table.meta.items()}
    head = {"result": "ResultTable", "flybystab": __version__, "columns_of": {**about, "units": units}}
    return columns, {**head, "about": meta}


def _joined(columns: saving.Columns, meta: Document) -> ResultTable:
    """The table of the columns and metadata of :func:`_document`."""
    how = meta["columns_of"]
    first = {parts[0]: name for name, parts in how["vectors"].items()}
    rest = {part for parts in how["vectors"].values() for part in parts[1:]}
    times = {f"{name}_tdb": name for name in how["times"]}
    out = ResultTable()
    for name, column in columns.items():
        if name in rest:
            continue
        if name in times:
            out[times[name]] = Time(column, format="isot", scale="tdb")
        elif name in first:
            out[first[name]] = np.stack([columns[part] for part in how["vectors"][first[name]]], axis=1)
        else:
            out[name] = Quantity(column).to(Unit(how["units"][name])) if name in how["units"] else column
    for name, text in how["descriptions"].items():
        out[name].info.description = text
    out.meta = {name: decoded(value) for name, value in meta["about"].items()}
    return out


def ecsv_content(table: QTable) -> bytes:
    """A table as an ECSV file, with the number of rows in its header."""
    counted = table.copy(copy_data=False)
    if not len(table):  # the reader of astropy refuses vectors without rows
        for name, parts in _scalars(table, 3)[1]["vectors"].items():
            place = counted.index_column(name)
            counted.add_columns([counted[name][:, k] for k in range(3)], [place] * 3, parts)
            counted.remove_column(name)
    counted.meta = {**table.meta, "rows": len(table)}
    text = io.StringIO()
    counted.write(text, format="ascii.ecsv")
    return text.getvalue().encode()


def _by(suffix: str) -> Callable[[QTable], bytes]:
    return lambda table: saving.content_of(suffix, *_document(table))


#: Functions that make the bytes of a file, by suffix.
_WRITERS: dict[str, Callable[[QTable], bytes]] = {
    ".ecsv": ecsv_content,
    **{suffix: _by(suffix) for suffix in (".parquet", ".json", ".nc")},
    ".csv": lambda table: saving.content_of(".csv", *_scalars(table, 3)),
}


def read_table(path: str | Path, name: str = "path") -> ResultTable:
    """A table file as a table with units and its provenance in ``meta``.

    Parameters
    ----------
    path : str or Path
        File that :meth:`ResultTable.save` or a command wrote: ECSV, Parquet, JSON or netCDF.
    name : str
        Name of the argument in errors.

    Raises
    ------
    InvalidInput
        The file cannot be read, or has fewer rows than its header says.
    """
    file = Path(path)
    if file.suffix not in READ:
        raise InvalidInput(name, str(path), f"a file name that ends in {', '.join(READ)}")
    try:
        if file.suffix == ".ecsv":
            return _read_ecsv(file, path, name)
        if file.suffix == ".parquet" and not _saved(file):
            return _read_parquet(file)
        columns, meta = saving.read_columns(file)
        if meta.get("result") != "ResultTable":
            raise InvalidInput(name, str(path), f"a saved table, not a {meta.get('result')}")
        return _joined(columns, meta)
    except FlybystabError:
        raise
    except Exception as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise InvalidInput(name, str(path), f"a readable result file ({reason})") from None


def _read_ecsv(file: Path, path: str | Path, name: str) -> ResultTable:
    content = read_bytes(file, name, LARGEST)
    table = ResultTable(QTable.read(content.decode(), format="ascii.ecsv"), copy=False)
    _check_complete(table, content, path, name)
    for column in table.colnames:  # an empty text counts as missing in ECSV
        if isinstance(table[column], MaskedColumn) and table[column].dtype.kind == "U":
            about = table[column].info.description
            table[column] = table[column].filled("")
            table[column].info.description = about
    return table


def _check_complete(table: QTable, content: bytes, path: str | Path, name: str) -> None:
    """Refuse a truncated table: the header gives the number of rows, and the last line must end with a newline."""
    rows = table.meta.get("rows")
    if isinstance(rows, int) and (rows != len(table) or not content.endswith(b"\n")):
        raise InvalidInput(
            name,
            str(path),
            f"the {rows:,} rows that its header gives; {len(table):,} are there: the file was cut off",
        )


def _parquet_about(schema: Schema) -> Document:
    """The entry of this package in the metadata of a Parquet file."""
    return dict(json.loads((schema.metadata or {}).get(b"flybystab", b"{}")))


def _saved(file: Path) -> bool:
    """True for a Parquet file of save(); commands write theirs row by row."""
    return {"columns", "meta"} == set(_parquet_about(saving.pyarrow().parquet.read_schema(file)))


def _read_parquet(path: Path) -> ResultTable:
    data = saving.pyarrow().parquet.read_table(path)
    table = ResultTable()
    for name in data.column_names:
        values = data[name].to_numpy(zero_copy_only=False)
        if values.dtype == object:
            values = values.astype(str)
        about = data.schema.field(name).metadata or {}
        unit = about.get(b"unit", b"").decode()
        table[name] = values * Unit(unit) if unit else values
        table[name].info.description = about.get(b"description", b"").decode()
    table.meta = _parquet_about(data.schema)
    return table
