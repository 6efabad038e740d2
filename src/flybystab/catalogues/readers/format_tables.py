"""Tables of orbits with a column FORMAT: Sorcha, layup and OpenOrb (``.csv``, ``.des``).

The column FORMAT determines centre, axes and elements: COM, KEP, CART (CAR) are heliocentric, BCOM, BKEP, BCART
barycentric, all with axes of the J2000 ecliptic; BCART_EQ and CAREQ have equatorial axes. Barycentric elements refer to
the GM of the whole solar system. Units: au, au/d, deg; epochs and times of perihelion in MJD, TDB (OpenOrb: TT).
Columns and conversions: ``parse_orbit_row`` of https://github.com/dirac-institute/sorcha, ``element_order`` of
https://github.com/Smithsonian/layup, ``readDESOrbitFile`` of https://github.com/oorb/oorb.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np

from flybystab.catalogues.designations import name_columns
from flybystab.catalogues.readers import Contents, reader
from flybystab.catalogues.readers.conversion import (
    CARTESIAN,
    COMETARY,
    KEPLERIAN,
    MJD,
    elements_row,
    heliocentric_state,
    number,
    rotated,
    state_of,
    state_row,
)
from flybystab.catalogues.readers.covariances import cartesian_covariance, printed_covariance
from flybystab.catalogues.readers.parameters import check_parameters, looks_like_parameter
from flybystab.errors import InvalidInput
from flybystab.files import csv_rows
from flybystab.orbit.elements import GM_TOTAL

if TYPE_CHECKING:
    from flybystab.catalogues.readers import Entry

#: Elements, centre and axes of each FORMAT.
FORMATS: Mapping[str, tuple[tuple[str, ...], str, str]] = {
    "COM": (COMETARY, "sun", "ecliptic"),
    "BCOM": (COMETARY, "ssb", "ecliptic"),
    "KEP": (KEPLERIAN, "sun", "ecliptic"),
    "BKEP": (KEPLERIAN, "ssb", "ecliptic"),
    "CART": (CARTESIAN, "sun", "ecliptic"),
    "CAR": (CARTESIAN, "sun", "ecliptic"),
    "BCART": (CARTESIAN, "ssb", "ecliptic"),
    "BCART_EQ": (CARTESIAN, "ssb", "equator"),
    "CAREQ": (CARTESIAN, "sun", "equator"),
}
#: Column names, in lower case, of each element. Dates are MJD, or JD if the column name says so.
_ALIASES: Mapping[str, tuple[str, ...]] = {
    "a": ("a",), "q": ("q",), "e": ("e",), "i": ("inc", "i", "incl"), "node": ("node", "omega", "longnode"),
    "peri": ("argperi", "peri", "w"), "M": ("ma", "m", "meananomaly"),
    "tp": ("t_p_mjd_tdb", "t_p", "tp", "tperi", "t_p_jd_tdb"), "x": ("x",), "y": ("y",), "z": ("z",),
    "vx": ("xdot", "dx/dt", "vx"), "vy": ("ydot", "dy/dt", "vy"), "vz": ("zdot", "dz/dt", "vz"),
    "epoch": ("epochmjd_tdb", "t_0", "epochjd_tdb", "epoch"), "id": ("objid", "provid", "oid", "s3mid", "id"),
}  # fmt: skip
_OTHER = frozenset({"FORMAT", "H", "G", "INDEX", "N_PAR", "MOID", "COMPCODE", "OID", "ID", "M"})
_COVARIANCE = [f"cov_{i}_{j}" for i in range(6) for j in range(6)]


def _lines(text: str) -> Iterator[str]:
    """Lines other than comments; the header line of OpenOrb may start with ``!!``."""
    for line in text.splitlines():
        if line.strip() and not line.startswith("#") and not re.match(r"!(?!!)", line):
            yield line.removeprefix("!!")


def _cells(line: str) -> list[str]:
    if "\t" in line:
        return [c.strip() for c in line.split("\t")]
    if "," in line:
        return [c.strip() for c in next(csv_rows(line, "catalogue file", ""))]
    return line.split("|") if "|" in line else line.split()


def _is_table(text: str) -> bool:
    first = next(_lines(text[:20000]), "")
    if len(first) > 5000 or text[:1] in "{[":
        return False
    cells = [c.strip('"') for c in re.split(r"[,|\s]+", first.strip())]
    return "FORMAT" in cells or (len(cells) > 9 and cells[1] in FORMATS)


@reader(
    "Sorcha, layup, OpenOrb",
    _is_table,
    Contents(
        "COM, KEP, CART, CAR, CAREQ; barycentric BCOM, BKEP, BCART, BCART_EQ",
        "full matrix of a state, else printed digits",
        "none",
        "H",
        files="column FORMAT",
    ),
)
def read_table(text: str, file: str) -> list[Entry]:
    """Rows of a table; FORMAT may change from row to row.

    Raises
    ------
    InvalidInput
    """
    lines = list(_lines(text))
    columns = _cells(lines[0])
    if "\t" in lines[0] and "" in columns:  # columns separated by several tabs
        lines = [re.sub(r"\t+", "\t", line.strip()) for line in lines]
        columns = _cells(lines[0])
    if "FORMAT" not in columns:  # OpenOrb reads tables without a header
        kind = columns[1] if len(columns) > 1 else ""
        if kind not in FORMATS:
            raise InvalidInput("FORMAT", kind, f"a header, or one of {', '.join(FORMATS)}, in {file}")
        columns = ["OID", "FORMAT", *FORMATS[kind][0], "H", "t_0", "INDEX", "N_PAR", "MOID", "COMPCODE"]
    else:
        lines = lines[1:]
    out = []
    for k, line in enumerate(lines, start=2):
        cells = _cells(line)
        if len(cells) != len(columns):
            raise InvalidInput("row", f"line {k} of {file}", f"{len(columns)} cells, as in the header")
        out.append(_entry(dict(zip(columns, (c.strip() for c in cells), strict=True)), file))
    return out


def _given(text: str) -> bool:
    """Whether a cell contains a value other than zero."""
    try:
        return bool(np.nan_to_num(float(text)))
    except ValueError:
        return text.lower() not in ("", "none", "null", "--")


def _entry(row: Mapping[str, str], file: str) -> Entry:
    kind = row["FORMAT"]
    if kind not in FORMATS:
        raise InvalidInput("FORMAT", kind, f"one of {', '.join(FORMATS)} in {file}")
    _check(row, file)
    names, centre, axes = FORMATS[kind]
    lower = {c.lower(): c for c in row}

    def cell(name: str) -> tuple[str, str]:
        column = next((lower[a] for a in _ALIASES[name] if a in lower), "")
        if not column:
            raise InvalidInput("columns", ", ".join(row), f"{_ALIASES[name][0]} for FORMAT {kind} in {file}")
        return column, row[column]

    def day(name: str) -> float:
        column, text = cell(name)
        return number(text, column, file) + (0.0 if "jd" in column.lower().replace("mjd", "") else MJD)

    jd = day("epoch")
    texts = [cell(n)[1] for n in names]
    values = [number(t, n, file) for n, t in zip(names, texts, strict=True)]
    offset = 0.0
    if "tp" in names:
        offset = float(texts[5]) - (day("tp") - jd)
        values[5] -= offset
    gm = GM_TOTAL if centre == "ssb" and "x" not in names else None
    source = f"{kind} ({file})"
    out = name_columns(cell("id")[1]) | {"orbit_source": source}
    if row.get("H"):
        out["H_mag"] = row["H"]
    if centre == "sun" and axes == "ecliptic":
        out |= elements_row(jd, names, texts, values)
    else:
        state = state_of(names, values, gm)
        if axes == "equator":  # undo the rotation by state_of, which assumes ecliptic axes
            state = rotated(state, to_ecliptic=True)
        out |= state_row(jd, heliocentric_state(jd, state, centre))
    matrix = _matrix(row, kind, names is CARTESIAN, axes, file)
    if matrix is not None:
        return out, cartesian_covariance(jd, names, values, matrix, source)
    if axes == "equator":  # the size of the digits does not depend on the axes
        texts = [f"{v:.{len(t.partition('.')[2])}f}" for v, t in zip(values, texts, strict=True)]
    return out, printed_covariance(jd, names, texts, offset, source, gm)


def _check(row: Mapping[str, str], file: str) -> None:
    """Raise InvalidInput for parameters of force models; layup writes them in lower case, with their errors."""
    names = [c for c in row if (looks_like_parameter(c) and c not in _OTHER) or re.match(r"a[1-9](_|$)", c)]
    given = {c.partition("_")[0].upper() for c in names if _given(row[c])}
    given |= {c for c in row if re.match(r"cov_([6-9]_|\d_[6-9])", c) and _given(row[c])}
    check_parameters("FORMAT", sorted(given), file)


def _matrix(row: Mapping[str, str], kind: str, cartesian: bool, axes: str, file: str) -> np.ndarray | None:
    """Covariance of the state with ecliptic axes; None if the row has none.

    Raises
    ------
    InvalidInput
        The covariance is one of elements, whose unit (rad2 or deg2) depends on the version of layup.
    """
    if not all(c in row for c in _COVARIANCE) or not any(_given(row[c]) for c in _COVARIANCE):
        return None
    if not cartesian:
        raise InvalidInput(
            "covariance",
            kind,
            f"the covariance of a state (layup convert to BCART_EQ) in {file}: in other formats, angles are in radians "
            "or degrees, depending on the version of layup",
        )
    matrix = np.array([number(row[c], c, file) for c in _COVARIANCE]).reshape(6, 6)
    matrix = 0.5 * (matrix + matrix.T)
    if axes != "equator":
        return matrix
    turn = rotated(np.eye(6), to_ecliptic=True)
    return turn @ matrix @ turn.T
