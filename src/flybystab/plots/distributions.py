"""Figures of samples and distributions: slopes of surfaces, orbits of clones, phases, piles of grains.

Functions that take matplotlib axes and return them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import astropy.units as u
import numpy as np
from astropy.units import Quantity

from flybystab.body.bounds import Requirements
from flybystab.body.perturbation import Push
from flybystab.body.surface_history import SurfaceHistory
from flybystab.body.surface_slope import SlopeChange, SurfaceSlopes
from flybystab.encounter.distribution import EncounterDistribution
from flybystab.encounter.linear_target_plane import LinearPlane, ellipse
from flybystab.flybys.binary import BinarySample
from flybystab.flybys.grains_outcome import GrainsCourse, GrainsOutcome
from flybystab.flybys.spin_forecast import SpinForecast
from flybystab.plots.flyby import BLACK, BLUE, ORANGE, RED
from flybystab.plots.labels import subject_title
from flybystab.typing import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def slope_plot(axes: Axes, slopes: SurfaceSlopes) -> Axes:
    """Plot the fraction of the area that is steeper than each slope."""
    _area_above(axes, slopes.slope, slopes.area, BLUE, "-", None)
    return _slope_axes(axes)


def slope_change_plot(axes: Axes, change: SlopeChange) -> Axes:
    """Plot the fraction of the area steeper than each slope, before an encounter and at most during it."""
    _area_above(axes, change.before, change.area, BLACK, "--", "before the encounter")
    _area_above(axes, change.greatest, change.area, RED, "-", "greatest during it")
    axes.legend()
    return _slope_axes(axes)


def _area_above(
    axes: Axes, slope: Quantity, area: Quantity, colour: str, line: str, label: str | None
) -> None:
    order = np.argsort(slope.value)
    weight = area.value[order]
    above = 1.0 - (np.cumsum(weight) - weight) / weight.sum()
    axes.step(slope.to_value(u.deg)[order], above, where="pre", color=colour, ls=line, label=label)


def _slope_axes(axes: Axes) -> Axes:
    axes.set(xlabel="slope (deg)", ylabel="fraction of the area that is steeper", ylim=(0.0, 1.02))
    axes.set_xlim(left=0.0)
    return axes


def surface_history_plot(axes: Axes, history: SurfaceHistory) -> Axes:
    """Plot the change of the slopes against time: median, the middle 90 % and the extremes over the facets."""
    t = history.time.to_value(u.h)
    change = history.change.to_value(u.deg)
    low, mid, high = np.quantile(change, [0.05, 0.5, 0.95], axis=1)
    axes.fill_between(t, low, high, color="0.8", lw=0, label="90 % of the facets")
    axes.plot(t, mid, color=BLUE, label="median")
    axes.plot(t, change.min(axis=1), color=BLACK, ls=":", label="extremes")
    axes.plot(t, change.max(axis=1), color=BLACK, ls=":")
    axes.set(xlabel="time from closest approach (h)", ylabel="change of slope (deg)")
    axes.legend()
    return axes


def distribution_plot(axes: Axes, distribution: EncounterDistribution) -> Axes:
    """Plot clones on the target plane, with the 1-sigma ellipse of the linear map and the disc of impacts."""
    points = distribution.b[distribution.found].to_value(u.km)
    hit = distribution.impact[distribution.found]
    axes.plot(*points[~hit].T, ".", color=BLUE, ms=3, label=f"clones that miss ({(~hit).sum()})")
    if hit.any():
        axes.plot(*points[hit].T, "x", color=RED, ms=4, label=f"clones that hit ({hit.sum()})")
    linear = distribution.linear
    if linear is not None:
        axes.plot(*_ellipse_points(linear, 1.0), color=BLACK, lw=1, label="1-sigma ellipse")
    speed = np.median(distribution.v_inf[distribution.found].to_value(u.m / u.s)) if len(points) else np.nan
    radius = distribution.planet.impact_distance
    if speed > 0.0 and np.linalg.norm(np.median(points, axis=0)) < 30.0 * radius / 1e3:
        from matplotlib.patches import Circle

        disc = radius * np.sqrt(1.0 + 2.0 * distribution.planet.gm / (radius * speed**2)) / 1e3
        label = f"hits {distribution.planet.name.capitalize()}"
        axes.add_patch(Circle((0, 0), disc, facecolor="0.85", edgecolor=BLACK, hatch="//", label=label))
        axes.autoscale_view()
        axes.set_aspect("equal", adjustable="datalim")
    axes.set(xlabel="B.T (km)", ylabel="B.R (km)")
    axes.legend()
    axes.set_title(f"{distribution.planet.name.capitalize()}, {distribution.time.tdb.iso[:10]}")
    return axes


def linear_plane_plot(axes: Axes, plane: LinearPlane) -> Axes:
    """Plot the target plane of a linear map: the 1-sigma and the 3-sigma ellipse about the nominal point."""
    for sigmas, line in ((1.0, "-"), (3.0, "--")):
        outline = _ellipse_points(plane, sigmas)
        axes.plot(*outline, color=BLUE, ls=line, label=f"{sigmas:g} sigma")
    axes.plot(*plane.centre.to_value(u.km), "+", color=BLACK, label="nominal orbit")
    axes.set(xlabel="B.T (km)", ylabel="B.R (km)")
    axes.legend()
    return axes


def _ellipse_points(plane: LinearPlane, sigmas: float) -> Array:
    """Points (2, n) of an ellipse of a linear map on the target plane, km."""
    long, short, direction = ellipse(plane.covariance)
    around = np.linspace(0.0, 2.0 * np.pi, 181)
    x = sigmas * long.to_value(u.km) * np.cos(around)
    y = sigmas * short.to_value(u.km) * np.sin(around)
    c, s = np.cos(direction.to_value(u.rad)), np.sin(direction.to_value(u.rad))
    return np.asarray(plane.centre.to_value(u.km)[:, None] + np.stack([c * x - s * y, s * x + c * y]))


def push_plot(axes: Axes, found: Push) -> Axes:
    """Plot the kinetic energy lost by a perturbation against its strain: two expansions and the whole path."""
    for values, name, colour, line in (
        (found.loss.second, "to second order", BLUE, ":"),
        (found.loss.third, "to third order", ORANGE, "--"),
        (found.loss.barrier, "on the whole path", BLACK, "-"),
    ):
        axes.plot(found.strain, values.to_value(u.J), color=colour, ls=line, label=name)
    axes.set(xlabel="strain", ylabel="kinetic energy lost (J)")
    axes.legend()
    return axes


def forecast_plot(axes: Axes, forecast: SpinForecast) -> Axes:
    """Plot the periods after an encounter, sorted, over the sampled rotation phases."""
    share = (np.arange(len(forecast)) + 0.5) / len(forecast)
    for values, name, colour, line in (
        (forecast.precession_period, "precession", BLUE, "-"),
        (forecast.effective_period, "effective", BLACK, "--"),
        (forecast.rotation_period, "rotation about the own axis", ORANGE, ":"),
    ):
        hours = np.sort(values.to_value(u.h))
        kept = np.isfinite(hours)
        if kept.any():
            axes.step(hours[kept], share[kept], where="mid", color=colour, ls=line, label=name)
    axes.set(
        xlabel="period after the encounter (h)", ylabel="fraction of the rotation phases", ylim=(0.0, 1.0)
    )
    axes.legend()
    return subject_title(axes, forecast.subject)


def binary_plot(axes: Axes, sample: BinarySample) -> Axes:
    """Plot eccentricity against semi-major axis of the mutual orbits that stay bound; the legend counts the others."""
    bound = sample.fate == "bound"
    axes.plot(
        sample.semi_major_axis[bound].to_value(u.km), sample.eccentricity[bound], "o", color=BLUE, ms=3,
        label=f"bound ({bound.sum()})",
    )  # fmt: skip
    for fate in ("escape", "collision"):
        if np.any(sample.fate == fate):
            axes.plot([], [], ls="none", label=f"{fate} ({np.sum(sample.fate == fate)}), not shown")
    axes.set(xlabel="semi-major axis of the mutual orbit (km)", ylabel="eccentricity", ylim=(0.0, None))
    axes.legend()
    return subject_title(axes, sample.subject)


def grains_outcome_plot(axes: Axes, outcome: GrainsOutcome) -> Axes:
    """Plot the mass fractions of the largest clump, and of all grains bound to it, of each pile."""
    largest = np.array([run.largest_fraction for run in outcome.runs])
    bound = np.array([run.bound_fraction for run in outcome.runs])
    order = np.argsort(largest)
    place = np.arange(1, len(order) + 1)
    axes.bar(place, bound[order], color="0.85", edgecolor=BLACK, hatch="//", label="bound to it")
    axes.bar(place, largest[order], color=BLUE, edgecolor=BLACK, label="largest clump")
    axes.set(xlabel="pile, by the mass of its largest clump", ylabel="fraction of the mass", ylim=(0.0, 1.05))
    axes.set_xticks(place)
    axes.legend(loc="lower right")
    return axes


def grains_course_plot(axes: Axes, course: GrainsCourse) -> Axes:
    """Plot the mass fractions of the largest clump, and of all grains bound to it, against time."""
    t = course.time.to_value(u.h)
    axes.plot(t, course.bound_fraction, color=ORANGE, ls="--", label="bound to it")
    axes.plot(t, course.largest_fraction, color=BLUE, label="largest clump")
    axes.set(xlabel="time from closest approach (h)", ylabel="fraction of the mass", ylim=(0.0, 1.05))
    axes.legend()
    return axes


def requirements_plot(axes: Axes, found: Requirements) -> Axes:
    """Plot the fraction of the samples that are in equilibrium at each friction angle."""
    phi = np.sort(found.friction_angle.to_value(u.deg))
    share: Array = (np.arange(len(phi)) + 1.0) / len(phi)
    finite = np.isfinite(phi)
    axes.step(phi[finite], share[finite], where="post", color=BLUE)
    axes.set(xlabel="friction angle (deg)", ylabel="fraction of the samples in equilibrium", ylim=(0.0, 1.02))
    return axes
