"""Grains through encounters."""

import csv
from pathlib import Path

import astropy.units as u
import numpy as np
import pytest
from scenes import earth
from scipy.spatial.transform import Rotation

import flybystab as fs
from flybystab.core.grains.clumps import bound_clumps, friends_of_friends
from flybystab.core.grains.state import Grains
from flybystab.errors import InvalidInput
from flybystab.flybys.grains_resolution import (
    ELONGATION,
    EXPONENT,
    LARGE,
    LOST,
    REFERENCE,
    SMALL,
    resolution_errors,
)

BODY = fs.Body(semi_axes=[1408, 850, 748] * u.m, density=2000 * u.kg / u.m**3, spin_period=6 * u.h)


@pytest.fixture(scope="module", autouse=True)
def folder(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("FLYBYSTAB_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(scope="module")
def deep():
    return fs.flyby(
        BODY.with_(material=fs.Material(yield_surface="mohr-coulomb")), earth(1.6), grains=150, seeds=4
    )


def test_a_distant_passage_leaves_the_pile_as_it_was():
    r = fs.flyby(BODY, earth(5.96), grains=200, seeds=[3], model="grains")
    assert r.verdict == "INTACT"
    assert r.rung == "grains"
    assert (r.largest_fraction, r.bound_fraction) == (1.0, 1.0)
    (run,) = r.grains.runs
    assert run.settled
    assert run.stretch == pytest.approx(1.0, abs=2e-3)
    # the spin changes as that of the rigid body of the pile's own shape and spin
    rigid = fs.flyby(
        fs.Body(semi_axes=run.initial_semi_axes, density=2000 * u.kg / u.m**3, spin=run.initial_spin_vector),
        earth(5.96),
    )
    change = (run.spin - np.linalg.norm(run.initial_spin_vector)).to_value(u.rad / u.s)
    expected = (rigid.spin - np.linalg.norm(run.initial_spin_vector)).to_value(u.rad / u.s)
    assert change == pytest.approx(expected, rel=0.1)
    assert r.spin_ratio > 1.05


def test_the_ladder_hands_on_only_where_it_must(deep):
    distant = fs.flyby(BODY, earth(5.96), grains=150, seeds=2)
    assert (distant.rung, distant.grains, distant.fragments) == ("rigid body", None, None)
    assert distant.largest_fraction == distant.bound_fraction == 1.0
    flows = fs.flyby(BODY, earth(2.2), grains=150, seeds=2)
    assert (flows.rung, flows.verdict) == ("ellipsoid", "RESHAPED")
    ellipsoid = fs.flyby(BODY.with_(material=fs.Material(yield_surface="mohr-coulomb")), earth(1.6))
    assert ellipsoid.verdict == "BEYOND MODEL"
    assert deep.rung == "grains"


def test_a_deep_passage_disrupts(deep):
    assert deep.verdict == "DISRUPTED"
    assert deep.verdict_class == "S"
    assert 0.1 < deep.largest_fraction < 0.5
    assert deep.grains.probabilities()[deep.verdict][0] >= 0.5
    for share, low, high in deep.grains.probabilities().values():
        assert 0.0 <= low <= share <= high <= 1.0


def test_fragments_are_consistent(deep):
    table = deep.fragments
    assert set(np.unique(table["seed"])) == {0, 1, 2, 3}
    mass = BODY.mass.to_value(u.kg)
    for run in deep.grains.runs:
        rows = table[table["seed"] == run.seed]
        assert rows["mass_fraction"][0] == pytest.approx(run.largest_fraction)
        assert np.all(np.diff(rows["mass_fraction"]) <= 0)
        assert 0.8 < rows["mass_fraction"].sum() <= 1.0 + 1e-12
        assert np.all(rows["position"][0] == 0)
        for i, row in enumerate(rows):
            j = int(row["bound_to"])
            if j < 0:
                assert np.isnan(row["a"])
                continue
            assert j < i
            d = (row["position"] - rows["position"][j]).to_value(u.m)
            v = (row["velocity"] - rows["velocity"][j]).to_value(u.m / u.s)
            gm = 6.6743e-11 * mass * (row["mass_fraction"] + rows["mass_fraction"][j])
            # vis viva, and the eccentricity vector
            r = np.linalg.norm(d)
            assert row["a"].to_value(u.m) == pytest.approx(1 / (2 / r - v @ v / gm), rel=1e-6)
            e = np.cross(v, np.cross(d, v)) / gm - d / r
            assert row["e"] == pytest.approx(np.linalg.norm(e), abs=1e-5)


def test_momentum_of_all_grains_stays_zero(deep):
    for run in deep.grains.runs:
        assert len(run.course) > 50
        assert run.course.time[-1] == run.end_time
        assert np.all(np.diff(run.course.time.value) > 0)
        assert run.course.largest_fraction[0] == 1.0


def test_scaling_of_size_and_density():
    # the same dimensionless passage: tide and spin over G rho equal, lengths free
    e = earth(1.9, v_inf=0.0)
    one = fs.flyby(BODY, e, grains=100, seeds=[1], model="grains")
    twice = fs.flyby(BODY.with_(semi_axes=2 * BODY.semi_axes), e, grains=100, seeds=[1], model="grains")
    a, b = one.grains.runs[0], twice.grains.runs[0]
    assert b.course.largest_fraction[:30] == pytest.approx(a.course.largest_fraction[:30], abs=1e-12)
    np.testing.assert_allclose(b.course.semi_axes[:30], 2 * a.course.semi_axes[:30], rtol=1e-3)


def test_rotation_of_the_frame():
    # planet, pile and attitude turned together: nothing changes but the frame
    from flybystab.body.pile import make_pile
    from flybystab.core.ellipsoid.tide import TidePanels, components, tensor
    from flybystab.core.grains.simulation import Simulation

    turn = Rotation.from_euler("ZXZ", [0.3, 1.1, -0.7]).as_matrix()
    k = np.zeros((1, 2, 6))
    k[0, 0] = [1.2, -0.6, -0.6, 0.0, 0.0, 0.0]
    turned = k.copy()
    turned[0, 0] = components(turn @ tensor(k[0, 0]) @ turn.T)
    ends = []
    for matrix, tide in ((np.eye(3), k), (turn, turned)):
        sim: Simulation = make_pile(BODY, 100, 1).simulation
        sim.rotate(matrix)
        sim.tide = TidePanels(1e3, 0.0, 1.0, tide)
        sim.advance(0.5)
        ends.append(sim.grains.x @ matrix)
    assert np.abs(ends[0] - make_pile(BODY, 100, 1).simulation.grains.x).max() > 0.05
    np.testing.assert_allclose(ends[1], ends[0], atol=1e-7)


def test_threads_change_nothing():
    from flybystab.flybys.grains_flyby import grains_flyby

    e = earth(1.9)
    runs = [grains_flyby(BODY, e, np.eye(3), grains=100, seeds=2, threads=k).runs for k in (1, 2)]
    for a, b in zip(*runs, strict=True):
        np.testing.assert_array_equal(a.course.positions.value, b.course.positions.value)


def test_grains_that_reach_the_ground_are_lost():
    # the path clears the atmosphere, the pile does not
    e = fs.Encounter.hyperbolic("earth", fs.R_earth + 101.0 * u.km, 10 * u.km / u.s)
    assert not e.impact
    huge = BODY.with_(semi_axes=[2800, 1700, 1500] * u.m)
    r = fs.flyby(huge, e, grains=100, seeds=[1], model="grains")
    (run,) = r.grains.runs
    assert r.verdict == "IMPACT"
    assert 0.0 < run.ground_fraction < 0.9
    assert run.fragments["mass_fraction"].sum() <= 1.0 - run.ground_fraction + 1e-9


def test_clumps_of_hand_made_grains():
    x = np.array([[0.0, 0, 0], [2.1, 0, 0], [30.0, 0, 0], [30.0, 2.1, 0], [300.0, 0, 0], [0, 90.0, 0]])
    v = np.zeros((6, 3))
    m = np.array([3.0, 3.0, 1.0, 1.0, 1.0, 0.0])
    g = Grains(x, v, v.copy(), np.ones(6), m)
    label = np.empty(6, np.int64)
    assert friends_of_friends(g, 1.15, label) == 3
    assert label.tolist() == [0, 0, 1, 1, 2, -1]
    # escape of a two-body problem: v^2/2 = (M + m)/r
    for factor, bound in ((0.98, True), (1.02, False)):
        g.v[2:4, 0] = factor * np.sqrt(2 * 8.0 / 29.0)
        g.v[4] = 100.0
        assert bound_clumps(g, label, 0).tolist() == [True, bound, False]


def test_bad_input_is_refused_and_few_grains_warn():
    e = earth(2.0)
    with pytest.raises(InvalidInput, match="model"):
        fs.flyby(BODY, e, model="fluid")
    with pytest.raises(InvalidInput, match="grains"):
        fs.flyby(BODY, e, grains="often")
    with pytest.raises(InvalidInput, match="seeds"):
        fs.flyby(BODY, e, grains=200, seeds=0)
    with pytest.raises(InvalidInput, match="seeds"):
        fs.flyby(BODY, e, grains=200, seeds=[1, 1])
    with pytest.raises(InvalidInput, match="model"):
        fs.flyby(BODY, e, grains=200, model="ellipsoid")
    stiff = BODY.with_(material=fs.Material(friction_angle=60 * u.deg))
    with pytest.raises(InvalidInput, match="calibrated"):
        fs.flyby(stiff, e, model="grains")
    with pytest.warns(UserWarning, match="40 grains"):
        fs.flyby(BODY, earth(5.96), grains=40, seeds=1, model="grains")


def test_a_pile_is_carried_through_an_encounter_as_it_is():
    pile = fs.Pile(BODY, 100, seed=5)
    r = fs.flyby(pile, earth(1.9))
    assert r.rung == "grains"
    (run,) = r.grains.runs
    assert run.seed == 5
    same = fs.flyby(BODY, earth(1.9), grains=100, seeds=[5], model="grains").grains.runs[0]
    np.testing.assert_array_equal(run.course.positions.value, same.course.positions.value)
    two = fs.flyby(pile, earth(5.96), seeds=2).grains.runs
    assert [x.seed for x in two] == [5, 6]
    coarse = fs.flyby(fs.Pile(BODY, 100, 5, "power law"), earth(1.9)).grains.runs[0]
    assert coarse.radius.max() / coarse.radius.min() > same.radius.max() / same.radius.min()
    for options, name in (({"grains": 200}, "grains"), ({"model": "ellipsoid"}, "model")):
        with pytest.raises(InvalidInput, match=name):
            fs.flyby(pile, earth(1.9), **options)


def test_a_contact_binary_parts_at_its_neck():
    lobes = np.array([[600, 450, 400], [400, 350, 300]])
    shape = fs.Shape.contact_binary(*(lobes * u.m), facets=500)
    pile = fs.Pile(shape, 150, 1, density=2 * u.g / u.cm**3, spin_period=8 * u.h)
    assert fs.flyby(pile, earth(8.0)).verdict == "INTACT"
    parted = fs.flyby(pile, earth(4.0))
    assert parted.bound_fraction == 1.0
    expected = np.prod(lobes, axis=1) / np.prod(lobes, axis=1).sum()
    np.testing.assert_allclose(parted.fragments["mass_fraction"], expected, atol=0.05)
    assert parted.fragments["bound_to"].tolist() == [-1, 0]
    assert fs.flyby(pile, earth(1.3)).largest_fraction < 0.4


def test_cohesion_holds_a_pile_together():
    # the ellipsoid yields at 50 Pa and stays rigid at 200 Pa; so do grains
    def pile(cohesion):
        return BODY.with_(material=fs.Material(cohesion=cohesion * u.Pa))

    weak, strong = (fs.flyby(pile(c), earth(1.9), grains=150, seeds=[1], model="grains") for c in (20, 300))
    assert weak.largest_fraction < 0.9
    assert strong.verdict == fs.flyby(pile(300), earth(1.9)).verdict == "INTACT"
    assert "cohesion 300 Pa" in "; ".join(strong.modelled)


def test_the_error_from_the_number_of_grains_falls_with_it(deep):
    errors = deep.grains.resolution_errors
    assert 0.0 < errors.largest_fraction < deep.largest_fraction
    assert np.isnan(errors.stretch)
    # four times the grains halve the error
    few, many = (resolution_errors(n, 0.97, 1.5, whole=True) for n in (500, 2000))
    assert many.stretch == pytest.approx(0.5 * few.stretch)
    assert many.largest_fraction == pytest.approx(0.5 * few.largest_fraction)
    # a body that is neither stretched nor loses mass has no such error
    assert resolution_errors(500, 1.0, 1.0, whole=True) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("q", "quantity", "base", "constant"),
    [
        ("1.6", "clump", lambda y: y, SMALL),
        ("2.0", "clump", lambda y: y, LARGE),
        ("2.2", "clump", lambda y: 1 - y, LOST),
        ("2.2", "stretch", lambda y: y - 1, ELONGATION),
    ],
)
def test_the_error_from_the_number_of_grains_is_that_of_the_runs(q, quantity, base, constant):
    path = Path(__file__).parents[2] / "docs" / "tables" / "grains_numbers.csv"
    with path.open() as file:
        rows = list(csv.DictReader(x for x in file if not x.startswith("#")))
    some = [r for r in rows if (r["periapsis"], r["quantity"]) == (q, quantity)]
    n, piles, mean = (np.array([float(r[k]) for r in some]) for k in ("grains", "piles", "mean"))
    slope, _ = np.polyfit(n**-EXPONENT, mean, 1, w=np.sqrt(piles))
    at = mean[n == REFERENCE][0]
    assert constant == pytest.approx(abs(slope) * REFERENCE**-EXPONENT / base(at), abs=0.01)
