"""Columns with units and metadata as files: ECSV, Parquet, JSON, netCDF to save and read, CSV to save.

The content is a dictionary of arrays (:class:`~astropy.units.Quantity` or numpy, same first dimension) and metadata
of plain types (:func:`~flybystab.encoding.encoded`). Every format but CSV restores both exactly, infinite and undefined
numbers included. The entry ``object`` of the metadata is the encoded object that the columns describe.
"""

from __future__ import annotations

import io
import json
import tempfile
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

import numpy as np
from astropy.units import Quantity, Unit, UnitBase, km

from flybystab.encoding import KNOWN, decoded, encoded
from flybystab.errors import FlybystabError, InvalidInput, MissingExtra
from flybystab.files import parse_json, read_bytes, read_text, replace_file
from flybystab.typing import Document

if TYPE_CHECKING:
    from xarray import Dataset

__all__ = ["KNOWN", "decoded", "encoded", "read_columns", "save_columns", "with_unit"]

#: Columns by name; a quantity is an array, too.
Columns = dict[str, np.ndarray]
#: Units of quantities in documents and CSV files, where tables differ: one key for one quantity.
DOCUMENT_UNITS = {"distance": km}
#: Text that starts with one of these is quoted: spreadsheets read it as a formula, ECSV readers as a comment (#).
QUOTED_START = ("=", "+", "-", "@", "#", " ", "\t")
#: Variable of a netCDF file that holds the encoded object.
_OBJECT = "flybystab_object"
#: Largest file that is read, bytes.
SAVED_LIMIT = 4 * 2**30


def with_unit(name: str, unit: UnitBase) -> str:
    """Name of a column followed by its unit, such as ``v_inf_km_s`` or ``density_kg_m3``."""
    text = unit.to_string().replace(" / ", "_").replace(" ", "").replace("%", "percent")
    return f"{name}_{text}" if text else name


def pyarrow() -> ModuleType:
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


def xarray() -> ModuleType:
    """The package xarray.

    Raises
    ------
    MissingExtra
    """
    try:
        import h5netcdf  # noqa: F401
        import xarray
    except ImportError:
        raise MissingExtra("xarray", "xarray", "an xarray data set or a netCDF file") from None
    return xarray


def flat(columns: Mapping[str, np.ndarray]) -> Columns:
    """Columns of scalars without units, by a name with the unit; a component is a column, such as ``semi_axes_1_m``."""
    out: Columns = {}
    for name, column in columns.items():
        for index in np.ndindex(column.shape[1:]):
            part = column[(slice(None), *index)]
            label = name + ("_" + "".join(str(i + 1) for i in index) if index else "")
            if isinstance(part, Quantity):
                out[with_unit(label, part.unit)] = part.value
            else:
                out[label] = part
    return out


def listed(columns: Mapping[str, np.ndarray]) -> dict[str, list[object]]:
    """Lists by column, with the unit in the name; infinite and undefined numbers are None."""
    out = {}
    for name, column in columns.items():
        bare: np.ndarray = column.value if isinstance(column, Quantity) else column
        label = with_unit(name, column.unit) if isinstance(column, Quantity) else name
        if bare.dtype.kind == "f":
            finite = np.isfinite(bare)
            bare = bare.astype(object)
            bare[~finite] = None
        out[label] = bare.tolist()
    return out


def csv_cell(value: object) -> str:
    """A cell of a CSV or ECSV file; text that a spreadsheet would take for a formula is quoted."""
    if not isinstance(value, str):
        return str(value)
    if value.startswith(QUOTED_START) or any(c in value for c in ',"\r\n'):
        return '"' + value.replace('"', '""') + '"'
    return value


def csv_text(names: Iterable[str], rows: Iterable[Iterable[object]]) -> str:
    """A CSV file: the names of the columns, then the rows."""
    return "".join(",".join(map(csv_cell, row)) + "\n" for row in (names, *rows))


def save_columns(
    path: str | Path, columns: Mapping[str, np.ndarray], meta: Mapping[str, object], overwrite: bool
) -> Path:
    """Write columns and metadata in the format of the suffix; returns the path.

    Raises
    ------
    InvalidInput
        Another suffix, a file that exists (without `overwrite`), or one that cannot be written.
    MissingExtra
        A Parquet file without pyarrow.
    """
    return written(path, _WRITERS, overwrite, columns, meta)


