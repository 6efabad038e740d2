"""Size distributions of grains."""

from __future__ import annotations

from dataclasses import dataclass
from difflib import get_close_matches
from numbers import Real

import numpy as np

from flybystab.errors import InvalidInput, UnknownName
from flybystab.typing import Array

#: Distributions by name.
DISTRIBUTIONS = ("uniform", "power law")
#: Default ranges of the radii. Only their ratio matters.
RANGES = {"uniform": (0.6, 1.4), "power law": (0.5, 2.0)}
#: Default exponent of the cumulative power law.
INDEX = 3.0
#: Largest ratio of radii: the time step is that of the smallest grain, the cells of neighbours those of the largest.
WIDEST = 10.0


@dataclass(frozen=True)
class GrainSizes:
    """Distribution of the radii of grains, in any unit.

    Attributes
    ----------
    distribution : str
        ``"uniform"`` in the radius, or ``"power law"``: the number of grains larger than ``r`` goes as ``r^-index``.
    low, high : float
        Range of the radii.
    index : float
        Exponent of the cumulative power law; unused for a uniform distribution.
    """

    distribution: str = "uniform"
    low: float = RANGES["uniform"][0]
    high: float = RANGES["uniform"][1]
    index: float = 0.0

    def draw(self, n: int, generator: np.random.Generator) -> Array:
        """Radii of `n` grains."""
        if self.distribution == "uniform":
            return generator.uniform(self.low, self.high, n)
        share = generator.uniform(size=n)
        if self.index == 0.0:
            return np.asarray(self.low * (self.high / self.low) ** share)
        a, b = self.low**-self.index, self.high**-self.index
        return np.asarray((a + share * (b - a)) ** (-1.0 / self.index))


def grain_sizes(
    distribution: str = "uniform",
    index: float | None = None,
    size_range: tuple[float, float] | None = None,
) -> GrainSizes:
    """Checked size distribution (see :class:`GrainSizes`).

    Raises
    ------
    UnknownName, InvalidInput
    """
    if str(distribution) not in DISTRIBUTIONS:
        near = get_close_matches(str(distribution), DISTRIBUTIONS, cutoff=0.4)
        raise UnknownName(
            "size distribution", str(distribution), near, f"(known: {', '.join(DISTRIBUTIONS)})"
        )
    if index is not None:
        if distribution == "uniform":
            raise InvalidInput("index", index, "size_distribution='power law': a uniform one has no exponent")
        if isinstance(index, bool) or not isinstance(index, Real) or not abs(index) <= 10.0:
            raise InvalidInput("index", index, "an exponent of the cumulative power law from -10 to 10")
    given = RANGES[distribution] if size_range is None else size_range
    try:
        low, high = (float(x) for x in given)
    except (TypeError, ValueError):
        raise InvalidInput("size_range", size_range, "two numbers: smallest and largest radius") from None
    if not (0.0 < low < high <= WIDEST * low * (1.0 + 1e-12) and np.isfinite(high)):
        raise InvalidInput(
            "size_range", size_range, f"0 < smallest < largest radius, at most {WIDEST:g} times the smallest"
        )
    exponent = 0.0 if distribution == "uniform" else INDEX if index is None else float(index)
    return GrainSizes(distribution, low, high, exponent)
