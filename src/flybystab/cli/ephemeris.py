"""``flybystab ephemeris NAME``: apparent positions of an asteroid for an observer on the Earth."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from flybystab.cli.common import asteroid_named, dates_arguments, show, tdb
from flybystab.errors import InvalidInput, WrongUsage

if TYPE_CHECKING:
    from astropy.table import QTable
    from astropy.time import Time

HELP = "apparent positions of an asteroid in the sky"
EXAMPLE = "flybystab ephemeris Apophis --from 2029-04-10 --to 2029-04-15 --step 6h --observer 568"
#: Largest number of positions in one table.
LARGEST = 100_000
_UNITS = {"d": 86400.0, "h": 3600.0, "m": 60.0, "s": 1.0}


def arguments(sub: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    sub.add_argument("name", help="number, name or designation")
    dates_arguments(sub, "2029-04-01", "2029-05-01")
    sub.add_argument("--step", default="1d", metavar="TIME", help="interval, such as 6h, 10m, 30s (1d)")
    sub.add_argument(
        "--observer",
        default="500",
        metavar="PLACE",
        help="MPC code, or LAT,LON[,ALT] in deg, deg east, m (500, the geocentre); southern latitudes need an equals "
        "sign: --observer=-30.2,-70.8,2200",
    )
    sub.add_argument("--output", metavar="FILE", help="write the table (.ecsv, .parquet, .csv)")


def run(options: argparse.Namespace) -> None:
    """Execute the command."""
    from flybystab.cli.common import check_table
    from flybystab.flybys.document import table_document
    from flybystab.orbit.observation import sky_positions
    from flybystab.orbit.observatories import observer
    from flybystab.screening.tables import write_table

    step = _seconds(options.step)
    check_table(options.output)
    times = _times(tdb(options.start, "--from"), tdb(options.stop, "--to"), step)
    place = observer(options.observer)
    asteroid = asteroid_named(options)
    table = sky_positions(
        asteroid.orbit, times, place, _number(asteroid.row.get("H_mag")), _number(asteroid.row.get("G_slope"))
    )
    if options.output:
        write_table(table, options.output)
    show(options, lambda: table_document(table), lambda: _lines(asteroid.label, table, options.output))


def _seconds(text: str) -> float:
    """An interval such as ``6h`` in seconds."""
    try:
        value = float(text[:-1]) * _UNITS[text[-1:].lower()]
    except (ValueError, KeyError):
        value = 0.0
    if not 0.0 < value < 1e12:
        raise WrongUsage(f"--step = {text}: expected a positive number with d, h, m or s")
    return value


def _times(start: Time, stop: Time, step: float) -> Time:
    import numpy as np
    from astropy.time import TimeDelta

    length = (stop - start).sec
    if not length >= 0.0:
        raise InvalidInput("--to", stop.iso, f"a date not before --from, {start.iso}")
    count = int(length / step + 1e-9) + 1
    if count > LARGEST:
        raise InvalidInput("--step", f"{step:g} s", f"at most {LARGEST} positions, here {count}")
    return start + TimeDelta(np.arange(count) * step, format="sec")


def _number(text: str | None) -> float | None:
    return float(text) if text else None


def _lines(label: str, table: QTable, output: str | None) -> list[str]:
    """The table as text, with sexagesimal positions."""
    import astropy.units as u
    from astropy.coordinates import Angle

    ground = "altitude" in table.colnames
    ra = Angle(table["ra"]).to_string(u.hourangle, sep=" ", precision=2, pad=True)
    dec = Angle(table["dec"]).to_string(u.deg, sep=" ", precision=1, pad=True, alwayssign=True)
    out = [
        f"{label}: apparent places (true equator and equinox of date) from {table.meta['observer']}, "
        f"{table.meta['ephemeris'].upper()}",
        f"{'time (TDB)':19s} {'RA (h m s)':>11s} {'Dec (d m s)':>11s} {'dist (au)':>10s} {'Sun (au)':>8s} "
        f"{'dRA cosD':>9s} {'dDec':>9s} {'phase':>5s} {'elong':>5s} {'V':>5s}"
        + (f" {'alt':>5s} {'az':>5s}" if ground else ""),
        f"{'':19s} {'':>11s} {'':>11s} {'':>10s} {'':>8s} {'arcsec/min':>19s} {'deg':>5s} {'deg':>5s} {'mag':>5s}"
        + (f" {'deg':>5s} {'deg':>5s}" if ground else ""),
    ]
    for k, row in enumerate(table):
        v = row["V"].value
        out.append(
            f"{row['time'].iso[:19]:19s} {ra[k]:>11s} {dec[k]:>11s} {row['distance'].value:10.6f} "
            f"{row['sun_distance'].value:8.4f} {row['ra_rate'].value:9.3f} {row['dec_rate'].value:9.3f} "
            f"{row['phase'].value:5.1f} {row['elongation'].value:5.1f} {f'{v:5.1f}' if v == v else '    -'}"
            + (f" {row['altitude'].value:5.1f} {row['azimuth'].value:5.1f}" if ground else "")
        )
    return [*out, *([f"table      {output}"] if output else [])]
