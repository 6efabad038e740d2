"""Figures of screening tables, and of bounds on the material from survived encounters."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import astropy.units as u
import numpy as np
from astropy.table import QTable

from flybystab.flybys.verdict import Verdict
from flybystab.plots.labels import label_points
from flybystab.plots.outcome_map import MARKERS, SCALE
from flybystab.plots.style import new_figure, save, styled
from flybystab.screening.columns import VERDICTS
from flybystab.screening.inference import strongest_passage
from flybystab.screening.results import read_results
from flybystab.screening.summary import summary

PANELS = {
    "friction_equilibrium": "shape and spin",
    "friction_any_attitude": "with encounters, necessary at any attitude",
    "friction_every_attitude": "with encounters, sufficient at every attitude",
}
#: Smallest friction angle (deg) shown as the effect of an encounter.
NOTHING = 1e-5
#: Contours of the minimum friction angle, deg.
_LEVELS = (0, 5, 10, 15, 20, 25, 30, 35, 40, 45, 60)


@styled
def inference_figure(table: QTable, path: str | Path) -> Path:
    """Plot the region of density, cohesion and friction angle that is consistent with :func:`flybystab.infer`.

    Each panel is a map of the minimum friction angle over density and cohesion; hatched: no friction angle suffices.
    The white line and band are the density of the catalogue and its 1-sigma.

    Returns
    -------
    Path
        The file written.
    """
    import matplotlib

    density = np.unique(table["density"].to_value(u.kg / u.m**3))
    cohesion = np.unique(table["cohesion"].to_value(u.Pa))
    names = list(PANELS) if table.meta.get("passages") else list(PANELS)[:1]
    figure = new_figure(1.2 + 3.6 * len(names), 3.8)
    panels: Any = figure.subplots(1, len(names), sharey=True, squeeze=False)[0]
    # On the logarithmic axis zero cohesion is placed below the smallest other value.
    height = np.arange(len(cohesion))
    known = table.meta.get("catalogue_density_kg_m3") or []
    filled = lines = None
    colours = matplotlib.colormaps["viridis_r"].with_extremes(over="0.85")
    for panel, name in zip(panels, names, strict=True):
        need = table[name].to_value(u.deg).reshape(len(density), len(cohesion)).T
        capped = np.where(np.isfinite(need), np.minimum(need, 90.0), 90.0)
        if min(capped.shape) > 1:
            filled = panel.contourf(density, height, capped, _LEVELS, cmap=colours, extend="max")
            # The levels of the lines are marked in the colour bar: labels on crowded lines would overlap.
            lines = panel.contour(density, height, capped, [15, 25, 35, 45], colors="k", linewidths=0.7)
            panel.contourf(density, height, capped, [60, 91], colors="none", hatches=["///"])
        if len(known) == 2:
            panel.axvspan(known[0] - known[1], known[0] + known[1], color="w", alpha=0.35, lw=0)
            panel.axvline(known[0], color="w", lw=1)
        panel.set_title(PANELS[name])
        panel.set(xlabel="density (kg/m$^3$)", xlim=(density[0], density[-1]))
        panel.locator_params(axis="x", nbins=4)
    panels[0].set_yticks(height, [f"{c:g}" for c in cohesion])
    panels[0].set_ylabel("cohesion (Pa)")
    if filled is not None and lines is not None:
        bar = figure.colorbar(
            filled, ax=list(panels), label="minimum friction angle (deg);\nhatched: none suffices"
        )
        bar.add_lines(lines)
    axes = " x ".join(f"{2 * a:.0f}" for a in table.meta.get("semi_axes_m", []))
    title = f"{table.meta.get('asteroid', '')}: {axes} m, {table.meta.get('spin_period_h', np.nan):.4g} h"
    strongest = strongest_passage(table)
    if strongest is not None:
        title += f"; strongest tide: {strongest['passage']}"
    figure.suptitle(title)
    return save(figure, path)


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
    verdict = np.asarray(table["verdict"], dtype=str)
    distance = table["distance"].to_value(u.au)
    rise = np.maximum(table["friction_rise"].to_value(u.deg), NOTHING)
    margin = table["margin"].to_value(u.deg)
    figure = new_figure(10, 4.2)
    left, right = figure.subplots(1, 2)
    stands = np.isfinite(rise) & np.isfinite(margin) & (verdict != Verdict.NOT_IN_EQUILIBRIUM)
    bound = np.asarray(table["decided_by"], dtype=str) == "bound"
    for v in VERDICTS:
        known = {"mfc": SCALE[v][1], "marker": MARKERS[list(SCALE).index(v)], "ms": 5}
        for chosen, how, style in (
            (
                stands & (verdict == v) & bound,
                "upper limit",
                {"mfc": "none", "mec": "0.5", "marker": "v", "ms": 4},
            ),
            (stands & (verdict == v) & ~bound, "integrated", {"mec": "black", **known}),
        ):
            if chosen.any():
                style = {"ls": "", "mew": 0.5, **style}
                left.plot(distance[chosen], rise[chosen], **style, label=f"{v}, {how} ({chosen.sum()})")
                right.plot(rise[chosen], margin[chosen], **style)
    left.set(xscale="log", yscale="log", xlabel="distance at closest approach (au)")
    adds = "increase of the mobilised friction angle (deg)"
    left.set_ylabel(adds)
    right.set(xscale="log", xlabel=adds)
    right.set_ylabel("margin (deg of friction angle)")
    right.axhline(0.0, color="0.6", lw=0.8)
    if left.get_legend_handles_labels()[0]:
        left.legend(fontsize="x-small")
    out = int((verdict == Verdict.NOT_IN_EQUILIBRIUM).sum())
    rest = len(table) - out - int(stands.sum())
    hidden = f"{out} of bodies that are not in equilibrium" + (
        f", {rest} without a finite margin" if rest else ""
    )
    least = f"; points at {NOTHING:g} deg: {NOTHING:g} deg or less" if np.any(rise[stands] == NOTHING) else ""
    figure.suptitle(
        f"{len(table)} encounters, ephemeris {table.meta.get('ephemeris', '-')}; not shown: {hidden}{least}",
    )
    exact = stands & ~bound
    for axes, x, y, rows in (
        (left, distance, rise, np.flatnonzero(exact)[np.argsort(-rise[exact], kind="stable")]),
        (right, rise, margin, np.flatnonzero(stands)[np.argsort(margin[stands], kind="stable")]),
    ):
        named = [
            (x[k], y[k], f"{table['asteroid'][k]} {str(table['time_tdb'][k])[:4]}") for k in rows[:names]
        ]
        label_points(axes, named, np.column_stack([x[stands], y[stands]]), fontsize="x-small")
    return save(figure, path)
