"""Figures of a pile of grains in an encounter: grains at one time, the largest clump against time, an animation.

Grains are drawn to scale in the plane of the orbit, seen from the direction of the orbital angular momentum. The colour
is that of the clump to which a grain belongs at the end; grains of no clump are grey.
"""

from __future__ import annotations

from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, cast

import astropy.units as u
import numpy as np
from matplotlib.collections import EllipseCollection

from flybystab.encounter.attitude import periapsis_axes
from flybystab.errors import InvalidInput
from flybystab.flybys.batch import span_of
from flybystab.flybys.grains_outcome import GrainsOutcome, GrainsRun, piles_of
from flybystab.flybys.result import FlybyResult
from flybystab.plots.flyby import BLACK
from flybystab.plots.style import NARROW, new_figure, save, styled
from flybystab.progress import Progressing, progress_bar
from flybystab.typing import Array, Document

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Colours of clumps, the most massive first; then they repeat.
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#f0e442", "#7f3c8d")
LOOSE = "0.7"


def grains_plot(
    axes: Axes, run: GrainsRun, row: int, turn: Array | None = None, reach: float | None = None
) -> Axes:
    """Plot the grains of a run at one time, km.

    Parameters
    ----------
    axes : matplotlib Axes
    run : GrainsRun
    row : int
        Index of the time in its course.
    turn : ndarray (3, 3), optional
        Rotation matrix, frame of the encounter -> frame of the figure.
    reach : float, optional
        Half of the width of the axes, km; by default they hold all clumps.
    """
    x = run.course.positions[row].to_value(u.km) @ (np.eye(3) if turn is None else turn).T
    r = run.radius.to_value(u.km)
    held = np.isfinite(x).all(axis=1)
    biggest = held & (run.label == 0)
    centre = x[biggest].mean(axis=0) if biggest.any() else np.zeros(3)
    order = np.flatnonzero(held)[np.argsort(x[held, 2])]
    place = x[order, :2] - centre[:2]
    colours = [COLOURS[k % len(COLOURS)] if k >= 0 else LOOSE for k in run.label[order]]
    size = 2.0 * r[order]
    axes.add_collection(
        EllipseCollection(
            size, size, np.zeros(len(size)), units="xy", offsets=place, offset_transform=axes.transData,
            facecolors=colours, edgecolors=BLACK, linewidths=0.15,
        )
    )  # fmt: skip
    if reach is None:
        inside = run.label[order] >= 0
        reach = 1.1 * float(np.abs(place[inside] if inside.any() else place).max() + r.max())
    axes.set(aspect="equal", xlim=(-reach, reach), ylim=(-reach, reach), xlabel="x (km)")
    axes.locator_params(nbins=5)
    return axes


def grains_scene_plot(
    axes: Axes, result: FlybyResult, magnification: float | None = None, places: int = 7
) -> Axes:
    """Plot planet, path and the pile with the median outcome at several times, in the plane of the orbit, 1000 km.

    The direction of motion at periapsis points to the right, periapsis lies above the planet.

    Parameters
    ----------
    axes : matplotlib Axes
    result : FlybyResult
        Computed with grains.
    magnification : float, optional
        Scale factor of the pile; by default such that neighbours do not touch.
    places : int
        Number of times, evenly along the nearest part of the path.
    """
    from matplotlib.patches import Circle

    run, encounter = _outcome(result).median, result.encounter
    turn = periapsis_axes(encounter)
    t = run.course.time.to_value(u.s)
    q, radius = encounter.distance.to_value(u.m), encounter.planet.radius
    t = t[t <= span_of(encounter)[1]]
    near = t[encounter.distances(t) < 4.5 * max(q, radius)]
    low, high = (near[0], near[-1]) if len(near) > 1 else (t[0], t[-1])
    fine = np.linspace(low, high, 2001)
    path = encounter.positions(fine) @ turn.T / 1e6
    way = np.concatenate([[0.0], np.linalg.norm(np.diff(path, axis=0), axis=1).cumsum()])
    rows = np.unique(
        [int(np.abs(t - x).argmin()) for x in np.interp(np.linspace(0.0, way[-1], places), way, fine)]
    )
    centres = encounter.positions(t[rows]) @ turn.T / 1e6
    clouds = [run.course.positions[row].to_value(u.m) @ turn.T / 1e6 for row in rows]
    if magnification is None:
        gap = np.linalg.norm(np.diff(centres, axis=0), axis=1).min() if len(centres) > 1 else q / 1e6
        longest = max(np.nanpercentile(np.linalg.norm(c, axis=1), 95) for c in clouds)
        magnification = float(f"{min(0.5 * gap, radius / 1e6) / longest:.1g}")
    axes.add_patch(Circle((0.0, 0.0), radius / 1e6, color="0.8", zorder=1))
    axes.plot(path[:, 1], path[:, 0], color=BLACK, lw=0.7, zorder=2)
    size = 2.0 * magnification * run.radius.to_value(u.m) / 1e6
    colours = np.array([COLOURS[k % len(COLOURS)] if k >= 0 else LOOSE for k in run.label])
    for centre, cloud in zip(centres, clouds, strict=True):
        held = np.isfinite(cloud).all(axis=1)
        order = np.flatnonzero(held)[np.argsort(-cloud[held, 2])]
        axes.add_collection(
            EllipseCollection(
                size[order], size[order], np.zeros(len(order)), units="xy",
                offsets=(centre + magnification * cloud[order])[:, [1, 0]], offset_transform=axes.transData,
                facecolors=colours[order], edgecolors="none", zorder=3,
            )
        )  # fmt: skip
    axes.set(aspect="equal", xlabel="y (1000 km)", ylabel="x (1000 km)")
    axes.margins(0.08)
    text = f"{encounter.planet.name.capitalize()} to scale, pile enlarged {magnification:,.0f} times; "
    axes.set_title(
        fill(f"{text}colours: clumps at the end", int(13.0 * cast("Figure", axes.figure).get_figwidth()))
    )
    return axes


