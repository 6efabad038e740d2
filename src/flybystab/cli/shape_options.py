"""The option ``--shape`` of the commands: an asteroid with a polyhedral shape from a file."""

from __future__ import annotations

import argparse
from functools import lru_cache
from typing import TYPE_CHECKING

from flybystab.errors import WrongUsage
from flybystab.plots.formats import FIGURES

if TYPE_CHECKING:
    from flybystab.body.body import Body
    from flybystab.body.shape import Shape
    from flybystab.body.shape_slope import SurfaceSlopes
    from flybystab.body.surface_history import SurfaceHistory
    from flybystab.catalogues.asteroid import Asteroid
    from flybystab.flybys.result import FlybyResult

#: Value of --shape-unit for shape models without a scale: the shape is given the catalogued volume.
CATALOGUE = "catalogue"


def shape_arguments(sub: argparse.ArgumentParser) -> None:
    """Add the options of the shape."""
    sub.add_argument(
        "--shape",
        metavar="FILE",
        help="shape model of the asteroid (OBJ, PLY, STL, PDS or ICQ table, DAMIT shape.txt)",
    )
    sub.add_argument(
        "--shape-unit",
        metavar="UNIT",
        default="km",
        help=f"unit of the coordinates in --shape; {CATALOGUE}: scale to the catalogued volume (km)",
    )


def map_argument(sub: argparse.ArgumentParser) -> None:
    """Add the option --map."""
    sub.add_argument(
        "--map",
        metavar="FILE",
        help="with --shape: write a map of the slopes (.png, .svg, .pdf) or a mesh with fields (.vtk, .ply)",
    )


def shaped(asteroid: Asteroid, options: argparse.Namespace) -> Asteroid:
    """The asteroid with the shape of the options, if one is given."""
    if getattr(options, "shape", None) is None:
        return asteroid
    return asteroid.with_shape(shape_of(options, asteroid.body))


def shape_of(options: argparse.Namespace, body: Body) -> Shape:
    """The shape of the options; ``--shape-unit catalogue`` gives it the volume of the body."""
    if options.shape_unit != CATALOGUE:
        return _read(options.shape, options.shape_unit)
    return _read(options.shape, "m").scaled(volume=body.volume)


@lru_cache(maxsize=2)
def _read(path: str, unit: str) -> Shape:
    from flybystab.body.shape import Shape, length_unit

    return Shape.read(path, unit=length_unit(unit, "--shape-unit"))


def check_map(options: argparse.Namespace) -> None:
    """Check, before the computation, that the map can be written."""
    from flybystab.cli.common import check_picture

    if options.map is not None and options.shape is None:
        raise WrongUsage("--map: expected only with --shape")
    check_picture(options.map, (*FIGURES, ".vtk", ".ply"))


def surface_of(options: argparse.Namespace, result: FlybyResult) -> SurfaceHistory | None:
    """Surface of the shape through a computed flyby; None without a shape."""
    if options.shape is None:
        return None
    from flybystab.flybys.surface_history import history_of

    return history_of(result.inputs, shape_of(options, result.inputs.body))


def write_map(options: argparse.Namespace, surface: SurfaceHistory | None) -> None:
    """Write the map of ``--map``."""
    if options.map is None or surface is None:
        return
    if options.map.lower().endswith((".vtk", ".ply")):
        surface.shape.write(options.map, surface.fields())
    else:
        from flybystab.io.surface_text import REPOSE
        from flybystab.plots.shape_map import surface_history_figure

        surface_history_figure(surface, REPOSE).savefig(options.map, dpi=130)


def rest_slopes(options: argparse.Namespace, body: Body) -> SurfaceSlopes | None:
    """Slopes of the shape at the spin of the body, without a tide; None without a shape."""
    if options.shape is None:
        return None
    from flybystab.body.shape_slope import shape_slopes

    return shape_slopes(shape_of(options, body), body)
