"""``flybystab rates [FILE]``: rates of encounters, or of their verdicts, for a population."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from flybystab.cli.body_options import distance
from flybystab.cli.common import document, sampling_arguments, show, style_argument, surface_argument
from flybystab.errors import InvalidInput

if TYPE_CHECKING:
    from astropy.table import QTable
    from astropy.units import Quantity

    from flybystab.population.rates import Orbits
    from flybystab.typing import Document

HELP = "rates of encounters, or of their verdicts, for a population"
EXAMPLE = "flybystab rates --planet earth --within 0.05"
#: Planets by default.
PLANETS = ("mercury", "venus", "earth", "mars")


def arguments(sub: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    sub.add_argument(
        "file",
        nargs="?",
        help="catalogue, table of a model population with columns a, e, i (and H, weight), or distribution (.toml); "
        "default: the known near-Earth asteroids brighter than --limit",
    )
    sub.add_argument(
        "--limit",
        type=float,
        default=17.75,
        metavar="H",
        help="without FILE: largest absolute magnitude (17.75, about 1 km)",
    )
    sub.add_argument(
        "--columns",
        metavar="NAMES",
        help="columns of a table without a header, such as H,a,e,i (others are ignored)",
    )
    sub.add_argument("--planet", action="append", help=f"planet; may be repeated ({', '.join(PLANETS)})")
    sub.add_argument(
        "--within", type=distance, metavar="AU", help="largest periapsis distance (radius of the planet)"
    )
    sub.add_argument(
        "--verdicts",
        action="store_true",
        help="rates of the verdicts of encounters within 5 radii of each planet",
    )
    sub.add_argument(
        "--diameter",
        metavar="KM",
        default="1",
        help="with --verdicts: diameter of all bodies, or H for sizes from H and the albedo (1 km)",
    )
    sampling_arguments(
        sub,
        800,
        "encounters sampled per planet",
        population="priors of the bodies, TOML, as for screen",
        grains="with --verdicts: continue bodies beyond the ellipsoid model with piles of N grains",
    )
    surface_argument(sub)
    sub.add_argument(
        "--output", metavar="FILE",
        help="with --verdicts: figure (.png, .pdf, .svg) or table of the samples (.ecsv, .parquet, .csv); resumable",
    )  # fmt: skip
    style_argument(sub)


def run(options: argparse.Namespace) -> None:
    """Execute the command."""
    import astropy.units as u

    from flybystab.population.rates import elements_table, encounter_rates
    from flybystab.units import number_of

    orbits = elements_table(_orbits(options))
    planets = options.planet or list(PLANETS)
    source = options.file or f"known near-Earth asteroids of H < {options.limit:g}"
    if options.verdicts:
        rows, lines, count = _verdicts(options, orbits, planets)
        size = "sizes from H" if options.diameter == "H" else f"bodies of {options.diameter} km"
        what = f"verdicts of {size} within 5 radii"
    elif options.output or options.grains:
        name = "output" if options.output else "grains"
        raise InvalidInput(f"--{name}", getattr(options, name), "this option only with --verdicts")
    else:
        within = None if options.within is None else options.within * u.au
        rows, lines, count = [], [], 0
        for name in planets:
            rates = encounter_rates(orbits, name, within)
            count = len(rates.rate)
            met = rates.rate.value > 0.0
            total = float(rates.total.to_value(1 / u.yr))
            weight = rates.weight[met] * rates.rate.value[met]
            speed = float((weight * rates.v_inf.value[met]).sum() / total) if total > 0.0 else None
            rows.append(
                {
                    "planet": rates.planet.name,
                    "periapsis_km": float(rates.periapsis.to_value(u.km)),
                    "rate_per_yr": total,
                    "orbits_that_meet": int(met.sum()),
                    "v_inf_km_s": speed,
                }
            )
            mean = "" if speed is None else f"   v_inf {speed:.1f} km/s (mean)"
            lines.append(
                f"{rates.planet.name:8s} {_interval(total)}   {number_of(int(met.sum()), 'orbit')}{mean}"
            )
        what = "encounters " + ("at the surface" if within is None else f"within {options.within:g} au")
    show(
        options,
        lambda: document("rates", source=source, orbits=count, rows=rows),
        lambda: [f"{source} ({number_of(count, 'orbit')}): {what}", *lines],
    )


def _verdicts(
    options: argparse.Namespace, orbits: QTable, planets: list[str]
) -> tuple[list[Document], list[str], int]:
    """Rows of the document, lines of the text, and the number of orbits."""
    from pathlib import Path

    import astropy.units as u

    from flybystab.body.body import Material
    from flybystab.plots.formats import FIGURES
    from flybystab.population.disruption import disruption_rates
    from flybystab.population.rates import encounter_rates
    from flybystab.screening.priors import Population
    from flybystab.screening.results import WRITTEN
    from flybystab.screening.table_files import check_output

    output = None if options.output is None else Path(options.output)
    figure = output is not None and output.suffix in FIGURES
    if output is not None and not figure:
        if output.suffix not in WRITTEN:
            raise InvalidInput(
                "--output", str(output), f"a file that ends in {', '.join((*FIGURES, *WRITTEN))}"
            )
        check_output(output, WRITTEN)
    result = disruption_rates(
        orbits,
        planets,
        diameter=_diameter(options.diameter),
        samples=options.samples,
        seed=options.seed,
        material=Material(yield_surface=options.surface),
        priors=None if options.population is None else Population.from_file(options.population),
        grains=options.grains,
        journal=None if output is None else output.with_name(output.name + ".journal"),
    )
    if figure and output is not None:
        from flybystab.plots.population import population_figure
        from flybystab.plots.style import save

        names = orbits["designation"] if "designation" in orbits.colnames else None
        save(population_figure(result, [encounter_rates(orbits, name) for name in planets], names), output)
    elif output is not None:
        from flybystab.screening.tables import write_table

        write_table(result.samples, output)
    rows: list[Document] = [
        {
            "planet": str(row["planet"]),
            "verdict": str(row["verdict"]),
            "rate_per_yr": float(row["rate"].to_value(1 / u.yr)),
            "rate_error_per_yr": float(row["rate_error"].to_value(1 / u.yr)),
        }
        for row in result.table
    ]
    lines = [f"{row['planet']:8s} {row['verdict']:18s} {_interval(row['rate_per_yr'])}" for row in rows]
    changed = result.changed_fraction(1 * u.Myr)
    lines.append(f"reshaped or worse in a million years: {changed:.2g} of the population")
    lines += [f"{'figure' if figure else 'samples'}  {output}"] if output is not None else []
    return rows, lines, len(orbits)


def _diameter(text: str) -> Quantity | None:
    """Diameter from the option: a number of km, or H."""
    import astropy.units as u

    if text == "H":
        return None
    try:
        return float(text) * u.km
    except ValueError:
        raise InvalidInput(
            "--diameter", text, "a number of km, or H for sizes from absolute magnitudes"
        ) from None


def _interval(rate: float) -> str:
    """A rate per year, and the mean interval between events."""
    return f"{rate:9.3e} /yr   one in {1.0 / rate:.3g} yr" if rate > 0.0 else f"{rate:9.3e} /yr"


def _orbits(options: argparse.Namespace) -> Orbits:
    """Orbits of a population file or a catalogue; without a file, the known near-Earth asteroids."""
    from flybystab.catalogues.catalogue import catalogue
    from flybystab.population.model_population import is_population, known_population, read_population

    if options.file is None:
        return known_population(options.limit)
    columns = None if options.columns is None else [c.strip() for c in options.columns.split(",")]
    if columns is not None or is_population(options.file):
        return read_population(options.file, columns=columns, seed=options.seed)
    return catalogue(options.file)
