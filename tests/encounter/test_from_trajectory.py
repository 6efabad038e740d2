"""Encounters from samples of a trajectory, against the routes that know the orbit."""

import pickle

import astropy.units as u
import numpy as np
import pytest
from astropy.time import Time
from scenes import PILE, R_E, earth

import flybystab as fs
from flybystab.encounter.encounter import Encounter
from flybystab.errors import InvalidInput, NoEncounter, UnitMismatch
from flybystab.flybys.flyby import flyby

TURN = np.linalg.qr(np.array([[1.0, 2.0, 0.5], [-0.3, 1.0, 2.0], [1.0, -1.0, 0.4]]))[0]
TURN *= np.sign(np.linalg.det(TURN))


def resampled(e, times, turn=None):
    """The encounter from its own states at `times`, in a frame that is turned."""
    turn = np.eye(3) if turn is None else turn
    r, v = e.position(times), e.velocity(times)
    return Encounter.from_trajectory(
        times + 5 * u.h, r @ turn.T, v @ turn.T, e.planet, start_distance=10 * R_E
    )


@pytest.mark.parametrize("n", [7, 40])
def test_a_hyperbola_from_a_few_samples_is_exact(n):
    e = earth(2.2)
    times = np.linspace(e.t_start, e.t_stop, n) * u.s + 13 * u.s
    again = resampled(e, np.concatenate([[e.t_start], times.value[1:]]) * u.s)
    assert again.frame == "trajectory"
    assert again.time is None
    for name in ("distance", "v_inf", "v_periapsis"):
        assert getattr(again, name).value == pytest.approx(getattr(e, name).value, rel=1e-9)
    t = np.linspace(e.t_start, e.t_stop, 101) * u.s
    np.testing.assert_allclose(again.position(t).value, e.position(t).value, atol=1.0)
    assert again.t_start == pytest.approx(e.t_start, abs=1e-3)
    assert again.t_stop == pytest.approx(e.t_stop, abs=1e-3)
    a, b = flyby(PILE, e, error=False), flyby(PILE, again, error=False)
    np.testing.assert_allclose(a.semi_axes.value, b.semi_axes.value, rtol=1e-6)
    assert a.spin_ratio == pytest.approx(b.spin_ratio, rel=1e-6)


def test_the_frame_may_be_turned():
    e = earth(2.2)
    again = resampled(e, np.linspace(e.t_start, e.t_stop, 60) * u.s, TURN)
    np.testing.assert_allclose(again.periapsis_axes, TURN.T, atol=1e-9)
    a, b = flyby(PILE, e, error=False), flyby(PILE, again, error=False)
    np.testing.assert_allclose(b.spin_vector.value, TURN @ a.spin_vector.value, atol=1e-6 * a.spin.value)


def test_a_real_encounter_from_its_samples():
    apophis = fs.Asteroid.from_catalogue("Apophis")
    e = Encounter.from_orbit(apophis.orbit, "earth", Time("2029-04-13", scale="tdb"))
    errors = []
    for n in (20, 80):
        t = np.linspace(e.t_start, e.t_stop, n) * u.s
        again = Encounter.from_trajectory(e.time + t, e.position(t), e.velocity(t), "earth")
        assert again.frame == "ICRF"
        fine = np.linspace(e.t_start, e.t_stop, 333) * u.s
        errors.append(np.abs(again.position(fine).value - e.position(fine).value).max())
    assert errors[1] < 1.0  # m
    assert errors[1] < errors[0] / 20
    assert abs((again.time - e.time).to_value(u.s)) < 1e-3
    assert again.distance.to_value(u.m) == pytest.approx(e.distance.to_value(u.m), abs=1.0)
    body, start = apophis.body, apophis.attitude(0 * u.deg)
    ratios = [
        flyby(body, x, x.periapsis_axes @ start, error=False, history=False).spin_ratio for x in (e, again)
    ]
    assert ratios[0] == pytest.approx(ratios[1], rel=1e-3)  # tides of Moon and Sun are not in it


def test_an_impact():
    e = earth(0.9)
    again = resampled(e, np.linspace(e.t_start, 3600.0, 50) * u.s)
    assert again.impact
    assert again.impact_level == "surface"
    assert again.impact_time == pytest.approx(e.impact_time, abs=1e-3)
    assert flyby(PILE, again, error=False).verdict == "IMPACT"


def test_it_pickles():
    e = earth(2.2)
    again = resampled(e, np.linspace(e.t_start, e.t_stop, 30) * u.s)
    copy = pickle.loads(pickle.dumps(again))
    assert copy.position(1 * u.h)[0] == again.position(1 * u.h)[0]


def test_bad_trajectories_are_named():
    e = earth(2.2)
    t = np.linspace(e.t_start, -100.0, 20) * u.s
    r, v = e.position(t), e.velocity(t)
    with pytest.raises(NoEncounter, match="closest approach"):
        Encounter.from_trajectory(t, r, v, "earth")
    with pytest.raises(InvalidInput, match="increasing"):
        Encounter.from_trajectory(t[::-1], r, v, "earth")
    with pytest.raises(InvalidInput, match="positions"):
        Encounter.from_trajectory(t, r[:5], v, "earth")
    with pytest.raises(UnitMismatch, match="velocities"):
        Encounter.from_trajectory(t, r, r, "earth")
    with pytest.raises(UnitMismatch, match="times"):
        Encounter.from_trajectory(t.value, r, v, "earth")


@pytest.mark.parametrize("n", [3, 4, 5, 9, 200])
@pytest.mark.parametrize("v_inf", [0.0, 5.0, 30.0])
def test_widely_spaced_samples_of_a_true_motion_are_accepted(n, v_inf):
    e = Encounter.hyperbolic("earth", 1.5 * R_E, v_inf * u.km / u.s, start_distance=30 * R_E)
    times = np.linspace(e.t_start, -0.9 * e.t_start, n) * u.s
    assert resampled(e, times).distance.to_value(u.m) == pytest.approx(e.distance.to_value(u.m), rel=1e-6)


def test_velocities_that_are_not_those_of_the_positions_are_refused():
    e = earth(3)
    times = np.linspace(e.t_start, e.t_stop, 60) * u.s
    r, v = e.position(times), e.velocity(times)
    turned = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    for t, x, w in (
        (times, r, 1e-3 * v),  # m/s for km/s
        (times.value * u.d, r, v),  # days for seconds
        (times, 1e-3 * r, v),
        (times, r, -v),
        (times, r, v @ turned.T),  # another frame
    ):
        with pytest.raises(InvalidInput, match="the rates of change of the positions") as error:
            Encounter.from_trajectory(t, x, w, "earth")
        assert len(str(error.value)) < 700  # long arrays are cut
