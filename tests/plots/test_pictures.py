"""Figures show the computed values, with units on the axes; maps agree with single flybys."""

import astropy.units as u
import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

import flybystab as fs
from flybystab.errors import InvalidInput
from flybystab.plots import flyby as plotting
from flybystab.plots import outcome_map as maps
from flybystab.plots import scene

PILE = fs.Body(semi_axes=[1400, 850, 750] * u.m, density=2000 * u.kg / u.m**3, spin_period=6 * u.h)


@pytest.fixture(scope="module")
def flown():
    return fs.flyby(PILE, fs.Encounter.hyperbolic("earth", 2.2 * fs.R_earth, 5 * u.km / u.s))


def axes(projection=None):
    return Figure().add_subplot(projection=projection)


@pytest.mark.parametrize(
    ("plot", "unit"),
    [
        (lambda a, r: plotting.distance_plot(a, r.history, r.encounter), "(km)"),
        (lambda a, r: plotting.friction_plot(a, r.history, 35 * u.deg), "(deg)"),
        (lambda a, r: plotting.spin_plot(a, r.history), "(rev/day)"),
        (lambda a, r: plotting.axes_plot(a, r.history), "(m)"),
    ],
)
def test_history_panels_return_their_axes(flown, plot, unit):
    a = axes()
    assert plot(a, flown) is a
    assert unit in a.get_ylabel()


def test_a_result_without_history_cannot_be_drawn(flown, tmp_path):
    from dataclasses import replace

    bare = replace(flown, history=None)
    for draw in (
        lambda: plotting.flyby_figure(bare, "t", tmp_path / "x.png"),
        lambda: scene.scene_plot(axes("3d"), bare),
        lambda: scene.animation(bare, tmp_path / "x.gif"),
    ):
        with pytest.raises(InvalidInput, match="history"):
            draw()


def test_the_surface_is_the_ellipsoid():
    s = np.array([[4.0, 1.0, 0.0], [1.0, 3.0, 0.5], [0.0, 0.5, 2.0]])
    x = scene.surface(s).reshape(3, -1)
    assert np.einsum("ij,ik,kj->j", x, np.linalg.inv(s), x) == pytest.approx(np.ones(x.shape[1]), abs=1e-12)


def test_scene_shows_planet_and_bodies(flown):
    a = axes("3d")
    assert scene.scene_plot(a, flown, times=[-1, 0, 1, 3] * u.h, magnification=2000.0) is a
    assert len(a.collections) == 5
    assert "(1000 km)" in a.get_xlabel()
    assert "2,000 times" in a.get_title()


def test_animation(flown, tmp_path):
    from PIL import Image

    path = scene.animation(flown, tmp_path / "pile.gif", "P1", frames=4)
    assert Image.open(path).n_frames == 4
    with pytest.raises(InvalidInput, match=r"\.gif or \.mp4"):
        scene.animation(flown, tmp_path / "pile.avi")


def test_outcome_map_agrees_with_single_flybys():
    q, v = [1.6, 2.0, 4.0] * fs.R_earth, [3.0, 9.0] * u.km / u.s
    found = maps.outcome_map(PILE, q, v, phases=2)
    for i in range(3):
        for j in range(2):
            encounter = fs.Encounter.hyperbolic("earth", q[i], v[j])
            one = fs.flyby(PILE, encounter, history=False, error=False)
            assert found.verdict[i, j, 0] == one.verdict
            assert found.axis_growth[i, j, 0] == pytest.approx(
                (one.semi_axes[0] / PILE.semi_axes[0]).value, rel=1e-4
            )
    assert set(found.worst[2]) == {"INTACT"}
    assert found.worst[0, 0] == "BEYOND MODEL"
    assert found.share_yielding[0, 0] == 1.0
    a = axes()
    assert maps.outcome_plot(a, found) is a
    assert "radii of Earth" in a.get_xlabel()
    assert "(km/s)" in a.get_ylabel()


def test_retrograde_spin_is_safer():
    q, v = [2.2] * fs.R_earth, [5.0] * u.km / u.s
    forward = maps.outcome_map(PILE, q, v, phases=6)
    backward = maps.outcome_map(PILE, q, v, phases=6, retrograde=True)
    assert backward.axis_growth.max() < forward.axis_growth.max()
    # fewer phases yield on the cone; on Mohr-Coulomb more, since the onset is further out for a retrograde body
    cone = PILE.with_(material=fs.Material(yield_surface="drucker-prager"))
    forward, backward = (maps.outcome_map(cone, q, v, phases=6, retrograde=r) for r in (False, True))
    assert backward.share_yielding[0, 0] <= forward.share_yielding[0, 0]


def test_target_map_agrees_with_single_flybys():
    v, q = 8.0 * u.km / u.s, 1.7 * fs.R_earth
    found = maps.target_map(PILE, v, [1.7, 4.0] * fs.R_earth, 4)
    encounter = fs.Encounter.hyperbolic("earth", q, v)
    # B along +T is prograde, along -T retrograde; the long axis is along the asymptote
    e = 1.0 + q.to_value(u.m) * 8000.0**2 / encounter.planet.gm
    c, s = 1 / e, np.sqrt(1 - 1 / e**2)
    forward = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
    backward = np.array([[c, s, 0], [s, -c, 0], [0, 0, -1.0]])
    for direction, attitude in ((0, forward), (2, backward)):
        one = fs.flyby(PILE, encounter, attitude, history=False, error=False)
        assert found.verdict[0, direction] == one.verdict
        assert found.max_required_friction_angle[0, direction].value == pytest.approx(
            one.max_required_friction_angle.value, rel=1e-4
        )
    assert set(found.verdict[1]) == {"INTACT"}
    grazing = fs.Encounter.hyperbolic("earth", found.planet.impact_distance * u.m, v)
    assert found.capture_radius.value == pytest.approx(
        np.linalg.norm(grazing.b_plane().to_value(u.km)), rel=1e-9
    )
    a = axes()
    assert maps.target_plot(a, found) is a
    assert a.get_xlabel() == "B.T (km)"


def test_points_on_the_target_plane():
    a = axes()
    maps.verdict_points(a, [[1, 2], [3, 4], [5, 6]] * u.km, ["INTACT", "RESHAPED", "INTACT"], 7 * u.km)
    shown = [t.get_text() for t in a.get_legend().get_texts()]
    assert shown == ["INTACT (2)", "RESHAPED (1)", "disc of impacts"]


def test_verdicts_can_be_told_apart_in_greyscale():
    shades = [to_rgb(shade) for _, shade in list(maps.SCALE.values())[:6]]  # intact to impact
    grey = np.array(shades) @ [0.2126, 0.7152, 0.0722]
    assert np.all(np.diff(grey) < -0.08)
    letters = [letter for letter, _ in maps.SCALE.values()]
    assert len(set(letters)) == len(letters)
