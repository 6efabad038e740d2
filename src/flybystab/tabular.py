"""Results as data: tables with units, data frames, dictionaries, files, HTML and plots, by two mixins.

:class:`Tabular` is for results with one row per time, sample or point of a grid, :class:`Record` for single ones.
"""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from html import escape
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
from astropy.units import Quantity

from flybystab import saving
from flybystab._version import __version__
from flybystab.errors import InvalidInput
from flybystab.saving import decoded, encoded, with_unit

if TYPE_CHECKING:
    from astropy.table import QTable

__all__ = ["Record", "Tabular", "with_unit"]

#: Columns and rows of a table in a notebook.
SHOWN_COLUMNS, SHOWN_ROWS = 10, 20


class Results:
    """What both mixins share: all that follows from columns and metadata."""

    #: Columns that a notebook shows; by default the first ten.
    _shown: ClassVar[tuple[str, ...]] = ()

    def _columns(self) -> tuple[dict[str, Any], dict[str, Any]]:
        """Columns of the same length, and metadata of plain types (:func:`flybystab.saving.encoded`)."""
        raise NotImplementedError

    def _about(self) -> dict[str, Any]:
        return {"result": type(self).__name__, "flybystab": __version__}

    def __astropy_table__(self, cls: type, copy: bool, **kwargs: Any) -> Any:
        """Table of the class `cls`: called by ``QTable(result)`` and ``Table(result)``."""
        columns, meta = self._columns()
        return cls(columns, copy=copy, meta=meta, **kwargs)

    def to_table(self) -> QTable:
        """Table with units and metadata; vectors and tensors are columns with more dimensions."""
        from astropy.table import QTable

        return QTable(self)

    def to_dict(self) -> dict[str, Any]:
        """Lists by column, with the unit in the name; infinite and undefined numbers are None."""
        return saving.listed(self._columns()[0])

    def to_pandas(self) -> Any:
        """DataFrame with the unit in the name of each column; components are columns, such as ``semi_axes_1_m``."""
        import pandas

        return pandas.DataFrame(saving.flat(self._columns()[0]))

    def save(self, path: str | Path, *, overwrite: bool = False) -> Path:
        """Write to ``.ecsv``, ``.parquet`` (extra ``parquet``), ``.json``, ``.nc`` (extra ``xarray``) or ``.csv``.

        All but ``.csv``, which has no metadata, are for :meth:`read`.

        Raises
        ------
        InvalidInput
            Another suffix, a file that exists (without `overwrite`), or one that cannot be written.
        MissingExtra
        """
        return saving.save_columns(path, *self._columns(), overwrite)

    def plot(self, axes: Any = None, **options: Any) -> Any:
        """Plot into matplotlib axes, new ones by default; returns the axes.

        The figures are functions of :mod:`flybystab.plots`; `options` are passed to them.

        Raises
        ------
        InvalidInput
            There is no figure of this kind of result.
        """
        # by name: plots import the results that they show
        return import_module("flybystab.plots.results").plot_result(self, axes, **options)

    def _repr_html_(self) -> str:
        table = self.to_table()
        names = [n for n in self._shown if n in table.colnames] or table.colnames[:SHOWN_COLUMNS]
        rest = [n for n in table.colnames if n not in names]
        lines = table[names].pformat(max_lines=SHOWN_ROWS + 5, max_width=-1, html=True, show_unit=True)
        note = f"<p>and {len(rest)} more columns in to_table(): {escape(', '.join(rest))}</p>" if rest else ""
        return f"<div><p>{escape(repr(self))}</p>{''.join(lines)}{note}</div>"


class Tabular(Results):
    """Mixin of a dataclass of arrays with the same leading dimensions; other fields are metadata of the table."""

    #: Names of the leading dimensions, and for each field along one of them that dimension.
    _dimensions: ClassVar[tuple[str, ...]] = ("row",)

    def __len__(self) -> int:
        raise NotImplementedError

    def _grid(self) -> tuple[int, ...]:
        """Leading dimensions of the arrays."""
        return (len(self),)

    def _parts(self) -> tuple[dict[str, Any], dict[str, Any], dict[str, Any]]:
        """Arrays over the grid, coordinates along one dimension of it, and the other fields."""
        grid, arrays, along, rest = self._grid(), {}, {}, {}
        for f in fields(self):  # type: ignore[arg-type]
            value = getattr(self, f.name)
            if len(grid) > 1 and f.name in self._dimensions:
                along[f.name] = value
            elif isinstance(value, np.ndarray) and value.ndim and value.shape[: len(grid)] == grid:
                arrays[f.name] = value
            else:
                rest[f.name] = value
        return arrays, along, rest

    def _columns(self) -> tuple[dict[str, Any], dict[str, Any]]:
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

    @classmethod
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
        grid = tuple(meta.get("grid", ()))
        values = {}
        for f in fields(cls):  # type: ignore[arg-type]
            if f.name not in columns:
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

    def to_xarray(self) -> Any:
        """The same as an xarray data set with named dimensions (extra ``xarray``); units are attributes."""
        grid = self._grid()
        arrays, along, rest = self._parts()
        variables = {name: ([name], value) for name, value in along.items()}
        for name, value in arrays.items():
            more = [f"{name}_{k}" for k in range(1, value.ndim - len(grid) + 1)]
            variables[name] = ([*self._dimensions, *more], value)
        return saving.dataset(variables, {**self._about(), **{k: encoded(v) for k, v in rest.items()}})


class Record(Results):
    """Mixin of a single result, a dataclass: a table of one row; nested results are columns with a prefix."""

    #: Fields that are not columns.
    _left_out: ClassVar[tuple[str, ...]] = ()

    def _columns(self) -> tuple[dict[str, Any], dict[str, Any]]:
        columns: dict[str, Any] = {}
        for f in fields(self):  # type: ignore[arg-type]
            if f.name not in self._left_out:
                _put(columns, f.name, getattr(self, f.name))
        return columns, self._about()

    def to_dict(self) -> dict[str, Any]:
        """Values by name, with the unit in the name; infinite and undefined numbers are None."""
        return {name: values[0] for name, values in super().to_dict().items()}

    @classmethod
    def read(cls, path: str | Path) -> QTable:
        """Table of one row in a file that :meth:`save` wrote: what :meth:`to_table` gave.

        Raises
        ------
        InvalidInput
            Not such a file, or another kind of result.
        """
        from astropy.table import QTable

        columns, meta = saving.read_columns(path)
        if meta.get("result") != cls.__name__:
            raise InvalidInput("path", str(path), f"a saved {cls.__name__}, not {meta.get('result')}")
        return QTable(columns, meta=meta)


def _put(columns: dict[str, Any], name: str, value: Any) -> None:
    """Append a value as columns of length 1; None and bodies are left out."""
    if isinstance(value, Quantity | np.ndarray | bool | int | float | str | np.generic):
        if isinstance(value, str):
            value = str(value)
        columns[name] = value[None] if isinstance(value, Quantity) else np.asarray(value)[None]
    elif hasattr(value, "_asdict"):
        for key, part in value._asdict().items():
            _put(columns, f"{name}_{key}", part)
    elif isinstance(value, dict):
        for key, part in value.items():
            _put(columns, f"{name}_{key}", part)
    elif is_dataclass(value) and type(value).__name__ not in saving.KNOWN:
        left_out = getattr(value, "_left_out", ())
        for f in fields(value):
            if f.name not in left_out:
                _put(columns, f"{name}_{f.name}", getattr(value, f.name))
