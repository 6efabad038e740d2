"""Checks of arguments that require neither catalogue nor files; a failure is wrong usage (exit status 2)."""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from flybystab.cli.body_options import check_body_options
from flybystab.cli.common import material_of, tdb
from flybystab.errors import InvalidInput, UnknownName, WrongUsage

#: Smallest valid integer for each argument.
_LEAST = {"samples": 1, "jobs": 1, "attitudes": 1, "clones": 0, "seed": 0}


@contextmanager
def usage() -> Iterator[None]:
    """Convert errors of invalid values within the block to WrongUsage."""
    try:
        yield
    except (InvalidInput, UnknownName) as error:
        raise WrongUsage(str(error)) from None


def check_arguments(options: argparse.Namespace) -> None:
    """Check ranges of numbers, dates, planets and yield surfaces.

    Raises
    ------
    WrongUsage
        A value is invalid.
    """
    given = vars(options)
    with usage():
        for name, least in _LEAST.items():
            if given.get(name, least) < least:
                raise InvalidInput(f"--{name}", given[name], f"a whole number, {least} or more")
        within = given.get("within")
        if within is not None and not 0.0 < within < math.inf:
            raise InvalidInput("--within", given["within"], "a distance above 0, in au")
        if not 0.0 < given.get("error", 1.0) < math.inf:
            raise InvalidInput("--error", given["error"], "an error above 0, in km")
        if "friction" in given:
            material_of(options)
            check_body_options(options)
        elif "surface" in given:
            _yield_surface(given["surface"])
        _dates(given)
        for name in _list(given.get("planet")):
            _planet(name)


def _list(value: str | list[str] | None) -> list[str]:
    return value if isinstance(value, list) else [] if value is None else [value]


def _dates(given: Mapping[str, str]) -> None:
    options = {"start": "--from", "stop": "--to", "date": "--date"}
    dates = {k: tdb(given[k], name) for k, name in options.items() if given.get(k) is not None}
    if "stop" in dates and not dates["start"] < dates["stop"]:
        raise InvalidInput("--to", given["stop"], f"a date after --from {given['start']}")


def _planet(name: str) -> None:
    from flybystab.orbit.planets import planet

    planet(name)


def _yield_surface(name: str) -> None:
    from flybystab.body.body import Material

    Material(yield_surface=name)