def written(
    path: str | Path, writers: Mapping[str, Callable[..., bytes]], overwrite: bool, *content: object
) -> Path:
    """Write the bytes of the writer of the suffix through a temporary file."""
    out = Path(path)
    if out.suffix not in writers:
        raise InvalidInput("path", str(path), f"a file name that ends in {', '.join(writers)}")
    if out.exists() and not overwrite:
        raise InvalidInput("path", str(path), "a file that does not exist, or overwrite=True")
    data = writers[out.suffix](*content)
    try:
        replace_file(out, data)
    except OSError as error:
        raise InvalidInput("path", str(path), f"a file that can be written ({error.strerror})") from None
    return out


def content_of(suffix: str, columns: Mapping[str, np.ndarray], meta: Mapping[str, object]) -> bytes:
    """The bytes of a file in the format of a suffix."""
    return _WRITERS[suffix](columns, meta)


def read_columns(path: str | Path) -> tuple[Columns, Document]:
    """Columns and metadata of a file that :func:`save_columns` wrote.

    Raises
    ------
    InvalidInput
        Another suffix, or not such a file.
    """
    file = Path(path)
    if file.suffix not in _READERS:
        raise InvalidInput("path", str(path), f"a file name that ends in {', '.join(_READERS)}")
    try:
        return _READERS[file.suffix](file)
    except FlybystabError:
        raise
    except Exception as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise InvalidInput("path", str(path), f"a file written by save() ({reason})") from None


def _ecsv(columns: Mapping[str, np.ndarray], meta: Mapping[str, object]) -> bytes:
    from astropy.table import Table

    text = io.StringIO()
    about = {**meta, "rows": _length(columns), "layout": _described(columns)}
    if "object" in about:  # as one text: YAML is slow
        about["object"] = json.dumps(about["object"], allow_nan=False)
    # not a QTable, whose ECSV writer fails at a quantity in a column named "value"
    Table(dict(columns), meta=about).write(text, format="ascii.ecsv")
    return text.getvalue().encode()


def _read_ecsv(path: Path) -> tuple[Columns, Document]:
    from astropy.table import MaskedColumn, QTable

    table = QTable.read(read_bytes(path, "path", SAVED_LIMIT).decode(), format="ascii.ecsv")
    if table.meta.pop("rows") != len(table):
        raise ValueError("rows are missing: the file was cut off")
    out: Columns = {}
    for name in table.colnames:
        column = table[name]
        if isinstance(column, MaskedColumn):  # an empty text counts as missing in ECSV
            column = column.filled("")
        out[name] = np.asarray(column.value if isinstance(column, Quantity) else column)
    for name, _, unit in table.meta.pop("layout"):  # a column without dimension has no unit in ECSV
        out[name] = out[name] if unit is None else out[name] * Unit(unit)
    meta = dict(table.meta)
    if "object" in meta:
        meta["object"] = json.loads(meta["object"])
    return out, meta


def _parquet(columns: Mapping[str, np.ndarray], meta: Mapping[str, object]) -> bytes:
    pa = pyarrow()
    about = json.dumps({"columns": _described(columns), "meta": dict(meta)}, allow_nan=False)
    units = [
        column.unit.to_string("vounit") if isinstance(column, Quantity) else ""
        for column in columns.values()
        for _ in np.ndindex(column.shape[1:])
    ]
    parts = {k: np.ascontiguousarray(v) for k, v in flat(columns).items()}
    arrays = [pa.array(v.tolist() if v.dtype.kind in "UO" else v) for v in parts.values()]
    arrays = [a if a.type != pa.null() else a.cast(pa.string()) for a in arrays]
    schema = pa.schema(
        [
            pa.field(name, a.type, metadata={"unit": unit})
            for name, a, unit in zip(parts, arrays, units, strict=True)
        ],
        metadata={"flybystab": about},
    )
    stream = io.BytesIO()
    pa.parquet.write_table(pa.table(arrays, schema=schema), stream, compression="zstd")
    return stream.getvalue()


def _read_parquet(path: Path) -> tuple[Columns, Document]:
    data = pyarrow().parquet.read_table(path)
    about = json.loads(data.schema.metadata[b"flybystab"])
    names = iter(data.column_names)
    out: Columns = {}
    for name, shape, unit in about["columns"]:
        parts = []
        for _ in np.ndindex(*shape):
            part = data[next(names)].to_numpy()
            parts.append(part.astype(str) if part.dtype == object else part)
        values = np.stack(parts, axis=-1).reshape(-1, *shape)
        out[name] = values if unit is None else values * Unit(unit)
    return out, dict(about["meta"])


