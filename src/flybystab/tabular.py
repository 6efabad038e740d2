"""Results with one row per time or sample as tables: astropy, pandas, dictionaries."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Any

import numpy as np
from astropy.units import Quantity, UnitBase

if TYPE_CHECKING:
    from astropy.table import QTable


def with_unit(name: str, unit: UnitBase) -> str:
    """Name of a column followed by its unit, such as ``v_inf_km_s`` or ``density_kg_m3``."""
    text = unit.to_string().replace(" / ", "_").replace(" ", "").replace("%", "percent")
    return f"{name}_{text}" if text else name


class Tabular:
    """Mixin of a dataclass of arrays with the same first dimension; other fields are metadata of the table."""

    def __len__(self) -> int:
        raise NotImplementedError

    def _columns(self) -> tuple[dict[str, Any], dict[str, Any]]:
        """Columns and metadata."""
        values = {f.name: getattr(self, f.name) for f in fields(self)}  # type: ignore[arg-type]
        columns = {
            k: v for k, v in values.items() if isinstance(v, np.ndarray) and v.shape[:1] == (len(self),)
        }
        return columns, {k: v for k, v in values.items() if k not in columns}

    def __astropy_table__(self, cls: type, copy: bool, **kwargs: Any) -> Any:
        """Table of the class `cls`: called by ``QTable(result)`` and ``Table(result)``."""
        columns, meta = self._columns()
        return cls(columns, copy=copy, meta=meta, **kwargs)

    def to_table(self) -> QTable:
        """Table with units; vectors and tensors are columns with more dimensions."""
        from astropy.table import QTable

        return QTable(self)

    def to_dict(self) -> dict[str, list[Any]]:
        """Lists by column, with the unit in the name; infinite and undefined numbers are None."""
        out = {}
        for name, column in self._columns()[0].items():
            bare = column.value if isinstance(column, Quantity) else column
            label = with_unit(name, column.unit) if isinstance(column, Quantity) else name
            if bare.dtype.kind == "f":
                bare = np.where(np.isfinite(bare), bare.astype(object), None)
            out[label] = bare.tolist()
        return out

    def to_pandas(self) -> Any:
        """DataFrame with the unit in the name of each column; components are columns, such as ``semi_axes_1_m``."""
        import pandas

        out = {}
        for name, column in self._columns()[0].items():
            for index in np.ndindex(column.shape[1:]):
                part = column[(slice(None), *index)]
                label = name + ("_" + "".join(str(i + 1) for i in index) if index else "")
                if isinstance(part, Quantity):
                    out[with_unit(label, part.unit)] = part.value
                else:
                    out[label] = part
        return pandas.DataFrame(out)
