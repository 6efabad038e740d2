"""Limit of infinitely many grains, from mean outcomes of piles of 250 to 2,000 grains.

python benchmarks/grains_resolution.py [FILE]

The file (``docs/tables/grains_numbers.csv``) has the mean and the standard error over the piles of each number of
grains, from ``python benchmarks/grains_references.py numbers``. The fit is ``y = y_inf + b n^-p``; the scatter of
single piles is taken to be the same for all numbers of grains. Printed are the limit and its difference from piles of
500 grains for three exponents: absolute, and relative to the mass of the clump (where it has at most 0.9), to the mass
lost (otherwise) or to ``stretch - 1``. The chi-square (2 degrees of freedom) does not tell the exponents apart.
"""

from __future__ import annotations

import csv
import sys
from pathlib import Path

import numpy as np

TABLE = Path(__file__).parents[1] / "docs" / "tables" / "grains_numbers.csv"


def fit(n: np.ndarray, piles: np.ndarray, y: np.ndarray, error: np.ndarray, p: float) -> tuple[float, ...]:
    """Limit, its error, limit less the value of 500 grains, its error, and chi-square."""
    # scatter of single piles, pooled over the numbers of grains
    scatter = np.sqrt(np.average(error**2 * piles, weights=piles - 1))
    sigma = scatter / np.sqrt(piles)
    matrix = np.stack([np.ones(len(n)), n**-p], axis=1) / sigma[:, None]
    covariance = np.linalg.inv(matrix.T @ matrix)
    limit, slope = covariance @ matrix.T @ (y / sigma)
    chi2 = float(((matrix @ [limit, slope] - y / sigma) ** 2).sum())
    share = 500.0**-p
    return limit, np.sqrt(covariance[0, 0]), -slope * share, np.sqrt(covariance[1, 1]) * share, chi2


def main() -> None:
    """Fit every flyby and quantity of the table."""
    with Path(sys.argv[1] if len(sys.argv) > 1 else TABLE).open() as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    print("q (R_E)  quantity   p     limit              limit - 500 grains   relative            chi2")
    for q, name in dict.fromkeys((r["periapsis"], r["quantity"]) for r in rows):
        some = [r for r in rows if (r["periapsis"], r["quantity"]) == (q, name)]
        n, piles, y, error = (
            np.array([float(r[k]) for r in some]) for k in ("grains", "piles", "mean", "error")
        )
        at = float(y[n == 500][0])
        # what the difference is compared with: mass, mass lost, elongation
        base = at - 1.0 if name == "stretch" else 1.0 - at if at > 0.9 else at
        for label, p in (("1/3", 1 / 3), ("1/2", 1 / 2), ("1", 1.0)):
            limit, limit_error, gap, gap_error, chi2 = fit(n, piles, y, error, p)
            print(
                f"{q:>7s}  {name:8s}  {label:3s}  {limit:6.3f} +- {limit_error:.3f}   {gap:+7.3f} +- {gap_error:.3f}"
                f"    {gap / base:+6.2f} +- {gap_error / base:.2f}   {chi2:6.1f}"
            )


if __name__ == "__main__":
    main()