def _json(columns: Mapping[str, np.ndarray], meta: Mapping[str, object]) -> bytes:
    infinite: dict[str, dict[str, list[int]]] = {}
    for name, column in columns.items():
        bare = np.asarray(column)
        if bare.dtype.kind == "f" and np.isinf(bare).any():
            ends = (("inf", np.inf), ("-inf", -np.inf))
            infinite[name] = {text: np.flatnonzero(bare == end).tolist() for text, end in ends}
    document = {
        "schema": "result/1",
        "meta": dict(meta),
        "layout": _described(columns),
        "infinite": infinite,
        "columns": listed(columns),
    }
    return (json.dumps(document, allow_nan=False, indent=1) + "\n").encode()


def _read_json(path: Path) -> tuple[Columns, Document]:
    document = parse_json(read_text(path, "path"), "path", path)
    if document["schema"] != "result/1":
        raise ValueError(f"schema {document['schema']}")
    out: Columns = {}
    for (name, shape, unit), values in zip(document["layout"], document["columns"].values(), strict=True):
        array = np.array(values)
        if array.dtype == object:  # with None
            array = array.astype(float)
        array = array.reshape(-1, *shape)
        for text, places in document["infinite"].get(name, {}).items():
            array.reshape(-1)[places] = float(text)
        out[name] = array if unit is None else array * Unit(unit)
    return out, dict(document["meta"])


def _csv(columns: Mapping[str, np.ndarray], meta: Mapping[str, object]) -> bytes:
    parts = flat(columns)
    return csv_text(parts, zip(*(v.tolist() for v in parts.values()), strict=True)).encode()


def _netcdf(columns: Mapping[str, np.ndarray], meta: Mapping[str, object]) -> bytes:
    about = {k: v for k, v in meta.items() if k != "object"}
    data = dataset(
        {k: (["row", *(f"{k}_{i}" for i in range(1, v.ndim))], v) for k, v in columns.items()}, about
    )
    if "object" in meta:  # too long for an attribute of HDF5
        data[_OBJECT] = ([], json.dumps(meta["object"], allow_nan=False))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "x.nc")
        data.to_netcdf(file, engine="h5netcdf")
        return file.read_bytes()


def _read_netcdf(path: Path) -> tuple[Columns, Document]:
    with xarray().open_dataset(path, engine="h5netcdf", decode_times=False, decode_timedelta=False) as data:
        out: Columns = {}
        about = json.loads(data.attrs["flybystab"])
        for name, _, unit in about["columns"]:
            values = data[name].values
            values = values.astype(str) if values.dtype == object else values
            out[name] = values if unit is None else values * Unit(unit)
        if _OBJECT in data:
            about["meta"]["object"] = json.loads(str(data[_OBJECT].values))
    return out, dict(about["meta"])


def dataset(variables: Mapping[str, tuple[list[str], np.ndarray]], meta: Mapping[str, object]) -> Dataset:
    """An xarray data set of named arrays with their dimensions; units and metadata are attributes."""
    xr = xarray()
    data = xr.Dataset()
    for name, (dimensions, values) in variables.items():
        bare = np.asarray(values.value if isinstance(values, Quantity) else values)
        data[name] = (dimensions, bare.astype(object) if bare.dtype.kind == "U" else bare)
        if isinstance(values, Quantity):
            data[name].attrs["units"] = values.unit.to_string()
    about = {"columns": _described({k: v for k, (_, v) in variables.items()}), "meta": dict(meta)}
    data.attrs["flybystab"] = json.dumps(about, allow_nan=False)
    return data


def _length(columns: Mapping[str, np.ndarray]) -> int:
    return len(next(iter(columns.values())))


def _described(columns: Mapping[str, np.ndarray]) -> list[list[object]]:
    """Name, shape of a row and unit of each column."""
    return [
        [name, list(c.shape[1:]), c.unit.to_string() if isinstance(c, Quantity) else None]
        for name, c in columns.items()
    ]


_WRITERS: dict[str, Callable[[Mapping[str, np.ndarray], Mapping[str, object]], bytes]] = {
    ".ecsv": _ecsv,
    ".parquet": _parquet,
    ".json": _json,
    ".nc": _netcdf,
    ".csv": _csv,
}
_READERS: dict[str, Callable[[Path], tuple[Columns, Document]]] = {
    ".ecsv": _read_ecsv,
    ".parquet": _read_parquet,
    ".json": _read_json,
    ".nc": _read_netcdf,
}
