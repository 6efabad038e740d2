"""``flybystab bench [WHAT]``: benchmarks of error against computing time."""

from __future__ import annotations

import argparse

from flybystab.bench import BENCHES
from flybystab.cli.common import check_picture, document, figure_argument, show

HELP = "benchmarks, error against computing time: " + "; ".join(
    f"{name} ({about})" for name, about in BENCHES.items()
)
EXAMPLE = "flybystab bench flyby --output bench.png"


def arguments(sub: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    sub.add_argument("what", nargs="?", default="flyby", choices=list(BENCHES), help="benchmark (flyby)")
    figure_argument(sub)


def run(options: argparse.Namespace) -> None:
    """Execute the command."""
    from importlib import import_module

    check_picture(options.output)
    bench = import_module(f"flybystab.bench.{options.what}")
    rows = bench.rows(options.output)
    show(options, lambda: document("bench", rows=rows), lambda: bench.lines(rows))
