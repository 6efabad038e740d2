"""Options for the body of an asteroid: ``--axes --diameter --H --density ...``, with errors (``200+-20 m``)."""

from __future__ import annotations

import argparse
import re
from typing import TYPE_CHECKING

from flybystab.errors import InvalidInput

if TYPE_CHECKING:
    from astropy.units import Quantity

    from flybystab.catalogues.asteroid import Asteroid
    from flybystab.screening.priors import Population

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_VALUE = re.compile(rf"\s*({_NUMBER})\s*(?:(?:\+-|\+/-|±)\s*({_NUMBER}))?\s*(.*?)\s*")


#: Expected value of --axes.
AXES_EXAMPLE = "one or three semi-axes: '200x170x150+-10 m'"


class Measured(float):
    """A number with its 1-sigma error; zero if none is given."""

    sigma: float = 0.0


def measured(text: str, unit: str, name: str) -> Measured:
    """Read ``35``, ``35 deg`` or ``35+-5 deg``; a number without a unit is in `unit`.

    Raises
    ------
    InvalidInput
        The text is not a number with an error, or has a unit of another dimension.
    """
    import astropy.units as u

    found = _VALUE.fullmatch(text)
    example = f"a value such as 20 {unit} or 20+-2 {unit}"
    if found is None:
        raise InvalidInput(name, text, example)
    value, sigma, given = found.groups()
    try:
        factor = u.Unit(given).to(u.Unit(unit)) if given else 1.0
    except (ValueError, TypeError, u.UnitConversionError):
        raise InvalidInput(name, text, example) from None
    out = Measured(float(value) * factor)
    out.sigma = abs(float(sigma or 0.0)) * factor
    return out


def friction(text: str) -> Measured:
    """Value of --friction, deg."""
    return _typed(text, "deg", "--friction")


def cohesion(text: str) -> Measured:
    """Value of --cohesion, Pa."""
    return _typed(text, "Pa", "--cohesion")


def distance(text: str) -> float:
    """Value of --within, au: a number, or one with a unit of length such as ``1e6 km`` or ``5 R_earth``."""
    try:
        return float(text)  # nan and infinity are refused with the other arguments
    except ValueError:
        pass
    try:
        found = measured(text, "au", "--within")
    except InvalidInput:
        found = None
    if found is None or found.sigma:
        raise argparse.ArgumentTypeError(f"{text}: expected a distance such as 0.05 au or '1e6 km'")
    return float(found)


def _typed(text: str, unit: str, name: str) -> Measured:
    try:
        return measured(text, unit, name)
    except InvalidInput as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def body_arguments(sub: argparse.ArgumentParser) -> None:
    """Add the options of the body."""
    sub.add_argument(
        "--phys",
        action="append",
        metavar="FILE",
        help="file of physical parameters: SBDB answer, SsODNet card, DAMIT spin.txt, LCDB or spin solutions as CSV; "
        "may be repeated",
    )
    sub.add_argument("--axes", metavar="AxBxC", help="semi-axes: '200x170x150+-10 m', '0.2 km' for a sphere")
    sub.add_argument(
        "--diameter", metavar="D", help="diameter; known semi-axes are scaled to it: '340+-40 m'"
    )
    sub.add_argument("--H", metavar="H", help="absolute magnitude, from which --assume derives the size")
    sub.add_argument("--density", metavar="RHO", help="density: '2000+-300 kg/m3', '2 g/cm3'")
    sub.add_argument("--period", metavar="P", help="spin period: '5.3+-0.1 h'")
    sub.add_argument(
        "--pole", metavar="LON,LAT", help="ecliptic longitude and latitude of the spin pole, deg"
    )
    sub.add_argument(
        "--assume",
        action="store_true",
        help="take missing properties from the priors of screen: medians, or samples in a report",
    )


def check_body_options(options: argparse.Namespace) -> None:
    """Check the values of the options; raises InvalidInput if one is invalid."""
    _given(options)


def _axes(text: str) -> tuple[list[float], list[float]]:
    """Semi-axes and their errors (m); an error or unit at the end applies to all of them."""
    parts = re.split(r"\s*[x×]\s*", text.strip())
    if len(parts) not in (1, 3):
        raise InvalidInput("--axes", text, AXES_EXAMPLE)
    tail = re.fullmatch(rf"(.*?)((?:\s*(?:\+-|\+/-|±)\s*{_NUMBER})?)\s*([A-Za-z]*)", parts[-1])
    assert tail is not None
    error, unit = tail.group(2), tail.group(3)
    whole = []
    for part in parts[:-1]:
        has_unit = re.search(r"[A-Za-z]\s*$", part) is not None
        has_error = re.search(r"\+-|\+/-|±", part) is not None
        whole.append(part + ("" if has_error or has_unit else error) + ("" if has_unit else unit))
    try:
        found = [measured(part, "m", "--axes") for part in (*whole, parts[-1])]
    except InvalidInput:
        raise InvalidInput("--axes", text, AXES_EXAMPLE) from None
    found = sorted(found * (3 if len(found) == 1 else 1), reverse=True)
    return [float(x) for x in found], [x.sigma for x in found]


