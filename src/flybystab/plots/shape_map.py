"""Maps on polyhedral shapes: a quantity by facet, seen along the principal axes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import astropy.units as u
import numpy as np
from astropy.units import Quantity
from numpy.typing import NDArray

from flybystab.arguments import check_arguments
from flybystab.body.shape import Shape
from flybystab.body.surface_history import SurfaceHistory
from flybystab.body.surface_slope import SlopeChange
from flybystab.errors import InvalidInput
from flybystab.plots.style import NARROW, new_figure, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import PolyCollection
    from matplotlib.figure import Figure

#: Directions of view, with the image's right and up: from +x, +y and +z of the principal frame.
VIEWS = (("+x", 0, (1, 2)), ("+y", 1, (0, 2)), ("+z", 2, (0, 1)))


@check_arguments
def shape_map(
    axes: Axes,
    shape: Shape,
    values: NDArray[np.float64],
    view: str = "+z",
    *,
    limits: tuple[float, float] | None = None,
    cmap: str = "viridis",
) -> PolyCollection:
    """Plot a quantity on the facets that face the viewer, in orthographic projection.

    Parameters
    ----------
    axes : matplotlib Axes
    shape : Shape
    values : ndarray (f,)
        One value per facet.
    view : str
        ``"+x"``, ``"+y"`` or ``"+z"``: the axis that points to the viewer.
    limits : (float, float), optional
        Range of the colour scale.
    cmap : str

    Returns
    -------
    PolyCollection
        Mappable for a colour bar.
    """
    from matplotlib import colormaps
    from matplotlib.collections import PolyCollection

    if axes is None or view not in [v[0] for v in VIEWS]:
        raise InvalidInput("axes, view", (axes, view), f"matplotlib axes and one of {[v[0] for v in VIEWS]}")
    if np.shape(values) != (len(shape.facets),) or cmap not in colormaps:
        raise InvalidInput(
            "values, cmap", (np.shape(values), cmap), "one value per facet and the name of a colour map"
        )
    if limits is not None and (np.shape(limits) != (2,) or not limits[0] < limits[1]):
        raise InvalidInput("limits", limits, "two numbers, the lower first")
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
    axes.set_title(f"seen from {view}")
    return drawn


@styled
@check_arguments
def slope_change_figure(shape: Shape, change: SlopeChange, repose: Quantity = 35 * u.deg) -> Figure:
    """Slopes before an encounter, the greatest during it, and the largest change, in three views each.

    Parameters
    ----------
    shape : Shape
    change : SlopeChange
        Of :func:`flybystab.surface_change` with this shape.
    repose : Quantity
        Angle of repose; the title gives the fraction of the area that exceeds it.

    Returns
    -------
    matplotlib Figure
    """
    figure = new_figure(9.0, 7.5)
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
    figure.suptitle(f"slope rises above {repose.to_value(u.deg):g} deg on {share:.2g} % of the area")
    return figure


@styled
def surface_history_figure(
    history: SurfaceHistory, repose: Quantity = 35 * u.deg, *, figure: Figure | None = None
) -> Figure:
    """Slopes before closest approach, at it and after it in three views each, and as a function of time.

    Parameters
    ----------
    history : SurfaceHistory
        Of :func:`flybystab.surface_history`.
    repose : Quantity
        Angle of repose, for the fraction of the area that is steeper.
    figure : matplotlib Figure, optional
        To draw on; in one narrower than 6 inches the colour bars are below the maps, and the curves below each other.

    Returns
    -------
    matplotlib Figure
    """
    figure = new_figure(9.0, 9.5) if figure is None else figure
    narrow = figure.get_figwidth() < NARROW
    grid = figure.add_gridspec(
        5 if narrow else 4, 3, height_ratios=(1.0, 1.0, 1.0, 1.1, 1.1) if narrow else (1.0, 1.0, 1.0, 0.8)
    )
    slope, change = history.slope.to_value(u.deg), history.change.to_value(u.deg)
    largest = float(max(np.abs(change).max(), 1e-3))
    rows = (
        ("slope before (deg)", slope[0], (0.0, float(slope.max())), "viridis"),
        ("change at closest approach (deg)", change[history.closest], (-largest, largest), "RdBu_r"),
        ("change after (deg)", change[-1], (-largest, largest), "RdBu_r"),
    )
    for i, (label, values, limits, cmap) in enumerate(rows):
        places = [figure.add_subplot(grid[i, j]) for j in range(3)]
        for axes, (view, _, _) in zip(places, VIEWS, strict=True):
            drawn = shape_map(axes, history.shape, values, view, limits=limits, cmap=cmap)
            if narrow:  # the scale is the same on both axes
                axes.set(title=view, xticks=[])
                axes.locator_params(axis="y", nbins=2)
        figure.colorbar(drawn, ax=places, label=label, location="bottom" if narrow else "right")
    hours = history.time.to_value(u.h)
    curves = (grid[3, :], grid[4, :]) if narrow else (grid[3, :2], grid[3, 2])
    left, right = figure.add_subplot(curves[0]), figure.add_subplot(curves[1])
    for percent, line in ((1, ":"), (50, "-"), (99, "--")):
        left.plot(hours, np.percentile(change, percent, axis=1), ls=line, label=f"{percent} %")
    left.axvline(0.0, color="0.8", lw=0.8, zorder=0)
    left.set_xlabel("time from closest approach (h)")
    left.set_ylabel("change of\nslope (deg)" if narrow else "change of slope (deg)")
    if narrow:
        left.legend(title="percentile of the facets", loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3)
    else:
        left.legend(title="percentile of the facets", loc="upper right")
    right.plot(hours, 100.0 * history.share_past(repose))
    right.set_xlabel("time (h)")
    right.set_ylabel(f"area above{chr(10) if narrow else ' '}{repose.to_value(u.deg):g} deg (%)")
    right.set_ylim(bottom=0.0, top=None if np.any(history.share_past(repose)) else 1.0)
    return figure
