"""Maps on polyhedral shapes: a quantity by facet, seen along the principal axes."""

from __future__ import annotations

from typing import Any

import astropy.units as u
import numpy as np
from astropy.units import Quantity
from numpy.typing import NDArray

from flybystab.body.shape import Shape
from flybystab.body.surface_slope import SlopeChange

#: Directions of view, with the image's right and up: from +x, +y and +z of the principal frame.
VIEWS = (("+x", 0, (1, 2)), ("+y", 1, (0, 2)), ("+z", 2, (0, 1)))


def shape_map(
    axes: Any,
    shape: Shape,
    values: NDArray[np.float64],
    view: str = "+z",
    *,
    limits: tuple[float, float] | None = None,
    cmap: str = "viridis",
) -> Any:
    """A quantity on the facets that face the viewer, in orthographic projection.

    Parameters
    ----------
    axes : matplotlib Axes
    shape : Shape
    values : ndarray (f,)
        By facet.
    view : str
        ``"+x"``, ``"+y"`` or ``"+z"``: the axis that points to the viewer.
    limits : (float, float), optional
        Of the colours.
    cmap : str

    Returns
    -------
    PolyCollection
        For a colour bar.
    """
    from matplotlib.collections import PolyCollection

    _, depth, (right, up) = next(v for v in VIEWS if v[0] == view)
    mirror = -1.0 if view == "+y" else 1.0  # x runs to the left when seen from +y with z up
    facing = shape.normals[:, depth] > 0.0
    order = np.argsort(shape.centroids.value[facing, depth])
    corners = shape.vertices.value[shape.facets[facing][order]]
    drawn = PolyCollection(
        list(np.stack([mirror * corners[:, :, right], corners[:, :, up]], axis=-1)),
        array=np.asarray(values, dtype=float)[facing][order],
        cmap=cmap,
        edgecolors="face",
        linewidths=0.2,
    )
    if limits is not None:
        drawn.set_clim(*limits)
    axes.add_collection(drawn)
    axes.set_aspect("equal")
    axes.autoscale_view()
    names = "xyz"
    axes.set_xlabel(f"{'-' if mirror < 0 else ''}{names[right]} (m)")
    axes.set_ylabel(f"{names[up]} (m)")
    axes.set_title(f"seen from {view}", fontsize=9)
    return drawn


def slope_change_figure(shape: Shape, change: SlopeChange, repose: Quantity = 35 * u.deg) -> Any:
    """Slopes before an encounter, the greatest during it, and the largest change, in three views each.

    Parameters
    ----------
    shape : Shape
    change : SlopeChange
        Of :func:`flybystab.surface_change` with this shape.
    repose : Quantity
        Angle of repose; the title says which share of the area passes it.

    Returns
    -------
    matplotlib Figure
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 7.5), layout="constrained")
    grid = figure.subplots(3, 3)
    steepest = float(change.greatest.max().to_value(u.deg))
    rows = (
        ("slope before (deg)", change.before, (0.0, steepest), "viridis"),
        ("greatest slope (deg)", change.greatest, (0.0, steepest), "viridis"),
        ("largest change (deg)", change.change, None, "magma"),
    )
    for row, (label, values, limits, cmap) in zip(grid, rows, strict=True):
        number = values.to_value(u.deg)
        span = limits or (0.0, float(number.max()))
        for axes, (view, _, _) in zip(row, VIEWS, strict=True):
            drawn = shape_map(axes, shape, number, view, limits=span, cmap=cmap)
        figure.colorbar(drawn, ax=list(row), label=label)
    share = 100.0 * change.share_passing(repose)
    figure.suptitle(f"{share:.2g} % of the area passes {repose.to_value(u.deg):g} deg", fontsize=10)
    return figure