def _given(options: argparse.Namespace) -> tuple[dict[str, str], list[str]]:
    """Catalogue columns of the given options, and the names of these options."""
    import astropy.units as u

    from flybystab.catalogues.given import error_columns, pole_columns
    from flybystab.catalogues.record import SHAPE

    row: dict[str, str] = {}
    names = []
    sigmas: dict[str, Quantity] = {}
    if getattr(options, "axes", None) is not None:
        axes, errors = _axes(options.axes)
        row |= dict(zip(SHAPE, map(repr, axes), strict=True)) | {
            "shape_kind": "measured",
            "diameter_sigma_m": "",
        }
        row["diameter_m"] = repr(float(2.0 * (axes[0] * axes[1] * axes[2]) ** (1.0 / 3.0)))
        sigmas["axes"] = errors * u.m
        names += ["axes"]
        row["semi_axes_source"] = "--axes"
    if getattr(options, "H", None) is not None:
        row["H_mag"] = repr(float(measured(options.H, "mag", "--H")))
        names += ["H"]
    if getattr(options, "diameter", None) is not None:
        if "axes" in names:
            raise InvalidInput("--diameter", options.diameter, "a diameter or --axes, not both")
        size = measured(options.diameter, "m", "--diameter")
        row |= {"diameter_m": repr(float(size)), "diameter_source": "--diameter"}
        row["diameter_sigma_m"] = repr(size.sigma) if size.sigma else ""
        names += ["diameter"]
    for key, column, unit in (
        ("density", "density_kg_m3", "kg/m3"),
        ("period", "spin_period_h", "h"),
    ):
        text = getattr(options, key, None)
        if text is None:
            continue
        value = measured(text, unit, f"--{key}")
        row[column] = repr(float(value))
        sigmas[key] = value.sigma * u.Unit(unit)
        names += [key]
    if "density" in names:
        row["density_source"] = "--density"
    if "period" in names:
        row |= {"spin_state": "principal", "spin_source": "--period"}
        row |= dict.fromkeys(("tumbling_mode", "precession_period_h", "rotation_period_h"), "")
    if getattr(options, "pole", None) is not None:
        try:
            longitude, latitude = (float(x) for x in options.pole.removesuffix("deg").split(","))
        except ValueError:
            raise InvalidInput(
                "--pole", options.pole, "ecliptic longitude and latitude in deg: 120,-45"
            ) from None
        row |= pole_columns([longitude, latitude] * u.deg) | {"pole_source": "--pole"}
        names += ["pole"]
    row |= error_columns(sigmas)
    return row, names


def with_body_options(asteroid: Asteroid, options: argparse.Namespace) -> Asteroid:
    """The asteroid with the values of the options."""
    from dataclasses import replace

    if getattr(options, "phys", None):
        asteroid = asteroid.with_physical(*options.phys)
    row, names = _given(options)
    if not names:
        return asteroid
    if "period" in names or "pole" in names:
        row["spin_solutions"] = ""
    if "diameter" in names:
        from flybystab.catalogues.physical import body_of

        row = body_of(asteroid, row)
    columns = {**asteroid.row, **row}
    columns["assumed"] = ";".join(c for c in asteroid.assumed if c not in row)
    return replace(asteroid, row=columns)


def population_of(options: argparse.Namespace) -> Population | None:
    """The population of a screening, with the errors of --friction and --cohesion; None without errors."""
    from flybystab.screening.distributions import Distribution
    from flybystab.screening.priors import Population

    changes: dict[str, Distribution] = {}
    for name, key, high in (("friction", "friction_angle_deg", 89.0), ("cohesion", "cohesion_Pa", None)):
        value = getattr(options, name, None)
        if isinstance(value, Measured) and value.sigma > 0.0:
            changes[key] = Distribution("normal", mean=float(value), sd=value.sigma, low=0.0, high=high)
    if not changes:
        return None
    default = Population()
    return Population(
        friction_angle_deg=changes.get("friction_angle_deg", default.friction_angle_deg),
        cohesion_Pa=changes.get("cohesion_Pa", default.cohesion_Pa),
    )
