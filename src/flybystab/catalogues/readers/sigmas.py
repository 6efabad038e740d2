"""1-sigma errors in orbit files: conversion to numbers and detection of unknown errors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flybystab.catalogues.readers.conversion import number
from flybystab.errors import InvalidInput
from flybystab.typing import Array


def sigmas_of(texts: Sequence[object], names: Sequence[str], file: str) -> Array | None:
    """1-sigma errors as numbers, shape (n,); None if all are zero, by which some programs denote unknown errors.

    Raises
    ------
    InvalidInput
        A value is negative or not a finite number.
    """
    out = np.array([number(t, f"sigma of {n}", file) for t, n in zip(texts, names, strict=True)])
    if np.any(out < 0.0):
        k = int(np.argmax(out < 0.0))
        raise InvalidInput(f"sigma of {names[k]}", texts[k], f"a 1-sigma of zero or more in {file}")
    return out if np.any(out > 0.0) else None
