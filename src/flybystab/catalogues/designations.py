"""Designations of asteroids: names of numbered near-Earth asteroids, and the packed forms of the MPC."""

from __future__ import annotations

import csv
import io
import re
from datetime import date
from functools import lru_cache
from importlib import resources

from flybystab.errors import InvalidInput


@lru_cache(maxsize=1)
def _table() -> dict[str, tuple[str, str]]:
    text = resources.files("flybystab.data").joinpath("names.csv").read_text(encoding="utf-8")
    return {r["number"]: (r["name"], r["designation"]) for r in csv.DictReader(io.StringIO(text, newline=""))}


def names_of(number: str) -> tuple[str, str]:
    """Name and designation of a number (``data/names.csv``), each empty where there is none."""
    return _table().get(number, ("", ""))


_DIGITS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz"


def unpacked(text: str) -> str:
    """Number or provisional designation from its packed form; other texts as they are.

    ``K04M04N`` is 2004 MN4, ``a0001`` 360001, ``~0K8Q`` 697402 (620000 and a number in base 62)
    (https://minorplanetcenter.net/iau/info/PackedDes.html).
    """
    if re.fullmatch(r"[IJK]\d\d[A-HJ-Y][0-9A-Za-z]\d[A-HJ-Z]", text):
        year = 100 * _DIGITS.index(text[0]) + int(text[1:3])
        cycle = 10 * _DIGITS.index(text[4]) + int(text[5])
        return f"{year} {text[3]}{text[6]}{cycle or ''}"
    if re.fullmatch(r"~[0-9A-Za-z]{4}", text):
        n = 0
        for c in text[1:]:
            n = 62 * n + _DIGITS.index(c)
        return str(620000 + n)
    if re.fullmatch(r"[0-9A-Za-z]\d{4}", text):
        return str(10000 * _DIGITS.index(text[0]) + int(text[1:]))
    return text


def unpacked_date(text: str) -> float:
    """Julian date of a packed date (``K107N`` is 2010 July 23.0).

    Raises
    ------
    InvalidInput
        It is no date.
    """
    try:
        year = 100 * _DIGITS.index(text[0]) + int(text[1:3])
        day = date(year, _DIGITS.index(text[3]), _DIGITS.index(text[4]))
    except (ValueError, IndexError):
        raise InvalidInput("epoch", text, "a packed date of the MPC, as K107N") from None
    return day.toordinal() + 1721424.5
