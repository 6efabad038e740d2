"""Stability figures carry the data, units and labels that they claim."""

import astropy.units as u
import matplotlib as mpl
import numpy as np
import pytest

from flybystab.aggregate.body import Body, Material
from flybystab.constants import GM_EARTH, R_EARTH
from flybystab.face.plotting_stability import (
    axis_ratios,
    barrier_plot,
    critical_energy_plot,
    failure_distance_plot,
    regions_plot,
    spin_plot,
)

mpl.use("Agg")
plt = pytest.importorskip("matplotlib.pyplot")


@pytest.fixture
def axes():
    figure, axes = plt.subplots()
    yield axes
    plt.close(figure)


def body(friction=30):
    return Body(
        [1000, 800, 700] * u.m,
        2000 * u.kg / u.m**3,
        4 * u.h,
        material=Material(friction_angle=friction * u.deg),
    )


def test_regions(axes):
    assert regions_plot(axes, 0.3, bodies={"pile": body()}, cells=40) is axes
    assert "a_2/a_1" in axes.get_xlabel()
    assert "a_3/a_1" in axes.get_ylabel()
    assert [t.get_text() for t in axes.texts if t.get_text() == "pile"] == ["pile"]
    assert axis_ratios({"pile": body()})["pile"] == pytest.approx((0.8, 0.7))
    assert axes.collections, "no contours"


def test_spin_limits_reach_the_sphere_at_one(axes):
    spin_plot(axes, (20, 40))
    upper = {line.get_label(): line for line in axes.lines if line.get_label() in ("20°", "40°")}
    assert set(upper) == {"20°", "40°"}
    sin = np.sin(np.deg2rad(40))
    assert upper["40°"].get_ydata()[-1] == pytest.approx(8 / 3 * sin / (1 + sin), rel=1e-9)
    assert upper["20°"].get_xdata()[-1] == 1.0


def test_barrier_curves_start_at_zero(axes):
    barrier_plot(axes, body(), longest=0.5)
    assert len(axes.lines) == 3
    for line in axes.lines:
        assert line.get_ydata()[0] == pytest.approx(0.0, abs=1e-12)
        assert line.get_ydata()[10] > 0


def test_failure_distance_falls_with_friction(axes):
    gm, radius = GM_EARTH * u.m**3 / u.s**2, R_EARTH * u.m
    failure_distance_plot(axes, {"pile": body()}, gm, radius)
    y = axes.lines[0].get_ydata()
    y = y[np.isfinite(y)]
    assert len(y) > 50
    assert np.all(np.diff(y) < 0)


def test_critical_energy(axes):
    critical_energy_plot(axes, 0.3, 30 * u.deg, cells=20)
    assert "a_3/a_1" in axes.get_ylabel()
