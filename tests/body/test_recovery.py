"""Pushed bodies: what the dynamics do with them, and that the barrier foretells it."""

import astropy.units as u
import numpy as np
import pytest

from flybystab.body.body import Body, Material
from flybystab.body.equilibrium import equilibrium
from flybystab.body.perturbation import push
from flybystab.body.recovery import pushed, recovery, recovery_energy
from flybystab.body.stability import stability
from flybystab.constants import G
from flybystab.errors import InvalidInput

RHO = 2000.0
STRETCH = np.diag([1.0, -0.5, -0.5])


def body(axes, w2, friction, **material):
    omega = np.sqrt(w2 * np.pi * G * RHO)
    return Body(
        np.array(axes) * u.km,
        RHO * u.kg / u.m**3,
        spin=[0, 0, omega] * u.rad / u.s,
        material=Material(friction_angle=friction * u.deg, **material),
    )


@pytest.mark.parametrize("dilatancy", [0.0, 0.6, 1.0])
def test_friction_stops_a_gentle_push_of_a_sphere_after_the_strain_that_the_powers_give(dilatancy):
    """K + t P1 + t^2/2 P2 = 0; a sphere has no other direction to turn to."""
    b = body((1, 1, 1), 0.0, 30)
    p1, p2, _ = (v.to_value(u.J) for v in push(b, STRETCH, [0.0], dilatancy=dilatancy).powers)
    for share, error in ((1e-3, 1e-2), (1e-4, 1e-3)):
        energy = share * stability(b).binding_energy.to_value(u.J)
        t = (-p1 - np.sqrt(p1 * p1 - 2.0 * p2 * energy)) / p2
        r = pushed(b, STRETCH, energy * u.J, dilatancy=dilatancy)
        assert r.recovered
        assert r.ending == "rest"
        grown = np.log(r.semi_axes.value / b.axes)
        assert grown @ np.diag(STRETCH) / np.linalg.norm(STRETCH) == pytest.approx(t, rel=error)
        if dilatancy == 0.0:
            assert grown.sum() == pytest.approx(0.0, abs=1e-9)


def test_no_push_leaves_the_body_as_it_is():
    r = pushed(body((1, 0.8, 0.7), 0.3, 30), STRETCH, 0 * u.J)
    assert r.recovered
    assert r.strain < 1e-9


def test_a_push_of_the_binding_energy_is_too_much():
    b = body((1, 0.8, 0.7), 0.3, 30)
    r = pushed(b, STRETCH, stability(b).binding_energy)
    assert not r.recovered
    assert r.ending == "beyond model"


def test_dilatancy_loosens_the_pile():
    b = body((1, 0.8, 0.7), 0.3, 30)
    k = 0.05 * stability(b).binding_energy
    loose, tight = (np.prod(pushed(b, STRETCH, k, dilatancy=d).semi_axes.value) for d in (1.0, 0.0))
    assert tight == pytest.approx(np.prod(b.axes), rel=1e-6)
    assert loose > 1.01 * tight


@pytest.mark.parametrize("dilatancy", [0.0, 1.0])
@pytest.mark.parametrize(
    ("axes", "w2", "friction"), [((1, 0.8, 0.7), 0.3, 30), ((1, 0.6, 0.6), 0.3, 20), ((1, 0.8, 0.7), 0.7, 30)]
)
def test_dynamics_judge_the_barrier_right_to_a_quarter(axes, w2, friction, dilatancy):
    """Least energy over the direction of the barrier and random ones; `benchmarks/stability.py push` has more."""
    b = body(axes, w2, friction)
    s = stability(b, dilatancy=dilatancy)
    rng = np.random.default_rng(0)
    directions = [s.directions.barrier, *(v + v.T for v in rng.standard_normal((4, 3, 3)))]
    least = min(recovery_energy(b, d, dilatancy=dilatancy, precision=0.05).value for d in directions)
    assert least == pytest.approx(s.critical_energy.barrier.value, rel=0.25)


@pytest.mark.parametrize("surface", ["drucker-prager", "mohr-coulomb"])
def test_recovery_is_reproducible_finds_less_than_single_directions_and_brackets_its_error(surface):
    b = body((1, 0.8, 0.7), 0.7, 30, yield_surface=surface)
    r = recovery(b, directions=10, refinements=10, searches=2, seed=3)
    again = recovery(b, directions=10, refinements=10, searches=2, seed=3)
    assert r.energy == again.energy
    assert r.runs == again.runs
    assert 0.0 <= r.error < 0.5
    one = recovery_energy(b, r.direction, precision=0.02)
    assert r.energy.value == pytest.approx(one.value, rel=2 * r.precision)
    assert r.energy <= recovery_energy(b, STRETCH) * (1 + r.precision)
    assert not pushed(b, r.direction, 1.02 * r.energy).recovered
    assert pushed(b, r.direction, 0.9 * r.energy).recovered
    assert r.energy.value == pytest.approx(
        stability(b, dilatancy=None).critical_energy.barrier.value, rel=0.35
    )


def test_recovery_of_a_body_that_flows_on_is_zero_where_its_strain_counts():
    b = body((1, 0.691, 0.155), 0.254, 18.7, yield_surface="drucker-prager")
    enough = equilibrium(b).required_friction_angle * (1 + 1e-9)
    b = b.with_(material=b.material.with_(friction_angle=enough))
    r = recovery(b, directions=3, refinements=0, searches=2, largest_strain=0.05)
    assert r.energy.value == 0.0
    assert recovery(b, directions=3, refinements=0, searches=2).energy.value > 0.0


def test_a_brittle_body_recovers_like_one_without_cohesion():
    tough = body((1, 0.8, 0.7), 0.3, 30, cohesion=300 * u.Pa)
    brittle = tough.with_(material=tough.material.with_(brittle=True))
    loose = tough.with_(material=tough.material.with_(cohesion=0 * u.Pa))
    energies = [recovery_energy(b, STRETCH).value for b in (tough, brittle, loose)]
    assert energies[1] == energies[2] < energies[0]


def test_bad_arguments_of_recovery_are_named():
    b = body((1, 0.8, 0.7), 0.3, 30)
    for name, value in {"searches": 1, "directions": 0, "precision": 1.5, "low": 3.0}.items():
        with pytest.raises(InvalidInput, match=name):
            recovery(b, **{name: value})
    with pytest.raises(InvalidInput, match="equilibrium"):
        recovery(body((1, 0.8, 0.7), 2.0, 30))


def test_bad_input_is_named():
    b = body((1, 0.8, 0.7), 0.3, 30)
    with pytest.raises(InvalidInput, match="deviator"):
        pushed(b, np.eye(3), 1 * u.J)
    with pytest.raises(InvalidInput, match="energy"):
        pushed(b, STRETCH, -1 * u.J)
    with pytest.raises(InvalidInput, match="dilatancy"):
        pushed(b, STRETCH, 1 * u.J, dilatancy=2.0)
    with pytest.raises(InvalidInput, match="body"):
        pushed("Apophis", STRETCH, 1 * u.J)
