"""Outcome maps: verdicts over periapsis and v_inf, and over the target plane of an encounter.

Verdicts run from light (intact) to dark (disrupted) and carry a letter each, so that the maps can be read in
greyscale and by colour-blind readers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import astropy.units as u
import numpy as np
from astropy.units import Quantity
from numpy.typing import NDArray

from flybystab.body.body import Body
from flybystab.encounter.attitude import periapsis_axes
from flybystab.encounter.encounter import Encounter
from flybystab.errors import InvalidInput
from flybystab.flybys.flyby_many import flyby_many
from flybystab.flybys.verdict import Verdict
from flybystab.orbit.planets import Planet, planet
from flybystab.orbit.target_plane import capture_radius
from flybystab.typing import Array
from flybystab.units import to_si

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


@dataclass(frozen=True, eq=False)
class OutcomeMap:
    """Verdicts over (periapsis, v_inf) for one body at several phases of its spin.

    Attributes
    ----------
    body : Body
    planet : Planet
    periapsis : Quantity (n,)
    v_inf : Quantity (m,)
    verdict : ndarray of str (n, m, k)
        For each of the k phases.
    axis_growth : ndarray (n, m, k)
        Long axis afterwards over before.
    """

    body: Body
    planet: Planet
    periapsis: Quantity
    v_inf: Quantity
    verdict: NDArray[np.str_]
    axis_growth: Array

    @property
    def worst(self) -> NDArray[np.str_]:
        """The most severe verdict over the phases, shape (n, m)."""
        rank = np.vectorize(_ORDER.index, otypes=[int])(self.verdict)
        return np.array(_ORDER, dtype=object)[rank.max(axis=-1)].astype(str)

    @property
    def share_yielding(self) -> Array:
        """Fraction of the phases in which the body yields or hits the planet, shape (n, m)."""
        return np.mean(self.verdict != str(Verdict.INTACT), axis=-1)


def outcome_map(
    body: Body,
    periapsis: Quantity,
    v_inf: Quantity,
    on: str | Planet = "earth",
    *,
    phases: int = 8,
    retrograde: bool = False,
    tolerance: float = 1e-6,
    workers: int | None = None,
) -> OutcomeMap:
    """Verdicts of hyperbolic encounters over a grid, with the spin axis along the orbital angular momentum.

    Parameters
    ----------
    body : Body
    periapsis, v_inf : Quantity (n,), (m,)
        The grid.
    on : str or Planet
        The planet.
    phases : int
        Phases of the spin at the start, uniform over half a turn (an ellipsoid repeats after that).
    retrograde : bool
        Turn the spin axis against the orbital angular momentum.
    tolerance, workers
        As in :func:`flybystab.flyby_many`.

    Raises
    ------
    InvalidInput, UnitMismatch, UnknownName
    """
    q = np.atleast_1d(to_si(periapsis, u.m, "periapsis", shape=None, low=0.0, open_low=True))
    v = np.atleast_1d(to_si(v_inf, u.m / u.s, "v_inf", shape=None, low=0.0))
    if phases < 1:
        raise InvalidInput("phases", phases, "at least one phase")
    where = planet(on)
    flip = np.diag([1.0, -1.0, -1.0]) if retrograde else np.eye(3)
    turns = [_about_z(np.pi * k / phases) @ flip for k in range(phases)]
    encounters = [Encounter.hyperbolic(where, x * u.m, y * u.m / u.s) for x in q for y in v]
    every = [e for e in encounters for _ in turns]
    table = flyby_many(
        [body] * len(every), every, turns * len(encounters), tolerance=tolerance, workers=workers
    )
    shape = (q.size, v.size, phases)
    return OutcomeMap(
        body=body,
        planet=where,
        periapsis=q * u.m,
        v_inf=(v * u.m / u.s).to(u.km / u.s),
        verdict=np.asarray(table.verdict).reshape(shape),
        axis_growth=(table.semi_axes[:, 0].to_value(u.m) / body.axes[0]).reshape(shape),
    )


def outcome_plot(axes: Any, outcomes: OutcomeMap) -> Any:
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
        labels = axes.clabel(lines, fmt=lambda x: f"{x:.0%} of phases yield", fontsize=7, inline=False)
        for label in labels:  # a halo instead of a gap in the line
            label.set_path_effects([withStroke(linewidth=2.5, foreground="white")])
    axes.set_xlabel(f"periapsis (radii of {outcomes.planet.name.capitalize()})")
    axes.set_ylabel("hyperbolic excess speed $v_\\infty$ (km/s)")
    _legend(axes, worst)
    return axes


@dataclass(frozen=True, eq=False)
class TargetMap:
    """Verdicts over the target plane of one direction of arrival.

    Attributes
    ----------
    planet : Planet
    v_inf : Quantity
    b_t, b_r : Quantity (n, m)
        Target-plane coordinates; n impact parameters, m directions.
    verdict : ndarray of str (n, m)
    max_required_friction_angle : Quantity (n, m)
    """

    planet: Planet
    v_inf: Quantity
    b_t: Quantity
    b_r: Quantity
    verdict: NDArray[np.str_]
    max_required_friction_angle: Quantity

    @property
    def capture_radius(self) -> Quantity:
        """Impact parameter of a path that grazes the atmosphere (surface, without one)."""
        v = self.v_inf.to_value(u.m / u.s)
        return (capture_radius(self.planet.gm, self.planet.impact_distance, v) * u.m).to(u.km)


def target_map(
    body: Body,
    v_inf: Quantity,
    periapsis: Quantity,
    directions: int = 24,
    on: str | Planet = "earth",
    *,
    attitude: Any = None,
    tolerance: float = 1e-6,
    workers: int | None = None,
) -> TargetMap:
    """Verdicts of a body with its attitude fixed in space over the target plane.

    Parameters
    ----------
    body : Body
    v_inf : Quantity
        Above zero.
    periapsis : Quantity (n,)
        Of the paths.
    directions : int
        Directions of B, uniform over the circle.
    attitude : ndarray (3, 3), optional
        Body axes -> (S, T, R): along the asymptote, and the two axes of the target plane. By default the
        spin axis is along -R and the long axis along the asymptote, so that paths with B along +T are prograde.
    tolerance, workers
        As in :func:`flybystab.flyby_many`.
    """
    where = planet(on)
    q = np.atleast_1d(to_si(periapsis, u.m, "periapsis", shape=None, low=0.0, open_low=True))
    v = to_si(v_inf, u.m / u.s, "v_inf", low=0.0, open_low=True)
    turn = np.array([[1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0]]) if attitude is None else np.asarray(attitude)
    if attitude is None:
        turn = turn @ np.diag([1.0, -1.0, -1.0])
    angles = 2.0 * np.pi * np.arange(directions) / directions
    impact = capture_radius(where.gm, q, v)
    encounters, rotations = [], []
    for x in q:
        encounter = Encounter.hyperbolic(where, x * u.m, v * u.m / u.s)
        e = 1.0 + x * v * v / where.gm
        # rows: S, B/|B| and S x B/|B| in the frame of the encounter (x periapsis, z angular momentum)
        c = 1.0 / e
        s = np.sqrt(1.0 - c * c)
        frame = periapsis_axes(encounter) @ np.array([[c, s, 0.0], [s, -c, 0.0], [0.0, 0.0, -1.0]]).T
        for angle in angles:
            # (S, T, R) -> (S, B, S x B)
            spin = np.array(
                [[1, 0, 0], [0, np.cos(angle), np.sin(angle)], [0, -np.sin(angle), np.cos(angle)]]
            )
            encounters.append(encounter)
            rotations.append(frame @ spin @ turn)
    table = flyby_many([body] * len(encounters), encounters, rotations, tolerance=tolerance, workers=workers)
    shape = (q.size, directions)
    return TargetMap(
        planet=where,
        v_inf=(v * u.m / u.s).to(u.km / u.s),
        b_t=(impact[:, None] * np.cos(angles) * u.m).to(u.km),
        b_r=(impact[:, None] * np.sin(angles) * u.m).to(u.km),
        verdict=np.asarray(table.verdict).reshape(shape),
        max_required_friction_angle=table.max_required_friction_angle.reshape(shape),
    )


def target_plot(axes: Any, target: TargetMap) -> Any:
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
        fontsize=7,
        zorder=4,
    )
    axes.set_aspect("equal")
    axes.set_xlabel("B.T (km)")
    axes.set_ylabel("B.R (km)")
    _legend(axes, target.verdict)
    return axes


def verdict_points(axes: Any, b: Quantity, verdict: Sequence[str], radius: Quantity | None = None) -> Any:
    """Points (n, 2) of a target plane, shaded by verdict; the impact disc of that radius, if given."""
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

        axes.add_patch(Circle((0, 0), radius.to_value(u.km), fill=False))
    axes.set(xlabel="B.T (km)", ylabel="B.R (km)")
    axes.legend(frameon=False, fontsize=8)
    return axes


def _about_z(angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _ranks(names: NDArray[np.str_]) -> NDArray[np.int64]:
    return np.vectorize(_ORDER.index, otypes=[np.int64])(names)


def _shades() -> dict[str, Any]:
    from matplotlib.colors import ListedColormap

    return {
        "cmap": ListedColormap([shade for _, shade in SCALE.values()]),
        "vmin": -0.5,
        "vmax": len(SCALE) - 0.5,
    }


def _letters(axes: Any, places: Sequence[Array], names: NDArray[np.str_]) -> None:
    for x, y, name in zip(places[0].ravel(), places[1].ravel(), names.ravel(), strict=True):
        letter = SCALE[name][0]
        dark = letter in "DXH"
        if letter != "I":
            axes.text(x, y, letter, ha="center", va="center", fontsize=6, color="white" if dark else "black")


def _legend(axes: Any, names: NDArray[np.str_]) -> None:
    from matplotlib.patches import Patch

    found = [n for n in _ORDER if n in set(names.ravel().tolist())]
    handles = [Patch(facecolor=SCALE[n][1], edgecolor="0.5", label=f"{SCALE[n][0]}  {n}") for n in found]
    axes.legend(handles=handles, fontsize=7, loc="upper right", framealpha=0.9)
