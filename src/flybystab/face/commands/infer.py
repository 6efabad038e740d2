"""``flybystab infer NAME``: what an asteroid's survival says of its material."""

from __future__ import annotations

import argparse

from flybystab.face.commands.common import (
    check_picture,
    dates_arguments,
    figure_argument,
    show,
    surface_argument,
    tdb,
)

HELP = "what an asteroid's survival says of its material"
EXAMPLE = "flybystab infer Toutatis"


def arguments(sub: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    sub.add_argument("name", help="number, name or designation")
    dates_arguments(sub, "2000-01-01", "2026-01-01")
    surface_argument(sub)
    figure_argument(sub)


def run(options: argparse.Namespace) -> None:
    """Answer the command."""
    import astropy.units as u

    from flybystab.face.document import table_document
    from flybystab.survey.asteroid import Asteroid
    from flybystab.survey.inference import infer, inference_figure, survived

    check_picture(options.output)
    asteroid = Asteroid.from_catalogue(options.name)
    passages = survived(asteroid, tdb(options.start, "--from"), tdb(options.stop, "--to"))
    table = infer(asteroid, passages, yield_surface=options.surface)
    if options.output:
        inference_figure(table, options.output)

    def lines() -> list[str]:
        head = f"{asteroid.label}: least friction angle (deg), {len(passages)} passages survived"
        columns = [c for c in table.colnames if c.startswith("friction_")]
        rows = [f"{'density':>8s} {'cohesion':>9s} " + " ".join(f"{c[9:]:>15s}" for c in columns)]
        for row in table:
            values = " ".join(f"{row[c].to_value(u.deg):15.2f}" for c in columns)
            rows.append(f"{row['density'].value:8.0f} {row['cohesion'].value:9.1f} {values}")
        return [head, *rows]

    show(options, lambda: table_document(table), lines)
