"""``flybystab screen [FILE or NAME ...]``: fly a whole catalogue through its encounters."""

from __future__ import annotations

import argparse
import sys
from typing import TYPE_CHECKING

from flybystab.cli.common import (
    check_computed,
    check_table,
    material_arguments,
    material_of,
    names_a_file,
    sampling_arguments,
    show,
    span_arguments,
    tdb,
)
from flybystab.cli.shape_options import shape_arguments, shaped
from flybystab.errors import WrongUsage

if TYPE_CHECKING:
    from pathlib import Path

HELP = "fly a whole catalogue through its encounters"
EXAMPLE = "flybystab screen --from 2026-01-01 --to 2036-01-01 --samples 100 --jobs 2"


def arguments(sub: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    study_arguments(sub)
    sub.add_argument(
        "--population-default", action="store_true", help="print the default priors as TOML and exit"
    )
    sub.add_argument(
        "--output",
        default="screening.ecsv",
        metavar="FILE",
        help="output table, .ecsv or .parquet (screening.ecsv)",
    )
    sub.add_argument(
        "--overwrite", action="store_true", help="replace existing tables (not needed to resume a run)"
    )
    sub.add_argument(
        "--samples-output", metavar="FILE", help="also write a table of all samples, .ecsv or .parquet"
    )


def study_arguments(sub: argparse.ArgumentParser) -> None:
    """Add the arguments of a screening without those of its output."""
    sub.add_argument(
        "asteroids",
        nargs="*",
        metavar="FILE",
        help="catalogue files in any format of docs/inputs.md, or names (default: the embedded catalogue)",
    )
    span_arguments(sub, "2026-01-01", "2036-01-01")
    material_arguments(sub)
    shape_arguments(sub)
    sampling_arguments(
        sub,
        1,
        "samples of the uncertain inputs; 1 for the nominal values only",
        population="priors of the uncertain inputs, TOML; omitted ones keep their defaults",
        grains="continue samples beyond the ellipsoid model with piles of N grains",
    )
    sub.add_argument("--jobs", type=int, default=1, metavar="N", help="number of processes (1)")
    sub.add_argument("--dask", metavar="ADDRESS", help="dask scheduler to use instead of processes")


def run(options: argparse.Namespace) -> None:
    """Execute the command."""
    from pathlib import Path

    from flybystab.flybys.document import table_document
    from flybystab.screening.priors import Population
    from flybystab.screening.results import FORMATS, read_results
    from flybystab.screening.summary import summary

    if options.population_default:
        print(Population().toml(), end="")
        return
    check_table(options.output, FORMATS)  # the summary reads it
    check_table(options.samples_output, FORMATS)
    output = Path(options.output)
    run_study(options, output, samples_output=options.samples_output, overwrite=options.overwrite)
    found = summary(output)
    show(
        options,
        lambda: table_document(read_results(output)),
        lambda: [
            found.text(),
            f"table      {output} (flybystab show {output} --output {output.with_suffix('.png')} plots it)",
        ],
    )
    check_computed(found.rows, found.failed, found.errors)


def run_study(
    options: argparse.Namespace, output: Path, *, samples_output: str | None = None, overwrite: bool = False
) -> None:
    """Run the screening of the options of :func:`study_arguments` into a table."""
    from pathlib import Path

    import astropy.units as u

    from flybystab.screening.executors import open_executor
    from flybystab.screening.priors import Population
    from flybystab.screening.progress import ProgressBar
    from flybystab.screening.screening import Screening
    from flybystab.screening.selection import listed
    from flybystab.screening.settings import settings

    names = [Path(a) if names_a_file(a) else a for a in options.asteroids]
    asteroids = listed(names or None)
    if options.shape:
        if len(asteroids) != 1:
            raise WrongUsage(f"--shape: expected with one asteroid, not with {len(asteroids)}")
        asteroids = (shaped(asteroids[0], options),)
    screening = Screening(
        asteroids,
        settings(
            tdb(options.start, "--from"),
            tdb(options.stop, "--to"),
            planets=options.planet or ["earth"],
            within=options.within * u.au,
            samples=options.samples,
            seed=options.seed,
            material=material_of(options),
            population=Population.from_file(options.population) if options.population else None,
            keep_samples=samples_output is not None,
            grains=options.grains,
        ),
    )
    bar = ProgressBar()
    try:
        with open_executor(options.jobs, options.dask) as executor:
            screening.run(
                output,
                samples_output=samples_output,
                overwrite=overwrite,
                executor=executor,
                progress=bar,
            )
    except KeyboardInterrupt:
        bar.end()
        print(
            f"flybystab: {output} contains the rows computed so far; rerun with the same arguments to resume",
            file=sys.stderr,
        )
        raise
