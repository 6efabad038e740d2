"""Objects of the package in plain types, for the metadata of saved files: numbers, text, lists and dictionaries.

A value without a JSON type is a dictionary with an entry that gives its type. Dataclasses and named
tuples of this package are stored by their fields, so that :func:`decoded` restores the object exactly; no other class
is restored.
"""

from __future__ import annotations

import base64
import io
import math
import re
import sys
import zlib
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np
from astropy.time import Time
from astropy.units import Quantity, Unit

from flybystab.typing import Document

if TYPE_CHECKING:
    from astropy.table import Table
    from scipy.interpolate import CubicHermiteSpline

#: Dataclasses that are stored by their name alone, with their modules.
KNOWN = {
    "Body": "flybystab.body.body",
    "Material": "flybystab.body.body",
    "Planet": "flybystab.orbit.planets",
}
#: Arrays with more elements are stored in the binary format of numpy, compressed.
LISTED = 64
#: Largest array that is read, bytes.
LARGEST = 2 * 2**30
_MODULE = re.compile(r"flybystab(\.[a-z][a-z0-9_]*)+")


def encoded(value: object) -> object:
    """The value in plain types.

    Raises
    ------
    TypeError
        For an object of a class that is neither of this package nor one of numpy and astropy's.
    """
    if value is None or isinstance(value, bool | int) or type(value) is str:
        return value
    if isinstance(value, Enum):
        return {"enum": _address(type(value)), "is": value.value}
    if isinstance(value, str):
        return str(value)
    if isinstance(value, Quantity):
        bare = value.value
        kept = (
            _array(bare)
            if isinstance(bare, np.ndarray) and not _short(bare)
            else encoded(np.asarray(bare).tolist())
        )
        return {"value": kept, "unit": value.unit.to_string()}
    if isinstance(value, np.void):
        return {"record": _array(np.array(value)[None])}
    if isinstance(value, np.generic):
        return encoded(value.item())
    if isinstance(value, float):
        return value if math.isfinite(value) else {"number": str(value)}
    if isinstance(value, np.ma.MaskedArray):
        return {"masked": [_array(np.asarray(value.data)), _array(np.ma.getmaskarray(value))]}
    if isinstance(value, np.ndarray):
        plain = np.asarray(value)
        return {"array": encoded(plain.tolist())} if _short(plain) else _array(plain)
    if isinstance(value, Time):
        return {
            "jd1": np.asarray(value.jd1).tolist(),
            "jd2": np.asarray(value.jd2).tolist(),
            "scale": value.scale,
        }
    if isinstance(value, tuple) and not hasattr(value, "_fields"):
        return {"tuple": [encoded(x) for x in value]}
    if isinstance(value, list):
        return [encoded(x) for x in value]
    if isinstance(value, Mapping):
        return {"mapping": [[encoded(k), encoded(v)] for k, v in value.items()]}
    return _object(value)


def _object(value: Any) -> Document:
    kind = type(value)
    if "astropy.table" in sys.modules and isinstance(value, sys.modules["astropy.table"].Table):
        columns = [encoded(value[name]) for name in value.colnames]
        return {"table": kind.__name__, "names": value.colnames, "columns": columns}
    if _MODULE.fullmatch(kind.__module__):
        label = kind.__name__ if kind.__name__ in KNOWN else _address(kind)
        return {"class": label, **{name: encoded(getattr(value, name)) for name in stored_fields(kind)}}
    if kind.__module__.startswith("astropy.table"):
        from astropy.table import Row

        if isinstance(value, Row):
            return {"row": encoded(value.table[value.index : value.index + 1])}
    if kind.__name__ == "CubicHermiteSpline":
        return {"spline": _array(value.c), "knots": _array(value.x)}
    raise TypeError(f"metadata cannot hold a {kind.__name__}")


def stored_fields(kind: type) -> tuple[str, ...]:
    """Names of the fields that are stored: those of the constructor, or the names in ``_stored`` of the class.

    Raises
    ------
    TypeError
        Neither a dataclass nor a named tuple.
    """
    if hasattr(kind, "_fields"):
        return tuple(kind._fields)
    if not is_dataclass(kind):
        raise TypeError(f"metadata cannot hold a {kind.__name__}")
    own: tuple[str, ...] | None = getattr(kind, "_stored", None)
    return own if own is not None else tuple(f.name for f in fields(kind) if f.init)


