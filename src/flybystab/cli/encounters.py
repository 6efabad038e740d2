"""``flybystab encounters NAME``: close approaches of an asteroid and their predictability."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from flybystab.cli.common import catalogue_argument, check_table, names_a_file, show, span_arguments, tdb
from flybystab.errors import WrongUsage

if TYPE_CHECKING:
    from astropy.table import QTable, Row

    from flybystab.catalogues.asteroid import Asteroid
    from flybystab.encounter.distribution import EncounterDistribution

HELP = "close approaches of an asteroid or of a catalogue"
#: Largest number of encounters printed; of more, only the closest are printed.
SHOWN = 100
EXAMPLE = (
    "flybystab encounters Apophis --to 2030-01-01 --clones 1000\n"
    "  flybystab encounters a.ke1 b.ke1 99942 --output table.csv"
)


def arguments(sub: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    sub.add_argument(
        "name",
        nargs="*",
        help="numbers, names or designations, or files of orbits (docs/inputs.md)",
    )
    catalogue_argument(sub)
    sub.add_argument(
        "--all",
        action="store_true",
        help="all asteroids of the embedded catalogue, of --catalogue or of the files, without predictability",
    )
    span_arguments(sub, "2020-01-01", "2050-01-01")
    sub.add_argument(
        "--error", type=float, default=0.1, metavar="KM", help="target error of the distances (0.1 km)"
    )
    sub.add_argument(
        "--clones", type=int, default=0, metavar="N", help="number of orbits drawn from the covariance (0)"
    )
    sub.add_argument("--seed", type=int, default=0, help="random seed of the clones (0)")
    sub.add_argument("--output", metavar="FILE", help="write the table (.ecsv, .parquet, .csv)")


def run(options: argparse.Namespace) -> None:
    """Execute the command."""
    import astropy.units as u

    from flybystab.flybys.document import table_document
    from flybystab.orbit.search.encounter_finder import find_encounters
    from flybystab.progress import Bar
    from flybystab.screening.tables import write_table
    from flybystab.units import number_of

    if not options.name and not options.all:
        raise WrongUsage("NAME: expected an asteroid, or --all for the whole catalogue")
    if options.clones and options.all:
        raise WrongUsage("--clones: expected with named asteroids or files, not with --all")
    check_table(options.output)
    asteroids = _asteroids(options.name, options.catalogue)
    bar = Bar(len(asteroids), "asteroids") if len(asteroids) > SHOWN else None
    table = find_encounters(
        asteroids,
        tdb(options.start, "--from"),
        tdb(options.stop, "--to"),
        planets=options.planet or ["earth"],
        within=options.within * u.au,
        error=options.error * u.km,
        growth=not options.all,
        progress=None if bar is None else lambda done, _, found: bar(done, number_of(found, "encounter")),
    )
    if bar is not None:
        bar.close()
    if options.clones:
        table = _with_clones(table, asteroids, options.clones, options.seed)
    if options.output:
        write_table(table, options.output)
    many = len(asteroids) > 1
    source = ", ".join(options.name) or options.catalogue or "embedded catalogue"
    head = f"{number_of(len(table), 'encounter')} within {options.within:g} au"
    head += ", without the errors of the orbits" if options.all else ""
    show(
        options,
        lambda: table_document(table),
        lambda: [
            f"{asteroids[0].label}: {head}" if not many else f"{source} ({len(asteroids)} asteroids): {head}",
            *_lines(table, many),
            *[f"not integrated: {one['why']}" for one in table.meta["failed"][:SHOWN]],
            *([f"table      {options.output}"] if options.output else []),
        ],
    )


def _asteroids(words: list[str], file: str | None) -> list[Asteroid]:
    """Asteroids of the names and files; without names, those of a catalogue file or of the embedded catalogue."""
    from pathlib import Path

    from flybystab.catalogues.asteroid import Asteroid
    from flybystab.catalogues.catalogue import catalogue, find

    rows = catalogue() if file is None else catalogue(Path(file))
    if not words:
        return list(rows)
    found: list[Asteroid] = []
    for word in words:
        if file is not None:
            found.append(find(rows, word, file))
        elif names_a_file(word):
            found += catalogue(Path(word))
        else:
            found.append(Asteroid.from_catalogue(word))
    return found


def _with_clones(table: QTable, asteroids: list[Asteroid], clones: int, seed: int) -> QTable:
    """Add the columns of the clones to the table."""
    import numpy as np

    from flybystab.encounter.clone_columns import add_clones
    from flybystab.encounter.distribution import distributions

    found: list[EncounterDistribution | None] = [None] * len(table)
    for i in np.unique(table["index"]).tolist():
        if len(asteroids) > 1 and asteroids[i].orbit.covariance is None:
            continue
        rows = np.flatnonzero(table["index"] == i)
        for row, one in zip(rows, distributions(asteroids[i], table[rows], n=clones, seed=seed), strict=True):
            found[row] = one
    add_clones(table, found)
    return table


def _lines(table: QTable, many: bool) -> list[str]:
    """The table as text: distances, then predictability."""
    import numpy as np

    if not len(table):
        return []
    clones, known = "clones" in table.colnames, "growth" in table.colnames
    count = len(table)
    if count > SHOWN:
        table = table[np.sort(np.argsort(table["distance"])[:SHOWN])]
    out = [_head(many, known, clones), *(_line(row, many, known, clones) for row in table)]
    if any(v == 0.0 for v in table["v_inf"].value):
        out.append("bound: slower than the escape speed at closest approach, so that v_inf is not defined")
    if count > SHOWN:
        out.append(f"the closest {SHOWN} of {count} are shown; --output FILE writes all")
    return [*out, *_notes(table, clones)] if known else out


def _head(many: bool, known: bool, clones: bool) -> str:
    """Headings of the columns."""
    head = f"{'asteroid':16s} " if many else ""
    head += f"{'planet':8s} {'time (TDB)':19s} {'distance (km)':>16s} {'(au)':>9s} {'v_inf (km/s)':>12s} "
    head += f"{'B.T (km)':>13s} {'B.R (km)':>13s}"
    if not known:
        return head
    head += f" {'sigma (km)':>11s} {'model (km)':>11s}"
    if clones:
        head += f" {'clones (km)':>11s} {'P(impact), 95 %':>24s} {'linear':>9s}"
    return head + "  predictability"


def _line(row: Row, many: bool, known: bool, clones: bool) -> str:
    """One encounter."""
    import astropy.units as u

    from flybystab.io.text import grade

    line = f"{row['asteroid'][:16]:16s} " if many else ""
    line += f"{row['planet']:8s} {_time(row)} {row['distance'].to_value(u.km):16,.1f} "
    line += f"{row['distance'].to_value(u.au):9.6f} "
    v_inf = row["v_inf"].to_value(u.km / u.s)
    if v_inf > 0.0:
        line += f"{v_inf:12.4f} {row['b_t'].to_value(u.km):13,.0f} {row['b_r'].to_value(u.km):13,.0f}"
    else:  # no asymptote and no target plane
        line += f"{'bound':>12s} {'-':>13s} {'-':>13s}"
    if known:
        line += f" {row['displacement'].to_value(u.km):11.4g} {row['model_error'].to_value(u.km):11.4g}"
    if clones:
        odds = f"{row['p_impact']:.3g} ({row['p_impact_low']:.2g}-{row['p_impact_high']:.2g})"
        line += f" {row['distance_sigma'].to_value(u.km):11.4g} {odds:>24s} {row['p_impact_linear']:9.2g}"
    remarks = [grade(row["predictability"])] if known else []
    if row["impact"]:
        remarks.append("impact: time of entry" + _place(row))
    return f"{line}  {', '.join(remarks)}".rstrip()


def _notes(table: QTable, clones: bool) -> list[str]:
    """Explanation of the errors in the table."""
    out = [
        f"sigma: displacement at the encounter of an orbit {'; '.join(table.meta['neighbours'])}; "
        "model: error due to ephemeris, tolerance and omitted forces"
    ]
    if clones:
        lost = int((table["clones"] - table["clones_found"]).max())
        out.append(
            f"clones, P(impact): 1-sigma of the distance and impact probability of {table['clones'].max()} clones"
            + (f", at most {lost} of them without this encounter" if lost else "")
            + f"; covariance: {'; '.join(table.meta['covariances'])}"
        )
    return out


def _time(row: Row) -> str:
    """Time of closest approach, or of the entry of an impact."""
    return str(row["entry_time"][:19].replace("T", " ") if row["impact"] else row["time"].tdb.iso[:19])


def _place(row: Row) -> str:
    """Where on the Earth an impact enters the atmosphere."""
    import astropy.units as u
    import numpy as np

    latitude, longitude = (row[f"entry_{c}"].to_value(u.deg) for c in ("latitude", "longitude"))
    if not np.isfinite(latitude):
        return ""
    north, east = "N" if latitude >= 0.0 else "S", "E" if longitude >= 0.0 else "W"
    return f" at {abs(latitude):.2f} {north} {abs(longitude):.2f} {east}"
