"""The figure of each kind of result, for ``result.plot()``."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import singledispatch

import astropy.units as u
import numpy as np
from matplotlib.axes import Axes  # evaluated with the annotations by singledispatch
from numpy.typing import ArrayLike

from flybystab.body.bounds import Requirements
from flybystab.body.perturbation import Push
from flybystab.body.stability import Stability
from flybystab.body.surface_history import SurfaceHistory
from flybystab.body.surface_slope import SlopeChange, SurfaceSlopes
from flybystab.encounter.distribution import EncounterDistribution
from flybystab.encounter.linear_target_plane import LinearPlane
from flybystab.errors import InvalidInput
from flybystab.flybys.binary import BinarySample
from flybystab.flybys.critical import CriticalValues
from flybystab.flybys.grains_outcome import GrainsCourse, GrainsOutcome, GrainsRun
from flybystab.flybys.history import History
from flybystab.flybys.outcome_map import OutcomeMap, TargetMap
from flybystab.flybys.result import FlybyResult
from flybystab.flybys.spin_forecast import SpinForecast
from flybystab.flybys.spin_sample import SpinSample
from flybystab.flybys.survival import Survival
from flybystab.flybys.table import FlybyTable
from flybystab.plots import distributions, screening
from flybystab.plots.flyby import BLUE, axes_plot, described, flyby_panels, friction_plot, spin_plot
from flybystab.plots.grains import grains_plot
from flybystab.plots.labels import subject_title
from flybystab.plots.outcome_map import outcome_plot, target_plot
from flybystab.plots.population import rate_plot, verdict_plot
from flybystab.plots.stability import barrier_plot
from flybystab.plots.style import new_axes, styled
from flybystab.population.rates import EncounterRates
from flybystab.population.verdict_rates import DisruptionRates
from flybystab.result_table import ResultTable


def plot_result(
    result: object, axes: Axes | Sequence[Axes] | None = None, **options: object
) -> Axes | Sequence[Axes]:
    """Plot a result into axes, new ones by default.

    Parameters
    ----------
    result
        Result of an encounter, of several, or of a map.
    axes : matplotlib Axes, or four of them for a :class:`FlybyResult`
    options
        Options of the figure: `what` for a history ("semi-axes", "spin" or "friction angle" with `limit`).

    Returns
    -------
    Axes, or an array of them

    Raises
    ------
    InvalidInput
        There is no figure of this kind of result.
    """
    if axes is None:
        return _plot_alone(result, **options)
    given = np.asarray(axes, dtype=object).ravel()
    if not len(given) or not all(hasattr(one, "plot") for one in given):
        raise InvalidInput("axes", axes, "matplotlib axes")
    return _plot(result, axes, **options)


@styled
def _plot_alone(result: object, **options: object) -> Axes | Sequence[Axes]:
    return _plot(result, new_axes(4 if isinstance(result, FlybyResult) else 1), **options)


@singledispatch
def _plot(result: object, axes: Axes | Sequence[Axes], **options: object) -> Axes | Sequence[Axes]:
    known = ", ".join(kind.__name__ for kind in _plot.registry if kind is not object)
    raise InvalidInput("result", result, f"a result that has a figure: {known}")


@_plot.register
def _(result: FlybyResult, axes: Sequence[Axes]) -> Sequence[Axes]:
    flyby_panels(axes, result)
    planet = result.encounter.planet.name.capitalize()
    axes[0].set_title(f"{planet}; {described(result.inputs.body)}: {result.verdict}")
    return axes


@_plot.register
def _(result: History, axes: Axes, what: str = "semi-axes", limit: u.Quantity | None = None) -> Axes:
    if what == "friction angle":
        if limit is None:
            raise InvalidInput("limit", limit, "the friction angle of the material")
        friction_plot(axes, result, limit)
    elif what in _HISTORY:
        _HISTORY[what](axes, result)
    else:
        raise InvalidInput("what", what, f"one of {', '.join(_HISTORY)}, friction angle")
    return axes


#: Quantities of a history that can be plotted without further arguments.
_HISTORY = {"semi-axes": axes_plot, "spin": spin_plot}


@_plot.register
def _(result: OutcomeMap, axes: Axes) -> Axes:
    return outcome_plot(axes, result)


@_plot.register
def _(result: TargetMap, axes: Axes) -> Axes:
    return target_plot(axes, result)


@_plot.register
def _(result: SpinSample, axes: Axes) -> Axes:
    axes.scatter(result.pole_change.to_value(u.deg), result.spin_ratio, s=14, color=BLUE)
    axes.set(xlabel="rotation of the spin axis (deg)", ylabel="spin rate after / before")
    sample = f"{len(result)} attitudes, pole {'known' if result.pole_known else 'unknown'}"
    return subject_title(axes, result.subject, sample)


@_plot.register
def _(result: CriticalValues, axes: Axes) -> Axes:
    unit = "radii of the planet" if result.quantity == "periapsis" else str(result.value.unit)
    axes.plot(result.phase.to_value(u.deg), result.value.value, "o-", color=BLUE)
    axes.set_xlabel("spin phase at closest approach (deg)")
    axes.set_ylabel(f"least {result.quantity.replace('_', ' ')} ({unit})\nfor {result.outcome}")
    failing = int(np.isinf(result.value.value).sum())
    note = f"no value of the range suffices at {failing} of {len(result)} phases" if failing else ""
    return subject_title(axes, result.subject, note)


@_plot.register
def _(result: Stability, axes: Axes) -> Axes:
    return barrier_plot(axes, result.body, dilatancy=result.dilatancy)


@_plot.register
def _(result: EncounterRates, axes: Axes) -> Axes:
    return rate_plot(axes, [result])


@_plot.register
def _(result: DisruptionRates, axes: Axes) -> Axes:
    return verdict_plot(axes, result)


#: Figures without options, by class of result.
_DISTRIBUTIONS: Mapping[type, Callable[..., Axes]] = {
    SurfaceSlopes: distributions.slope_plot,
    SlopeChange: distributions.slope_change_plot,
    SurfaceHistory: distributions.surface_history_plot,
    EncounterDistribution: distributions.distribution_plot,
    SpinForecast: distributions.forecast_plot,
    BinarySample: distributions.binary_plot,
    GrainsOutcome: distributions.grains_outcome_plot,
    GrainsCourse: distributions.grains_course_plot,
    LinearPlane: distributions.linear_plane_plot,
    Push: distributions.push_plot,
    Requirements: distributions.requirements_plot,
}


def _register(kind: type, function: Callable[..., Axes]) -> None:
    @_plot.register(kind)
    def _(result: object, axes: Axes) -> Axes:
        return function(axes, result)


for _kind, _function in _DISTRIBUTIONS.items():
    _register(_kind, _function)


@_plot.register
def _(result: GrainsRun, axes: Axes) -> Axes:
    grains_plot(axes, result, len(result.course) - 1)
    axes.set_ylabel("y (km)")
    axes.set_title(f"{result.largest_fraction:.0%} of the mass in the largest clump, colours by clump")
    return axes


@_plot.register
def _(result: FlybyTable, axes: Axes) -> Axes:
    return _counts(axes, result.verdict)


@_plot.register
def _(result: Survival, axes: Axes) -> Axes:
    return _counts(axes, result.verdict)


@_plot.register
def _(result: ResultTable, axes: Axes, **options: object) -> Axes:
    figure = _TABLES.get(result.kind())
    if figure is None:
        names = ", ".join(result.colnames)
        raise InvalidInput("result", f"a table with the columns {names}", f"a table of {', '.join(_TABLES)}")
    return figure(axes, result, **options)


#: Figures of tables, by their kind.
_TABLES: Mapping[str, Callable[..., Axes]] = {
    "encounters with verdicts": screening.rise_plot,
    "encounters": screening.encounters_plot,
    "possible impacts": screening.impacts_plot,
    "bounds on the material": screening.bounds_plot,
}


def _counts(axes: Axes, verdict: ArrayLike) -> Axes:
    """Bars with the number of rows of each verdict."""
    names, counts = np.unique(np.asarray(verdict, dtype=str), return_counts=True)
    bars = axes.barh(names, counts, color=BLUE)
    axes.bar_label(bars, padding=2)
    axes.margins(x=0.1)  # room for the numbers
    axes.set_xlabel("number of rows")
    return axes
