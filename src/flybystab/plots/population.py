"""Figures of the rates of a population: functions that take matplotlib axes and return them, and one figure of all."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import astropy.units as u
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FormatStrFormatter, LogLocator, NullFormatter

from flybystab.arguments import check_arguments
from flybystab.errors import InvalidInput
from flybystab.flybys.verdict import Verdict
from flybystab.plots.labels import literal
from flybystab.plots.style import new_figure, styled
from flybystab.population.rates import EncounterRates
from flybystab.population.verdict_rates import CHANGED, DisruptionRates

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Line style of matplotlib: a name, or offset and lengths of dashes.
Line = str | tuple[int, tuple[int, ...]]
#: Colours (Okabe & Ito) and line styles of the planets, distinguishable in greyscale.
PLANETS: dict[str, tuple[str, Line]] = {
    "mercury": ("#000000", ":"),
    "venus": ("#E69F00", "--"),
    "earth": ("#0072B2", "-"),
    "mars": ("#D55E00", "-."),
    "jupiter": ("#009E73", (0, (5, 1, 1, 1, 1, 1))),
}
#: Verdicts of the panel against size, each with its name, colour and line.
_SIZES = (
    (CHANGED, "reshaped, shedding or disrupted", "#0072B2", "-"),
    (
        (Verdict.MASS_LOSS, Verdict.DISRUPTED, Verdict.BEYOND_MODEL),
        "shedding, disrupted or beyond 6:1",
        "#D55E00",
        "--",
    ),
)


def _line(name: str) -> tuple[str, Line]:
    return PLANETS.get(name, ("0.4", "-"))


def rate_plot(axes: Axes, rates: Sequence[EncounterRates]) -> Axes:
    """Plot the rate of encounters within a periapsis distance (planetary radii), one line per planet."""
    for one in rates:
        q = np.geomspace(1.0, 30.0, 40)
        total = [one.within(x * one.planet.radius * u.m).total.to_value(1 / u.Myr) for x in q]
        if not any(total):
            continue
        colour, style = _line(one.planet.name)
        axes.loglog(q, total, color=colour, ls=style, label=one.planet.name.capitalize())
    axes.set(
        xlabel="periapsis distance (radii of the planet)", ylabel="encounters within the distance (1/Myr)"
    )
    axes.set_title("Encounters of the population")
    axes.legend()
    return axes


def verdict_plot(axes: Axes, result: DisruptionRates) -> Axes:
    """Plot the rate of each change by planet as bars with sampling errors; verdicts without samples are left out."""
    planets = list(dict.fromkeys(str(p) for p in result.table["planet"]))
    shown = [v for v in CHANGED if result.rate(v).value > 0.0]
    width = 0.8 / max(1, len(shown))
    least = np.inf
    hatches = ("", "////", "....", "xxxx")
    for k, verdict in enumerate(shown):
        rows = [
            result.table[(result.table["planet"] == p) & (result.table["verdict"] == str(verdict))]
            for p in planets
        ]
        rate = np.array([r["rate"].to_value(1 / u.Myr).sum() for r in rows])
        error = np.array([np.sqrt((r["rate_error"].to_value(1 / u.Myr) ** 2).sum()) for r in rows])
        bars = axes.bar(
            np.arange(len(planets)) + (k - 0.5 * (len(shown) - 1)) * width,
            rate,
            width,
            yerr=np.where(rate > 0.0, error, 0.0),
            label=str(verdict).capitalize(),
            color=("#56B4E9", "#E69F00", "#D55E00", "#009E73")[k % 4],
            edgecolor="black",
            linewidth=0.6,
            error_kw={"lw": 0.8},
        )
        least = min(least, rate[rate > 0.0].min())
        for bar in bars:
            bar.set_hatch(hatches[k % 4])
    axes.set_xticks(np.arange(len(planets)), [p.capitalize() for p in planets])
    axes.set(xlabel="planet", ylabel="rate in the population (1/Myr)", yscale="log" if shown else "linear")
    axes.set_title("Verdicts by planet")
    if shown:
        axes.set_ylim(bottom=0.3 * least)
        axes.legend()
    return axes


def probability_plot(axes: Axes, result: DisruptionRates, planet_name: str = "earth") -> Axes:
    """Plot the probability of a change (reshaped or worse) over periapsis and hyperbolic excess speed at one planet."""
    here = result.samples["planet"] == planet_name
    if not np.any(here):
        axes.set_title(f"{planet_name.capitalize()}: no encounters sampled")
        return axes
    speed = result.samples["v_inf"][here].to_value(u.km / u.s)
    edges_v = np.unique(np.round(np.quantile(speed, np.linspace(0.0, 1.0, 7)), 1))
    if len(edges_v) < 2:
        edges_v = np.array([speed.min() - 0.5, speed.max() + 0.5])
    edges_q = np.linspace(1.0, 5.0, 9)
    share = result.outcome_map(edges_q, edges_v * u.km / u.s, planet_name=planet_name)
    image = axes.pcolormesh(
        edges_q, edges_v, share, cmap="viridis", vmin=0.0, vmax=max(0.05, np.nanmax(share))
    )
    axes.figure.colorbar(image, ax=axes, label="probability of a change of shape")
    axes.set(xlabel="periapsis distance (radii of the planet)", ylabel="hyperbolic excess speed (km/s)")
    axes.set_title(f"Reshaped or worse at {planet_name.capitalize()}")
    return axes


def size_plot(axes: Axes, result: DisruptionRates) -> Axes:
    """Plot the cumulative rate of changes against diameter; for bodies of one size the rate is the same below it."""
    sizes = result.samples["diameter"].to_value(u.km)
    if len(sizes) == 0:
        return axes
    low, high = sizes.min(), sizes.max()
    grid = np.geomspace(low * 0.8, high * 1.2, 80)
    for verdicts, name, colour, style in _SIZES:
        rate = result.cumulative(grid * u.km, *verdicts).to_value(1 / u.Myr)
        if rate.max() > 0.0:
            axes.loglog(grid, np.where(rate > 0.0, rate, np.nan), color=colour, ls=style, label=name)
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter(FormatStrFormatter("%g"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set(xlabel="diameter (km)", ylabel="rate for larger bodies (1/Myr)")
    axes.set_title("Cumulative rate against size")
    axes.legend()
    return axes


def contributor_plot(axes: Axes, result: DisruptionRates, names: Sequence[str] | None = None) -> Axes:
    """Plot the rates of the orbits that contribute most to the changes, with 1-sigma sampling errors.

    Parameters
    ----------
    axes : matplotlib Axes
    result : DisruptionRates
    names : sequence of str, optional
        Names of the rows of the population; their numbers by default.

    Raises
    ------
    InvalidInput
        Fewer names than rows of the population that contribute.
    """
    most = result.contributors()[::-1]
    if names is not None and len(most) and len(names) <= (last := int(np.max(most["orbit"]))):
        raise InvalidInput(
            "names", f"{len(names)} names", f"one name a row of the population, more than {last}"
        )
    rate = most["rate"].to_value(1 / u.Myr)
    label = [f"row {k}" if names is None else literal(str(names[int(k)])) for k in most["orbit"]]
    axes.barh(
        label,
        rate,
        xerr=rate / np.sqrt(np.maximum(most["samples"], 1)),
        color="#56B4E9",
        edgecolor="black",
        linewidth=0.6,
        ecolor="0.2",
        capsize=2,
    )
    axes.set(xlabel="rate of changes (1/Myr)", xlim=(0.0, None))
    axes.set_title("Largest contributors: reshaped, shedding or disrupted")
    return axes


@check_arguments
@styled
def population_figure(
    result: DisruptionRates, rates: Sequence[EncounterRates], names: Sequence[str] | None = None
) -> Figure:
    """Encounters, verdicts by planet, probability over periapsis and speed, rates against size, largest contributors.

    `names` are those of the rows of the population, as in `contributor_plot`.
    """
    if not isinstance(rates, list | tuple) or not all(hasattr(one, "within") for one in rates) or not rates:
        raise InvalidInput("rates", rates, "EncounterRates, one a planet")
    figure = new_figure(9.6, 10.6)
    panels = figure.subplot_mosaic([["rates", "verdicts"], ["probability", "size"], ["most", "most"]])
    rate_plot(panels["rates"], rates)
    verdict_plot(panels["verdicts"], result)
    total = {one.planet.name: one.total.value for one in rates}
    probability_plot(
        panels["probability"], result, max(total, key=total.__getitem__) if "earth" not in total else "earth"
    )
    size_plot(panels["size"], result)
    contributor_plot(panels["most"], result, names)
    return figure
