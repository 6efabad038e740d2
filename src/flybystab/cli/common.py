"""What several commands share: arguments, dates, asteroids, and the two ways of printing a result."""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Callable, Mapping
from typing import Any

from flybystab.errors import InvalidInput, NothingComputed, WrongUsage
from flybystab.plots.formats import FIGURES, FILMS

#: Yield surfaces, the default first (named here as well: importing `Material` takes as long as ``--help``).
SURFACES = ("mohr-coulomb", "matsuoka-nakai", "drucker-prager", "drucker-prager-extension")


def material_arguments(sub: argparse.ArgumentParser) -> None:
    """Add the material: friction, cohesion, yield surface."""
    sub.add_argument("--friction", type=float, default=35.0, metavar="DEG", help="friction angle (35 deg)")
    sub.add_argument("--cohesion", type=float, default=0.0, metavar="PA", help="cohesion (0 Pa)")
    surface_argument(sub)


def surface_argument(sub: argparse.ArgumentParser) -> None:
    """Add the yield surface."""
    default, *others = SURFACES
    sub.add_argument(
        "--surface", default=default, metavar="NAME", help=f"yield surface ({default}; {', '.join(others)})"
    )


def dates_arguments(sub: argparse.ArgumentParser, start: str, stop: str) -> None:
    """Add the first and the last date."""
    sub.add_argument("--from", dest="start", default=start, metavar="DATE", help=f"TDB ({start})")
    sub.add_argument("--to", dest="stop", default=stop, metavar="DATE", help=f"TDB ({stop})")


def span_arguments(sub: argparse.ArgumentParser, start: str, stop: str) -> None:
    """Add what a search for encounters needs: dates, planets, largest distance."""
    dates_arguments(sub, start, stop)
    sub.add_argument("--planet", action="append", help="planet to look for; repeat for more (earth)")
    sub.add_argument("--within", type=float, default=0.05, metavar="AU", help="largest distance (0.05 au)")


#: Endings of figures, and of animations.


def figure_argument(sub: argparse.ArgumentParser, films: bool = False) -> None:
    """Add the file of a figure, or of an animation."""
    film = f" or an animation ({', '.join(FILMS)})" if films else ""
    sub.add_argument("--output", metavar="FILE", help=f"write a figure ({', '.join(FIGURES)}){film}")


def show(options: argparse.Namespace, document: Callable[[], Any], lines: Callable[[], list[str]]) -> None:
    """Print a result: one JSON document with ``--json``, else lines for people."""
    if options.json:
        print(json.dumps(document(), indent=1, allow_nan=False))
    else:
        print("\n".join(_coloured(line) for line in lines()))


def check_computed(rows: int, failed: int, reasons: Mapping[str, int]) -> None:
    """Raise NothingComputed if every row of a table failed; `reasons`: how often each, the commonest first."""
    if rows and failed == rows:
        reason, n = next(iter(reasons.items()), ("no reason is known", rows))
        raise NothingComputed(f"none of the rows could be computed ({rows}, of which {n}: {reason})")


def _coloured(line: str) -> str:
    """The verdict in bold, on a terminal that wants colours."""
    if not line.startswith("verdict") or os.environ.get("NO_COLOR") or not sys.stdout.isatty():
        return line
    return f"\033[1m{line}\033[0m"


def tdb(text: str, name: str) -> Any:
    """A date in words as an astropy Time."""
    from astropy.time import Time

    try:
        return Time(text, scale="tdb")
    except ValueError:
        raise InvalidInput(name, text, "a date such as 2029-04-13, read as TDB") from None


def material_of(options: argparse.Namespace) -> Any:
    """The material asked for."""
    import astropy.units as u

    from flybystab.body.body import Material

    return Material(
        friction_angle=options.friction * u.deg,
        cohesion=options.cohesion * u.Pa,
        yield_surface=options.surface,
    )


def catalogue_argument(sub: argparse.ArgumentParser) -> None:
    """Add the file that an asteroid is looked up in."""
    sub.add_argument(
        "--catalogue",
        metavar="FILE",
        help="look the name up in this file (own CSV, JPL SBDB, MPC, NEOCC .ke1), not in the embedded catalogue",
    )


def asteroid_named(options: argparse.Namespace) -> Any:
    """The asteroid named, of the embedded catalogue or of the file given."""
    from pathlib import Path

    from flybystab.catalogues.asteroid import Asteroid
    from flybystab.catalogues.catalogue import find
    from flybystab.screening.selection import listed

    file = getattr(options, "catalogue", None)
    return (
        Asteroid.from_catalogue(options.name)
        if file is None
        else find(listed(Path(file)), options.name, file)
    )


def asteroid_of(options: argparse.Namespace) -> Any:
    """The asteroid named, with the material asked for."""
    return asteroid_named(options).with_material(material_of(options))


def check_picture(path: str | None, endings: tuple[str, ...] = FIGURES) -> None:
    """Find out that a picture (or page) cannot be written before computing it."""
    if path is None:
        return
    from pathlib import Path

    target = Path(path)
    if target.suffix.lower() not in endings:
        raise WrongUsage(f"--output = {path}: expected a file that ends in {' or '.join(endings)}")
    if not target.parent.is_dir() or not os.access(target.parent, os.W_OK):
        raise InvalidInput("--output", path, "a folder that exists and can be written")


def check_table(path: str | None) -> None:
    """Find out that a table cannot be written before computing it."""
    if path is None:
        return
    from flybystab.screening.results import FORMATS
    from flybystab.screening.table_files import check_output

    if not path.endswith(FORMATS):
        raise WrongUsage(f"--output = {path}: expected a file that ends in {' or '.join(FORMATS)}")
    check_output(path)


def write_picture(result: Any, title: str, path: str) -> None:
    """Write the panels of a flyby, or its animation, as the ending says."""
    if path.lower().endswith(FILMS):
        from flybystab.plots.scene import animation

        animation(result, path, title)
    else:
        from flybystab.plots.flyby import flyby_figure

        flyby_figure(result, title, path)
