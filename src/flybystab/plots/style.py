"""Styles of figures: ``style.mplstyle`` for the screen, with changes for papers and for talks.

Fonts are embedded as TrueType (no Type 3), colours are those of Okabe & Ito (2008) in an order whose lightness varies,
and text is sized relative to ``font.size``, so that a style changes all of it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from functools import wraps
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Literal, ParamSpec, TypeVar

from flybystab.errors import UnknownName

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

P = ParamSpec("P")
R = TypeVar("R")
Layout = Literal["constrained", "compressed", "tight"]

#: Style file for ``matplotlib.style.context``.
STYLE = resources.files("flybystab.plots").joinpath("style.mplstyle")
#: Styles by name, with the scale of the size of their figures: two columns of a journal are 7.1 inches wide.
SCALES = {"default": 1.0, "paper": 0.74, "talk": 1.05}
_style: ContextVar[str | None] = ContextVar("style", default=None)


@contextmanager
def figure_style(name: str = "default") -> Iterator[None]:
    """Use a style for all figures made within the context.

    Parameters
    ----------
    name : str
        ``"default"``; ``"paper"``: 8 pt in figures as wide as one or two columns of a journal; ``"talk"``: large text
        and lines.

    Raises
    ------
    UnknownName

    Examples
    --------
    >>> from flybystab.plots.style import figure_style
    >>> with figure_style("paper"):
    ...     axes = result.plot()  # doctest: +SKIP
    """
    if name not in SCALES:
        raise UnknownName("style", str(name), [], f"(known: {', '.join(SCALES)})")
    import matplotlib

    settings = matplotlib.RcParams()
    for part in ("style",) if name == "default" else ("style", name):
        with resources.as_file(resources.files("flybystab.plots").joinpath(f"{part}.mplstyle")) as file:
            settings.update(matplotlib.rc_params_from_file(file, use_default_template=False))
    token = _style.set(name)
    try:
        with matplotlib.rc_context(settings):
            yield
    finally:
        _style.reset(token)


def styled(function: Callable[P, R]) -> Callable[P, R]:
    """Decorator of a function that makes a figure: the style of the context, or the default one."""

    @wraps(function)
    def wrapped(*args: P.args, **kwargs: P.kwargs) -> R:
        if _style.get() is not None:
            return function(*args, **kwargs)
        with figure_style():
            return function(*args, **kwargs)

    return wrapped


#: Width (inches) below which the panels of a figure are arranged for the screen of a phone.
NARROW = 6.0


def new_figure(
    width: float, height: float, dpi: float | None = None, layout: Layout | None = "constrained"
) -> Figure:
    """A figure of a given size in inches, scaled by the style, with a canvas that needs no window."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    scale = SCALES[_style.get() or "default"]
    figure = Figure(figsize=(scale * width, scale * height), dpi=dpi, layout=layout)
    FigureCanvasAgg(figure)
    return figure


@styled
def new_axes(rows: int = 1) -> Axes | Sequence[Axes]:
    """Axes of a new pyplot figure, which notebooks show: one, or a column with a common horizontal axis.

    Without a window system or notebook pyplot draws into memory.
    """
    import matplotlib.pyplot as plt

    scale = SCALES[_style.get() or "default"]
    width, height = (5.5, 4.0) if rows == 1 else (7.2, 2.1 * rows)
    size = (scale * width, scale * height)
    _, axes = plt.subplots(rows, 1, sharex=True, figsize=size, layout="constrained")
    found: Axes | Sequence[Axes] = axes
    return found


@styled
def save(figure: Figure, path: str | Path) -> Path:
    """Write a figure with the settings of the style; returns the path.

    Parameters
    ----------
    figure : matplotlib Figure
    path : str or Path
        File whose suffix gives the format (:data:`flybystab.plots.formats.FIGURES`).
    """
    figure.savefig(path)
    return Path(path)
