"""Results as data: tables with units, data frames, dictionaries, files, HTML and plots, by mixins.

:class:`Tabular` is for results with one row per time, sample or point of a grid, :class:`Record` for single ones,
:class:`Collection` for those with several rows and further content.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence, Sized
from dataclasses import MISSING, fields, is_dataclass
from html import escape
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
from astropy.time import Time
from astropy.units import Quantity

from flybystab import saving
from flybystab._version import __version__
from flybystab.arguments import check_arguments
from flybystab.encoding import decoded, encoded
from flybystab.errors import InvalidInput
from flybystab.saving import Columns, with_unit
from flybystab.typing import Document
from flybystab.units import brief

if TYPE_CHECKING:
    from astropy.table import QTable, Table
    from matplotlib.axes import Axes
    from pandas import DataFrame
    from xarray import Dataset

__all__ = ["Record", "Tabular", "with_unit"]

#: Columns and rows of a table in a notebook.
SHOWN_COLUMNS, SHOWN_ROWS = 10, 20
#: Significant digits of the numbers there; enough for a Julian date to 0.1 d.
DIGITS = 8


class Results:
    """Base of the mixins: methods that follow from columns and metadata."""

    #: Columns that a notebook shows; by default the first ten.
    _shown: ClassVar[tuple[str, ...]] = ()
    #: Fields that are neither columns nor metadata of the table; so are those whose names begin with "_".
    _left_out: ClassVar[tuple[str, ...]] = ()

    @classmethod
    def _hidden(cls, name: str) -> bool:
        return name.startswith("_") or name in cls._left_out

    def _columns(self) -> tuple[Columns, Document]:
        """Columns of the same length, and metadata of plain types (:func:`flybystab.saving.encoded`)."""
        raise NotImplementedError

    def _about(self) -> Document:
        return {"result": type(self).__name__, "flybystab": __version__}

    def __astropy_table__(self, cls: type[Table], copy: bool, **kwargs: object) -> Table:
        """Table of the class `cls`: called by ``QTable(result)`` and ``Table(result)``."""
        columns, meta = self._columns()
        return cls(columns, copy=copy, meta=meta, **kwargs)

    def to_table(self) -> QTable:
        """Table with units and metadata; vectors and tensors are columns with more dimensions."""
        from astropy.table import QTable

        return QTable(self)

    def to_dict(self) -> Document:
        """Lists by column, with the unit in the name; infinite and undefined numbers are None."""
        return saving.listed(self._columns()[0])

    def to_pandas(self) -> DataFrame:
        """DataFrame with the unit in the name of each column; components are columns, such as ``semi_axes_1_m``."""
        import pandas

        return pandas.DataFrame(saving.flat(self._columns()[0]))

    def _row_iterator(self) -> Iterator[Document]:
        """The rows of :meth:`to_pandas` as dictionaries: ``pandas.DataFrame(result)`` is made of them."""
        columns = saving.flat(self._columns()[0])
        return (dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True))

    @check_arguments
    def save(self, path: str | Path, *, overwrite: bool = False) -> Path:
        """Write to ``.ecsv``, ``.parquet`` (extra ``parquet``), ``.json``, ``.nc`` (extra ``xarray``) or ``.csv``.

        All but ``.csv``, which has no metadata, give the same result back by :meth:`read`.

        Raises
        ------
        InvalidInput
            Another suffix, a file that exists (without `overwrite`), or one that cannot be written.
        MissingExtra
        """
        columns, meta = self._columns()
        return saving.save_columns(path, columns, {**meta, **self._stored_with()}, overwrite)

    def _stored_with(self) -> Document:
        """Metadata of files alone, which :meth:`read` needs beyond the table."""
        raise NotImplementedError

    @classmethod
    @check_arguments
    def read(cls, path: str | Path) -> Self:
        """The result in a file that :meth:`save` wrote.

        Raises
        ------
        InvalidInput
            Not such a file, or another kind of result.
        """
        columns, meta = saving.read_columns(path)
        if meta.get("result") != cls.__name__:
            raise InvalidInput("path", str(path), f"a saved {cls.__name__}, not {meta.get('result')}")
        try:
            return cls._restored(columns, meta)
        except KeyError as missing:
            raise InvalidInput("path", str(path), f"a complete file (it has no {missing})") from None

    @classmethod
    def _restored(cls, columns: Columns, meta: Document) -> Self:
        raise NotImplementedError

    def plot(self, axes: Axes | Sequence[Axes] | None = None, **options: object) -> Any:
        """Plot into matplotlib axes, new ones by default; returns the axes.

        The figures are functions of :mod:`flybystab.plots`; `options` are passed to them.

        Raises
        ------
        InvalidInput
            There is no figure of this kind of result.
        """
        # by name: plots import the results that they show
        return import_module("flybystab.plots.results").plot_result(self, axes, **options)

    def __repr__(self) -> str:
        """Name of the class and the fields that fit on a line."""
        parts = []
        for f in fields(self):  # type: ignore[arg-type]
            value = getattr(self, f.name)
            if f.name.startswith("_") or not f.repr:
                continue
            if isinstance(value, Quantity):
                parts.append(f"{f.name} {brief(value)}" if value.isscalar else "")
            elif isinstance(value, bool | str | int | np.generic):
                parts.append(f"{f.name} {value}")
            elif isinstance(value, float):
                parts.append(f"{f.name} {value:.4g}")
        return f"<{type(self).__name__} {', '.join(p for p in parts if p)}>"

    def _repr_html_(self) -> str:
        table = self.to_table()
        shown = [n for n in self._shown if n in table.colnames]
        return table_html(table, shown, repr(self), "columns in to_table()")


def table_html(table: QTable, shown: Sequence[str], title: str, place: str) -> str:
    """A table in a notebook: its main columns, by default the first ten, and the names of the others."""
    names = list(shown) or table.colnames[:SHOWN_COLUMNS]
    rest = [n for n in table.colnames if n not in names]
    part = table[names]
    for name in names:
        column = part[name]
        if isinstance(column, Time):
            part.replace_column(name, np.array([str(x)[:19] for x in column.tdb.iso], dtype=str))
        elif getattr(getattr(column, "dtype", None), "kind", "") == "f" and not column.info.format:
            column = column.copy()
            column.info.format = f".{DIGITS}g"
            part.replace_column(name, column)
    lines = part.pformat(max_lines=SHOWN_ROWS + 5, max_width=-1, html=True, show_unit=True)
    note = f"<p>{len(rest)} more {place}: {escape(', '.join(rest))}</p>" if rest else ""
    return f"<div><p>{escape(title)}</p>{''.join(lines)}{note}</div>"


class Tabular(Results):
    """Mixin of a dataclass of arrays with the same leading dimensions; other fields are metadata of the table."""

    #: Names of the leading dimensions, and for each field along one of them that dimension.
    _dimensions: ClassVar[tuple[str, ...]] = ("row",)

    def __iter__(self) -> Iterator[Document]:
        """Rows as dictionaries, with the unit in each name."""
        return self._row_iterator()

    def __len__(self) -> int:
        visible = (getattr(self, f.name) for f in fields(self) if not self._hidden(f.name))  # type: ignore[arg-type]
        return next(len(value) for value in visible if isinstance(value, np.ndarray) and value.ndim)

    def _grid(self) -> tuple[int, ...]:
        """Leading dimensions of the arrays."""
        return (len(self),)

    def _parts(self) -> tuple[Columns, Columns, Document]:
        """Arrays over the grid, coordinates along one dimension of it, and the other fields."""
        grid, arrays, along, rest = self._grid(), {}, {}, {}
        for f in fields(self):  # type: ignore[arg-type]
            if self._hidden(f.name):
                continue
            value = getattr(self, f.name)
            if len(grid) > 1 and f.name in self._dimensions:
                along[f.name] = value
            elif isinstance(value, np.ndarray) and value.ndim and value.shape[: len(grid)] == grid:
                arrays[f.name] = value
            else:
                rest[f.name] = value
        return arrays, along, rest

    def _columns(self) -> tuple[Columns, Document]:
        grid = self._grid()
        arrays, along, rest = self._parts()
        columns = {}
        for name, value in along.items():
            place = self._dimensions.index(name)
            shape = [-1 if k == place else 1 for k in range(len(grid))]
            columns[name] = np.broadcast_to(value.reshape(shape), grid, subok=True).reshape(-1)
        for name, value in arrays.items():
            columns[name] = value.reshape(-1, *value.shape[len(grid) :])
        meta = {**self._about(), **{k: encoded(v) for k, v in rest.items()}}
        if len(grid) > 1:
            meta["grid"] = list(grid)
        return columns, meta

    def _stored_with(self) -> Document:
        hidden = [f.name for f in fields(self) if self._hidden(f.name)]  # type: ignore[arg-type]
        return {"object": {name: encoded(getattr(self, name)) for name in hidden}} if hidden else {}

    @classmethod
    def _restored(cls, columns: Columns, meta: Document) -> Self:
        grid = tuple(meta.get("grid", ()))
        values = {name: decoded(value) for name, value in meta.get("object", {}).items()}
        for f in fields(cls):  # type: ignore[arg-type]
            if f.name in values or not f.init:
                continue
            if f.name not in columns:
                if f.name not in meta and f.default is not MISSING:
                    continue  # a field that the version that wrote the file did not have
                values[f.name] = decoded(meta[f.name])
                continue
            column = columns[f.name]
            if grid:
                column = column.reshape(*grid, *column.shape[1:])
                if f.name in cls._dimensions:
                    place = cls._dimensions.index(f.name)
                    column = column[tuple(slice(None) if k == place else 0 for k in range(len(grid)))]
            values[f.name] = column
        return cls(**values)

    def to_xarray(self) -> Dataset:
        """The result as an xarray data set with named dimensions (extra ``xarray``); units are attributes."""
        grid = self._grid()
        arrays, along, rest = self._parts()
        variables = {name: ([name], value) for name, value in along.items()}
        for name, value in arrays.items():
            more = [f"{name}_{k}" for k in range(1, value.ndim - len(grid) + 1)]
            variables[name] = ([*self._dimensions, *more], value)
        return saving.dataset(variables, {**self._about(), **{k: encoded(v) for k, v in rest.items()}})


class Record(Results):
    """Mixin of a single result, a dataclass: a table of one row; nested results are columns with a prefix."""

    def _columns(self) -> tuple[Columns, Document]:
        columns: Columns = {}
        for f in fields(self):  # type: ignore[arg-type]
            if not self._hidden(f.name):
                _put(columns, f.name, getattr(self, f.name))
        return columns, self._about()

    def to_dict(self) -> Document:
        """Values by name, with the unit in the name; infinite and undefined numbers are None."""
        return {name: values[0] for name, values in super().to_dict().items()}

    def _stored_with(self) -> Document:
        return {"object": encoded(self)}

    @classmethod
    def _restored(cls, columns: Columns, meta: Document) -> Self:
        found: Self = decoded(meta["object"])
        return found


class Collection(Record):
    """Mixin of a result with several rows and further content: its table has one row for each part."""

    def _rows(self) -> Mapping[str, Sized]:
        """Columns of the table."""
        raise NotImplementedError

    def _columns(self) -> tuple[Columns, Document]:
        columns = {
            name: column if isinstance(column, Quantity) else np.asarray(column)
            for name, column in self._rows().items()
        }
        return columns, self._about()

    def __iter__(self) -> Iterator[Document]:
        """Rows as dictionaries, with the unit in each name."""
        return self._row_iterator()

    def __len__(self) -> int:
        return len(next(iter(self._rows().values())))

    def to_dict(self) -> Document:
        """Lists by column, with the unit in the name; infinite and undefined numbers are None."""
        return Results.to_dict(self)


def _put(columns: Columns, name: str, value: object) -> None:
    """Append a value as columns of length 1, times as text (TDB); None and bodies are left out."""
    if isinstance(value, Time):
        columns[f"{name}_tdb"] = np.asarray([value.tdb.isot])
        return
    if isinstance(value, Quantity | np.ndarray | bool | int | float | str | np.generic):
        if isinstance(value, str):
            value = str(value)
        columns[name] = value[None] if isinstance(value, Quantity) else np.asarray(value)[None]
    elif hasattr(value, "_asdict"):
        _put_parts(columns, name, value._asdict())
    elif isinstance(value, dict):
        _put_parts(columns, name, value)
    elif isinstance(value, Tabular):
        _put_parts(columns, name, value._parts()[2])
    elif isinstance(value, tuple) and value and all(isinstance(part, Quantity) for part in value):
        columns[name] = Quantity(list(value))[None]
    elif is_dataclass(value) and type(value).__name__ not in saving.KNOWN:
        left_out = getattr(value, "_left_out", ())
        names = [f.name for f in fields(value) if f.name not in left_out and not f.name.startswith("_")]
        _put_parts(columns, name, {key: getattr(value, key) for key in names})


def _put_parts(columns: Columns, name: str, parts: Mapping[str, object]) -> None:
    for key, part in parts.items():
        _put(columns, f"{name}_{key}", part)
