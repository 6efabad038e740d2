"""Contact with the planet: the body's true reach towards it, at each instant."""

from __future__ import annotations

from collections.abc import Callable

import astropy.units as u
import numpy as np
import pytest
from numpy.typing import NDArray
from scenes import PILE
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq, minimize_scalar
from scipy.spatial.transform import Rotation

from flybystab import Body, Encounter, Material, flyby, flyby_many
from flybystab.core.dynamics.run import LIMITS, body_state, integrate
from flybystab.flybys.batch import span_of
from flybystab.flybys.rigid_course import rigid_course
from flybystab.io.text import flyby_lines
from flybystab.orbit.planets import PLANETS

MOON = PLANETS["moon"].radius
STRONG = Material(cohesion=1 * u.MPa)
STICK = Body([1400, 850, 750] * u.m, 2000 * u.kg / u.m**3, spin=[0, 0, 0] / u.h, material=STRONG)


def moon(height: float, start: float = 10.0) -> Encounter:
    """A passage of the airless Moon with the centre at that height, m, from a distance of radii of the Moon."""
    q, v_inf = (MOON + height) * u.m, 5 * u.km / u.s
    return Encounter.hyperbolic("moon", q, v_inf, start_distance=start * MOON * u.m, settle=0 * u.s)


def flown(body: Body, encounter: Encounter, attitude: NDArray[np.float64]) -> Callable[[float], float]:
    """Gap (m) to the ground at a time (s from closest approach) on a finer run that knows of no ground."""
    start, stop, _ = span_of(encounter)
    m = body.material
    run = integrate(
        body_state(body.axes, body.rho, body.omega, attitude, m.phi, m.c_pa),
        (start, stop),
        encounter.tide,
        limits=LIMITS._replace(tolerance=1e-11),
        unyielding=True,
        keep=20_000,
    )
    q = run.history["quaternion"]
    vectors = CubicSpline(run.history["time"], Rotation.from_quat(np.roll(q, -1, axis=-1)).as_matrix())

    def gap(t: float) -> float:
        r = encounter.positions(t)[0]
        n = r / np.linalg.norm(r)
        return float(np.linalg.norm(r) - MOON - np.linalg.norm(body.axes * (vectors(t).T @ n)))

    return gap


@pytest.mark.parametrize(
    ("height", "standing", "lying"),
    [(1500, "INTACT", "INTACT"), (1000, "IMPACT", "INTACT"), (700, "IMPACT", "IMPACT")],
)
def test_the_side_towards_the_planet_counts(height, standing, lying):
    """A body of 1400 x 850 x 750 m that hardly turns: its long axis up, or along the path."""
    passing = moon(height)
    assert flyby(STICK, passing).verdict == standing
    assert flyby(STICK, passing, attitude=[[0, 1, 0], [1, 0, 0], [0, 0, -1]]).verdict == lying


def test_a_body_of_no_spin_touches_at_its_half_width():
    """Faces of the body along the axes of the orbit: the height at which it touches is a semi-axis, to a centimetre."""
    for axis, turn in ((0, np.eye(3)), (1, Rotation.from_euler("z", 90, degrees=True).as_matrix())):
        reach = float(STICK.axes[axis])
        # the tide turns the body, and the planet moves by 1e-2 during the fall: 2e-4 of its length
        assert flyby(STICK, moon(reach - 2.0), attitude=turn).verdict == "IMPACT"
        assert flyby(STICK, moon(reach + 2.0), attitude=turn).verdict == "INTACT"


