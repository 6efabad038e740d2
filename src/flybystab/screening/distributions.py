"""Probability distributions of one variable: their parameters, quantiles and text form."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from difflib import get_close_matches

import numpy as np
from scipy.special import ndtr, ndtri

from flybystab.errors import InvalidInput, UnknownName
from flybystab.typing import Array

_KINDS = {
    "fixed": ("value",),
    "uniform": ("low", "high"),
    "loguniform": ("low", "high"),
    "normal": ("mean", "sd"),
    "lognormal": ("median", "sigma"),
    "catalogue": (),
    "lightcurves": (),
}


@dataclass(frozen=True)
class Distribution:
    """A distribution of one variable.

    Parameters
    ----------
    kind : str
        "fixed" (value), "uniform" or "loguniform" (low, high), "normal" (mean, sd), "lognormal" (median,
        sigma of the natural logarithm), "catalogue": the values of the embedded catalogue with equal weights, or
        "lightcurves": LCDB periods of the bodies nearest in absolute magnitude, with equal weights.
    low, high : float, optional
        Truncate "normal" and "lognormal".
    """

    kind: str
    value: float | None = None
    low: float | None = None
    high: float | None = None
    mean: float | None = None
    sd: float | None = None
    median: float | None = None
    sigma: float | None = None

    def __post_init__(self) -> None:
        if self.kind not in _KINDS:
            raise UnknownName(
                "distribution",
                str(self.kind),
                get_close_matches(str(self.kind), _KINDS),
                f"(known: {', '.join(_KINDS)})",
            )
        for f in fields(self)[1:]:
            x = getattr(self, f.name)
            if x is not None and (
                isinstance(x, bool) or not isinstance(x, int | float) or not np.isfinite(x)
            ):
                raise InvalidInput(f.name, x, "a finite number")
        for name in _KINDS[self.kind]:
            if getattr(self, name) is None:
                raise InvalidInput(name, "(missing)", f"a value: the distribution {self.kind!r} needs it")
        if self.low is not None and self.high is not None and not self.low <= self.high:
            raise InvalidInput("low", self.low, f"at most high = {self.high}")
        positive = {"loguniform": self.low, "lognormal": self.median}.get(self.kind, 1.0)
        spread = {"normal": self.sd, "lognormal": self.sigma}.get(self.kind, 0.0)
        if not (positive is not None and positive > 0.0 and spread is not None and spread >= 0.0):
            raise InvalidInput("distribution", self, "a positive scale and a spread of zero or more")

    def quantile(self, x: Array, values: Array | None = None) -> Array:
        """Values at cumulative probabilities `x` in (0, 1); `values` are the data of "catalogue" and "lightcurves"."""
        x = np.asarray(x, dtype=float)
        if self.kind == "fixed":
            return np.full(x.shape, self.value)
        if self.kind == "uniform":
            assert self.low is not None and self.high is not None  # noqa: PT018
            return self.low + (self.high - self.low) * x
        if self.kind == "loguniform":
            assert self.low is not None and self.high is not None  # noqa: PT018
            return self.low * (self.high / self.low) ** x
        if self.kind in ("catalogue", "lightcurves"):
            assert values is not None
            return np.sort(values)[np.minimum((x * len(values)).astype(int), len(values) - 1)]
        logarithmic = self.kind == "lognormal"
        centre, sd = (self.median, self.sigma) if logarithmic else (self.mean, self.sd)
        assert centre is not None and sd is not None  # noqa: PT018
        low, high = (-np.inf if self.low is None else self.low), (np.inf if self.high is None else self.high)
        if logarithmic:
            centre = np.log(centre)
            low, high = np.log(max(low, 1e-300)), np.log(high)
        found = truncated_normal(x, centre, sd, low, high)
        return np.exp(found) if logarithmic else found

    def toml(self) -> str:
        """The distribution as an inline table of TOML."""
        values = [f'kind = "{self.kind}"']
        values += [
            f"{f.name} = {getattr(self, f.name)!r}"
            for f in fields(self)[1:]
            if getattr(self, f.name) is not None
        ]
        return "{ " + ", ".join(values) + " }"

    def __str__(self) -> str:
        values = ", ".join(
            f"{f.name} {getattr(self, f.name):g}"
            for f in fields(self)[1:]
            if getattr(self, f.name) is not None
        )
        return f"{self.kind} ({values})" if values else self.kind


def truncated_normal(x: Array, mean: float, sd: float, low: float = -np.inf, high: float = np.inf) -> Array:
    """Quantile of a normal distribution truncated to [low, high]."""
    if sd == 0.0:
        return np.full(np.shape(x), min(max(mean, low), high))
    a, b = ndtr((low - mean) / sd), ndtr((high - mean) / sd)
    return np.clip(mean + sd * ndtri(a + x * (b - a)), low, high)


def distribution_of(key: str, value: object) -> Distribution:
    """Distribution given by a number (fixed) or a table with a "kind"; `key` names it in errors."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        value = {"kind": "fixed", "value": float(value)}
    if not isinstance(value, Mapping) or "kind" not in value:
        raise InvalidInput(key, value, f'a number or a table with a "kind" out of {list(_KINDS)}')
    allowed = {f.name for f in fields(Distribution)}
    for inner in value:
        if inner not in allowed:
            raise UnknownName(f"key of {key}", inner, get_close_matches(inner, allowed))
    try:
        return Distribution(**value)
    except InvalidInput as error:
        raise InvalidInput(f"{key}.{error.name}", error.value, error.expected) from None
