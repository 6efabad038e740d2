"""Trusted spin periods of near-Earth asteroids (LCDB: Warner, Harris & Pravec 2009, release 2021)."""

from __future__ import annotations

import csv
import io
from functools import lru_cache
from importlib import resources

import numpy as np

from flybystab.typing import Array

#: Bodies of like size among which a period is drawn.
NEIGHBOURS = 200


@lru_cache(maxsize=1)
def lightcurves() -> dict[str, dict[str, str]]:
    """Rows of ``data/lightcurves.csv`` by number, or designation where there is none."""
    text = resources.files("flybystab.data").joinpath("lightcurves.csv").read_text(encoding="utf-8")
    return {r["number"] or r["designation"]: r for r in csv.DictReader(io.StringIO(text, newline=""))}


@lru_cache(maxsize=1)
def _by_size() -> tuple[Array, Array]:
    """Absolute magnitudes in rising order and the periods (h) that go with them, tumblers left out."""
    rows = [r for r in lightcurves().values() if r["H_mag"] and not r["tumbles"]]
    pairs = np.array(sorted((float(r["H_mag"]), float(r["spin_period_h"])) for r in rows))
    return pairs[:, 0], pairs[:, 1]


@lru_cache(maxsize=4096)
def periods_like(magnitude: float | None) -> Array:
    """Periods, h, of the bodies nearest in absolute magnitude, rising; of all without one.

    Small bodies turn faster, so the size matters; that fast rotators are easier to measure stays in the sample.
    """
    size, period = _by_size()
    if magnitude is None:
        return np.sort(period)
    near = np.argsort(np.abs(size - magnitude), kind="stable")[:NEIGHBOURS]
    return np.sort(period[near])
