"""Figures of grains: the grains are where the run has put them, in the colours of their clumps."""

from dataclasses import replace

import astropy.units as u
import numpy as np
import pytest
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from scenes import earth

import flybystab as fs
from flybystab.encounter.attitude import periapsis_axes
from flybystab.errors import InvalidInput
from flybystab.plots.grains import COLOURS, LOOSE, grains_figure, grains_plot, grains_scene_plot

BODY = fs.Body(semi_axes=[1408, 850, 748] * u.m, density=2000 * u.kg / u.m**3, spin_period=6 * u.h)


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("FLYBYSTAB_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield fs.flyby(BODY, earth(1.5), grains=100, seeds=[1], model="grains")


def test_grains_lie_along_the_path_in_the_colours_of_their_clumps(result):
    axes = grains_scene_plot(Figure().subplots(), result, magnification=500.0, places=5)
    run = result.grains.median
    piles = axes.collections
    assert 4 <= len(piles) <= 5
    turn = periapsis_axes(result.encounter)
    path = axes.lines[0].get_xydata()
    assert np.ptp(path[:, 0]) > 20.0
    assert path[:, 1].max() == pytest.approx(
        1.5 * fs.R_earth.to_value(u.km) / 1000, rel=1e-3
    )  # periapsis above
    assert np.all(np.diff(path[:, 0]) > 0)  # moving to the right
    for pile in piles:
        centre = pile.get_offsets().mean(axis=0)
        assert np.linalg.norm(path - centre, axis=1).min() < 1.0
    colours = {tuple(c) for c in piles[0].get_facecolors()}
    assert to_rgba(COLOURS[0]) in colours
    share = np.mean([tuple(c) == to_rgba(COLOURS[0]) for c in piles[-1].get_facecolors()])
    # the colours repeat
    assert share == pytest.approx(np.mean((run.label >= 0) & (run.label % len(COLOURS) == 0)))
    if (run.label < 0).any():
        assert to_rgba(LOOSE) in colours
    # the first pile is to the scale that the title names
    x = run.course.positions[0].to_value(u.km) @ turn.T
    extent = np.ptp(piles[0].get_offsets(), axis=0)
    assert extent.max() * 1000 / 500.0 == pytest.approx(np.ptp(x[:, :2], axis=0).max(), rel=0.5)
    assert "500 times" in axes.get_title()


def test_a_still_is_to_scale_about_the_largest_clump(result):
    run = result.grains.median
    axes = grains_plot(Figure().subplots(), run, len(run.course) - 1)
    places = axes.collections[0].get_offsets()
    assert len(places) == np.isfinite(run.course.positions[-1].value).all(axis=1).sum()
    x = run.course.positions[-1].to_value(u.km)
    centre = x[run.label == 0].mean(axis=0)[:2]
    expected = np.sort(np.linalg.norm(x[:, :2] - centre, axis=1))
    np.testing.assert_allclose(np.sort(np.linalg.norm(places, axis=1)), expected, atol=1e-9)


def test_an_ellipsoid_has_no_grains_to_draw():
    with pytest.raises(InvalidInput, match="grains"):
        grains_scene_plot(Figure().subplots(), fs.flyby(BODY, earth(3.0)))


def test_the_title_counts_piles(result):
    figure = grains_figure(result)
    assert figure.get_suptitle().endswith(", 1 pile")
    assert "1 pile:" in repr(result.grains)
    two = result.with_(grains=replace(result.grains, runs=2 * result.grains.runs))
    assert grains_figure(two).get_suptitle().endswith(", 2 piles, blue: the median one")
    assert "2 piles:" in repr(two.grains)
