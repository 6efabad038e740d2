"""``flybystab screen [FILE]``: a whole catalogue through its encounters."""

from __future__ import annotations

import argparse

from flybystab.face.commands.common import show, span_arguments, tdb

HELP = "a whole catalogue through its encounters"
EXAMPLE = "flybystab screen --from 2026-01-01 --to 2036-01-01 --samples 100 --jobs 2"


def arguments(sub: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    sub.add_argument("file", nargs="?", help="catalogue file; the embedded catalogue if left out")
    span_arguments(sub, "2026-01-01", "2036-01-01")
    sub.add_argument(
        "--samples", type=int, default=1, metavar="N", help="draws of the uncertain inputs (1: none)"
    )
    sub.add_argument("--seed", type=int, default=0, help="fixes every draw (0)")
    sub.add_argument("--jobs", type=int, default=1, metavar="N", help="processes (1)")
    sub.add_argument("--dask", metavar="ADDRESS", help="a dask scheduler instead of processes")
    sub.add_argument("--output", default="screening.ecsv", metavar="FILE", help="table, .ecsv or .parquet")


def run(options: argparse.Namespace) -> None:
    """Answer the command."""
    import astropy.units as u

    from flybystab.face.document import table_document
    from flybystab.survey.executors import workers
    from flybystab.survey.progress import ProgressBar
    from flybystab.survey.results import check_output, read_results
    from flybystab.survey.screening import Screening, listed, settings
    from flybystab.survey.summary import summary

    output = check_output(options.output)
    screening = Screening(
        listed(options.file),
        settings(
            tdb(options.start, "--from"),
            tdb(options.stop, "--to"),
            planets=options.planet or ["earth"],
            within=options.within * u.au,
            samples=options.samples,
            seed=options.seed,
        ),
    )
    with workers(options.jobs, options.dask) as executor:
        screening.run(output, executor=executor, progress=ProgressBar())
    show(
        options,
        lambda: table_document(read_results(output)),
        lambda: [summary(output).text(), f"table      {output}"],
    )
