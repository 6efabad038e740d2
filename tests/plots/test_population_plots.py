"""Figures of a population: the lines are the numbers of the result."""

import astropy.units as u
import numpy as np
import pytest
from astropy.table import QTable
from matplotlib.figure import Figure

import flybystab as fs
from flybystab.errors import InvalidInput
from flybystab.plots.population import (
    contributor_plot,
    population_figure,
    probability_plot,
    rate_plot,
    size_plot,
    verdict_plot,
)

ORBITS = QTable({"a": [1.3, 2.0] * u.au, "e": [0.4, 0.6], "i": [10.0, 3.0] * u.deg, "H": [17.0, 19.0]})


@pytest.fixture(scope="module")
def result():
    return fs.disruption_rates(ORBITS, ["earth", "mars"], diameter=None, samples=80, seed=4)


def axes():
    return Figure().subplots()


def test_rates_against_distance():
    rates = fs.encounter_rates(ORBITS, "earth")
    (line,) = rate_plot(axes(), [rates]).get_lines()
    q, total = line.get_data()
    assert total[0] == pytest.approx(rates.total.to_value(1 / u.Myr), rel=1e-12)
    assert q[-1] == pytest.approx(30.0)


def test_bars_are_rates(result):
    bars = [p.get_height() for p in verdict_plot(axes(), result).patches]
    expected = [r["rate"].to_value(1 / u.Myr) for r in result.table if r["verdict"] == "RESHAPED"]
    assert bars[: len(expected)] == pytest.approx(expected)


def test_rate_against_size_starts_at_all_changes(result):
    line = size_plot(axes(), result).get_lines()[0]
    total = sum(
        result.rate(v).to_value(1 / u.Myr) for v in ("RESHAPED", "MASS LOSS", "DISRUPTED", "BEYOND MODEL")
    )
    assert line.get_ydata()[0] == pytest.approx(total, rel=1e-12)
    assert np.all(np.diff(line.get_ydata()[np.isfinite(line.get_ydata())]) <= 0.0)


def test_a_planet_without_encounters_has_an_empty_map(result):
    assert "no encounters" in probability_plot(axes(), result, "venus").get_title()


def test_bars_of_the_largest_contributors(result):
    drawn = contributor_plot(axes(), result, ["inner", "outer"])
    most = result.contributors()
    bars = [p.get_width() for p in drawn.patches]
    assert bars == pytest.approx(most["rate"].to_value(1 / u.Myr)[::-1])
    names = [t.get_text() for t in drawn.get_yticklabels()]
    assert names == [["inner", "outer"][k] for k in most["orbit"]][::-1]
    with pytest.raises(InvalidInput, match="names = 0 names: expected one name a row"):
        contributor_plot(axes(), result, [])


def test_the_page_has_five_panels_and_a_scale(result, tmp_path):
    rates = [fs.encounter_rates(ORBITS, name) for name in ("earth", "mars")]
    figure = population_figure(result, rates)
    assert len(figure.axes) == 6
    figure.savefig(tmp_path / "x.png")
