"""Rigid bodies side by side: every number is that of the body alone."""

from types import SimpleNamespace

import astropy.units as u
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from flybystab.bench.flyby import case
from flybystab.core.dynamics.lane_rows import lane_rows
from flybystab.core.dynamics.step_tide import N_POINTS, N_SCRATCH, POINTS, step_tide
from flybystab.core.dynamics.verdict_row import BODY, OUTCOME, YIELDS, rigid_rows
from flybystab.core.dynamics.workspace import Limits
from flybystab.core.ellipsoid.tide import no_tide, tide_at
from flybystab.core.material import surfaces
from flybystab.core.verdict_codes import FAILED, INTACT, NOT_IN_EQUILIBRIUM
from flybystab.encounter.encounter import Encounter
from flybystab.flybys import batch
from flybystab.flybys.batch import MAX_STEPS, SIDE_BY_SIDE, encounter_records, output_buffers, side_by_side
from flybystab.flybys.flyby import flyby
from flybystab.flybys.flyby_many import flyby_many
from flybystab.units import R_earth


def random_rows(n, seed):
    """Records of `n` bodies of all yield surfaces, and of their encounters."""
    rng = np.random.default_rng(seed)
    axes = np.sort(rng.uniform(0.5, 1.0, (n, 3)))[:, ::-1] * 10.0 ** rng.uniform(1.0, 3.0, (n, 1))
    bodies = np.zeros(n, BODY)
    bodies["axes"], bodies["rho"] = axes, rng.uniform(1200.0, 3000.0, n)
    bodies["omega"][:, 2] = 2.0 * np.pi / (3600.0 * rng.uniform(2.3, 30.0, n))
    bodies["omega"][::4, :2] = rng.normal(0.0, 1e-4, (len(bodies[::4]), 2))
    bodies["attitude"] = Rotation.random(n, random_state=seed).as_matrix()
    bodies["phi"] = np.radians(rng.uniform(15.0, 45.0, n))
    bodies["cohesion"] = rng.choice([0.0, 5.0, 50.0], n)
    bodies["surface"] = rng.integers(0, len(surfaces.SURFACES), n)
    bodies["encounter"] = rng.integers(0, 6, n)
    met = [
        Encounter.hyperbolic(planet, q * R_earth, v * u.km / u.s)
        for planet, q, v in (
            ("earth", 1.6, 3), ("earth", 3, 12), ("earth", 40, 6), ("venus", 2, 8), ("moon", 1, 5), ("jupiter", 30, 5),
        )
    ]  # fmt: skip
    return bodies, encounter_records(met, float(axes.max()))


def outcomes(rows, bodies, encounters, limits):
    """Outcomes side by side, and one by one."""
    many, single = np.zeros(len(bodies), OUTCOME), output_buffers(len(bodies), 0)
    single.outcomes[:] = np.zeros((), OUTCOME)
    lane_rows(rows, bodies, encounters, limits, many)
    rigid_rows(rows, bodies, encounters, limits, single)
    return many, single.outcomes


def same(many, single):
    """All fields of the rows that do not yield, and the verdicts of all, are the same to the bit."""
    np.testing.assert_array_equal(many["verdict"], single["verdict"])
    rigid = many["verdict"] != YIELDS
    for name in OUTCOME.names:
        np.testing.assert_array_equal(many[name][rigid], single[name][rigid], err_msg=name)


@pytest.mark.parametrize("tolerance", [1e-4, 1e-8])
def test_outcomes_are_those_of_single_bodies_to_the_bit(tolerance):
    """All yield surfaces, with and without cohesion, tumbling bodies, several planets and distances."""
    bodies, met = random_rows(200, seed=5)
    many, single = outcomes(np.arange(200), bodies, met, Limits(tolerance, 6.0, MAX_STEPS))
    same(many, single)
    assert {YIELDS, INTACT, NOT_IN_EQUILIBRIUM} <= set(many["verdict"])
    assert set(bodies["surface"]) == set(range(len(surfaces.SURFACES)))


def test_bodies_next_to_yield_have_their_own_verdicts():
    """Friction angles just above and below the largest mobilised one, by amounts down to its last digits."""
    bodies, met = random_rows(40, seed=6)
    bodies["phi"], bodies["cohesion"] = np.radians(80.0), 0.0
    limits = Limits(1e-8, 6.0, MAX_STEPS)
    _, first = outcomes(np.arange(40), bodies, met, limits)
    rows = np.flatnonzero((first["verdict"] == INTACT) & (first["friction"] < np.radians(70.0)))
    assert rows.size > 20
    below = above = 0
    for shift in (1e-3, 1e-5, 1e-8, 1e-11, -1e-11, -1e-8, -1e-5, -1e-3):
        near = bodies.copy()
        near["phi"] = first["friction"] + shift
        many, single = outcomes(rows, near, met, limits)
        same(many, single)
        above += np.count_nonzero(many["verdict"][rows] == INTACT)
        below += np.count_nonzero(many["verdict"][rows] == YIELDS)
    assert above > 60
    assert below > 60


