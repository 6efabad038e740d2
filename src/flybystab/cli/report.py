"""``flybystab report NAME``: HTML report of one encounter."""

from __future__ import annotations

import argparse

from flybystab.cli.body_options import population_of
from flybystab.cli.common import asteroid_of, check_picture, grains_arguments, show
from flybystab.cli.flown import encounter_arguments, flown
from flybystab.cli.shape_options import surface_of

HELP = "HTML report of one encounter"
EXAMPLE = "flybystab report Apophis --output apophis.html"


def arguments(sub: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    encounter_arguments(sub)
    grains_arguments(sub)
    sub.add_argument(
        "--samples",
        type=int,
        default=200,
        metavar="N",
        help="samples of the uncertain inputs; 1 for none (200)",
    )
    sub.add_argument("--output", default="report.html", metavar="FILE", help="HTML file (report.html)")


def run(options: argparse.Namespace) -> None:
    """Execute the command."""
    import shlex

    import astropy.units as u

    from flybystab.flybys import document
    from flybystab.io.report import report
    from flybystab.screening.screening import screen

    check_picture(options.output, (".html",))
    asteroid, result, sample = flown(options)
    surface = surface_of(options, result)
    e = result.encounter
    screened = None
    if options.samples > 1:
        day = 1.0 * u.d
        table = screen(
            [asteroid_of(options, assume=False)],
            e.time - day,
            e.time + day,
            planets=[options.planet],
            within=1.01 * e.distance,
            samples=options.samples,
            seed=options.seed,
            material=asteroid.material,
            population=population_of(options),
        )
        screened = table[0] if len(table) == 1 and not table["error"][0] else None
    command = "flybystab " + shlex.join(options.words)
    path = report(
        asteroid, result, sample, options.output, screened=screened, command=command, surface=surface
    )
    show(
        options,
        lambda: document.flyby_document(result, sample, asteroid=asteroid.label, report=str(path)),
        lambda: [f"{asteroid.label}: {result.verdict}", f"report     {path}"],
    )
