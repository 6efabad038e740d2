"""``flybystab impacts NAME``: possible impacts along the line of variations, with hazard scales for the Earth."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from flybystab.cli.body_options import distance
from flybystab.cli.common import catalogue_argument, check_table, dates_arguments, show, tdb

if TYPE_CHECKING:
    from astropy.table import QTable
    from astropy.time import Time
    from astropy.units import Quantity

    from flybystab.catalogues.asteroid import Asteroid

HELP = "possible impacts of an asteroid with an uncertain orbit"
EXAMPLE = "flybystab impacts 2024YR4.ke1 --planet moon --from 2032-12-15 --to 2032-12-30"


def arguments(sub: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    sub.add_argument("name", help="number, name or designation, or a file with one orbit (docs/inputs.md)")
    catalogue_argument(sub)
    dates_arguments(sub, "2026-01-01", "2076-01-01")
    sub.add_argument("--planet", default="earth", help="planet or moon (earth)")
    sub.add_argument("--within", type=distance, default=0.1, metavar="AU", help="maximum distance (0.1 au)")
    sub.add_argument(
        "--orbits",
        type=int,
        default=1001,
        metavar="N",
        help="number of orbits on the line of variations (1001)",
    )
    sub.add_argument(
        "--sigmas",
        type=float,
        default=5.0,
        metavar="S",
        help="half length of the line of variations, in sigma (5)",
    )
    sub.add_argument(
        "--least", type=float, default=1e-12, metavar="P", help="smallest impact probability listed (1e-12)"
    )
    sub.add_argument(
        "--mass", type=float, metavar="KG", help="mass for the hazard scales (from the catalogue)"
    )
    sub.add_argument(
        "--date",
        metavar="DATE",
        help="date from which the time to impact in the Palermo scale is counted (today)",
    )
    sub.add_argument("--output", metavar="FILE", help="write the table (.ecsv, .parquet, .csv)")


def run(options: argparse.Namespace) -> None:
    """Execute the command."""
    import astropy.units as u
    from astropy.time import Time

    from flybystab.cli.common import asteroid_named
    from flybystab.encounter.virtual_impactors import virtual_impactors
    from flybystab.flybys.document import table_document
    from flybystab.screening.tables import write_table
    from flybystab.units import number_of

    check_table(options.output)
    asteroid = asteroid_named(options)
    date = Time.now().tdb if options.date is None else tdb(options.date, "--date")
    table = virtual_impactors(
        asteroid,
        tdb(options.start, "--from"),
        tdb(options.stop, "--to"),
        options.planet,
        n=options.orbits,
        sigmas=options.sigmas,
        within=options.within * u.au,
        least=options.least,
    )
    mass = _mass(asteroid, options.mass)
    on_earth = table.meta["planet"] == "earth"  # the scales are those of impacts on the Earth
    if mass is not None and on_earth:
        _add_scales(table, mass, date)
    if options.output:
        write_table(table, options.output)
    show(
        options,
        lambda: table_document(table),
        lambda: [
            f"{asteroid.label}: {number_of(len(table), 'possible impact')} on {table.meta['planet']}, "
            f"{options.start} to {options.stop}",
            *_lines(table),
            *(
                ["no hazard scales: mass unknown (--mass KG)"]
                if mass is None and on_earth and len(table)
                else []
            ),
            *([f"table      {options.output}"] if options.output else []),
        ],
    )


def _mass(asteroid: Asteroid, mass: float | None) -> Quantity | None:
    """Mass from the option or of the body in the catalogue; None if unknown."""
    import astropy.units as u

    from flybystab.errors import FlybystabError, InvalidInput

    if mass is not None:
        if not mass > 0.0:
            raise InvalidInput("--mass", mass, "a mass above zero, kg")
        return mass * u.kg
    try:
        return asteroid.body.mass
    except FlybystabError:
        return None


def _add_scales(table: QTable, mass: Quantity, date: Time) -> None:
    """Add the energy (megatons of TNT) and the Palermo and Torino scales; the time to impact starts at `date`."""
    import astropy.units as u
    import numpy as np

    from flybystab.encounter.hazard_scales import MEGATON, impact_energy, palermo_scale, torino_scale
    from flybystab.orbit.planets import planet

    body = planet(table.meta["planet"])
    escape2 = 2.0 * body.gm / body.impact_distance
    energies = [
        impact_energy(mass, np.sqrt(v.to_value(u.m / u.s) ** 2 + escape2) * u.m / u.s) for v in table["v_inf"]
    ]
    times = [max((t - date).to(u.s), 1.0 * u.s) for t in table["time"]]
    rows = list(zip(table["probability"], energies, times, strict=True))
    table["energy_Mt"] = np.array([e.to_value(u.J) / MEGATON for e in energies], dtype=float)
    table["palermo"] = np.array([palermo_scale(float(p), e, t) for p, e, t in rows], dtype=float)
    table["torino"] = np.array([torino_scale(float(p), e) for p, e, _ in rows], dtype=int)


def _lines(table: QTable) -> list[str]:
    """The table as text."""
    import astropy.units as u

    if not len(table):
        return []
    scales = "palermo" in table.colnames
    head = (
        f"{'time (TDB)':19s} {'probability':>11s} {'sigma':>8s} {'width (km)':>11s} {'stretching (km)':>15s} "
    )
    head += f"{'v_inf (km/s)':>12s}" + (f" {'energy (Mt)':>11s} {'Palermo':>8s} Torino" if scales else "")
    out = [head]
    for row in table:
        line = (
            f"{row['time'].tdb.iso[:19]} {row['probability']:11.3g} {row['sigma']:8.3f} "
            f"{row['width'].to_value(u.km):11.4g} {row['stretching'].to_value(u.km):15.4g} "
            f"{row['v_inf'].to_value(u.km / u.s):12.3f}"
        )
        if scales:
            line += f" {row['energy_Mt']:11.4g} {row['palermo']:8.2f} {row['torino']:6d}"
        out.append(line)
    return out
