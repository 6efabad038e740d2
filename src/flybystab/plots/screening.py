"""Figures of screening tables, and of bounds on the material from survived encounters."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import astropy.units as u
import numpy as np
from astropy.table import QTable
from numpy.typing import NDArray

from flybystab.errors import InvalidInput, UnknownName
from flybystab.flybys.verdict import Verdict
from flybystab.plots.flyby import BLACK, BLUE, GREEN, ORANGE, RED, SKY
from flybystab.plots.labels import label_points, literal
from flybystab.plots.outcome_map import MARKERS, SCALE
from flybystab.plots.style import new_figure, save, styled
from flybystab.screening.columns import VERDICTS
from flybystab.screening.inference import strongest_encounter
from flybystab.screening.results import read_results
from flybystab.screening.summary import summary
from flybystab.typing import Array, Document
from flybystab.units import number_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.contour import QuadContourSet
    from matplotlib.figure import Figure, SubFigure

    #: Filled contours and lines.
    Contours = tuple[QuadContourSet, QuadContourSet]

PANELS = {
    "friction_equilibrium": "shape and spin",
    "friction_any_attitude": "with encounters, necessary at any attitude",
    "friction_every_attitude": "with encounters, sufficient at every attitude",
}
#: Smallest friction angle (deg) shown as the effect of an encounter.
NOTHING = 1e-5
#: Colours of the planets of a table, in alphabetical order.
PLANETS = (BLUE, ORANGE, GREEN, RED, SKY, BLACK)
#: Contours of the minimum friction angle, deg.
_LEVELS = (0, 5, 10, 15, 20, 25, 30, 35, 40, 45, 60)


def bounds_plot(axes: Axes, table: QTable, column: str | None = None) -> Axes:
    """Plot the minimum friction angle over density and cohesion from a table of :func:`flybystab.infer`.

    Hatched: no friction angle suffices. The white line and band are the density of the catalogue and its 1-sigma.

    Parameters
    ----------
    axes : matplotlib Axes
    table : QTable
    column : str, optional
        A key of :data:`PANELS`; by default the necessary angle, with encounters if the table has any.

    Raises
    ------
    UnknownName
        Another column.
    """
    name = column or ("friction_any_attitude" if table.meta.get("passages") else "friction_equilibrium")
    if name not in PANELS:
        raise UnknownName("column", str(name), [], f"(known: {', '.join(PANELS)})")
    drawn = _bounds_panel(axes, table, name)
    axes.set_ylabel("cohesion (Pa)")
    axes.set_title(f"{literal(table.meta.get('asteroid', ''))}: {PANELS[name]}".removeprefix(": "))
    if drawn is not None:
        _bounds_scale(axes.figure, drawn, axes)
    return axes


def _bounds_panel(panel: Axes, table: QTable, name: str) -> Contours | None:
    """Draw one map of a table of bounds; returns the filled contours and the lines."""
    import matplotlib

    density = np.unique(table["density"].to_value(u.kg / u.m**3))
    cohesion = np.unique(table["cohesion"].to_value(u.Pa))
    if len(table) != len(density) * len(cohesion):
        raise InvalidInput("table", f"{len(table)} rows", "all densities with all cohesions")
    # On the logarithmic axis zero cohesion is placed below the smallest other value.
    height = np.arange(len(cohesion))
    known = table.meta.get("catalogue_density_kg_m3") or []
    colours = matplotlib.colormaps["viridis_r"].with_extremes(over="0.85")
    need = table[name].to_value(u.deg).reshape(len(density), len(cohesion)).T
    capped = np.where(np.isfinite(need), np.minimum(need, 90.0), 90.0)
    drawn = None
    if min(capped.shape) > 1:
        filled = panel.contourf(density, height, capped, _LEVELS, cmap=colours, extend="max")
        # The levels of the lines are marked in the colour bar: labels on crowded lines would overlap.
        lines = panel.contour(density, height, capped, [15, 25, 35, 45], colors="k", linewidths=0.7)
        panel.contourf(density, height, capped, [60, 91], colors="none", hatches=["///"])
        drawn = filled, lines
    if len(known) == 2:
        panel.axvspan(known[0] - known[1], known[0] + known[1], color="w", alpha=0.35, lw=0)
        panel.axvline(known[0], color="w", lw=1)
    panel.set_title(PANELS[name])
    panel.set(xlabel="density (kg/m$^3$)", xlim=(density[0], density[-1]))
    panel.locator_params(axis="x", nbins=4)
    panel.set_yticks(height, [f"{c:g}" for c in cohesion])
    return drawn


def _bounds_scale(figure: Figure | SubFigure, drawn: Contours, panels: Axes | Sequence[Axes]) -> None:
    bar = figure.colorbar(drawn[0], ax=panels, label="minimum friction angle (deg);\nhatched: none suffices")
    bar.add_lines(drawn[1])


@styled
def inference_figure(table: QTable, path: str | Path) -> Path:
    """Plot the region of density, cohesion and friction angle that is consistent with :func:`flybystab.infer`.

    Each panel is a map as in :func:`bounds_plot`.

    Returns
    -------
    Path
        The file written.
    """
    names = list(PANELS) if table.meta.get("passages") else list(PANELS)[:1]
    figure = new_figure(1.2 + 3.6 * len(names), 3.8)
    panels: Sequence[Axes] = figure.subplots(1, len(names), sharey=True, squeeze=False)[0]
    drawn = [_bounds_panel(panel, table, name) for panel, name in zip(panels, names, strict=True)]
    panels[0].set_ylabel("cohesion (Pa)")
    if drawn[0] is not None:
        _bounds_scale(figure, drawn[0], list(panels))
    axes = " x ".join(f"{2 * a:.0f}" for a in table.meta.get("semi_axes_m", []))
    title = f"{literal(table.meta.get('asteroid', ''))}: {axes} m, {table.meta.get('spin_period_h', np.nan):.4g} h"
    strongest = strongest_encounter(table)
    if strongest is not None:
        title += f"; strongest tide: {strongest['passage']}"
    figure.suptitle(title)
    return save(figure, path)


#: Axes of the figures of a screening: label and scale.
_QUANTITIES = {
    "distance": ("distance at closest approach (au)", "log"),
    "rise": ("increase of the mobilised friction angle (deg)", "log"),
    "margin": ("margin (deg of friction angle)", "linear"),
}


def rise_plot(axes: Axes, table: QTable, names: int = 4) -> Axes:
    """Plot the effect of each encounter on the mobilised friction angle against its distance.

    The `names` encounters with the largest increase are labelled. Bodies that are not in equilibrium are not shown.
    """
    values, stands, bound = _screened(table)
    _verdict_marks(axes, table, "distance", "rise")
    if axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize="x-small")
    exact = stands & ~bound
    rows = np.flatnonzero(exact)[np.argsort(-values["rise"][exact], kind="stable")]
    return _labelled(axes, table, "distance", "rise", rows[:names])


def margin_plot(axes: Axes, table: QTable, names: int = 4) -> Axes:
    """Plot the margin of each encounter against its effect; the `names` encounters nearest to failure are labelled."""
    values, stands, _ = _screened(table)
    _verdict_marks(axes, table, "rise", "margin")
    axes.axhline(0.0, color="0.6", lw=0.8)
    rows = np.flatnonzero(stands)[np.argsort(values["margin"][stands], kind="stable")]
    return _labelled(axes, table, "rise", "margin", rows[:names])


def _screened(table: QTable) -> tuple[dict[str, Array], NDArray[np.bool_], NDArray[np.bool_]]:
    """Quantities of the figures, mask of the rows shown, and mask of the rows whose margin is a bound."""
    values = {
        "distance": table["distance"].to_value(u.au),
        "rise": np.maximum(table["friction_rise"].to_value(u.deg), NOTHING),
        "margin": table["margin"].to_value(u.deg),
    }
    verdict = np.asarray(table["verdict"], dtype=str)
    stands = (
        np.isfinite(values["rise"]) & np.isfinite(values["margin"]) & (verdict != Verdict.NOT_IN_EQUILIBRIUM)
    )
    return values, stands, np.asarray(table["decided_by"], dtype=str) == "bound"


def _verdict_marks(axes: Axes, table: QTable, x: str, y: str) -> None:
    """Points with a marker and shade for each verdict; open triangles are upper limits of the increase."""
    values, stands, bound = _screened(table)
    verdict = np.asarray(table["verdict"], dtype=str)
    for v in VERDICTS:
        known: Document = {"mfc": SCALE[v][1], "marker": MARKERS[list(SCALE).index(v)], "ms": 5}
        limit: Document = {"mfc": "none", "mec": "0.5", "marker": "v", "ms": 4}
        for chosen, how, style in (
            (stands & (verdict == v) & bound, "upper limit", limit),
            (stands & (verdict == v) & ~bound, "integrated", {"mec": "black", **known}),
        ):
            if chosen.any():
                label = f"{v}, {how} ({chosen.sum()})"
                axes.plot(
                    values[x][chosen], values[y][chosen], **{"ls": "", "mew": 0.5, **style}, label=label
                )
    axes.set(xscale=_QUANTITIES[x][1], yscale=_QUANTITIES[y][1])
    axes.set(xlabel=_QUANTITIES[x][0], ylabel=_QUANTITIES[y][0])


def _labelled(axes: Axes, table: QTable, x: str, y: str, rows: NDArray[np.int64]) -> Axes:
    values, stands, _ = _screened(table)
    named = [
        (values[x][k], values[y][k], f"{table['asteroid'][k]} {str(table['time_tdb'][k])[:4]}") for k in rows
    ]
    return label_points(
        axes, named, np.column_stack([values[x][stands], values[y][stands]]), fontsize="x-small"
    )


@styled
def results_figure(results: QTable | str | Path, path: str | Path, names: int = 4) -> Path:
    """Plot a result table: effect of each encounter on the mobilised friction angle, and the margin.

    The encounters with the largest increase (left) and those nearest to failure (right) are labelled.

    Returns
    -------
    Path
        The file written.
    """
    table = results if isinstance(results, QTable) else read_results(results)
    summary(table)
    values, stands, _ = _screened(table)
    figure = new_figure(10, 4.2)
    left, right = figure.subplots(1, 2)
    out = int((np.asarray(table["verdict"], dtype=str) == Verdict.NOT_IN_EQUILIBRIUM).sum())
    rest = len(table) - out - int(stands.sum())
    hidden = [f"{out} of bodies that are not in equilibrium"] * bool(out)
    hidden += [f"{rest} without a finite margin"] * bool(rest)
    limited = np.any(values["rise"][stands] == NOTHING)
    least = f"; points at {NOTHING:g} deg: {NOTHING:g} deg or less" if limited else ""
    figure.suptitle(
        f"{number_of(len(table), 'encounter')}, ephemeris {table.meta.get('ephemeris', '-')}"
        f"{'; not shown: ' if hidden else ''}{', '.join(hidden)}{least}",
    )
    rise_plot(left, table, names)
    margin_plot(right, table, names)
    return save(figure, path)


def encounters_plot(axes: Axes, table: QTable, names: int = 6) -> Axes:
    """Plot the distances of close approaches against time, by planet; the `names` closest are labelled.

    Bars are the 99.73 % interval of the distance where clones have been computed; crosses are impacts.
    """
    from matplotlib.dates import date2num

    day = date2num(np.asarray(table["time"].tdb.isot, dtype="datetime64[ms]"))
    distance = table["distance"].to_value(u.km)
    planet, hits = np.asarray(table["planet"], dtype=str), np.asarray(table["impact"], dtype=bool)
    for k, name in enumerate(sorted(set(planet))):
        chosen = (planet == name) & ~hits
        label = f"{name.capitalize()} ({(planet == name).sum()})"
        style: Document = {
            "ls": "",
            "marker": "osD^vP"[k % 6],
            "ms": 4,
            "color": PLANETS[k % 6],
            "label": label,
        }
        axes.plot(day[chosen], distance[chosen], **style)
        if "distance_low" in table.colnames:
            low, high = (table[f"distance_{end}"].to_value(u.km)[chosen] for end in ("low", "high"))
            axes.vlines(day[chosen], low, high, color=PLANETS[k % 6], lw=1)
    if hits.any():
        axes.plot(day[hits], distance[hits], "x", color="black", ms=6, label=f"impacts ({hits.sum()})")
    _date_axis(axes)
    axes.set(yscale="log", xlabel="date (TDB)", ylabel="distance at closest approach (km)")
    if len(table):
        axes.legend()
    rows = np.argsort(distance, kind="stable")[:names]
    points = [(day[k], distance[k], str(table["asteroid"][k])) for k in rows]
    return label_points(axes, points, np.column_stack([day, distance]), fontsize="x-small")


def _date_axis(axes: Axes) -> None:
    from matplotlib.dates import AutoDateLocator, ConciseDateFormatter

    locator = AutoDateLocator(minticks=3, maxticks=10)
    axes.xaxis.set_major_locator(locator)
    axes.xaxis.set_major_formatter(ConciseDateFormatter(locator))


def impacts_plot(axes: Axes, table: QTable) -> Axes:
    """Plot the probability of possible impacts against time, from a table of :func:`flybystab.virtual_impactors`."""
    from matplotlib.dates import date2num

    day = date2num(np.asarray(table["time"].tdb.isot, dtype="datetime64[ms]"))
    probability = np.asarray(table["probability"], dtype=float)
    axes.plot(day, probability, "D", color=BLUE, ms=4)
    _date_axis(axes)
    axes.set(yscale="log", xlabel="date (TDB)", ylabel="impact probability")
    planet = str(table.meta.get("planet", ""))
    count = f"{len(table)} possible impact{'' if len(table) == 1 else 's'}"
    axes.set_title(f"{planet.capitalize()}: {count}".removeprefix(": "))
    if len(table):
        axes.vlines(day, 0.5 * probability.min(), probability, color=BLUE, lw=1)
        axes.set_ylim(bottom=0.5 * probability.min())
    return axes
