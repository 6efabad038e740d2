"""Orbit covariances included in the package, by number of the asteroid (``data/covariances``)."""

from __future__ import annotations

from functools import lru_cache
from importlib import resources
from typing import TYPE_CHECKING

from flybystab.catalogues.readers.oef import from_neocc
from flybystab.catalogues.readers.sbdb_answer import from_sbdb_answer

if TYPE_CHECKING:
    from flybystab.orbit.covariance import Covariance


@lru_cache(maxsize=64)
def embedded_covariance(number: str) -> Covariance | None:
    """Published covariance of the orbit of a numbered asteroid; None if the package does not include one."""
    if not number.isdigit():
        return None
    for suffix, read in ((".json", from_sbdb_answer), (".ke1", from_neocc)):
        file = resources.files("flybystab.data").joinpath("covariances", number + suffix)
        if file.is_file():
            return read(file.read_text(encoding="utf-8"), number + suffix)[1]
    return None
