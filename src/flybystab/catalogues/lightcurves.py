"""Reliable spin periods of near-Earth asteroids (LCDB, Warner, Harris & Pravec 2009; release of 2021)."""

from __future__ import annotations

import csv
import io
from functools import lru_cache
from importlib import resources

import numpy as np

from flybystab.typing import Array

#: Number of bodies of similar size from which a period is drawn.
NEIGHBOURS = 200


@lru_cache(maxsize=1)
def lightcurves() -> dict[str, dict[str, str]]:
    """Rows of ``data/lightcurves.csv`` by number, or by designation for unnumbered asteroids."""
    text = resources.files("flybystab.data").joinpath("lightcurves.csv").read_text(encoding="utf-8")
    return {r["number"] or r["designation"]: r for r in csv.DictReader(io.StringIO(text, newline=""))}


@lru_cache(maxsize=1)
def _by_size() -> tuple[Array, Array]:
    """Absolute magnitudes in ascending order and the corresponding periods (h), without tumblers."""
    rows = [r for r in lightcurves().values() if r["H_mag"] and not r["tumbles"]]
    pairs = np.array(sorted((float(r["H_mag"]), float(r["spin_period_h"])) for r in rows))
    return pairs[:, 0], pairs[:, 1]


@lru_cache(maxsize=4096)
def periods_like(magnitude: float | None) -> Array:
    """Periods (h), in ascending order, of the bodies nearest in absolute magnitude; of all bodies for None.

    Bodies are selected by size because small ones rotate faster. The observational bias towards fast rotators, whose
    periods are easier to measure, is not corrected.
    """
    size, period = _by_size()
    if magnitude is None:
        return np.sort(period)
    near = np.argsort(np.abs(size - magnitude), kind="stable")[:NEIGHBOURS]
    return np.sort(period[near])
