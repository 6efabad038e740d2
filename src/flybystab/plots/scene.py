"""Path and body in three dimensions: figure and animation.

The planet and the path have a common scale, and so do the bodies. A body of a kilometre would be a dot at the scale of
the planet: it is magnified by a factor that the title gives.
"""

from __future__ import annotations

from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING

import astropy.units as u
import numpy as np
from astropy.units import Quantity

from flybystab.encounter.attitude import periapsis_axes
from flybystab.errors import InvalidInput
from flybystab.flybys.result import FlybyResult, History
from flybystab.plots.flyby import BLACK, BLUE, ORANGE, RED
from flybystab.plots.style import new_figure, styled
from flybystab.progress import Progressing, progress_bar
from flybystab.typing import Array, Document

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from mpl_toolkits.mplot3d import Axes3D

#: Colour of the body by regime; light comes from the planet's side, so that shape shows in greyscale.
REGIMES = {"rigid": "0.75", "flowing": ORANGE, "dispersed": RED}
_SOLID: Document = {"linewidth": 0, "antialiased": False, "rstride": 1, "cstride": 1}


def surface(shape: Array, n: int = 25) -> Array:
    """Points (3, 2n, n) of the ellipsoid ``x.S^-1.x = 1`` (m) of a shape tensor S (3, 3), m2."""
    values, vectors = np.linalg.eigh(shape)
    root = vectors @ np.diag(np.sqrt(values)) @ vectors.T
    lon, lat = np.meshgrid(np.linspace(0, 2 * np.pi, 2 * n), np.linspace(0, np.pi, n), indexing="ij")
    ball = np.stack([np.sin(lat) * np.cos(lon), np.sin(lat) * np.sin(lon), np.cos(lat)])
    return np.einsum("ij,jkl->ikl", root, ball)


def scene_plot(
    axes: Axes3D, result: FlybyResult, times: Quantity | None = None, magnification: float | None = None
) -> Axes3D:
    """Plot planet, path and body at several times, in the periapsis frame.

    Parameters
    ----------
    axes : matplotlib Axes3D
    result : FlybyResult
        With its history.
    times : Quantity (n,), optional
        From closest approach; by default seven, evenly along the nearest part of the path.
    magnification : float, optional
        Scale factor of the body; by default such that neighbours do not touch.
    """
    history = _history(result)
    encounter = result.encounter
    turn = periapsis_axes(encounter)
    t = history.time_from_periapsis.to_value(u.s)
    q = encounter.distance.to_value(u.m)
    if times is None:
        inside = t[encounter.distances(t) < 3.5 * max(q, encounter.planet.radius)]
        low, high = (inside[0], inside[-1]) if inside.size > 1 else (t[0], t[-1])
        fine = np.linspace(low, high, 2001)
        way = np.linalg.norm(np.diff(encounter.positions(fine), axis=0), axis=1).cumsum()
        chosen = np.interp(np.linspace(0.0, way[-1], 7), np.concatenate([[0.0], way]), fine)
    else:
        chosen = np.atleast_1d(times.to_value(u.s))
    chosen = np.clip(chosen, t[0], t[-1])
    path = encounter.positions(np.linspace(chosen.min(), chosen.max(), 400)) @ turn.T / 1e6
    places = encounter.positions(chosen) @ turn.T / 1e6
    rows = np.searchsorted(t, chosen).clip(0, len(t) - 1)
    longest = float(history.semi_axes[rows, 0].max().to_value(u.m)) / 1e6
    if magnification is None:
        gaps = np.linalg.norm(np.diff(places, axis=0), axis=1) if len(places) > 1 else np.array([q / 1e6])
        # neither touching its neighbour nor larger than the planet
        size = min(0.45 * gaps.min(), encounter.planet.radius / 1e6)
        magnification = float(f"{size / longest:.1g}")
    planet = surface(np.eye(3) * (encounter.planet.radius / 1e6) ** 2)
    axes.plot_surface(*planet, color=BLUE, **_SOLID)
    axes.plot(*path.T, color=BLACK, lw=0.8)
    for place, row in zip(places, rows, strict=True):
        shape = turn @ history.shape[row].to_value(u.m**2) @ turn.T * (magnification / 1e6) ** 2
        body = surface(shape) + place[:, None, None]
        axes.plot_surface(*body, color=REGIMES[str(history.regime[row])], **_SOLID)
    axes.set_xlabel("x (1000 km)", labelpad=-4)
    axes.set_ylabel("y (1000 km)", labelpad=8)
    axes.set_zticks([])
    name = encounter.planet.name.capitalize()
    text = f"{name} to scale, body enlarged {magnification:,.0f} times; grey: rigid, orange: flowing"
    title = fill(text, int(13.0 * axes.figure.get_figwidth()))
    # The axes fill the figure: further lines go into them.
    axes.set_title(title, pad=6.0 - 12.0 * title.count("\n"))
    limits = np.array([getattr(axes, f"get_{n}lim")() for n in "xyz"])
    # The scene is wide, while matplotlib draws it in a square as high as the figure: let it extend to the sides.
    room, (width, height) = axes.get_position(original=True), axes.figure.get_size_inches()
    axes.set_box_aspect(np.ptp(limits, axis=1), zoom=0.85 * room.width * width / (room.height * height))
    axes.set_in_layout(False)
    for artist in (*axes.collections, *axes.lines):
        artist.set_clip_on(False)
    axes.locator_params(axis="x", nbins=4)
    axes.view_init(elev=50, azim=-10)
    return axes


