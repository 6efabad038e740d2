"""``flybystab scenario FILE.toml``: fly the body of a TOML file through its encounter."""

from __future__ import annotations

import argparse

from flybystab.cli.common import (
    SURFACES,
    check_picture,
    figure_argument,
    movie_argument,
    show,
    write_picture,
)
from flybystab.plots.formats import FIGURES, FILMS

HELP = "fly the body of a TOML file through its encounter"
EXAMPLE = "flybystab scenario examples/disruption_p2.toml"


def arguments(sub: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    sub.add_argument("file", help="scenario file")
    figure_argument(sub, films=True)
    movie_argument(sub)


def run(options: argparse.Namespace) -> None:
    """Execute the command."""
    from flybystab.flybys import document
    from flybystab.flybys.flyby import flyby
    from flybystab.flybys.surface_history import surface_history
    from flybystab.io import text
    from flybystab.io.grains_text import grains_lines
    from flybystab.io.scenario import scenario
    from flybystab.io.surface_text import extra, surface_lines

    check_picture(options.output, FIGURES + FILMS)
    check_picture(options.movie, FILMS, "--movie")
    script = scenario(options.file)
    figure = options.output or script.figure
    check_picture(figure, FIGURES + FILMS)
    result = flyby(
        script.body,
        script.encounter,
        script.attitude,
        surfaces=SURFACES,
        grains=script.grains,
        seeds=script.piles,
    )
    surface = None
    if script.shape is not None:
        surface = surface_history(script.body, script.encounter, script.attitude, shape=script.shape)
    if figure:
        write_picture(result, script.title, figure)
    if options.movie:
        write_picture(result, script.title, options.movie)
    show(
        options,
        lambda: document.flyby_document(result, title=script.title, figure=figure, **extra(surface)),
        lambda: [
            f"scenario   {script.title}",
            *text.encounter_lines(script.encounter),
            *text.flyby_lines(result),
            *grains_lines(result),
            *([] if surface is None else surface_lines(surface)),
            *text.model_lines(result),
            *([f"figure     {figure}"] if figure else []),
            *([f"movie      {options.movie}"] if options.movie else []),
        ],
    )
