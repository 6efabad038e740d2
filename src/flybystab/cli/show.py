"""``flybystab show FILE``: summary and figure of a screening table, or its conversion to CSV."""

from __future__ import annotations

import argparse

from flybystab.cli.common import check_picture, check_table, show, style_argument
from flybystab.plots.formats import FIGURES

HELP = "summary and figure of a screening table"
EXAMPLE = "flybystab show screening.ecsv --output screening.png"


def arguments(sub: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    sub.add_argument("file", help="table written by flybystab screen")
    sub.add_argument(
        "--output", metavar="FILE", help=f"write a figure ({', '.join(FIGURES)}) or the table (.csv)"
    )
    style_argument(sub)


def run(options: argparse.Namespace) -> None:
    """Execute the command."""
    from flybystab.flybys.document import table_document
    from flybystab.plots.screening import results_figure
    from flybystab.screening.results import read_results
    from flybystab.screening.summary import summary
    from flybystab.screening.tables import write_table

    as_csv = str(options.output).endswith(".csv")
    if as_csv:
        check_table(options.output)
    else:
        check_picture(options.output)
    table = read_results(options.file)
    if as_csv:
        write_table(table, options.output)
    elif options.output:
        results_figure(table, options.output)
    show(options, lambda: table_document(table), lambda: [summary(table).text()])
