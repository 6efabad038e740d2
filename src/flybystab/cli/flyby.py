"""``flybystab flyby NAME``: fly an asteroid through one encounter."""

from __future__ import annotations

import argparse

from flybystab.cli.common import (
    check_picture,
    figure_argument,
    grains_arguments,
    movie_argument,
    show,
    write_picture,
)
from flybystab.cli.flown import attitude_words, encounter_arguments, flown
from flybystab.cli.shape_options import check_map, map_argument, surface_of, write_map
from flybystab.plots.formats import FIGURES, FILMS

HELP = "fly an asteroid through one encounter"
EXAMPLE = "flybystab flyby Apophis --output apophis.png"


def arguments(sub: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    encounter_arguments(sub)
    grains_arguments(sub)
    figure_argument(sub, films=True)
    movie_argument(sub)
    map_argument(sub)


def run(options: argparse.Namespace) -> None:
    """Execute the command."""
    from flybystab.flybys import document
    from flybystab.io import text
    from flybystab.io.grains_text import grains_lines
    from flybystab.io.surface_text import extra, surface_lines

    check_picture(options.output, FIGURES + FILMS)
    check_picture(options.movie, FILMS, "--movie")
    check_map(options)
    asteroid, result, sample = flown(options)
    surface = surface_of(options, result)
    write_map(options, surface)
    encounter = result.encounter
    for target in filter(None, (options.output, options.movie)):
        where = encounter.planet.name.capitalize()
        when = "" if encounter.time is None else f", {encounter.time.tdb.iso[:10]}"
        write_picture(result, f"{asteroid.label} at {where}{when}", target)
    show(
        options,
        lambda: document.flyby_document(
            result,
            sample,
            asteroid=asteroid.label,
            catalogue=asteroid.file,
            orbit_solution=asteroid.record.get("orbit_solution"),
            assumed=asteroid.assumptions,
            attitude=attitude_words(asteroid),
            distance_error_numerical_km=None
            if encounter.distance_error is None
            else encounter.distance_error.to_value("km"),
            figure=options.output,
            **extra(surface),
        ),
        lambda: [
            f"asteroid   {asteroid.label}",
            *text.encounter_lines(encounter),
            f"attitude   {attitude_words(asteroid)}",
            *text.flyby_lines(result),
            *grains_lines(result),
            *text.sample_lines(sample),
            *([] if surface is None else surface_lines(surface)),
            *text.model_lines(result, asteroid.assumptions),
            *([f"figure     {options.output}"] if options.output else []),
            *([f"movie      {options.movie}"] if options.movie else []),
            *([f"map        {options.map}"] if options.map else []),
        ],
    )
