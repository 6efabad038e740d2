"""Summary table of the Asteroid Lightcurve Database in fixed columns: ``lc_summary_pub.txt`` (``LC_SUM_PUB.TXT``).

Columns of the releases since 2020, counted from 1, both ends inclusive: number 1-7, name 11-40, designation 42-61,
taxonomic class 74-83, diameter 89-96 (km), H 100-105, flag of the period 144, period 146-158 (h), flag of the amplitude
176, largest amplitude 183-186 (mag), U 188-189, notes 191-195. They are those of section 4.1.3 of the ``readme.pdf`` of
the release of October 2023 (https://minplanobs.org), as quoted by public programs that read the file. The rows follow
a title, a date and a line of column names. Since the columns differ between releases, the positions of these names are
compared with the columns given here.
"""

from __future__ import annotations

from flybystab.catalogues.physical import PhysicalData, physical_reader
from flybystab.catalogues.physical.lcdb import bodies_of
from flybystab.errors import InvalidInput

_COLUMNS = {
    "Number": (0, 7), "Name": (10, 40), "Desig": (41, 61), "Class": (73, 83), "Diam": (88, 96), "H": (99, 105),
    "PFlag": (143, 144), "Period": (145, 158), "AmpFlag": (175, 176), "AmpMax": (182, 186), "U": (187, 189),
    "Notes": (190, 195),
}  # fmt: skip
#: Column names in the header line, with the range of columns in which each must be.
_TITLES = {"NAME": (10, 40), "DESIG": (41, 61), "PERIOD": (143, 158), "AMAX": (181, 187), "NOTES": (189, 196)}


def _titles(text: str) -> str:
    """The line of column names among the first ten lines; empty if there is none."""
    lines = text[:5000].splitlines()[:10]
    return next((s for s in lines if s.lstrip().startswith("NUMBER") and "PERIOD" in s and "AMAX" in s), "")


@physical_reader(
    "LCDB (fixed columns)",
    lambda text: bool(_titles(text)),
    "H, diameter, lightcurve amplitude, taxonomic class",
    "periods of the best quality; tumbling",
)
def read_summary(text: str, file: str) -> list[PhysicalData]:
    """The asteroids in the summary.

    Raises
    ------
    InvalidInput
        The file has the columns of another release, or a value is not a number.
    """
    titles = _titles(text).upper()
    for title, (first, last) in _TITLES.items():
        if not first <= titles.find(title, max(first - 3, 0)) <= last - len(title):
            raise InvalidInput(
                "columns", titles.strip()[:60], f"{title} in columns {first + 1}-{last} of {file}"
            )
    lines = text.splitlines()
    start = next(k for k, line in enumerate(lines) if line.upper() == titles) + 1
    rows = []
    for line in lines[start:]:
        if line.strip() and not line.startswith("---"):
            rows.append({c: line[a:b].strip() for c, (a, b) in _COLUMNS.items()})
    return bodies_of(rows, file)
