"""Orbit files of OpenOrb (``.orb``): four header lines and fixed columns.

Columns: ``readOpenOrbOrbitFile`` of https://github.com/oorb/oorb (main/io.f90). The numbers in the last header line
identify them: 2 to 7 Keplerian elements (au, deg), 75 and 76 perihelion distance and time, 39 to 44 a state with
ecliptic axes (au, au/d), 8 the epoch as year, month and day, 74 as MJD (TT); 9 to 14 standard deviations, 15 to 29
correlations, 78 to 92 covariances. Errors of cometary elements are not used, since their units are not documented.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import date
from typing import TYPE_CHECKING

import numpy as np

from flybystab.catalogues.designations import name_columns
from flybystab.catalogues.readers import Contents, reader
from flybystab.catalogues.readers.conversion import CARTESIAN, COMETARY, KEPLERIAN, MJD, elements_row, number
from flybystab.catalogues.readers.covariances import covariance_of, printed_covariance
from flybystab.catalogues.readers.parameters import check_parameters, named_parameters
from flybystab.errors import InvalidInput

if TYPE_CHECKING:
    from flybystab.catalogues.readers import Entry
    from flybystab.typing import Array

_SETS = {
    (2, 3, 4, 5, 6, 7): KEPLERIAN,
    (75, 3, 4, 5, 6, 76): COMETARY,
    (39, 40, 41, 42, 43, 44): CARTESIAN,
}


def _is_openorb(text: str) -> bool:
    head = text[:20000].splitlines()[:4]
    return len(head) == 4 and all(line.startswith("#") for line in head) and "-0001-" in head[3]


@reader(
    "OpenOrb orbits",
    _is_openorb,
    Contents(
        "Keplerian, cometary, cartesian",
        "full matrix of Keplerian elements or a state, else printed digits",
        "none",
        "none",
        files="`.orb`",
    ),
)
def read_openorb(text: str, file: str) -> list[Entry]:
    """Rows of a file.

    Raises
    ------
    InvalidInput
    """
    lines = text.splitlines()
    tags = [int(x) for x in re.findall(r"-(\d{4})-", lines[3])]
    check_parameters("table", named_parameters(" ".join(lines[:3])), file)
    found = [(k, n) for k, n in _SETS.items() if set(k) <= set(tags)]
    if len(found) != 1:
        raise InvalidInput(
            "orbit file", file, "Keplerian, cometary or cartesian elements in the fourth header line"
        )
    return [_entry(line, tags, found[0][1], file) for line in lines[4:] if line.strip() and line[0] != "#"]


def _entry(line: str, tags: Sequence[int], names: Sequence[str], file: str) -> Entry:
    cells = line[16:].split()
    if len(cells) < 7:
        raise InvalidInput("row", line[:60], f"a name, six elements and an epoch in {file}")
    texts = [c.replace("D", "E") for c in cells[:6]]
    values = [number(t, n, file) for n, t in zip(names, texts, strict=True)]
    if 8 in tags:
        try:
            midnight = date(int(cells[6]), int(cells[7]), 1).toordinal() + 1721423.5
        except (ValueError, IndexError):
            raise InvalidInput("epoch", " ".join(cells[6:9]), f"year, month and day in {file}") from None
        jd, rest = midnight + number("".join(cells[8:9]), "epoch", file), cells[9:]
    else:
        jd, rest = number(cells[6], "epoch", file) + MJD, cells[7:]
    offset = 0.0
    if "tp" in names:
        offset = jd - MJD
        values[5] -= offset
    source = f"OpenOrb ({file})"
    row = name_columns(line[:16].strip()) | {"orbit_source": source}
    row |= elements_row(jd, names, texts, values)
    if 38 in tags:
        rest = rest[1:]
    matrix = None if "q" in names else _matrix(rest, tags, file)
    if matrix is None:
        return row, printed_covariance(jd, names, texts, offset, source)
    return row, covariance_of(jd, names, values, matrix, source, file)


def _matrix(cells: Sequence[str], tags: Sequence[int], file: str) -> Array | None:
    """Covariance from standard deviations with correlations or covariances; None if these are missing."""
    if 9 not in tags or not {15, 78} & set(tags):
        return None
    upper = np.triu_indices(6, 1)
    if len(cells) < 21:
        raise InvalidInput(
            "row", " ".join(cells)[:60], f"6 standard deviations and 15 correlations in {file}"
        )
    sigma = np.array([number(c, "standard deviation", file) for c in cells[:6]])
    off = np.array([number(c, "correlation", file) for c in cells[6:21]])
    matrix = np.diag(sigma**2)
    matrix[upper] = off * sigma[upper[0]] * sigma[upper[1]] if 15 in tags else off
    return np.asarray(matrix + np.triu(matrix, 1).T)
