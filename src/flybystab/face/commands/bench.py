"""``flybystab bench flyby``: error against time of the flyby integrators."""

from __future__ import annotations

import argparse

from flybystab import __version__
from flybystab.face.commands.common import figure_argument, show

HELP = "error against time of the flyby integrators"
EXAMPLE = "flybystab bench flyby --output bench.png"


def arguments(sub: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    sub.add_argument("what", choices=["flyby"], help="which benchmark")
    figure_argument(sub)


def run(options: argparse.Namespace) -> None:
    """Answer the command."""
    from flybystab.face.bench import flyby_bench, lines

    rows = flyby_bench(options.output)
    show(options, lambda: {"flybystab": __version__, "rows": rows}, lambda: lines(rows))
