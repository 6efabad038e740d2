"""Code shared by several commands: arguments, dates, asteroids, and output as text or JSON."""

from __future__ import annotations

import argparse
import json
import os
import re
import sys
import unicodedata
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from flybystab._version import __version__
from flybystab.cli.body_options import cohesion, distance, friction, with_body_options
from flybystab.core.material.surfaces import DEFAULT, NAMES
from flybystab.errors import InvalidInput, NothingComputed, WrongUsage
from flybystab.plots.formats import FIGURES, FILMS

if TYPE_CHECKING:
    from astropy.time import Time

    from flybystab.body.body import Material
    from flybystab.catalogues.asteroid import Asteroid
    from flybystab.flybys.result import FlybyResult
    from flybystab.typing import Document

#: Yield surfaces, the default first.
SURFACES = (DEFAULT, *(name for name in NAMES if name != DEFAULT))


def material_arguments(sub: argparse.ArgumentParser) -> None:
    """Add the options --friction, --cohesion and --surface of the material."""
    sub.add_argument(
        "--friction",
        type=friction,
        default=35.0,
        metavar="DEG",
        help="friction angle, e.g. 38 or 35+-5 (35 deg)",
    )
    sub.add_argument(
        "--cohesion", type=cohesion, default=0.0, metavar="PA", help="cohesion, e.g. '20+-10 Pa' (0 Pa)"
    )
    surface_argument(sub)


def surface_argument(sub: argparse.ArgumentParser) -> None:
    """Add the option --surface."""
    default, *others = SURFACES
    sub.add_argument(
        "--surface", default=default, metavar="NAME", help=f"yield surface ({default}; {', '.join(others)})"
    )


def dates_arguments(sub: argparse.ArgumentParser, start: str, stop: str) -> None:
    """Add the options --from and --to."""
    sub.add_argument("--from", dest="start", default=start, metavar="DATE", help=f"first date, TDB ({start})")
    sub.add_argument("--to", dest="stop", default=stop, metavar="DATE", help=f"last date, TDB ({stop})")


def span_arguments(sub: argparse.ArgumentParser, start: str, stop: str) -> None:
    """Add the options of a search for encounters: dates, planets, maximum distance."""
    dates_arguments(sub, start, stop)
    sub.add_argument("--planet", action="append", help="planet; may be repeated (earth)")
    sub.add_argument(
        "--within",
        type=distance,
        default=0.05,
        metavar="AU",
        help="maximum distance (0.05 au), or '1e6 km'",
    )


def figure_argument(sub: argparse.ArgumentParser, films: bool = False) -> None:
    """Add the options --output and --style for a figure; `films` allows an animation as well."""
    film = f" or an animation ({', '.join(FILMS)})" if films else ""
    sub.add_argument("--output", metavar="FILE", help=f"write a figure ({', '.join(FIGURES)}){film}")
    style_argument(sub)


def style_argument(sub: argparse.ArgumentParser) -> None:
    """Add the option --style of figures."""
    sub.add_argument(
        "--style",
        choices=("default", "paper", "talk"),
        default="default",
        help="style of the figure: paper (8 pt, width of journal columns) or talk (large text and lines)",
    )


def movie_argument(sub: argparse.ArgumentParser) -> None:
    """Add the option --movie."""
    sub.add_argument("--movie", metavar="FILE", help=f"also write an animation ({', '.join(FILMS)})")


def show(options: argparse.Namespace, document: Callable[[], object], lines: Callable[[], list[str]]) -> None:
    """Print a result: one JSON document with ``--json``, text otherwise."""
    if options.json:
        print(json.dumps(document(), indent=1, allow_nan=False))
    else:
        print("\n".join(_coloured(printable(line)) for line in lines()))


def document(kind: str, **content: object) -> Document:
    """Document of a kind in :data:`flybystab.io.schema.NAMES`, with its schema and the version of the package."""
    from flybystab.flybys.document import plain

    return plain({"schema": f"{kind}/1", "flybystab": __version__, **content})


def printable(text: str) -> str:
    """The text with control characters and changes of writing direction escaped.

    Names come from files; without this, an escape sequence in the name of an asteroid could control the terminal or
    hide other text.
    """
    return "".join(
        c
        if c in "\n\t" or unicodedata.category(c) not in ("Cc", "Cf")
        else c.encode("unicode_escape").decode()
        for c in text
    )


def check_computed(rows: int, failed: int, reasons: Mapping[str, int]) -> None:
    """Raise NothingComputed if all rows of a table failed; `reasons` counts each reason, the most common first."""
    if rows and failed == rows:
        reason, n = next(iter(reasons.items()), ("unknown reason", rows))
        raise NothingComputed(f"none of the rows could be computed ({rows}, of which {n}: {reason})")


def _coloured(line: str) -> str:
    """The line; in bold if it is the verdict and stdout is a terminal, unless NO_COLOR is set."""
    if not line.startswith("verdict") or os.environ.get("NO_COLOR") or not sys.stdout.isatty():
        return line
    return f"\033[1m{line}\033[0m"