@pytest.mark.parametrize("period", [6.0, 0.1, 0.005])
def test_contact_is_where_an_independent_course_touches(period):
    """Against a spline through a finer run, a root-finder and a minimiser; the last body turns once in 18 s."""
    rng = np.random.default_rng(1)
    body = STICK.with_(spin_period=period * u.h, material=Material(cohesion=100 * u.MPa))
    seen = set()
    for turn in Rotation.random(8, rng):
        passing = moon(float(rng.uniform(760, 1390)), start=10.0 if period > 0.01 else 1.05)
        gap = flown(body, passing, passing.periapsis_axes.T @ turn.as_matrix())
        times = np.linspace(-30, 30, 2001)
        values = np.array([gap(t) for t in times])
        k = int(np.argmin(values))
        near = minimize_scalar(gap, bounds=(times[k - 1], times[k + 1]), method="bounded")
        if abs(near.fun) < 0.01:
            continue
        r = flyby(body, passing, attitude=turn, error=False)
        seen.add(str(r.verdict))
        assert (r.verdict == "IMPACT") == (near.fun < 0.0)
        if near.fun < 0.0:
            first = int(np.argmax(values < 0.0)) if (values < 0.0).any() else k
            exact = brentq(gap, times[first - 1], min(times[first], near.x), xtol=1e-9)
            assert r.history.time_from_periapsis[-1].value == pytest.approx(exact, abs=1e-4)
            assert np.all(np.diff(r.history.time.value) > 0.0)
            assert r.contact == "body"
    assert seen == {"IMPACT", "INTACT"}


def test_a_flowing_body_touches_with_its_shape_of_then():
    """Stretched by the tide, the body touches from above its initial long semi-axis, where a rigid one passes."""
    floor = PLANETS["earth"].impact_distance
    passing = Encounter.hyperbolic("earth", floor * u.m + 1.6 * u.km, 1 * u.km / u.s)
    turn = Rotation.from_euler("z", 75, degrees=True)
    r = flyby(PILE, passing, turn, max_axis_ratio=20)
    assert r.verdict == "IMPACT"
    assert r.onset_time is not None
    position = passing.position(r.history.time_from_periapsis[-1]).value
    radius = np.linalg.norm(position)
    n = position / radius
    reach = np.sqrt(n @ r.history.shape[-1].value @ n)
    assert radius - floor == pytest.approx(reach, abs=1e-5)
    assert reach > 1600.0
    assert np.count_nonzero(np.diff(r.history.time.value) <= 0.0) == len(
        r.events
    )  # one pair of rows a switch
    assert flyby(PILE.with_(material=STRONG), passing, turn).verdict == "INTACT"


def test_path_into_the_planet_is_told_from_a_touch():
    deep, graze = flyby(STICK, moon(-5e3)), flyby(STICK, moon(1000))
    assert (deep.contact, graze.contact, flyby(STICK, moon(5e3)).contact) == ("path", "body", None)
    table = flyby_many([STICK] * 3, [deep.encounter, graze.encounter, moon(5e3)])
    assert table.contact.tolist() == ["path", "body", ""]
    # the body touches before its centre is down
    assert deep.end_time.value + deep.encounter.t_start < deep.encounter.impact_time
    assert "the path enters the surface" in "\n".join(flyby_lines(deep))
    assert "the centre would pass 1 km above the ground, but the body touches it" in "\n".join(
        flyby_lines(graze)
    )


def test_tables_agree_to_the_bit_and_rows_do_not_know_each_other():
    rng = np.random.default_rng(2)
    turns = list(Rotation.random(12, rng))
    heights = [*rng.uniform(700, 1450, 11).tolist(), 5e5]
    passings = [moon(h) for h in heights]
    pebble = STICK.with_(semi_axes=[10, 9, 8] * u.m)
    bodies = [STICK, pebble, PILE] * 4
    table = flyby_many(bodies, passings, turns)
    assert len(set(table.verdict)) > 1
    for i, body in enumerate(bodies):
        alone = flyby(body, passings[i], turns[i], error=False, history=False)
        assert table.verdict[i] == alone.verdict
        assert (table.semi_axes[i] == alone.semi_axes).all()
        assert table.spin_ratio[i] == alone.spin_ratio


def test_the_rigid_course_ends_at_the_touch_too():
    touch = flyby(STICK, moon(1000))
    course = rigid_course(STICK, moon(1000))
    assert course.time[-1].value == pytest.approx(touch.history.time_from_periapsis[-1].value, abs=1e-6)


def test_an_encounter_that_starts_on_the_ground():
    low = Encounter.hyperbolic("moon", (MOON + 100) * u.m, 5 * u.km / u.s, start_distance=(MOON + 150) * u.m)
    r = flyby(STICK, low)
    assert r.verdict == "IMPACT"
    assert r.end_time == 0 * u.s
