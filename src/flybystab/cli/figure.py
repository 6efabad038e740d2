"""``flybystab figure WHAT``: figures of equilibrium and stability."""

from __future__ import annotations

import argparse

from flybystab.cli.common import (
    asteroid_of,
    check_picture,
    document,
    material_arguments,
    material_of,
    show,
    style_argument,
)
from flybystab.plots.formats import FIGURES

HELP = "figures of equilibrium and stability: regions, spin limits, barrier, failure distance"
EXAMPLE = "flybystab figure regions --output regions.png"


def arguments(sub: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    sub.add_argument("what", choices=["regions", "spin", "barrier", "failure"], help="the figure")
    sub.add_argument(
        "name",
        nargs="?",
        help="asteroid of the figure barrier (a body with semi-axes 1400 x 850 x 750 m, 2 g/cm3, 6 h)",
    )
    material_arguments(sub)
    sub.add_argument("--output", metavar="FILE", help=f"figure file, {', '.join(FIGURES)} (WHAT.png)")
    style_argument(sub)


def run(options: argparse.Namespace) -> None:
    """Execute the command."""
    import astropy.units as u

    from flybystab.body.body import Body
    from flybystab.errors import WrongUsage
    from flybystab.plots.figures import (
        barrier_figure,
        catalogue_bodies,
        failure_figure,
        regions_figure,
        spin_figure,
    )
    from flybystab.plots.style import save

    output = options.output or f"{options.what}.png"
    check_picture(output)
    if options.name is not None and options.what != "barrier":
        raise WrongUsage(f"NAME = {options.name}: expected no asteroid; only the figure barrier takes one")
    material = material_of(options)
    if options.what == "barrier":
        pile = Body([1400, 850, 750] * u.m, 2000 * u.kg / u.m**3, 6 * u.h, material=material)
        figure = barrier_figure(pile if options.name is None else asteroid_of(options).body)
    elif options.what == "failure":
        figure = failure_figure(material.yield_surface)
    else:
        make = regions_figure if options.what == "regions" else spin_figure
        figure = make(catalogue_bodies(), material.yield_surface)
    save(figure, output)
    show(
        options,
        lambda: document("figure", figure=options.what, file=output),
        lambda: [f"figure     {output}"],
    )
