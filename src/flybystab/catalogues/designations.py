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
    """Name and designation of a numbered asteroid (``data/names.csv``); each is empty if unknown."""
    return _table().get(number, ("", ""))


_DIGITS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz"
_SURVEYS = {"PLS": "P-L", "T1S": "T-1", "T2S": "T-2", "T3S": "T-3"}
_LETTERS = "ABCDEFGHJKLMNOPQRSTUVWXYZ"


def unpacked(text: str) -> str:
    """Number or designation from its packed form; other texts are returned unchanged.

    ``K04M04N`` is 2004 MN4, ``a0001`` 360001, ``~0K8Q`` 697402 (620000 and a number in base 62), ``_QC0000``
    2026 CA620, ``PLS2040`` 2040 P-L, ``CK20F030`` C/2020 F3, ``0001P`` 1P
    (https://minorplanetcenter.net/iau/info/PackedDes.html).
    """
    if re.fullmatch(r"[IJK]\d\d[A-HJ-Y][0-9A-Za-z]\d[A-HJ-Z]", text):
        cycle = 10 * _DIGITS.index(text[4]) + int(text[5])
        return f"{_year(text)} {text[3]}{text[6]}{cycle or ''}"
    if re.fullmatch(r"_[0-9A-Za-z][A-HJ-Y][0-9A-Za-z]{4}", text):
        order = _base62(text[3:])  # counted from cycle 620, after 15,500 designations of the half-month
        year = 2000 + _DIGITS.index(text[1])
        return f"{year} {text[2]}{_LETTERS[order % 25]}{620 + order // 25}"
    if re.fullmatch(r"(PLS|T[123]S)\d{4}", text):
        return f"{text[3:]} {_SURVEYS[text[:3]]}"
    if re.fullmatch(r"~[0-9A-Za-z]{4}", text):
        return str(620000 + _base62(text[1:]))
    if re.fullmatch(r"[0-9A-Za-z]\d{4}", text):
        return str(10000 * _DIGITS.index(text[0]) + int(text[1:]))
    if re.fullmatch(r"\d{4}[PDI]([a-z]{1,2})?", text):
        fragment = f"-{text[5:].upper()}" if text[5:] else ""
        return f"{int(text[:4])}{text[4]}{fragment}"
    if re.fullmatch(r"(\d{4})?[CPDXAI][IJK]\d\d[A-HJ-Y][0-9A-Za-z]\d[0-9a-zA-Z]", text):
        number, kind, body = text[:-8], text[-8], text[-7:]
        if number:
            return f"{int(number)}{kind}" + (f"-{body[6].upper()}" if body[6].islower() else "")
        order = 10 * _DIGITS.index(body[4]) + int(body[5])
        if body[6].isupper():  # designated as a minor planet first: C/2016 AA1
            return f"{kind}/{_year(body)} {body[3]}{body[6]}{order or ''}"
        fragment = f"-{body[6].upper()}" if body[6] != "0" else ""
        return f"{kind}/{_year(body)} {body[3]}{order}{fragment}"
    return text


def _year(packed: str) -> int:
    return 100 * _DIGITS.index(packed[0]) + int(packed[1:3])


def _base62(text: str) -> int:
    n = 0
    for c in text:
        n = 62 * n + _DIGITS.index(c)
    return n


def is_comet(designation: str) -> bool:
    """Whether a designation is that of a comet: 67P, C/2020 F3, 73P-B."""
    return bool(re.match(r"(\d+[PCDI](-|/|$)|[PCDXI]/)", designation.strip()))


def name_columns(text: str) -> dict[str, str]:
    """Number, name and designation of a full name: ``99942 Apophis (2004 MN4)``, ``(433) Eros``, ``1P/Halley``.

    Packed forms are unpacked. The number of a comet is part of its designation; its name is the full name.
    """
    full = " ".join(text.split())
    plain = unpacked(full)
    # Designations without a space or with an underscore: 2010TU149, 2010_TU149, 2040P-L.
    if compact := re.fullmatch(r"(\d{4})_?([A-HJ-Y][A-HJ-Z]\d{0,3}|P-L|T-[123])", plain):
        plain = f"{compact[1]} {compact[2]}"
    if hyperbolic := re.match(r"(A/\d{4} [A-Z]{1,2}\d*)", plain):
        return {"number": "", "name": plain, "designation": hyperbolic[1]}
    if is_comet(plain):
        kept = re.match(
            r"(\d+[PCDI](?:-[A-Z]{1,2})?|[PCDXI]/-?\d+ [A-Z]{1,2}\d*(?:-[A-Z]{1,2})?)(?:/|\s*\(|$)", plain
        )
        if kept is None:
            return {"number": "", "name": plain, "designation": plain}
        fragment = re.search(r"/.*-([A-Z]{1,2})$", plain) if "-" not in kept[1] else None
        designation = f"{kept[1]}-{fragment[1]}" if fragment and kept[1][:1].isdigit() else kept[1]
        # The full name identifies a comet: many are called LINEAR or SOHO.
        return {"number": "", "name": plain, "designation": designation}
    provisional = r"(?:[A-Z]?\d{3,4} [A-Z]{2}\d*|\d{4} (?:P-L|T-[123]))"
    if bare := re.fullmatch(rf"\(?({provisional})\)?", plain):
        return {"number": "", "name": bare[1], "designation": bare[1]}
    found = re.fullmatch(rf"(?:\((\d+)\)|(\d+))?\s*(.*?)\s*(?:\(({provisional})\))?", plain)
    if found is None:
        return {"number": "", "name": plain, "designation": ""}
    number = found[1] or found[2] or ""
    name, designation = found[3] or "", found[4] or ""
    if re.fullmatch(provisional, name):
        name, designation = "", designation or name
    known = names_of(number) if number else ("", "")
    designation = designation or known[1]
    return {
        "number": number,
        "name": name or known[0] or designation or number or plain,
        "designation": designation,
    }


def unpacked_date(text: str) -> float:
    """Julian date of a packed date (``K107N`` is 2010 July 23.0).

    Raises
    ------
    InvalidInput
        The text is not a packed date.
    """
    try:
        year = 100 * _DIGITS.index(text[0]) + int(text[1:3])
        day = date(year, _DIGITS.index(text[3]), _DIGITS.index(text[4]))
    except (ValueError, IndexError):
        raise InvalidInput("epoch", text, "a packed date of the MPC, as K107N") from None
    return day.toordinal() + 1721424.5
