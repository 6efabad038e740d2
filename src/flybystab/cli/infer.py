"""``flybystab infer NAME``: bounds on the material from the encounters that an asteroid has survived."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from flybystab.cli.body_options import body_arguments
from flybystab.cli.common import (
    asteroid_of,
    catalogue_argument,
    check_picture,
    figure_argument,
    material_arguments,
    show,
    span_arguments,
    tdb,
)
from flybystab.cli.shape_options import shape_arguments

if TYPE_CHECKING:
    from astropy.table import QTable
    from astropy.units import Quantity

    from flybystab.catalogues.asteroid import Asteroid

HELP = "bounds on friction, cohesion and density from the encounters that an asteroid survived"
EXAMPLE = "flybystab infer Toutatis --output toutatis.png"


def arguments(sub: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    sub.add_argument("name", help="number, name or designation")
    catalogue_argument(sub)
    span_arguments(sub, "1950-01-01", "2026-01-01")
    sub.add_argument(
        "--attitudes",
        type=int,
        default=32,
        metavar="N",
        help="attitudes sampled per encounter (32)",
    )
    sub.add_argument("--seed", type=int, default=0, help="random seed of the attitudes (0)")
    material_arguments(sub)
    body_arguments(sub)
    shape_arguments(sub)
    figure_argument(sub)


def run(options: argparse.Namespace) -> None:
    """Execute the command."""
    import astropy.units as u

    from flybystab.flybys.document import table_document
    from flybystab.plots.screening import inference_figure
    from flybystab.screening.inference import infer, survived

    check_picture(options.output)
    asteroid = asteroid_of(options)
    encounters = survived(
        asteroid,
        tdb(options.start, "--from"),
        tdb(options.stop, "--to"),
        planets=options.planet or ["earth"],
        within=options.within * u.au,
    )
    table = infer(
        asteroid,
        encounters,
        attitudes=options.attitudes,
        seed=options.seed,
        yield_surface=options.surface,
    )
    if options.output:
        inference_figure(table, options.output)
    show(options, lambda: table_document(table), lambda: _lines(asteroid, table))


def _lines(asteroid: Asteroid, table: QTable) -> list[str]:
    """Bounds from shape and spin, the effect of each encounter, and the table over density and cohesion."""
    import astropy.units as u
    import numpy as np

    from flybystab.body.bounds import density_intervals, required_cohesion
    from flybystab.body.equilibrium import equilibrium
    from flybystab.screening.inference import NEGLIGIBLE

    body = asteroid.body
    rho = body.density.to_value(u.kg / u.m**3)
    rest = equilibrium(body)
    phi = body.material.friction_angle
    needed = rest.required_friction_angle.to_value(u.deg)
    lines = [
        f"{asteroid.label}: bounds on its material, assuming that its shape has not changed",
        f"shape and spin, at {rho:.0f} kg/m3"
        + (" (assumed)" if "density_kg_m3" in asteroid.assumed else "")
        + ": "
        + (
            f"friction >= {needed:.1f} deg without cohesion"
            if np.isfinite(needed)
            else "no friction angle suffices without cohesion"
        ),
        f"at {phi.to_value(u.deg):g} deg: cohesion >= {required_cohesion(body, phi).to_value(u.Pa):.3g} Pa; "
        + _density_bound(density_intervals(body)),
    ]
    small = np.rad2deg(NEGLIGIBLE)
    for p in table.meta["passages"]:
        worst = p["adds_at_worst_attitude_deg"]
        lines.append(
            f"encounter {p['passage']}: "
            + (
                f"raises the required friction angle by less than {small:.2g} deg at any attitude"
                if worst < small
                else f"raises the required friction angle by {p['adds_at_any_attitude_deg']:.2f} deg at any attitude, "
                f"by {worst:.2f} deg at the least favourable one (largest over the table)"
            )
        )
    if not table.meta["passages"]:
        lines.append("no encounter in this time span within this distance")
    constraining = any(p["adds_at_worst_attitude_deg"] >= small for p in table.meta["passages"])
    cohesions = np.unique(table["cohesion"].to_value(u.Pa))
    for name, title in (
        ("friction_equilibrium", "from shape and spin"),
        ("friction_any_attitude", "with encounters, necessary at any attitude"),
        ("friction_every_attitude", "with encounters, sufficient at every attitude"),
    ):
        if name != "friction_equilibrium" and not constraining:
            continue
        lines.append(f"minimum friction angle (deg), {title}; columns: cohesion (Pa)")
        lines.append(f"{'kg/m3':>8s} " + " ".join(f"{c:8g}" for c in cohesions))
        need = table[name].to_value(u.deg).reshape(-1, len(cohesions))
        for density, row in zip(np.unique(table["density"].value), need, strict=True):
            cells = (f"{x:8.2f}" if np.isfinite(x) else f"{'none':>8s}" for x in row)
            lines.append(f"{density:8.0f} " + " ".join(cells))
    return lines


def _density_bound(intervals: Quantity) -> str:
    import astropy.units as u

    from flybystab.body.body import DENSITY_RANGE

    if not len(intervals):
        return "no density suffices without cohesion"
    least = intervals[0, 0].to_value(u.kg / u.m**3)
    if least <= 1.001 * DENSITY_RANGE[0]:
        return "any density"
    return f"density >= {least:.0f} kg/m3 without cohesion"
