"""Alternative spin solutions of an asteroid: periods and poles that fit its lightcurves, with weights.

A catalogue row lists them in one column, ``spin_solutions``, as ``period sigma longitude latitude weight`` (h, h, deg,
deg, ecliptic J2000; ``-`` if unknown), separated by semicolons. The columns of period and pole contain the solution
with the largest weight. A screening draws one solution for each sample.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flybystab.errors import InvalidInput
from flybystab.typing import Array

COLUMN = "spin_solutions"


@dataclass(frozen=True)
class SpinSolution:
    """One spin solution.

    Attributes
    ----------
    period : float
        Sidereal rotation period, h.
    sigma : float
        1-sigma error of the period, h; zero if unknown.
    pole : tuple of float, or None
        Ecliptic longitude and latitude, deg, J2000.
    weight : float
        Weight relative to that of the other solutions.
    source : str
    """

    period: float
    sigma: float = 0.0
    pole: tuple[float, float] | None = None
    weight: float = 1.0
    source: str = ""

    def __post_init__(self) -> None:
        numbers = [self.period, self.sigma, self.weight, *(self.pole or ())]
        valid = np.isfinite(numbers).all() and self.period > 0.0 and self.sigma >= 0.0 and self.weight > 0.0
        if not valid or (self.pole is not None and abs(self.pole[1]) > 90.0):
            raise InvalidInput(
                "spin solution",
                self,
                "a period and a weight above 0, an error of 0 or more, |latitude| <= 90",
            )


def solution_columns(solutions: Sequence[SpinSolution]) -> dict[str, str]:
    """Columns of period and pole for the solution with the largest weight, and of all if there are several."""
    if not solutions:
        return {}
    best = max(solutions, key=lambda s: s.weight)
    row = {"spin_period_h": repr(best.period), "spin_source": best.source, "spin_state": "principal"}
    row["spin_period_sigma_h"] = repr(best.sigma) if best.sigma else ""
    row |= dict.fromkeys(("tumbling_mode", "precession_period_h", "rotation_period_h"), "")
    if best.pole is not None:
        row |= {"pole_ecl_lon_deg": repr(best.pole[0]), "pole_ecl_lat_deg": repr(best.pole[1])}
        row["pole_source"] = best.source
    cells = []
    for s in solutions:
        pole = ("-", "-") if s.pole is None else tuple(repr(x) for x in s.pole)
        cells.append(" ".join((repr(s.period), repr(s.sigma), *pole, repr(s.weight))))
    return row | {COLUMN: ";".join(cells) if len(solutions) > 1 else ""}


def solutions_of(row: Mapping[str, str]) -> tuple[SpinSolution, ...]:
    """The alternative solutions of a row; empty if there are none.

    Raises
    ------
    InvalidInput
    """
    out = []
    for text in filter(None, row.get(COLUMN, "").split(";")):
        cells = text.split()
        try:
            period, sigma, longitude, latitude, weight = (np.nan if c == "-" else float(c) for c in cells)
        except ValueError:
            raise InvalidInput(COLUMN, text, "period, error, longitude, latitude, weight") from None
        pole = None if np.isnan(longitude) or np.isnan(latitude) else (longitude, latitude)
        out.append(SpinSolution(period, sigma, pole, weight, row.get("spin_source", "")))
    return tuple(out)


def chosen(solutions: Sequence[SpinSolution], uniform: Array) -> NDArray[np.int64]:
    """Indices of solutions drawn in proportion to their weights by uniform numbers in [0, 1), shape (n,)."""
    total = np.cumsum([s.weight for s in solutions])
    number = np.searchsorted(total / total[-1], uniform, side="right")
    return np.minimum(number, len(solutions) - 1).astype(np.int64)
