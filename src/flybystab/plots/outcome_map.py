"""Figures of outcome maps: verdicts over periapsis and v_inf, and over the target plane of an encounter.

Verdicts run from light (intact) to dark (disrupted) and carry a letter each, so that the maps can be read in
greyscale and by colour-blind readers.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import astropy.units as u
import numpy as np
from astropy.units import Quantity
from numpy.typing import NDArray

from flybystab.flybys.outcome_map import OutcomeMap, TargetMap, outcome_map, target_map
from flybystab.flybys.verdict import Verdict
from flybystab.plots.flyby import described
from flybystab.typing import Array, Document

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["MARKERS", "SCALE", "outcome_map", "outcome_plot", "target_map", "target_plot", "verdict_points"]

#: Verdicts from the least to the most damage, with the letter and the shade of a map. The lightness falls from
#: entry to entry; the hues are those of the colour map cividis.
SCALE: dict[str, tuple[str, str]] = {
    Verdict.INTACT: ("I", "#fdf3c8"),
    Verdict.RESHAPED: ("R", "#dcc76b"),
    Verdict.MASS_LOSS: ("M", "#a69c75"),
    Verdict.DISRUPTED: ("D", "#767880"),
    Verdict.BEYOND_MODEL: ("X", "#48567a"),
    Verdict.IMPACT: ("H", "#101f3f"),
    Verdict.NOT_IN_EQUILIBRIUM: ("-", "#ffffff"),
    "FAILED": ("?", "#ffffff"),
}
_ORDER = list(SCALE)
#: Markers of points, in the same order.
MARKERS = "osDPXv^*"


def outcome_plot(axes: Axes, outcomes: OutcomeMap) -> Axes:
    """Plot the most severe verdict over periapsis and v_inf, with contours of 10 % and 90 % of the phases yielding."""
    q = outcomes.periapsis.to_value(u.m) / outcomes.planet.radius
    v = outcomes.v_inf.to_value(u.km / u.s)
    worst = outcomes.worst
    axes.pcolormesh(q, v, _ranks(worst).T, **_shades(), shading="nearest")
    _letters(axes, np.meshgrid(q, v, indexing="ij"), worst)
    from matplotlib.patheffects import withStroke

    share = outcomes.share_yielding
    if share.min() < 0.5 <= share.max() and min(share.shape) > 1:
        lines = axes.contour(q, v, share.T, levels=[0.1, 0.9], colors="black", linestyles=["--", "-"])
        labels = axes.clabel(
            lines, fmt=lambda x: f"{x:.0%} of phases yield", fontsize="x-small", inline=False
        )
        for label in labels:  # a halo instead of a gap in the line
            label.set_path_effects([withStroke(linewidth=2.5, foreground="white")])
    axes.set_xlabel(f"periapsis (radii of {outcomes.planet.name.capitalize()})")
    axes.set_ylabel("hyperbolic excess speed $v_\\infty$ (km/s)")
    axes.set_title(f"{outcomes.planet.name.capitalize()}; {described(outcomes.body)}")
    _legend(axes, worst)
    return axes


def target_plot(axes: Axes, target: TargetMap) -> Axes:
    """Plot the verdicts over the target plane, with the disc of impacts."""
    x, y = target.b_t.to_value(u.km), target.b_r.to_value(u.km)
    m = x.shape[1]
    step = np.pi / m
    b = np.hypot(x[:, 0], y[:, 0])
    edges = np.concatenate([[b[0] - (b[1] - b[0]) / 2], (b[1:] + b[:-1]) / 2, [b[-1] + (b[-1] - b[-2]) / 2]])
    angle = 2.0 * step * np.arange(m + 1) - step
    mesh = edges[:, None] * np.cos(angle), edges[:, None] * np.sin(angle)
    axes.pcolormesh(*mesh, _ranks(target.verdict), **_shades())
    _letters(axes, (x, y), target.verdict)
    from matplotlib.patches import Circle

    disc = target.capture_radius.to_value(u.km)
    axes.add_patch(Circle((0, 0), disc, color=SCALE[Verdict.IMPACT][1], zorder=3))
    axes.text(
        0,
        0,
        f"hits {target.planet.name.capitalize()}",
        color="white",
        ha="center",
        va="center",
        fontsize="x-small",
        zorder=4,
    )
    axes.set_aspect("equal")
    axes.set_xlabel("B.T (km)")
    axes.set_ylabel("B.R (km)")
    speed = target.v_inf.to_value(u.km / u.s)
    axes.set_title(f"{target.planet.name.capitalize()}, $v_\\infty$ = {speed:g} km/s")
    _legend(axes, target.verdict)
    return axes


def verdict_points(axes: Axes, b: Quantity, verdict: Sequence[str], radius: Quantity | None = None) -> Axes:
    """Plot points (n, 2) of a target plane, shaded by verdict, and the disc of impacts if its radius is given."""
    points = b.to_value(u.km)
    names = np.asarray(verdict, dtype=str)
    for name in (n for n in _ORDER if n in names):
        chosen = names == name
        axes.plot(
            *points[chosen].T, MARKERS[_ORDER.index(name)], ls="none", ms=5, mfc=SCALE[name][1], mec="black",
            mew=0.4, label=f"{name} ({chosen.sum()})",
        )  # fmt: skip
    if radius is not None:
        from matplotlib.patches import Circle

        axes.add_patch(Circle((0, 0), radius.to_value(u.km), fill=False, label="disc of impacts"))
    axes.set(xlabel="B.T (km)", ylabel="B.R (km)")
    axes.legend()
    return axes


def _ranks(names: NDArray[np.str_]) -> NDArray[np.int64]:
    return np.vectorize(_ORDER.index, otypes=[np.int64])(names)


def _shades() -> Document:
    from matplotlib.colors import ListedColormap

    return {
        "cmap": ListedColormap([shade for _, shade in SCALE.values()]),
        "vmin": -0.5,
        "vmax": len(SCALE) - 0.5,
    }


def _letters(axes: Axes, places: Sequence[Array], names: NDArray[np.str_]) -> None:
    for x, y, name in zip(places[0].ravel(), places[1].ravel(), names.ravel(), strict=True):
        letter = SCALE[name][0]
        dark = letter in "DXH"
        if letter != "I":
            axes.text(
                x,
                y,
                letter,
                ha="center",
                va="center",
                fontsize="xx-small",
                color="white" if dark else "black",
            )


def _legend(axes: Axes, names: NDArray[np.str_]) -> None:
    from matplotlib.patches import Patch

    found = [n for n in _ORDER if n in set(names.ravel().tolist())]
    handles = [Patch(facecolor=SCALE[n][1], edgecolor="0.5", label=f"{SCALE[n][0]}  {n}") for n in found]
    axes.legend(handles=handles, loc="upper right", framealpha=0.9)
