"""Figures of the HTML report as data URLs, for a wide and for a narrow screen."""

from __future__ import annotations

import base64
import io
from collections.abc import Callable
from typing import TYPE_CHECKING

import astropy.units as u

from flybystab.body.surface_history import SurfaceHistory
from flybystab.flybys.result import FlybyResult
from flybystab.flybys.spin_sample import SpinSample
from flybystab.io.surface_text import REPOSE
from flybystab.plots.flyby import BLUE, flyby_panels
from flybystab.plots.grains import grains_figure, grains_scene_plot
from flybystab.plots.scene import scene_plot
from flybystab.plots.shape_map import surface_history_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: A figure as a data URL, and the same figure drawn for a narrow screen.
Pictures = tuple[str, str]
#: Width of a figure on a phone, inches: about 390 px with text at full size.
_PHONE = 4.0


def _embedded(figure: Figure) -> str:
    stream = io.BytesIO()
    figure.savefig(stream, format="svg")
    return "data:image/svg+xml;base64," + base64.b64encode(stream.getvalue()).decode()


def _blank(width: float, height: float) -> Figure:
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasSVG(figure)
    return figure


def _twice(
    draw: Callable[[Figure], object],
    wide: tuple[float, float],
    narrow: float,
    encode: Callable[[Figure], str],
) -> Pictures:
    """A figure of the size `wide`, and one with the width of a phone and the height `narrow`."""
    out = []
    for width, height in (wide, (_PHONE, narrow)):
        figure = _blank(width, height)
        draw(figure)
        out.append(encode(figure))
    return out[0], out[1]


def history_picture(r: FlybyResult) -> Pictures:
    """Time series of the flyby."""
    return _twice(
        lambda figure: flyby_panels(figure.subplots(4, 1, sharex=True), r), (7.2, 8.0), 7.6, _embedded
    )


def _bitmap(figure: Figure) -> str:
    """A figure as a bitmap, which is smaller than vector graphics if it has many elements."""
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=130)
    return "data:image/png;base64," + base64.b64encode(stream.getvalue()).decode()


def grains_picture(r: FlybyResult) -> Pictures:
    """Outcomes of the piles of grains."""
    return _twice(lambda figure: grains_figure(r, figure=figure), (11.0, 5.6), 8.4, _bitmap)


def grains_scene_picture(r: FlybyResult) -> Pictures:
    """Path and pile of grains, to scale."""
    return _twice(lambda figure: grains_scene_plot(figure.subplots(), r), (7.2, 4.2), 3.0, _bitmap)


def surface_picture(surface: SurfaceHistory) -> Pictures:
    """Maps of the slopes on the shape."""
    return _twice(
        lambda figure: surface_history_figure(surface, REPOSE, figure=figure), (8.0, 9.0), 8.8, _bitmap
    )


def scene_picture(r: FlybyResult) -> Pictures:
    """Path and body in three dimensions."""

    def draw(figure: Figure) -> None:
        scene_plot(figure.add_subplot(projection="3d"), r)

    return _twice(draw, (7.2, 3.2), 2.4, _bitmap)


def sample_picture(s: SpinSample) -> Pictures:
    """Change of the spin over the sampled attitudes."""
    return _twice(lambda figure: sample_plot(figure.subplots(), s), (6.4, 3.6), 3.2, _embedded)


def sample_plot(axes: Axes, sample: SpinSample) -> Axes:
    """Plot the rotation of the spin axis against the change of the spin rate, one point for each attitude."""
    axes.plot(
        sample.spin_ratio, sample.pole_change.to_value(u.deg), "o", ms=4, color=BLUE, mec="white", mew=0.4
    )
    axes.axvline(1.0, color="0.5", lw=0.8, ls="--")
    axes.set_xlabel("spin rate after / before")
    axes.set_ylabel("rotation of the spin axis (deg)")
    axes.set_ylim(bottom=0.0)
    return axes
