"""Stability figures carry the data, units and labels that they claim."""

import astropy.units as u
import matplotlib as mpl
import numpy as np
import pytest

from flybystab.body.body import Body, Material
from flybystab.body.stability import stability
from flybystab.cli.main import main
from flybystab.constants import GM_EARTH, R_EARTH, G
from flybystab.plots.figures import SPINS, barrier_figure, failure_figure, regions_figure, spin_figure
from flybystab.plots.stability import (
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
    spin_plot(axes, (20, 40), yield_surface="drucker-prager")  # exact at the corners of a spheroid
    upper = {line.get_label(): line for line in axes.lines if line.get_label() in ("20°", "40°")}
    assert set(upper) == {"20°", "40°"}
    sin = np.sin(np.deg2rad(40))
    assert upper["40°"].get_ydata()[-1] == pytest.approx(8 / 3 * sin / (1 + sin), rel=1e-9)
    assert upper["20°"].get_xdata()[-1] == 1.0


def test_barrier_curves_start_at_zero(axes):
    barrier_plot(axes, body(), longest=0.5)
    *curves, dot = axes.lines
    assert len(curves) == 3
    s = stability(body())
    assert dot.get_xdata()[0] == pytest.approx(s.critical_strain.barrier)
    assert dot.get_ydata()[0] == pytest.approx((s.critical_energy.barrier / s.binding_energy).value)
    for line in curves:
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


def test_regions_put_each_body_on_the_panel_of_its_spin():
    w2 = float(body().omega @ body().omega / (np.pi * G * 2000.0))
    nearest = min(SPINS, key=lambda s: abs(s - w2))
    figure = regions_figure({"Apophis": body()}, cells=30)
    marked = [[t.get_text() for t in a.texts if t.get_text() == "Apophis"] for a in figure.axes]
    assert [bool(m) for m in marked] == [s == nearest for s in SPINS]


def test_regions_hatch_the_fluids_past_the_bifurcation():
    """Maclaurin spheroids flatter than e = 0.81267 are not stable with no more friction than they need: none."""
    figure = regions_figure({}, cells=60)
    quiet, _, fast, _ = figure.axes
    assert not any(getattr(c, "hatches", [None])[0] for c in quiet.collections)
    assert any(getattr(c, "hatches", [None])[0] for c in fast.collections)


def test_spin_barrier_and_failure_have_both_panels():
    flat, long = spin_figure({"Apophis": body()}).axes
    assert "oblate" in flat.get_xlabel()
    assert "prolate" in long.get_xlabel()
    styles = {(line.get_color(), line.get_linestyle()) for line in flat.lines if "°" in str(line.get_label())}
    assert len(styles) == 6  # distinguishable in greyscale
    assert [a.get_title() for a in barrier_figure(body()).axes] == [
        "volume-preserving flow",
        "associative flow",
    ]
    _, satellites = failure_figure().axes
    roche = next(line for line in satellites.lines if "Roche" in str(line.get_label()))
    mean = GM_EARTH / (4 / 3 * np.pi * G * R_EARTH**3)
    assert roche.get_ydata()[0] == pytest.approx(2.455175645 * (mean / 2000.0) ** (1 / 3), rel=1e-8)


def test_one_command_for_each(tmp_path, capsys):
    file = tmp_path / "barrier.svg"
    assert main(["figure", "barrier", "Apophis", "--output", str(file), "--json"]) == 0
    assert "barrier" in capsys.readouterr().out
    assert file.stat().st_size > 1000
    assert main(["figure", "failure", "--output", str(tmp_path / "no" / "x.png")]) == 1
    assert main(["figure", "spin", "Apophis", "--output", str(file)]) == 2
    assert main(["figure", "orbit"]) == 2