@pytest.mark.parametrize("count", [0, 1, 7, 8, 9])
def test_any_number_of_rows(count):
    bodies, met = random_rows(12, seed=7)
    rows = np.random.default_rng(1).permutation(12)[:count]
    same(*outcomes(rows, bodies, met, Limits(1e-7, 6.0, MAX_STEPS)))


def test_a_body_that_exceeds_the_number_of_steps_fails_alone():
    bodies, met = random_rows(24, seed=8)
    bodies["omega"][::3] *= 1e-3
    bodies["phi"] = np.radians(85.0)
    many, single = outcomes(np.arange(24), bodies, met, Limits(1e-10, 6.0, 60))
    same(many, single)
    failed = np.count_nonzero(many["verdict"] == FAILED)
    assert 0 < failed < 24


def test_tide_of_a_step_is_that_of_its_points_to_the_bit():
    tide = Encounter.hyperbolic("earth", 2 * R_earth, 5 * u.km / u.s).tide
    out, scratch, one = np.empty((6, N_POINTS)), np.empty(N_SCRATCH), np.empty(6)
    for t, h in ((-3e4, 50.0), (-3e4, 2e4), (-100.0, 3e3), (10.0, 1.0), (-5e4, 1e5)):
        step_tide(t, h, tide, scratch, out)
        for i, x in enumerate(POINTS):
            tide_at(tide.tau, tide.start, tide.width, tide.coefficients, t + x * h, one)
            np.testing.assert_array_equal(out[:, i], one)
    step_tide(0.0, 1.0, no_tide(), scratch, out)
    assert not out.any()


def test_flyby_many_is_the_same_as_one_by_one():
    """40 bodies, of which some yield, meet the Earth and Venus; on one and on two threads."""
    rng = np.random.default_rng(3)
    pile, _ = case()
    bodies = [pile.with_(spin_period=p * u.h) for p in rng.uniform(3.0, 20.0, 40)]
    met = [
        Encounter.hyperbolic(planet, q * R_earth, v * u.km / u.s)
        for planet, q, v in zip(
            ["earth", "venus"] * 20, rng.uniform(1.4, 4, 40), rng.uniform(3, 9, 40), strict=True
        )
    ]
    turns = list(Rotation.random(40, random_state=2).as_matrix())
    tables = [flyby_many(bodies, met, turns, workers=w) for w in (1, 2)]
    assert {"INTACT", "RESHAPED"} <= set(tables[0].verdict)
    for i in range(40):
        alone = flyby(bodies[i], met[i], turns[i], error=False, history=False)
        for table in tables:
            assert table.verdict[i] == alone.verdict
            assert table.margin[i] == alone.margin
            assert table.spin[i] == alone.spin
            assert table.pole_change[i] == alone.pole_change
            np.testing.assert_array_equal(table.semi_axes[i], alone.semi_axes)


def test_the_kernels_are_compiled_after_many_bodies(monkeypatch):
    """If they are not on the disk: a few hundred bodies do not wait for them."""
    bodies, met = random_rows(400, seed=9)
    monkeypatch.setattr(batch, "on_disk", lambda kernel: False)
    monkeypatch.setattr(batch, "lane_rows", SimpleNamespace(overloads={}))
    monkeypatch.setattr(batch, "_one_by_one", 0)
    sizes = [side_by_side(np.arange(400), bodies, met).size for _ in range(4)]
    assert sizes == [0, 0, 400, 400]
    monkeypatch.setattr(batch, "_one_by_one", 0)
    monkeypatch.setattr(batch, "on_disk", lambda kernel: True)
    assert side_by_side(np.arange(400), bodies, met).size == 400


def test_bodies_near_the_ground_are_followed_one_by_one(monkeypatch):
    monkeypatch.setattr(batch, "on_disk", lambda kernel: True)
    bodies, _ = random_rows(SIDE_BY_SIDE + 2, seed=9)
    met = encounter_records(
        [Encounter.hyperbolic("earth", q * R_earth, 5 * u.km / u.s) for q in (1.001, 3.0)],
        bodies["axes"].max(),
    )
    bodies["encounter"] = 1
    bodies["encounter"][:2] = 0
    rows = np.arange(len(bodies))
    np.testing.assert_array_equal(side_by_side(rows, bodies, met), rows[2:])
    assert side_by_side(rows[:-1], bodies, met).size == 0
