"""Style of figures: the file ``style.mplstyle`` (TrueType fonts in PDF and PostScript, resolution)."""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from typing import Any

#: Style file for ``matplotlib.style.context``.
STYLE = resources.files("flybystab.plots").joinpath("style.mplstyle")


def new_axes(rows: int = 1) -> Any:
    """Axes of a new pyplot figure, which notebooks show: one, or a column with a common horizontal axis.

    Without a window system or notebook pyplot draws into memory.
    """
    import matplotlib.pyplot as plt

    size = (5.5, 4.0) if rows == 1 else (7.2, 2.1 * rows)
    with resources.as_file(STYLE) as file, plt.rc_context(fname=file):
        _, axes = plt.subplots(rows, 1, sharex=True, figsize=size, layout="constrained")
    return axes


def save(figure: Any, path: str | Path) -> Path:
    """Write a figure with the settings of the style file; returns the path.

    Parameters
    ----------
    figure : matplotlib Figure
    path : str or Path
        File whose suffix gives the format (:data:`flybystab.plots.formats.FIGURES`).
    """
    import matplotlib

    with resources.as_file(STYLE) as file, matplotlib.rc_context(fname=file):
        figure.savefig(path)
    return Path(path)
