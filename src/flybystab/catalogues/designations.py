"""Names and principal designations of numbered near-Earth asteroids, for tables that give numbers alone."""

from __future__ import annotations

import csv
import io
from functools import lru_cache
from importlib import resources


@lru_cache(maxsize=1)
def _table() -> dict[str, tuple[str, str]]:
    text = resources.files("flybystab.data").joinpath("names.csv").read_text(encoding="utf-8")
    return {r["number"]: (r["name"], r["designation"]) for r in csv.DictReader(io.StringIO(text, newline=""))}


def names_of(number: str) -> tuple[str, str]:
    """Name and designation of a number (``data/names.csv``), each empty where there is none."""
    return _table().get(number, ("", ""))
