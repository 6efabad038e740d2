"""Labels of points that overlap neither each other nor the points.

Each label takes the first free position: close to its point on one of eight sides, otherwise farther away with a thin
line to the point. A label without a free position is omitted.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from matplotlib.patheffects import withStroke
from numpy.typing import ArrayLike

from flybystab.typing import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Directions of a label from its point, in order of preference, and the distances that are tried, in points.
_SIDES = ((1, 0.3), (1, -0.3), (-1, 0.3), (-1, -0.3), (0.5, 1), (0.5, -1), (-0.5, 1), (-0.5, -1))
_DISTANCES = (5.0, 10.0, 18.0, 28.0, 42.0)
#: Radius of a mark, in points.
_MARK = 3.0
#: Distance from which on a line connects label and point.
_LINE = 10.0


def literal(name: str) -> str:
    """A name as matplotlib shows it unchanged: dollar signs start no formula, control characters are escapes."""
    shown = (c if c.isprintable() else c.encode("unicode_escape").decode() for c in name)
    return "".join(shown).replace("$", r"\$")


def subject_title(axes: Axes, subject: str, detail: str = "") -> Axes:
    """Title from the subject of a result: the encounter, the body and further details on one line each."""
    lines = [part for part in (*subject.split("; ", 1), detail) if part]
    axes.set_title("\n".join(literal(line) for line in lines), fontsize="medium")
    return axes


def label_points(
    axes: Axes, points: Sequence[tuple[float, float, str]], others: ArrayLike | None = None, **text: Any
) -> Axes:
    """Write labels beside points; the axes must have their final limits.

    Parameters
    ----------
    axes : matplotlib Axes
    points : sequence of (x, y, name)
        In data coordinates, most important first.
    others : array_like, shape (n, 2), optional
        Other points that labels should not cover if possible.
    **text
        Text properties of matplotlib, e.g. ``fontsize``.

    Returns
    -------
    matplotlib Axes
    """
    # A white outline keeps a label legible on a line.
    text = {"path_effects": [withStroke(linewidth=2.0, foreground="w")], **text}
    figure = cast("Figure", axes.figure)
    figure.draw_without_rendering()
    if (layout := figure.get_layout_engine()) is not None:
        layout.execute(figure)
    renderer = figure.canvas.get_renderer() if hasattr(figure.canvas, "get_renderer") else None
    inside = axes.get_window_extent(renderer)
    pixels = figure.dpi / 72.0
    to_pixels = axes.transData.transform
    own = to_pixels(np.array([(x, y) for x, y, _ in points], dtype=float).reshape(-1, 2))
    crowd = own if others is None else np.vstack([own, to_pixels(np.asarray(others, dtype=float))])
    taken: list[tuple[float, float, float, float]] = []
    legend = axes.get_legend()
    if legend is not None:
        taken.append(legend.get_window_extent(renderer).extents)
    for (x, y, text_of_point), at in zip(points, own, strict=True):
        name = literal(text_of_point)
        note = axes.annotate(name, (x, y), xytext=(0, 0), textcoords="offset points", zorder=6, **text)
        box = note.get_window_extent(renderer)
        size = np.array([box.width, box.height])
        place = _free(at, size, np.asarray(inside.extents), taken, crowd, pixels)
        note.remove()
        if place is None:
            continue
        corner, distance = place
        taken.append((*corner, *(corner + size)))
        line = {"arrowstyle": "-", "color": "0.5", "lw": 0.5, "shrinkA": 0, "shrinkB": 2}
        # anchored at the end that is next to the point: widths depend a little on the resolution
        left = bool(corner[0] + 0.5 * size[0] < at[0])
        anchor = corner + np.array([size[0], 0.0]) if left else corner
        axes.annotate(
            name,
            (x, y),
            xytext=tuple((anchor - at) / pixels),
            textcoords="offset points",
            ha="right" if left else "left",
            va="bottom",
            zorder=6,
            arrowprops=line if distance >= _LINE else None,
            **text,
        )
    return axes


def _free(
    at: Array,
    size: Array,
    inside: Array,
    taken: Sequence[Sequence[float] | Array],
    crowd: Array,
    pixels: float,
) -> tuple[Array, float] | None:
    """Lower left corner of the best free box near a point, in pixels, and its distance in points."""
    best = None
    least = np.inf
    for distance in _DISTANCES:
        for rank, (side, up) in enumerate(_SIDES):
            away = distance * pixels * np.array([side, up])
            corner = at + away - size * np.array([0.5 - 0.5 * np.sign(side), 0.5 - 0.5 * np.clip(up, -1, 1)])
            low, high = corner, corner + size
            if np.any(low < inside[:2]) or np.any(high > inside[2:]):
                continue
            if any(low[0] < t[2] and t[0] < high[0] and low[1] < t[3] and t[1] < high[1] for t in taken):
                continue
            covered = np.count_nonzero(
                np.all((crowd > low - _MARK * pixels) & (crowd < high + _MARK * pixels), axis=1)
            )
            cost = 30.0 * covered + distance + 0.1 * rank
            if cost < least:
                least, best = cost, (corner, distance)
    return best