def tdb(text: str, name: str) -> Time:
    """Parse a date, TDB, into an astropy Time; `name` is the argument in the error message."""
    from flybystab.units import checked_time

    return checked_time(text, name)


def material_of(options: argparse.Namespace) -> Material:
    """Material specified by the options."""
    import astropy.units as u

    from flybystab.body.body import Material

    return Material(
        friction_angle=float(options.friction) * u.deg,
        cohesion=float(options.cohesion) * u.Pa,
        yield_surface=options.surface,
    )


def sampling_arguments(
    sub: argparse.ArgumentParser, samples: int, what: str, *, population: str, grains: str
) -> None:
    """Add the options --samples, --seed, --population and --grains of commands that sample bodies from priors."""
    sub.add_argument("--samples", type=int, default=samples, metavar="N", help=f"{what} ({samples})")
    sub.add_argument("--seed", type=int, default=0, help="random seed (0)")
    sub.add_argument("--population", metavar="FILE", help=population)
    sub.add_argument("--grains", type=int, metavar="N", help=grains)


def names_a_file(word: str) -> bool:
    """Whether an argument that may be an asteroid or a file is the name of a file.

    It is a file name if the file exists, if it has a suffix, or if it is a path in an existing folder. Comet
    designations such as C/2020 F3 are not file names.
    """
    from pathlib import Path

    path = Path(word)
    if path.exists():
        return not path.is_dir()
    return bool(re.search(r"\.[A-Za-z][A-Za-z0-9]{1,7}$", word)) or ("/" in word and path.parent.is_dir())


def catalogue_argument(sub: argparse.ArgumentParser) -> None:
    """Add the option --catalogue."""
    sub.add_argument(
        "--catalogue",
        metavar="FILE",
        help="catalogue file in any format of docs/inputs.md, instead of the embedded catalogue",
    )


def asteroid_named(options: argparse.Namespace) -> Asteroid:
    """The asteroid from the embedded catalogue, from --catalogue, or from a file with a single orbit."""
    from pathlib import Path

    from flybystab.catalogues.asteroid import Asteroid
    from flybystab.catalogues.catalogue import find
    from flybystab.screening.selection import listed

    file = getattr(options, "catalogue", None)
    if file is None and names_a_file(options.name):
        found = listed(Path(options.name))
        if len(found) != 1:
            names = ", ".join(a.name for a in found[:5]) + (", ..." if len(found) > 5 else "")
            raise WrongUsage(
                f"{options.name} contains {len(found)} asteroids ({names}): expected NAME --catalogue {options.name}"
            )
        return found[0]
    return (
        Asteroid.from_catalogue(options.name)
        if file is None
        else find(listed(Path(file)), options.name, file)
    )


def asteroid_of(options: argparse.Namespace, *, assume: bool = True) -> Asteroid:
    """The asteroid with body and material of the options; missing properties are completed if --assume is given.

    With ``assume=False`` they are left missing, for commands that sample them.
    """
    from flybystab.cli.shape_options import shaped

    asteroid = with_body_options(asteroid_named(options), options).with_material(material_of(options))
    if assume and getattr(options, "assume", False):
        from flybystab.screening.draws import completed

        asteroid = completed(asteroid)
    return shaped(asteroid, options)


def check_picture(path: str | None, endings: tuple[str, ...] = FIGURES, option: str = "--output") -> None:
    """Check, before the computation, that its figure or page can be written."""
    if path is None:
        return
    from pathlib import Path

    target = Path(path)
    if target.suffix.lower() not in endings:
        raise WrongUsage(f"{option} = {path}: expected a file that ends in {' or '.join(endings)}")
    if not target.parent.is_dir() or not os.access(target.parent, os.W_OK):
        raise InvalidInput(option, path, "a folder that exists and can be written")


def check_table(path: str | None, formats: tuple[str, ...] = ()) -> None:
    """Check, before the computation, that its table can be written."""
    if path is None:
        return
    from flybystab.screening.results import WRITTEN
    from flybystab.screening.table_files import check_output

    formats = formats or WRITTEN
    if not path.endswith(formats):
        raise WrongUsage(f"--output = {path}: expected a file that ends in {' or '.join(formats)}")
    check_output(path, formats)


def grains_arguments(sub: argparse.ArgumentParser) -> None:
    """Add the options --grains and --piles."""
    sub.add_argument(
        "--grains", type=int, metavar="N", help="continue with piles of N grains beyond the ellipsoid model"
    )
    sub.add_argument("--piles", type=int, default=8, metavar="N", help="number of piles of grains (8)")


def write_picture(result: FlybyResult, title: str, path: str) -> None:
    """Write the figure of a flyby or of its piles of grains, or an animation, depending on the suffix."""
    if result.grains is not None:
        from flybystab.plots.grains import grains_animation, grains_figure

        if path.lower().endswith(FILMS):
            grains_animation(result, path, title)
        else:
            grains_figure(result, title, path)
    elif path.lower().endswith(FILMS):
        from flybystab.plots.scene import animation

        animation(result, path, title)
    else:
        from flybystab.plots.flyby import flyby_figure

        flyby_figure(result, title, path)