@styled
def grains_figure(
    result: FlybyResult, title: str = "", path: str | Path | None = None, *, figure: Figure | None = None
) -> Figure:
    """The pile with the median outcome at four times, and the largest clump of all piles against time.

    Parameters
    ----------
    result : FlybyResult
        Computed with grains.
    title : str
    path : str or Path, optional
        File to write.
    figure : matplotlib Figure, optional
        To draw on; in one narrower than 6 inches the panels are in two columns.

    Returns
    -------
    matplotlib Figure
    """
    outcome = _outcome(result)
    run, turn = outcome.median, periapsis_axes(result.encounter)
    hours = run.course.time.to_value(u.h)
    rows = [0, *(int(np.abs(hours - h).argmin()) for h in (0.7, 1.8)), len(hours) - 1]
    figure = new_figure(11.0, 5.6) if figure is None else figure
    narrow = figure.get_figwidth() < NARROW
    if narrow:
        grid = figure.add_gridspec(4, 2, height_ratios=(1.4, 1.4, 1.0, 1.0))
        stills = [grid[0, 0], grid[0, 1], grid[1, 0], grid[1, 1]]
        share, spin = figure.add_subplot(grid[2, :]), figure.add_subplot(grid[3, :])
    else:
        grid = figure.add_gridspec(2, 4, height_ratios=(1.4, 1.0))
        stills = [grid[0, k] for k in range(4)]
        share, spin = figure.add_subplot(grid[1, :2]), figure.add_subplot(grid[1, 2:])
    for k, row in enumerate(rows):
        axes = figure.add_subplot(stills[k])
        grains_plot(axes, run, row, turn)
        axes.set_title(f"{hours[row]:+.2f} h")
        if k == 0 or (narrow and k == 2):
            axes.set_ylabel("y (km)")
    for one in outcome.runs:
        t = one.course.time.to_value(u.h)
        own: Document = {"color": COLOURS[0] if one is run else "0.7", "lw": 1.5 if one is run else 0.8}
        share.plot(t, one.course.largest_fraction, zorder=3 if one is run else 2, **own)
        spin.plot(t, one.course.semi_axes[:, 0].to_value(u.m), zorder=3 if one is run else 2, **own)
    share.set(xlabel="time from closest approach (h)", ylabel="largest clump / mass", ylim=(0.0, 1.05))
    spin.set(xlabel="time from closest approach (h)", ylabel="its long semi-axis (m)")
    figure.suptitle(
        fill(
            f"{title + ': ' if title else ''}{result.verdict}, {piles_of(len(outcome.runs))}"
            + (", blue: the median one" if len(outcome.runs) > 1 else ""),
            int(11.0 * figure.get_figwidth()),
        )
    )
    if path is not None:
        save(figure, path)
    return figure


@styled
def grains_animation(
    result: FlybyResult,
    path: str | Path,
    title: str = "",
    rate: int = 8,
    *,
    progress: Progressing = None,
) -> Path:
    """Write an animation of the pile with the median outcome, GIF or MP4; `progress` as in :func:`flybystab.flyby`."""
    from matplotlib.animation import FFMpegWriter, FuncAnimation, PillowWriter

    target = Path(path)
    run, turn = _outcome(result).median, periapsis_axes(result.encounter)
    figure = new_figure(5.0, 5.2, dpi=80, layout=None)
    axes: Axes = figure.add_axes((0.16, 0.1, 0.8, 0.8))

    def draw(k: int) -> list[Artist]:
        axes.clear()
        grains_plot(axes, run, k, turn)
        axes.set_title(f"{run.course.time[k].to_value(u.h):+.2f} h")
        axes.set_ylabel("y (km)")
        return []

    figure.suptitle(title)
    film = FuncAnimation(figure, draw, frames=len(run.course))
    writer = PillowWriter(fps=rate) if target.suffix.lower() == ".gif" else FFMpegWriter(fps=rate)
    with progress_bar(progress, len(run.course), "pictures", target.name) as tick:
        film.save(target, writer=writer, progress_callback=lambda k, _: tick(k + 1))
    return target


def _outcome(result: FlybyResult) -> GrainsOutcome:
    if result.grains is None:
        raise InvalidInput("result", result.rung, "the result of flyby(..., grains=) computed with grains")
    return result.grains
