"""Shell commands, one module each.

The module of a command has ``HELP`` and ``EXAMPLE`` (text), ``arguments(sub)``, which adds its arguments to an argparse
parser, and ``run(options)``, which executes it. Slow imports belong inside ``run``. To add a command, add a module and
an entry in :data:`COMMANDS`.
"""

from __future__ import annotations

import argparse
from typing import Protocol

from flybystab.cli import (
    atlas,
    bench,
    cite,
    completion,
    encounters,
    ephemeris,
    figure,
    flyby,
    impacts,
    infer,
    rates,
    report,
    scenario,
    screen,
    show,
    stability,
)


class Command(Protocol):
    """Interface of the module of a command."""

    HELP: str
    EXAMPLE: str

    def arguments(self, sub: argparse.ArgumentParser) -> None:
        """Add the arguments of the command."""

    def run(self, options: argparse.Namespace) -> None:
        """Execute the command."""


#: Commands by name, in the order of the help text.
COMMANDS: dict[str, Command] = {
    "flyby": flyby,
    "report": report,
    "scenario": scenario,
    "encounters": encounters,
    "impacts": impacts,
    "ephemeris": ephemeris,
    "stability": stability,
    "figure": figure,
    "screen": screen,
    "show": show,
    "atlas": atlas,
    "infer": infer,
    "rates": rates,
    "bench": bench,
    "cite": cite,
    "completion": completion,
}
