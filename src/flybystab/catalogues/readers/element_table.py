"""Tables of elements with units: Horizons elements of astroquery, sbpy ``Orbit``, and ECSV files of either.

Column names are those of https://sbpy.readthedocs.io/en/stable/sbpy/data/fieldnames.html and of astroquery's
``Horizons.elements``. Elements are taken to be heliocentric, with axes of the J2000 ecliptic. Since the tables do not
state their centre, it is checked by comparing the mean motion or the period, if given, with the semi-major axis.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from flybystab.catalogues.designations import name_columns
from flybystab.catalogues.readers import Contents, reader
from flybystab.catalogues.readers.conversion import DEGREE, epoch_row, perihelion_row, since_perihelion
from flybystab.catalogues.readers.parameters import check_parameters, looks_like_parameter
from flybystab.constants import AU, DAY
from flybystab.errors import InvalidInput
from flybystab.orbit.epochs import warn_of_utc

if TYPE_CHECKING:
    from astropy.table import Table

    from flybystab.catalogues.readers import Entry

_ALIASES: Mapping[str, tuple[str, ...]] = {
    "name": ("targetname", "Targetname", "target", "Target", "name", "Name", "id", "ID", "Object", "object"),
    "designation": ("desig", "designation"), "number": ("number", "target number"),
    "epoch": ("epoch", "datetime_jd", "datetime", "Date", "date", "Time", "time"),
    "a": ("a", "sma"), "e": ("e", "ecc"), "i": ("i", "inc", "incl"), "q": ("q", "periheldist"),
    "node": ("Omega", "longnode", "node"), "peri": ("w", "argper"), "M": ("M", "mean_anom"),
    "tp": ("Tp", "Tp_jd"), "n": ("n", "mean_motion"), "P": ("P", "period"), "H": ("absmag", "H"),
}  # fmt: skip
_STATE = frozenset({"x", "vx", "X", "VX"})
_OTHER = frozenset({"H", "G", "M", "M1", "M2", "K1", "K2", "P", "Q", "ID", "TJ", "U"})


@reader(
    "ECSV table",
    lambda text: text.startswith("# %ECSV"),
    Contents("a and M, or q and Tp, with units", "none", "none", "H"),
)
def read_ecsv(text: str, file: str) -> list[Entry]:
    """Rows of an ECSV file with elements and units, or with the columns of the embedded catalogue.

    Raises
    ------
    InvalidInput
    """
    from astropy.io import ascii as tables

    try:
        table = tables.read(text.splitlines(), format="ecsv")
    except (ValueError, TypeError, KeyError, tables.InconsistentTableError) as error:
        raise InvalidInput("catalogue file", file, f"a readable ECSV table ({error})") from None
    if "a_au" in table.colnames:
        return [({c: _text(row[c]) for c in table.colnames}, None) for row in table]
    return entries_of(table, file)


def _text(value: object) -> str:
    return "" if value is np.ma.masked or value is None or value != value else str(value)


def entries_of(table: Table, file: str) -> list[Entry]:
    """Rows of a table of elements.

    Raises
    ------
    InvalidInput
        Elements are missing, have no unit or are not heliocentric, or the table has non-gravitational parameters.
    """
    columns = {key: next((c for c in names if c in table.colnames), "") for key, names in _ALIASES.items()}
    if not (columns["e"] and columns["i"] and columns["node"] and columns["peri"] and columns["epoch"]):
        if _STATE & set(table.colnames):
            raise InvalidInput(
                "table",
                "vectors",
                "elements; a table of vectors states neither centre nor axes: use fs.Orbit.from_state",
            )
        raise InvalidInput("columns", ", ".join(table.colnames), "epoch, e, i, node, w and a, M or q, Tp")
    known = {*columns.values(), *_OTHER}
    check_parameters("table", [c for c in table.colnames if looks_like_parameter(c) and c not in known], file)
    return [
        _entry({k: (row[c], table[c]) for k, c in columns.items() if c and _known(row[c])}, file)
        for row in table
    ]


def _known(value: object) -> bool:
    """Whether a cell has a value, neither masked nor nan."""
    return not (
        value is None or bool(np.any(getattr(value, "mask", False))) or _text(value) in ("", "nan", "--")
    )


def _value(cells: Mapping[str, tuple[object, object]], name: str, unit: str) -> float:
    import astropy.units as u
    from astropy.units import Quantity

    value, column = cells[name]
    given = value.unit if isinstance(value, Quantity) else getattr(column, "unit", None)
    try:
        if unit == "":
            return float(Quantity(value).to_value(u.dimensionless_unscaled))
        if given is None or not isinstance(given, u.UnitBase):
            raise InvalidInput(name, value, f"a column with a unit ({unit})")
        return float(Quantity(value, given).to_value(unit))
    except (TypeError, u.UnitsError) as error:
        raise InvalidInput(name, value, f"a number in {unit or 'no unit'} ({error})") from None


def _day(cells: Mapping[str, tuple[object, object]], name: str) -> float:
    """Julian date (TDB) from a Time, or from a Julian date in days."""
    from astropy.time import Time

    value, _ = cells[name]
    if not isinstance(value, Time):
        return _value(cells, name, "d")
    warn_of_utc(value, name, stacklevel=2)
    return float(value.tdb.jd)


def _entry(cells: Mapping[str, tuple[object, object]], file: str) -> Entry:
    label = " ".join(_text(cells[k][0]) for k in ("number", "name", "designation") if k in cells)
    missing = [k for k in ("epoch", "e", "i", "node", "peri") if k not in cells]
    if missing:
        raise InvalidInput(
            "elements", f"without {', '.join(missing)}", f"values for {label or 'a row'} in {file}"
        )
    jd = _day(cells, "epoch")
    e = _value(cells, "e", "")
    angles = [_value(cells, k, "deg") for k in ("i", "node", "peri")]
    row = name_columns(label or "unnamed") | {"orbit_source": f"table ({file})"}
    if "H" in cells:
        row["H_mag"] = str(getattr(cells["H"][0], "value", cells["H"][0]))
    if "a" in cells and "M" in cells and e != 1.0:
        a, mean = _value(cells, "a", "AU"), _value(cells, "M", "deg")
        _check_centre(cells, a, file)
        row |= epoch_row(jd) | {"a_au": repr(a), "e": repr(e), "M_deg": repr(mean)}
        return row | dict(zip(("i_deg", "node_deg", "peri_deg"), map(repr, angles), strict=True)), None
    if not (("q" in cells or "a" in cells) and ("tp" in cells or "M" in cells)):
        raise InvalidInput("columns", ", ".join(cells), f"a or q, and M or Tp, in {file}")
    q = _value(cells, "q", "AU") if "q" in cells else _value(cells, "a", "AU") * (1.0 - e)
    if "tp" in cells:
        return row | perihelion_row(jd, (q, e, *angles), jd - _day(cells, "tp")), None
    since = since_perihelion(_value(cells, "M", "deg"), q / (1.0 - e))
    return row | perihelion_row(jd, (q, e, *angles), since), None


def _check_centre(cells: Mapping[str, tuple[object, object]], a: float, file: str) -> None:
    """Raise InvalidInput if axis and mean motion are not those of an orbit about the Sun."""
    from flybystab.orbit.elements import GM_SUN

    if "n" in cells:
        motion = _value(cells, "n", "deg/d") * DEGREE / DAY
    elif "P" in cells:
        motion = 2.0 * np.pi / (_value(cells, "P", "d") * DAY)
    else:
        return
    gm = motion**2 * abs(a * AU) ** 3
    if abs(gm / GM_SUN - 1.0) > 1e-4:
        raise InvalidInput(
            "elements",
            f"GM = {gm:.6g} m3/s2 from axis and mean motion",
            f"heliocentric elements in {file} (location='@10' in a query of Horizons)",
        )
