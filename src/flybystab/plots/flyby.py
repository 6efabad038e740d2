"""Figures of one flyby: functions that take matplotlib axes and return them.

The colours are those of Okabe & Ito (2008), distinguishable with colour-blindness; line styles differ as well, for
greyscale.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import astropy.units as u
import numpy as np

from flybystab.body.body import Body
from flybystab.encounter.encounter import Encounter
from flybystab.errors import InvalidInput
from flybystab.flybys.result import FlybyResult, History
from flybystab.plots.style import new_figure, save, styled
from flybystab.typing import Array, Document

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BLACK, ORANGE, SKY, GREEN, BLUE, RED = "#000000", "#E69F00", "#56B4E9", "#009E73", "#0072B2", "#D55E00"
STYLES = ("-", "--", ":")


#: Label of the time axis of histories.
TIME = "time from closest approach (h)"


def _hours(history: History) -> Array:
    return np.asarray(history.time_from_periapsis.to_value(u.h))


def _shade(axes: Axes, history: History, labels: bool = False) -> None:
    """Shade plastic flow (grey) and dispersal (hatched), with entries for the legend if requested."""
    t = _hours(history)
    regimes: tuple[tuple[str, str, Document], ...] = (
        ("flowing", "plastic flow", {"facecolor": "0.85"}),
        ("dispersed", "dispersed", {"facecolor": "0.85", "edgecolor": "0.45", "hatch": "//"}),
    )
    for regime, name, style in regimes:
        inside = history.regime == regime
        edges = np.flatnonzero(np.diff(np.concatenate([[0], inside.astype(int), [0]])))
        for a, b in zip(edges[::2], edges[1::2], strict=True):
            label = name if labels and a == edges[0] else None
            axes.axvspan(t[a], t[min(b, len(t) - 1)], lw=0, zorder=0, label=label, **style)


def described(body: Body) -> str:
    """Size, density and spin of a body for a title."""
    size = " x ".join(f"{2.0 * a:.4g}" for a in body.axes)
    rate = float(np.linalg.norm(body.omega))
    spin = f"{2.0 * np.pi / rate / 3600.0:.4g} h" if rate > 0.0 else "no spin"
    return f"{size} m, {body.rho:.4g} kg/m$^3$, {spin}, {body.material.friction_angle.to_value(u.deg):g} deg"


def distance_plot(axes: Axes, history: History, encounter: Encounter) -> Axes:
    """Plot distance from the planet's centre against time, with the planet's radius and a legend of the shading."""
    axes.semilogy(_hours(history), history.distance.to_value(u.km), color=BLACK)
    radius = encounter.planet.radius / 1e3
    axes.axhline(radius, color=BLUE, ls="--", label=f"radius of {encounter.planet.name.capitalize()}")
    axes.set(xlabel=TIME, ylabel="distance (km)")
    _shade(axes, history, labels=True)
    axes.legend()
    return axes


def friction_plot(axes: Axes, history: History, limit: u.Quantity, *, regimes: bool = True) -> Axes:
    """Plot the mobilised friction angle against time, with the friction angle of the material.

    Without `regimes` the shading of plastic flow has no entry in the legend.
    """
    phi = history.required_friction_angle.to_value(u.deg)
    axes.plot(_hours(history), np.where(np.isfinite(phi), phi, np.nan), color=RED, label="mobilised")
    axes.axhline(limit.to_value(u.deg), color=BLACK, ls="--", label="material")
    axes.set_ylim(0.0, 1.15 * limit.to_value(u.deg))
    axes.set(xlabel=TIME, ylabel="friction angle (deg)")
    _shade(axes, history, labels=regimes)
    axes.legend(loc="center left" if regimes else "center right")
    return axes


def spin_plot(axes: Axes, history: History, *, regimes: bool = True) -> Axes:
    """Plot the spin rate against time."""
    rate = np.linalg.norm(history.spin.to_value(u.rad / u.s), axis=1)
    axes.plot(_hours(history), rate * 86400.0 / (2.0 * np.pi), color=GREEN)
    axes.set(xlabel=TIME, ylabel="spin rate (rev/day)")
    axes.set_ylim(bottom=0.0)
    _shade(axes, history, labels=regimes)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(loc="lower left")
    return axes


def axes_plot(axes: Axes, history: History, *, regimes: bool = True) -> Axes:
    """Plot the semi-axes against time."""
    a = history.semi_axes.to_value(u.m)
    for i, (colour, style) in enumerate(zip((BLUE, ORANGE, BLACK), STYLES, strict=True)):
        axes.plot(_hours(history), a[:, i], color=colour, ls=style, label=f"$a_{i + 1}$")
    axes.set_ylim(0.0, 1.15 * a.max())
    axes.set(xlabel=TIME, ylabel="semi-axes (m)")
    _shade(axes, history, labels=regimes)
    axes.legend(ncols=3)
    return axes


def flyby_panels(panels: Sequence[Axes], result: FlybyResult) -> Sequence[Axes]:
    """Plot distance, mobilised friction angle, spin rate and semi-axes into four axes with a common time axis."""
    history = result.history
    if history is None:
        raise InvalidInput("result", "without history", "the result of flyby(..., history=True)")
    distance_plot(panels[0], history, result.encounter)
    friction_plot(panels[1], history, result.body.material.friction_angle, regimes=False)
    spin_plot(panels[2], history, regimes=False)
    axes_plot(panels[3], history, regimes=False)
    for panel in panels[:3]:
        panel.set_xlabel("")
    return panels


@styled
def flyby_figure(result: FlybyResult, title: str, path: str | Path) -> Path:
    """Write a figure with the four panels of a flyby; returns its path."""
    figure = new_figure(7.2, 8.4)
    panels: Sequence[Axes] = figure.subplots(4, 1, sharex=True)
    flyby_panels(panels, result)
    panels[0].set_title(title)
    return save(figure, path)
