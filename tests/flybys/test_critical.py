"""Critical values: the direct value where there is one, and the flyby on both sides of the value elsewhere."""

import astropy.units as u
import numpy as np
import pytest

import flybystab as fs
from flybystab.errors import InvalidInput, UnitMismatch, UnknownName

BODY = fs.Body([1400, 850, 750] * u.m, 2000 * u.kg / u.m**3, 6 * u.h)
PASSAGE = fs.Encounter.hyperbolic("earth", 2.4 * fs.R_earth, 6 * u.km / u.s)


def turned(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])


def test_friction_for_intact_is_the_largest_mobilised_angle():
    found = fs.critical(BODY, PASSAGE, "friction_angle", phases=4, tolerance=1e-6)
    strong = BODY.with_(material=fs.Material(friction_angle=80 * u.deg))
    for k, phase in enumerate(found.phase):
        attitude = turned(phase.to_value(u.rad))
        run = fs.flyby(strong, PASSAGE, attitude, attitude_at="periapsis", error=False)
        expected = run.max_required_friction_angle.to_value(u.deg)
        assert found.value[k].to_value(u.deg) == pytest.approx(expected, rel=3e-5)
        assert 0.0 < found.error[k].to_value(u.deg) <= 1e-6 * found.value[k].to_value(u.deg)
    assert found.least < found.largest


@pytest.mark.parametrize(
    ("quantity", "outcome"),
    [("cohesion", "INTACT"), ("density", "INTACT"), ("friction_angle", "RESHAPED"), ("periapsis", "INTACT")],
)
def test_the_outcome_changes_at_the_value(quantity, outcome):
    from flybystab.flybys.critical import PARAMETERS
    from flybystab.flybys.verdict import SEVERITY

    near = fs.Encounter.hyperbolic("earth", 1.8 * fs.R_earth, 6 * u.km / u.s)
    found = fs.critical(BODY, near, quantity, outcome, phases=2, tolerance=1e-3)
    value = found.value[1]
    assert np.isfinite(value)
    ranks = []
    for factor in (1.0, 1.0 - 1.001e-3):
        scene = PARAMETERS[quantity].apply(BODY, near, float(value.value) * factor)
        attitude = turned(found.phase[1].to_value(u.rad))
        run = fs.flyby(*scene, attitude, attitude_at="periapsis", error=False, history=False)
        ranks.append(SEVERITY.index(run.verdict))
    assert ranks[0] <= SEVERITY.index(outcome) < ranks[1]


def test_ends_of_the_range_are_said():
    far = fs.Encounter.hyperbolic("earth", 50 * fs.R_earth, 6 * u.km / u.s)
    always = fs.critical(BODY, far, "friction_angle", phases=1, low=20 * u.deg)
    assert always.value[0] == 20 * u.deg
    assert np.isnan(always.error[0])
    never = fs.critical(BODY, PASSAGE, "friction_angle", phases=1, high=3 * u.deg)
    assert never.value[0] == np.inf * u.deg


def test_workers_and_repetition_change_nothing():
    one, two = (fs.critical(BODY, PASSAGE, "friction_angle", phases=3, workers=k) for k in (1, 2))
    assert np.array_equal(one.value, two.value)
    assert one.to_table()["value"].unit == u.deg


@pytest.mark.parametrize(
    ("arguments", "options", "error", "expected"),
    [
        ((BODY, PASSAGE, "colour"), {}, UnknownName, "colour"),
        ((BODY, PASSAGE, "friction"), {}, UnknownName, "friction_angle"),
        ((BODY, PASSAGE, "density", "SHATTERED"), {}, UnknownName, "SHATTERED"),
        ((BODY, 3, "density"), {}, InvalidInput, "encounter"),
        ((BODY, PASSAGE, "density"), {"phases": 0}, InvalidInput, "phases"),
        ((BODY, PASSAGE, "density"), {"low": 3.0}, UnitMismatch, "low"),
        ((BODY, PASSAGE, "friction_angle"), {"low": 50 * u.deg, "high": 40 * u.deg}, InvalidInput, "low"),
        ((BODY, PASSAGE, "density"), {"tolerance": 0.0}, InvalidInput, "tolerance"),
    ],
)
def test_bad_input_is_named(arguments, options, error, expected):
    with pytest.raises(error, match=expected):
        fs.critical(*arguments, **options)


def test_a_periapsis_needs_a_hyperbolic_encounter():
    from astropy.time import Time

    apophis = fs.Asteroid.from_catalogue("Apophis")
    real = fs.Encounter.from_orbit(apophis.orbit, "earth", Time("2029-04-13", scale="tdb"))
    with pytest.raises(InvalidInput, match="hyperbolic"):
        fs.critical(apophis.body, real, "periapsis")
