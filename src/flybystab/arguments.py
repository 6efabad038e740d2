"""Checks of the types of arguments against the annotations of a function.

``@check_arguments`` raises an error that names an argument of the wrong type, such as a number for a name or a list for
a body, before the function runs. Domains (signs, ranges, units) are checked by the function itself.
"""

from __future__ import annotations

import inspect
import math
import os
from collections.abc import Callable, Iterable, Mapping
from functools import cache, wraps
from typing import ParamSpec, TypeVar

import numpy as np

from flybystab.errors import InvalidInput
from flybystab.typing import Array

P = ParamSpec("P")
R = TypeVar("R")


def _number(value: object) -> bool:
    if isinstance(value, np.ndarray) and value.shape == ():
        value = value[()]
    if isinstance(value, bool | np.bool_) or not isinstance(value, int | float | np.integer | np.floating):
        return False
    return isinstance(value, float | np.floating) or abs(int(value)) < 2**1023


def _whole(value: object) -> bool:
    return isinstance(value, int | np.integer) and not isinstance(value, bool) and abs(int(value)) < 2**63


def _numbers(value: object) -> bool:
    try:
        array = np.asarray(value)
        return array.dtype.kind in "fiu" and array.size > 0
    except (TypeError, ValueError):
        return False


def _names(value: object) -> bool:
    return isinstance(value, str) or (
        isinstance(value, Iterable) and all(isinstance(one, str) for one in value)
    )


#: Kinds of values by annotation: description for messages, and check.
KINDS: Mapping[str, tuple[str, Callable[[object], bool]]] = {
    "int": ("a whole number", _whole),
    "float": ("a real number", _number),
    "str": ("text", lambda value: isinstance(value, str)),
    "bool": ("True or False", lambda value: isinstance(value, bool | np.bool_)),
    "Path": ("a path", lambda value: isinstance(value, os.PathLike)),
    "Array": ("an array of real numbers", _numbers),
    "ArrayLike": ("an array of real numbers", _numbers),
    "Callable": ("a function", callable),
    "Executor": ("an executor with submit()", lambda value: hasattr(value, "submit")),
    "Finder": ("a function", callable),
    "Mapping": ("a mapping", lambda value: isinstance(value, Mapping)),
    "Sequence[str]": ("a sequence of names", _names),
}
#: Classes of this package and of astropy that are recognised by their name, so that this module imports none of them.
#: An Asteroid stands for its orbit.
CLASSES = (
    "Asteroid", "Axes", "Body", "Covariance", "DisruptionRates", "Encounter", "Ephemeris",
    "Friction", "GrainSizes", "Material", "Orbit", "Pile", "Planet", "Population", "QTable", "Shape",
    "SlopeChange", "Window",
)  # fmt: skip


def _is(value: object, kind: str) -> bool:
    if kind == "None":
        return value is None
    if kind in KINDS:
        return KINDS[kind][1](value)
    names = [c.__name__ for c in type(value).__mro__]
    return kind in names or (kind == "Orbit" and "Asteroid" in names)


def _kind(annotation: str) -> str:
    """Kind of an annotation, without the parameters of mappings and callables, which are not checked."""
    plain = annotation.partition("[")[0]
    return plain if plain in ("Callable", "Mapping") else annotation


def _check(name: str, value: object, kinds: tuple[str, ...]) -> None:
    if kinds and not any(_is(value, kind) for kind in kinds):
        wanted = [KINDS[k][0] if k in KINDS else k for k in kinds if k != "None"]
        raise InvalidInput(name, value, " or ".join(wanted))


@cache
def _parameters(function: Callable[..., object]) -> tuple[inspect.Signature, dict[str, tuple[str, ...]]]:
    """Signature, and the kinds of the parameters of which every kind is known."""
    signature = inspect.signature(function)
    kinds = {}
    for name, parameter in signature.parameters.items():
        found = tuple(_kind(k) for k in str(parameter.annotation).strip("'\"").split(" | "))
        if all(k in KINDS or k in CLASSES or k == "None" for k in found):
            kinds[name] = found
    return signature, kinds


def check_arguments(function: Callable[P, R]) -> Callable[P, R]:
    """Decorator that raises `InvalidInput` for arguments whose type does not match the annotation.

    Parameters with other annotations than those of :data:`KINDS`, :data:`CLASSES` and None are not checked.

    Raises
    ------
    InvalidInput
        Names the argument and what is expected.
    """

    @wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        signature, kinds = _parameters(function)
        for name, value in signature.bind(*args, **kwargs).arguments.items():
            known = kinds.get(name, ())
            for one in (
                value if signature.parameters[name].kind is inspect.Parameter.VAR_POSITIONAL else (value,)
            ):
                _check(name, one, known)
        return function(*args, **kwargs)

    return call


def finite(value: float, name: str, low: float = -math.inf, high: float = math.inf) -> float:
    """The value as a float; it must be a real number in a closed interval.

    Raises
    ------
    InvalidInput
    """
    if not _number(value) or not math.isfinite(value) or not low <= value <= high:
        raise InvalidInput(name, value, f"a real number from {low:g} to {high:g}")
    return float(value)


def vector(value: object, name: str) -> Array:
    """The value as an array of three finite numbers, not all zero.

    Raises
    ------
    InvalidInput
    """
    found = np.asarray(value, dtype=float) if _numbers(value) else np.zeros(0)
    if found.shape != (3,) or not np.isfinite(found).all() or not found.any():
        raise InvalidInput(name, value, "three finite numbers, not all zero")
    return found


def levels(value: object, name: str) -> Array:
    """The value as an array of probabilities from 0 to 1.

    Raises
    ------
    InvalidInput
    """
    found = np.asarray(value, dtype=float) if _numbers(value) else np.array([np.nan])
    if not np.all((found >= 0.0) & (found <= 1.0)):
        raise InvalidInput(name, value, "probabilities from 0 to 1")
    return found


def check_kinds(instance: object, *names: str) -> None:
    """Raise `InvalidInput` for attributes of a dataclass whose type does not match the annotation of its constructor.

    Raises
    ------
    InvalidInput
    """
    constructor: Callable[..., object] = type(instance)
    _, kinds = _parameters(constructor)
    for name in names:
        _check(name, getattr(instance, name), kinds.get(name, ()))
