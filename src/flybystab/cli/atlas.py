"""``flybystab atlas [TABLE, FILE or NAME ...]``: web site of the encounters of a screening."""

from __future__ import annotations

import argparse

from flybystab.cli.common import document, show
from flybystab.cli.screen import run_study, study_arguments

HELP = "web site of the encounters of a screening"
EXAMPLE = "flybystab atlas --from 2026-01-01 --to 2050-01-01 --samples 100 --output site"


def arguments(sub: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    study_arguments(sub)
    sub.add_argument("--title", default="", help="heading of the site")
    sub.add_argument(
        "--output",
        default="atlas",
        metavar="FOLDER",
        help="new folder (atlas); open its index.html in a browser",
    )
    sub.add_argument("--overwrite", action="store_true", help="replace an existing atlas")


def run(options: argparse.Namespace) -> None:
    """Execute the command."""
    from pathlib import Path

    from flybystab.errors import InvalidInput
    from flybystab.io.atlas import atlas, check_folder
    from flybystab.screening.results import FORMATS, read_results
    from flybystab.units import number_of

    folder = Path(options.output)
    check_folder(folder, options.overwrite)
    tables = [name for name in options.asteroids if Path(name).suffix in FORMATS]
    if tables and len(options.asteroids) > 1:
        raise InvalidInput(
            "FILE", ", ".join(options.asteroids), "one finished table, or catalogue files and names"
        )
    table = Path(tables[0]) if tables else folder.with_name(folder.name + ".ecsv")
    if not tables:
        run_study(options, table, overwrite=options.overwrite)
    results = read_results(table)
    page = atlas(results, folder, title=options.title, overwrite=options.overwrite)
    show(
        options,
        lambda: document("atlas", page=str(page), encounters=len(results), table=str(table)),
        lambda: [number_of(len(results), "encounter"), f"table      {table}", f"page       {page}"],
    )
