"""``flybystab encounters NAME``: close approaches of an asteroid."""

from __future__ import annotations

import argparse

from flybystab.face.commands.common import show, span_arguments, tdb

HELP = "close approaches of an asteroid"
EXAMPLE = "flybystab encounters Apophis --to 2030-01-01"


def arguments(sub: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    sub.add_argument("name", help="number, name or designation")
    span_arguments(sub, "2020-01-01", "2050-01-01")
    sub.add_argument("--output", metavar="FILE", help="write the table (.ecsv)")


def run(options: argparse.Namespace) -> None:
    """Answer the command."""
    import astropy.units as u

    from flybystab.face.document import table_document
    from flybystab.sky.finder import find_encounters
    from flybystab.survey.asteroid import Asteroid

    asteroid = Asteroid.from_catalogue(options.name)
    table = find_encounters(
        asteroid,
        tdb(options.start, "--from"),
        tdb(options.stop, "--to"),
        planets=options.planet or ["earth"],
        within=options.within * u.au,
    )
    if options.output:
        from flybystab.survey.results import check_output

        check_output(options.output)
        table.write(options.output, format="ascii.ecsv", overwrite=True)

    def lines() -> list[str]:
        head = f"{'planet':8s} {'time (TDB)':19s} {'distance (km)':>16s} {'(au)':>9s} {'v_inf (km/s)':>12s}"
        rows = [
            f"{row['planet']:8s} {row['time'].tdb.iso[:19]} {row['distance'].to_value(u.km):16,.1f} "
            f"{row['distance'].to_value(u.au):9.6f} {row['v_inf'].to_value(u.km / u.s):12.4f}"
            + (" impact" if row["impact"] else "")
            for row in table
        ]
        return [f"{asteroid.label}: {len(rows)} encounters within {options.within:g} au", head, *rows]

    show(options, lambda: table_document(table), lines)