def decoded(value: object) -> Any:
    """The value that :func:`encoded` made.

    Raises
    ------
    KeyError
        For a class that is not one of this package.
    """
    if isinstance(value, list):
        return [decoded(x) for x in value]
    if not isinstance(value, dict):
        return value
    for mark, restore in _RESTORE.items():
        if mark in value:
            return restore(value)
    raise KeyError(", ".join(map(str, value)))


def _restored_object(value: Document) -> Any:
    kind = _class(value["class"])
    content = {k: decoded(v) for k, v in value.items() if k != "class"}
    if not getattr(kind, "_verbatim", False):
        return kind(**content)
    made: object = object.__new__(kind)  # the constructor would change the values
    for name, part in content.items():
        object.__setattr__(made, name, part)
    return made


def _restored_quantity(value: Document) -> Quantity:
    number = decoded(value["value"])
    return (np.array(number) if isinstance(number, list) else number) * Unit(value["unit"])


def _restored_table(value: Document) -> Table:
    from astropy import table

    if value["table"] == "ResultTable":
        kind = import_module("flybystab.result_table").ResultTable  # by name: it imports this module
    else:
        kind = table.QTable if value["table"] == "QTable" else table.Table
    return kind([decoded(c) for c in value["columns"]], names=value["names"])


def _restored_spline(value: Document) -> CubicHermiteSpline:
    from scipy.interpolate import CubicHermiteSpline

    return CubicHermiteSpline.construct_fast(decoded(value["spline"]), decoded(value["knots"]))


def _restored_array(text: str) -> np.ndarray:
    unpacker = zlib.decompressobj()
    data = unpacker.decompress(base64.b64decode(text), LARGEST)
    if unpacker.unconsumed_tail:
        raise ValueError(f"an array of more than {LARGEST} bytes")
    array: np.ndarray = np.load(io.BytesIO(data), allow_pickle=False)
    return array


def _masked(value: Document) -> np.ma.MaskedArray:
    data, mask = map(decoded, value["masked"])
    return np.ma.MaskedArray(data, mask)


#: Function that restores a dictionary by the entry that marks its type.
_RESTORE = {
    "class": _restored_object,
    "number": lambda value: float(value["number"]),
    "unit": _restored_quantity,
    "array": lambda value: np.array(decoded(value["array"])),
    "npy": lambda value: _restored_array(value["npy"]),
    "record": lambda value: decoded(value["record"])[0],
    "masked": _masked,
    "scale": lambda value: Time(
        np.array(value["jd1"]), np.array(value["jd2"]), format="jd", scale=value["scale"]
    ),
    "tuple": lambda value: tuple(decoded(x) for x in value["tuple"]),
    "mapping": lambda value: {decoded(k): decoded(v) for k, v in value["mapping"]},
    "enum": lambda value: _class(value["enum"])(value["is"]),
    "table": _restored_table,
    "row": lambda value: decoded(value["row"])[0],
    "spline": _restored_spline,
}


def _short(array: np.ndarray) -> bool:
    """True for an array that is stored as a list: short, and of a type that the list determines."""
    usual = array.dtype.kind == "U" or array.dtype in (np.dtype(float), np.dtype(int), np.dtype(bool))
    return 0 < array.size <= LISTED and usual


def _array(array: np.ndarray) -> dict[str, str]:
    stream = io.BytesIO()
    np.save(stream, np.ascontiguousarray(array) if array.ndim else array, allow_pickle=False)
    return {"npy": base64.b64encode(zlib.compress(stream.getvalue(), 6)).decode()}


def _address(kind: type) -> str:
    return f"{kind.__module__}:{kind.__name__}"


def _class(address: str) -> type:
    """Class of an address ``module:Name``: a dataclass, named tuple or enumeration of the package in that module.

    Classes that were moved are found under their former address if that module still imports them.
    """
    module, _, name = address.rpartition(":")
    module = module or KNOWN[name]
    if not _MODULE.fullmatch(module):
        raise KeyError(address)
    kind = getattr(import_module(module), name, None)
    if not isinstance(kind, type) or not _MODULE.fullmatch(kind.__module__):
        raise KeyError(address)
    if not (is_dataclass(kind) or hasattr(kind, "_fields") or issubclass(kind, Enum)):
        raise KeyError(address)
    return kind
