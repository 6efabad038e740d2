"""Figures of equilibrium and stability: functions that take matplotlib axes and return them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import astropy.units as u
import numpy as np
from astropy.units import Quantity

from flybystab.body.body import DEFAULT_SURFACE, Body, Material
from flybystab.body.equilibrium import failure_distance, spin_limits
from flybystab.body.fluids import jacobi, maclaurin
from flybystab.body.perturbation import push
from flybystab.body.stability import stability
from flybystab.body.stability_regions import stability_map
from flybystab.constants import G
from flybystab.plots.labels import label_points
from flybystab.typing import Document

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.patches import Patch

BLACK, ORANGE, SKY, GREEN, BLUE, RED = "#000000", "#E69F00", "#56B4E9", "#009E73", "#0072B2", "#D55E00"
STYLES = ("-", "--", ":", "-.")
ANGLES = (1, 5, 10, 20, 30, 40)


def _mark(axes: Axes, points: Mapping[str, tuple[float, float]], named: Sequence[str] | None) -> None:
    """Mark points, with labels at those of `named` (all by default). Call it last: labels avoid what is drawn."""
    shown = [name for name in points if named is None or name in named]
    for name, (x, y) in points.items():
        axes.plot(x, y, "o", ms=4 if name in shown else 2, color=BLACK, mec="white", mew=0.4, zorder=5)
    everywhere = np.array(list(points.values())).reshape(-1, 2)
    label_points(axes, [(*points[name], name) for name in shown], everywhere, fontsize="x-small")


def axis_ratios(bodies: Mapping[str, Body]) -> dict[str, tuple[float, float]]:
    """``(a2/a1, a3/a1)`` of bodies, to be marked on :func:`regions_plot`."""
    return {name: (float(b.axes[1] / b.axes[0]), float(b.axes[2] / b.axes[0])) for name, b in bodies.items()}


def regions_plot(
    axes: Axes,
    w2: float = 0.0,
    angles: Sequence[float] = ANGLES,
    *,
    yield_surface: str = DEFAULT_SURFACE,
    bodies: Mapping[str, Body] | None = None,
    named: Sequence[str] | None = None,
    cells: int = 200,
    legend: bool = True,
) -> Axes:
    """Plot the required friction angle at one spin ``w2 = omega^2/(pi G rho)`` over the plane of axis ratios.

    One contour per angle (deg); shapes between the contours of an angle are in equilibrium with it. Grey: no friction
    angle suffices. Hatched: unstable to infinitesimal perturbations at exactly the required friction angle (associative
    flow). Fluid shapes require zero. `bodies` are marked by their axis ratios, regardless of their spin; `named` are
    those with a label (all by default).
    """
    ratio = np.linspace(0.05, 1.0, cells)
    table = stability_map(
        ratio[None, :], ratio[:, None], w2, 40 * u.deg, yield_surface=yield_surface, depth="friction"
    )
    shape = table.level >= 0
    required = np.where(shape, np.minimum(table.required_friction_angle.to_value(u.deg), 90.0), np.nan)
    if np.nanmax(required) >= 90.0:
        axes.contourf(ratio, ratio, required, levels=[89.0, 91.0], colors=["0.8"])
    # Stability costs some hundred times as much as the angle: half the cells in each direction.
    coarse = np.linspace(0.05, 1.0, max(2, cells // 2))
    perturbed = stability_map(
        coarse[None, :],
        coarse[:, None],
        w2,
        40 * u.deg,
        yield_surface=yield_surface,
        depth="infinitesimal",
    )
    unstable = np.where((perturbed.level >= 0) & (perturbed.curvature_at_yield < 0.0), 1.0, 0.0)
    if unstable.any():
        hatched = axes.contourf(coarse, coarse, unstable, levels=[0.5, 1.5], colors="none", hatches=["////"])
        hatched.set_edgecolor("0.55")
        hatched.set_linewidth(0.0)
    if np.nanmin(required) < max(angles):
        # dark to light with increasing angle, and labels on the lines, for greyscale
        lines = axes.contour(
            ratio, ratio, required, levels=sorted(angles), cmap="viridis", linewidths=1.3, vmin=0, vmax=45
        )
        axes.clabel(lines, fmt="%g°", fontsize="x-small")
    axes.plot([0, 1], [0, 1], color=BLACK, lw=0.8)
    axes.set_xlim(0, 1)
    axes.set_ylim(0, 1)
    axes.set_xlabel("axis ratio $a_2/a_1$")
    axes.set_ylabel("axis ratio $a_3/a_1$")
    axes.set_title(rf"friction angle required, $\omega^2/\pi G\rho = {w2:g}$")
    _mark(axes, axis_ratios(bodies or {}), named)
    if legend:
        axes.legend(handles=regions_legend(), loc="upper left")
    return axes


def regions_legend() -> list[Patch]:
    """Entries of the legend for the areas of :func:`regions_plot`."""
    from matplotlib.patches import Patch

    unstable = "unstable at the required friction angle"
    return [
        Patch(facecolor="0.8", label="no friction angle suffices"),
        Patch(facecolor="none", edgecolor="0.55", hatch="////", label=unstable),
    ]


def critical_energy_plot(
    axes: Axes, w2: float, friction_angle: Quantity, *, dilatancy: float = 1.0, cells: int = 100
) -> Axes:
    """Plot the minimum critical energy at second order over the plane of axis ratios, over the binding energy."""
    ratio = np.linspace(0.1, 1.0, cells)
    t = stability_map(ratio[None, :], ratio[:, None], w2, friction_angle, dilatancy=dilatancy, depth="second")
    energy = np.where(t.level >= 1, np.minimum(t.energy_second.value, 1.0), np.nan)
    image = axes.pcolormesh(ratio, ratio, energy, shading="nearest", cmap="viridis", vmin=0.0, vmax=1.0)
    axes.figure.colorbar(image, ax=axes, label="critical energy / binding energy (cut at 1)")
    axes.plot([0, 1], [0, 1], color=BLACK, lw=0.8)
    axes.set_xlabel("axis ratio $a_2/a_1$")
    axes.set_ylabel("axis ratio $a_3/a_1$")
    return axes


def spin_plot(
    axes: Axes,
    angles: Sequence[float] = ANGLES,
    *,
    prolate: bool = False,
    yield_surface: str = DEFAULT_SURFACE,
    bodies: Mapping[str, Body] | None = None,
    named: Sequence[str] | None = None,
) -> Axes:
    """Plot the lower and upper spin limit ``omega^2/(pi G rho)`` against ``a3/a1``, one line per friction angle (deg).

    Oblate bodies ``a1 = a2`` with the Maclaurin and, dashed, the Jacobi fluids; or prolate ones ``a2 = a3``.
    """
    ratio = np.linspace(0.1, 1.0, 91)
    shades = [SKY, BLUE, GREEN, ORANGE, RED, BLACK]
    rho = 2000.0
    for i, angle in enumerate(angles):
        limits = np.empty((len(ratio), 2))
        for j, r in enumerate(ratio):
            body = _unit_body((1.0, r, r) if prolate else (1.0, 1.0, r), rho, yield_surface)
            limits[j] = spin_limits(body, angle * u.deg).to_value(u.rad / u.s) ** 2 / (np.pi * G * rho)
        # colour and line style both distinguish the angles
        style: Document = {"color": shades[i % len(shades)], "ls": STYLES[i % len(STYLES)], "lw": 1.2}
        axes.plot(ratio, limits[:, 1], label=f"{angle:g}°", **style)
        axes.plot(ratio, np.where(limits[:, 0] > 0, limits[:, 0], np.nan), **style)
    if not prolate:
        axes.plot(ratio, [maclaurin(r).load for r in ratio], color=BLACK, lw=2, label="Maclaurin")
        fluid = [jacobi(x) for x in np.linspace(0.2, 0.999, 60)]
        axes.plot(
            [f.a3_a1 for f in fluid], [f.load for f in fluid], color=BLACK, lw=2, ls="--", label="Jacobi"
        )
    marks = {
        name: (float(b.axes[2] / b.axes[0]), float(b.omega @ b.omega / (np.pi * G * b.rho)))
        for name, b in (bodies or {}).items()
    }
    axes.set_xlabel("axis ratio $a_3/a_1$" + (" (prolate)" if prolate else " (oblate)"))
    axes.set_ylabel(r"$\omega^2/\pi G\rho$")
    if marks:
        axes.plot([], [], "o", ms=2, color=BLACK, label="asteroids")
    axes.legend(fontsize="x-small", title="friction angle", title_fontsize="x-small")
    _mark(axes, marks, named)
    return axes


def barrier_plot(axes: Axes, body: Body, *, dilatancy: float = 1.0, longest: float | None = None) -> Axes:
    """Plot the energy lost by a perturbation against its strain: second order, third order, whole path.

    The direction is that of the lowest barrier, up to 1.3 times its strain. The point marks the barrier: a maximum, or
    the axis ratio of 6:1 at which the model ends.
    """
    s = stability(body, dilatancy=dilatancy)
    ends = s.critical_strain.barrier
    if longest is None:
        longest = 1.3 * ends if 0.0 < ends < np.inf else 2.0
    strain = np.linspace(0.0, longest, 201)
    way = s.directions.barrier if np.all(np.isfinite(s.directions.barrier)) else s.direction
    p = push(body, way, strain, dilatancy=dilatancy)
    binding = s.binding_energy.to_value(u.J)
    for loss, name, color, style in zip(
        p.loss,
        ("second order", "third order", "whole path"),
        (SKY, ORANGE, BLACK),
        (":", "--", "-"),
        strict=True,
    ):
        axes.plot(strain, loss.to_value(u.J) / binding, color=color, ls=style, label=name)
    if 0.0 < ends < np.inf and not s.at_apex.barrier:
        top = s.critical_energy.barrier.to_value(u.J) / binding
        words = {"maximum": "barrier", "edge": "barrier: axis ratio of 6:1"}
        axes.plot(ends, top, "o", color=RED, zorder=5, label=words.get(s.barrier_kind, "barrier"))
    axes.set_xlabel("strain of the perturbation")
    axes.set_ylabel("kinetic energy lost / binding energy")
    lost = p.loss.barrier.to_value(u.J) / binding
    top = max(float(lost.max()), 1e-12)
    axes.set_ylim(max(-0.3 * top, min(-0.03 * top, 1.1 * float(lost.min()))), 1.4 * top)
    axes.legend()
    return axes


def failure_distance_plot(
    axes: Axes,
    bodies: Mapping[str, Body],
    mass_parameter: Quantity,
    radius: Quantity,
    *,
    synchronous: bool = False,
) -> Axes:
    """Plot the static failure distance, in planetary radii, against the friction angle, one line per body."""
    angles = np.linspace(1.0, 60.0, 119) * u.deg
    for i, (name, body) in enumerate(bodies.items()):
        d = failure_distance(body, mass_parameter, angles, synchronous=synchronous)
        color = (BLACK, BLUE, RED, GREEN, ORANGE, SKY)[i % 6]
        ratio = (d / radius).to_value(u.dimensionless_unscaled)
        axes.plot(angles.value, ratio, color=color, ls=STYLES[i % 4], label=name)
    axes.axhline(1.0, color="0.5", lw=0.8)  # the surface
    axes.set_xlabel("friction angle (deg)")
    axes.set_ylabel("failure distance (planetary radii)")
    axes.legend()
    return axes


def _unit_body(ratios: tuple[float, float, float], rho: float, yield_surface: str) -> Body:
    return Body(np.array(ratios) * u.km, rho * u.kg / u.m**3, material=Material(yield_surface=yield_surface))