def body_plot(
    axes: Axes3D, history: History, row: int, turn: Array | None = None, reach: float | None = None
) -> Axes3D:
    """Plot the body at one time of its history, to scale, in km.

    Parameters
    ----------
    axes : matplotlib Axes3D
    history : History
    row : int
        Index of the time.
    turn : ndarray (3, 3), optional
        Rotation matrix, frame of the encounter -> frame of the figure.
    reach : float, optional
        Half of the width of the axes, km.
    """
    turn = np.eye(3) if turn is None else turn
    shape = turn @ history.shape[row].to_value(u.km**2) @ turn.T
    axes.plot_surface(*surface(shape), color=REGIMES[str(history.regime[row])], **_SOLID)
    reach = reach or float(history.semi_axes[row, 0].to_value(u.km))
    for name in "xyz":
        getattr(axes, f"set_{name}lim")(-reach, reach)
        getattr(axes, f"set_{name}label")(f"{name} (km)")
    axes.set_box_aspect((1, 1, 1))
    return axes


@styled
def animation(
    result: FlybyResult,
    path: str | Path,
    title: str = "",
    frames: int = 60,
    rate: int = 15,
    *,
    progress: Progressing = None,
) -> Path:
    """Write an animation: the path around the planet, and the body in a second panel.

    Parameters
    ----------
    result : FlybyResult
        With its history.
    path : str or Path
        ``.gif``, or ``.mp4`` where ffmpeg is installed.
    title : str
    frames, rate : int
        Number of frames, and frames per second.
    progress : bool or function, optional
        Progress bar (:mod:`flybystab.progress`); by default after two seconds on a terminal.

    Raises
    ------
    InvalidInput
        Another suffix, or no ffmpeg for an ``.mp4``.
    """
    from matplotlib.animation import FFMpegWriter, FuncAnimation, PillowWriter
    from matplotlib.patches import Circle

    target = Path(path)
    kind = target.suffix.lower()
    if kind not in (".gif", ".mp4"):
        raise InvalidInput("path", str(path), "a file that ends in .gif or .mp4")
    if kind == ".mp4" and not FFMpegWriter.isAvailable():
        raise InvalidInput("path", str(path), "a .gif: ffmpeg, which writes .mp4, is not installed")
    history = _history(result)
    encounter = result.encounter
    turn = periapsis_axes(encounter)
    t = history.time_from_periapsis.to_value(u.s)
    # Even steps of asinh(t v/q): long ones far from the planet, short ones near it.
    scale = encounter.distance.to_value(u.m) / encounter.v_periapsis.to_value(u.m / u.s)
    moments = scale * np.sinh(np.linspace(np.arcsinh(t[0] / scale), np.arcsinh(t[-1] / scale), frames))
    rows = np.searchsorted(t, moments).clip(0, len(t) - 1)
    inside = np.clip(moments, encounter.t_start, encounter.t_stop)
    places = encounter.positions(inside) @ turn.T / 1e6
    reach = float(history.semi_axes[:, 0].to_value(u.km).max())

    figure = new_figure(8.0, 4.2, dpi=80)
    left = figure.add_subplot(1, 2, 1)
    right: Axes3D = figure.add_subplot(1, 2, 2, projection="3d")
    left.add_patch(Circle((0, 0), encounter.planet.radius / 1e6, color=BLUE))
    left.plot(places[:, 0], places[:, 1], color="0.6", lw=0.8)
    (dot,) = left.plot([], [], "o", color=BLACK, ms=5)
    left.set(aspect="equal", xlabel="x, towards periapsis (1000 km)", ylabel="y (1000 km)")
    # The motion far from the planet, while the body settles, is outside this panel.
    far = encounter.start_distance.to_value(u.km) / 1e3
    near = np.linalg.norm(places, axis=1) <= far
    left.set_ylim(1.1 * places[near, 1].min(), 1.1 * places[near, 1].max())
    left.locator_params(axis="x", nbins=3)

    def draw(k: int) -> list[Artist]:
        dot.set_data([places[k, 0]], [places[k, 1]])
        right.clear()
        body_plot(right, history, int(rows[k]), turn, reach)
        right.view_init(elev=90, azim=-90)
        right.set_zticks([])
        right.set_zlabel("")
        right.set_title(f"{history.regime[rows[k]]}, {moments[k] / 3600.0:+.2f} h")
        return [dot]

    figure.suptitle(title)
    film = FuncAnimation(figure, draw, frames=frames)
    writer = PillowWriter(fps=rate) if kind == ".gif" else FFMpegWriter(fps=rate)
    with progress_bar(progress, frames, "pictures", target.name) as tick:
        # The style has a higher resolution for pictures, which would make films large.
        film.save(target, writer=writer, dpi=figure.dpi, progress_callback=lambda k, _: tick(k + 1))
    return target


def _history(result: FlybyResult) -> History:
    if result.history is None:
        raise InvalidInput("result", "without history", "the result of flyby(..., history=True)")
    return result.history
