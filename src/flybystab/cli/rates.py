"""``flybystab rates [FILE]``: encounter rates of a population, and what the encounters do."""

from __future__ import annotations

import argparse
from typing import Any

from flybystab._version import __version__
from flybystab.cli.common import show

HELP = "how often the asteroids of a population pass the planets, and with which verdicts"
EXAMPLE = "flybystab rates --planet earth --within 0.05"
#: Planets by default.
PLANETS = ("mercury", "venus", "earth", "mars")


def arguments(sub: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    sub.add_argument(
        "file",
        nargs="?",
        help="catalogue, or table (.ecsv, .csv) with columns a, e, i of a model population; embedded catalogue",
    )
    sub.add_argument("--planet", action="append", help=f"planet, repeatable ({', '.join(PLANETS)})")
    sub.add_argument("--within", type=float, metavar="AU", help="largest periapsis distance (au; surface)")
    sub.add_argument(
        "--verdicts", action="store_true", help="rates of the verdicts within 5 radii of each planet"
    )
    sub.add_argument(
        "--diameter", type=float, default=1.0, metavar="KM", help="of every body, for --verdicts (1 km)"
    )
    sub.add_argument("--samples", type=int, default=800, metavar="N", help="encounters drawn a planet (800)")
    sub.add_argument("--seed", type=int, default=0, help="random seed (0)")


def run(options: argparse.Namespace) -> None:
    """Execute the command."""
    import astropy.units as u

    from flybystab.population.disruption import disruption_rates
    from flybystab.population.rates import encounter_rates

    orbits = _orbits(options.file)
    planets = options.planet or list(PLANETS)
    source = options.file or "embedded catalogue"
    if options.verdicts:
        result = disruption_rates(
            orbits, planets, diameter=options.diameter * u.km, samples=options.samples, seed=options.seed
        )
        rows = [
            {
                "planet": str(row["planet"]),
                "verdict": str(row["verdict"]),
                "rate_per_yr": float(row["rate"].to_value(1 / u.yr)),
                "rate_error_per_yr": float(row["rate_error"].to_value(1 / u.yr)),
            }
            for row in result.table
        ]
        lines = [
            f"{row['planet']:8s} {row['verdict']:18s} {_interval(float(row['rate'].to_value(1 / u.yr)))}"
            for row in result.table
        ]
        count = result.bodies
        what = f"verdicts of bodies of {options.diameter:g} km within 5 radii"
    else:
        within = None if options.within is None else options.within * u.au
        rows, lines, count = [], [], 0
        for name in planets:
            rates = encounter_rates(orbits, name, within)
            count = len(rates.rate)
            met = rates.rate.value > 0.0
            total = float(rates.total.to_value(1 / u.yr))
            speed = (
                float((rates.rate.value[met] * rates.v_inf.value[met]).sum() / total) if total > 0.0 else None
            )
            rows.append(
                {
                    "planet": rates.planet.name,
                    "periapsis_km": float(rates.periapsis.to_value(u.km)),
                    "rate_per_yr": total,
                    "orbits_that_meet": int(met.sum()),
                    "v_inf_km_s": speed,
                }
            )
            said = "" if speed is None else f"   v_inf {speed:.1f} km/s (mean)"
            lines.append(f"{rates.planet.name:8s} {_interval(total)}   {int(met.sum())} orbits{said}")
        what = "encounters " + ("at the surface" if within is None else f"within {options.within:g} au")
    show(
        options,
        lambda: {"flybystab": __version__, "source": source, "orbits": count, "rows": rows},
        lambda: [f"{source} ({count} orbits): {what}", *lines],
    )


def _interval(rate: float) -> str:
    """A rate per year, and the mean time between two events."""
    return f"{rate:9.3e} /yr   one in {1.0 / rate:.3g} yr" if rate > 0.0 else f"{rate:9.3e} /yr"


def _orbits(path: str | None) -> Any:
    """Orbits of a file: a table with columns a, e, i, or any catalogue; the embedded catalogue without a file."""
    from flybystab.catalogues.catalogue import catalogue

    if path is None:
        return catalogue()
    from astropy.table import QTable

    from flybystab.files import read_text

    lines = [line for line in read_text(path, "population file").splitlines() if not line.startswith("#")]
    if lines and {"a", "e", "i"} <= set(lines[0].replace(",", " ").split()) and "pdes" not in lines[0]:
        return QTable.read(path, format="ascii.ecsv" if path.endswith(".ecsv") else "ascii.csv")
    return catalogue(path)
