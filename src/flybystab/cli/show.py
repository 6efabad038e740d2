"""``flybystab show FILE``: summary and plot of a screening table."""

from __future__ import annotations

import argparse

from flybystab.cli.common import check_picture, figure_argument, show

HELP = "summary and plot of a screening table"
EXAMPLE = "flybystab show screening.ecsv --output screening.png"


def arguments(sub: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    sub.add_argument("file", help="table written by flybystab screen")
    figure_argument(sub)


def run(options: argparse.Namespace) -> None:
    """Execute the command."""
    from flybystab.flybys.document import table_document
    from flybystab.plots.screening import results_figure
    from flybystab.screening.results import read_results
    from flybystab.screening.summary import summary

    check_picture(options.output)
    table = read_results(options.file)
    if options.output:
        results_figure(table, options.output)
    show(options, lambda: table_document(table), lambda: [summary(table).text()])
