"""Random flybys over the whole domain: failures, energy gained, verdicts by tolerance, error estimates.

python benchmarks/campaign.py stress [N [SEED]]       two tolerances, energy, verdicts; 1000 flybys, seed 1
python benchmarks/campaign.py extremes [N [SEED]]     the same at the ends of every range, several at once; 1000, seed 4
python benchmarks/campaign.py integrators [N [SEED]]  against the integrator without events; 300, seed 2
python benchmarks/campaign.py tolerances [N [SEED]]   time, errors, verdicts and coverage by step tolerance
python benchmarks/campaign.py coverage [N [SEED]]     the error estimate against a run at 1e-11; 100 with flow of each
                                                      yield surface at dilatancy 0 and 1, seed 3
python benchmarks/campaign.py verdicts [N [SEED]]     verdicts, bound mass fractions beyond the model; 5000, seed 5

`stress` and `integrators` draw semi-axes to 1 : 0.1 : 0.1, 1 m to 1000 km, 1000 to 4000 kg/m3, any spin up to 1.2 times
the cohesionless limit of a sphere, any attitude; friction 0.1 to 60 deg, the four surfaces, dilatancy 0 to 1, cohesion
or none, brittle or not; Earth at 1.01 to 5 radii with 0 to 20 km/s. `extremes` takes each of these from a few values at
or beside the ends: spheres, needles and discs, bodies at the limit of their equilibrium, friction 0 to 75 deg, a
negligible cohesion or that of rock, 500 to 8000 kg/m3, grazing orbits, parabolas, 70 km/s, several planets and a
fictitious one. Energy is checked where it can only fall: the plastic power along the flow, and the kinetic energy
across every impulse and arrest.
"""

from __future__ import annotations

import dataclasses
import sys
import time
from collections import Counter
from collections.abc import Callable
from typing import Any

import astropy.units as u
import numpy as np
from scipy.spatial.transform import Rotation

import flybystab as fs
from flybystab.body.body import YIELD_SURFACES
from flybystab.constants import G
from flybystab.core.dynamics.moreau import follow_steps
from flybystab.core.dynamics.run import LIMITS, body_state, integrate, parameters
from flybystab.core.ellipsoid.tide import TidePanels, components, tensor
from flybystab.flybys.batch import FlybyRun, flyby_run
from flybystab.flybys.verdict import bound_fraction, classed
from flybystab.orbit.planets import planet

Scene = tuple[fs.Body, fs.Encounter, np.ndarray]

TOLERANCES = (1e-7, 1e-9)
#: Axis ratio where the model is left: above that of the longest bodies drawn.
LIMIT = 12.0
#: Steps of the event-free integrator a dynamical time, of the coarser of two runs.
STEPS = 250
#: Steps, over those of the coarser run, that show whether a difference falls with the step.
SHORTER = 64


def draw(rng: np.random.Generator) -> Scene:
    """One body, encounter and attitude."""
    size = 10.0 ** rng.uniform(0.0, 6.0)
    b = rng.uniform(0.1, 1.0) if rng.random() < 0.5 else rng.uniform(0.5, 1.0)
    c = rng.uniform(0.1, b) if rng.random() < 0.5 else rng.uniform(0.8, 1.0) * b
    if rng.random() < 0.1:  # spheroids and spheres
        b, c = [(1.0, c), (b, b), (1.0, 1.0)][rng.integers(3)]
    rho = rng.uniform(1000.0, 4000.0)
    limit = np.sqrt(4.0 / 3.0 * np.pi * G * rho)
    axis = rng.standard_normal(3) if rng.random() < 0.5 else np.array([0.0, 0.0, rng.choice([-1.0, 1.0])])
    spin = (
        rng.choice([0.0, 1.0], p=[0.1, 0.9])
        * rng.uniform(0.0, 1.2) ** 2
        * limit
        * axis
        / np.linalg.norm(axis)
    )
    strength = np.pi * G * rho**2 * size**2  # pressure at the centre, up to a number
    material = fs.Material(
        friction_angle=rng.choice([0.1, rng.uniform(0.1, 60.0), rng.uniform(25.0, 45.0)]) * u.deg,
        cohesion=rng.choice([0.0, 10.0 ** rng.uniform(-3.0, 0.5) * strength]) * u.Pa,
        dilatancy=float(rng.choice([0.0, 1.0, rng.uniform()])),
        yield_surface=str(rng.choice(YIELD_SURFACES)),
        brittle=bool(rng.random() < 0.3),
    )
    body = fs.Body(
        semi_axes=size * np.array([1.0, b, c]) * u.m,
        density=rho * u.kg / u.m**3,
        spin=spin * u.rad / u.s,
        material=material,
    )
    q = rng.choice([rng.uniform(1.01, 2.5), rng.uniform(1.01, 5.0)])
    v = rng.choice([0.0, 0.01, rng.uniform(0.0, 20.0)], p=[0.1, 0.1, 0.8])
    encounter = fs.Encounter.hyperbolic("earth", q * fs.R_earth, v * u.km / u.s)
    return body, encounter, Rotation.random(random_state=int(rng.integers(1 << 31))).as_matrix()


def draw_extreme(rng: np.random.Generator) -> Scene:
    """As `draw`, with everything at the ends of its range."""

    def one_of(*values: Any) -> Any:
        return values[int(rng.integers(len(values)))]

    size = one_of(1.0, 100.0, 1e4, 1e6)
    b, c = one_of(
        (1.0, 1.0), (1.0, 1.0 - 1e-9), (1.0, 0.1), (0.1, 0.1), (0.1, 0.01), (0.999, 0.998), (0.6, 0.5)
    )
    rho = one_of(500.0, 2000.0, 8000.0)
    phi = one_of(0.0, 1e-3, 0.1, 5.0, 35.0, 36.87, 60.0, 75.0)
    strength = np.pi * G * rho**2 * size**2
    material = fs.Material(
        friction_angle=phi * u.deg,
        cohesion=one_of(0.0, 0.0, 1e-9, 1.0, 1e6) * strength * u.Pa,
        dilatancy=one_of(0.0, 1e-3, 0.999, 1.0),
        yield_surface=str(rng.choice(YIELD_SURFACES)),
        brittle=bool(rng.integers(2)),
    )
    axes = size * np.array([1.0, b, c]) * u.m
    axis = one_of([0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0], rng.standard_normal(3))
    rate = np.sqrt(4.0 / 3.0 * np.pi * G * rho) * np.asarray(axis) / np.linalg.norm(axis)

    def spinning(share: float) -> fs.Body:
        return fs.Body(
            semi_axes=axes, density=rho * u.kg / u.m**3, spin=share * rate * u.rad / u.s, material=material
        )

    # the fastest spin that it bears, where it bears one
    low, high = 0.0, 2.0
    for _ in range(50):
        mid = 0.5 * (low + high)
        low, high = (mid, high) if fs.equilibrium(spinning(mid)).admissible else (low, mid)
    body = spinning(one_of(0.0, 1e-6, low * (1.0 - 1e-9), low * 0.999, low * 0.5))
    earth = planet("earth")
    pebble = dataclasses.replace(
        earth, name="pebble", gm=1e-6 * earth.gm, radius=1e-2 * earth.radius, atmosphere=0.0
    )
    name = one_of("earth", "earth", "earth", "jupiter", "sun", "moon", "venus", pebble)
    surface = planet(name).impact_distance
    q = one_of(0.999, 1.0 + 1e-6, 1.01, 1.02, 1.05, 1.3, 2.0, 6.0)
    v = one_of(0.0, 1e-6, 0.01, 5.0, 70.0)
    encounter = fs.Encounter.hyperbolic(name, q * surface * u.m, v * u.km / u.s)
    return (
        body,
        encounter,
        one_of(np.eye(3), Rotation.random(random_state=int(rng.integers(1 << 31))).as_matrix()),
    )


def said(body: fs.Body, encounter: fs.Encounter) -> str:
    """A scene in two lines."""
    m = body.material
    axes, spin = (" ".join(f"{x:.4g}" for x in v) for v in (body.axes, body.omega))
    return (
        f"   {axes} m, {body.rho:.0f} kg/m3, spin {spin} rad/s, {encounter.planet.name}, "
        f"q {encounter.distance.to_value('m') / encounter.planet.radius:.4f} R, "
        f"v_inf {encounter.v_inf:.2f},\n   {m.yield_surface}, friction {np.rad2deg(m.phi):.2f} deg, "
        f"cohesion {m.c_pa:.3g} Pa{' (brittle)' if m.brittle else ''}, dilatancy {m.dilatancy:.3g}"
    )


def energy_gain(found: FlybyRun, body: fs.Body) -> float:
    """Largest fraction of the kinetic energy gained at an instant, where it can only fall."""
    h = found.history
    assert h is not None
    gradient = h["velocity_gradient"]
    kinetic = 0.5 * np.einsum("nij,njk,nik->n", gradient, h["shape"], gradient)
    gain = 0.0
    for i in np.flatnonzero((np.diff(h["time"]) == 0.0) & (np.diff(h["regime"]) != 0)):
        own = 4.0 * np.pi * G * body.rho / 3.0 * np.trace(h["shape"][i])  # of the order of the self-gravity
        gain = max(gain, (kinetic[i + 1] - kinetic[i]) / max(kinetic[i], 1e-12 * own))
    return gain


def plastic_gain(found: FlybyRun) -> float:
    """Largest negative plastic power over the largest stress times rate of strain; the flow rule forbids any."""
    h = found.history
    assert h is not None
    flow = h["regime"] == 1
    if not np.any(flow):
        return 0.0
    d = 0.5 * (h["velocity_gradient"] + np.swapaxes(h["velocity_gradient"], 1, 2))[flow]
    trace = np.trace(d, axis1=1, axis2=2)
    d -= trace[:, None, None] / 3.0 * np.eye(3)
    size = np.sqrt(np.einsum("nij,nij->n", d, d))

    def lode(det: Any) -> Any:
        return np.arcsin(np.clip(-3.0 * np.sqrt(6.0) * det, -1.0, 1.0)) / 3.0

    turn = lode(np.linalg.det(d / size[:, None, None])) - lode(h["determinant"][flow])
    friction, dilation = h["deviator"][flow] * size * np.cos(turn), h["pressure"][flow] * trace
    return float(np.max(dilation - friction) / np.max((h["deviator"] + np.abs(h["pressure"]))[flow] * size))


def extremes(n: int, seed: int) -> Counter[str]:
    """`stress` with everything at the ends of its range."""
    return stress(n, seed, draw_extreme)


def stress(n: int, seed: int, draw: Callable[[np.random.Generator], Scene] = draw) -> Counter[str]:
    """Two tolerances of the default integrator."""
    first, encounter, _ = pile(np.random.default_rng(0), "drucker-prager", 0.0)
    flyby_run(
        first, encounter, np.eye(3), TOLERANCES[0], LIMIT, 20_000, required=True
    )  # compiles what is not on disk
    rng = np.random.default_rng(seed)
    count: Counter[str] = Counter()
    verdicts: Counter[str] = Counter()
    cpu = dict.fromkeys(TOLERANCES, 0.0)
    worst, power, longest = 0.0, 0.0, 0.0
    for i in range(n):
        body, encounter, attitude = draw(rng)
        while i % 10 > 0 and not fs.equilibrium(body).admissible:  # one in ten may be no body at all
            body, encounter, attitude = draw(rng)
        turn = fs.periapsis_axes(encounter).T @ attitude
        found = []
        for tol in TOLERANCES:
            start = time.process_time()
            found.append(
                flyby_run(
                    body, encounter, turn, tol, LIMIT, 20_000 if tol == TOLERANCES[0] else 0, required=True
                )
            )
            took = time.process_time() - start
            cpu[tol] += took
            longest = max(longest, took)
        failed = [r.failure for r in found if r.failure]
        if failed:
            count["not converged"] += 1
            print(f"{i}: {failed[0]}\n{said(body, encounter)}")
            continue
        first, second = found
        if not all(np.all(np.isfinite([*r.axes, *r.spin, r.bound, r.time])) for r in found):
            count["not finite"] += 1
            print(f"{i}: not finite\n{said(body, encounter)}")
        names = [[name for name, _, _ in r.events] for r in found]
        count["ran"] += 1
        verdicts[str(first.verdict)] += 1
        for name in ("onset", "loss of contact", "jam"):
            count[name] += name in names[0]
        if first.verdict != "NOT IN EQUILIBRIUM":
            gain, plastic = energy_gain(first, body), plastic_gain(first)
            worst, power = max(worst, gain), max(power, plastic)
            if max(gain, plastic) > 100.0 * TOLERANCES[0]:
                count["energy gained"] += 1
                print(f"{i}: energy gained {gain:.1e}, plastic power {-plastic:.1e}\n{said(body, encounter)}")
        if first.verdict != second.verdict:
            count["verdicts differ"] += 1
            print(f"{i}: {first.verdict} at {TOLERANCES[0]:g}, {second.verdict} at {TOLERANCES[1]:g}")
            print(f"   {names[0]} {names[1]}\n{said(body, encounter)}")
    print(f"{n} flybys, seed {seed}; tolerances {TOLERANCES[0]:g} and {TOLERANCES[1]:g}")
    for name in ("ran", "onset", "loss of contact", "jam"):
        print(f"{name:18s} {count[name]:6d}")
    for name in ("not converged", "not finite", "energy gained", "verdicts differ"):
        print(f"{name:18s} {count[name]:6d}  {count[name] / n:.2%}")
    print(f"largest gain of kinetic energy across an impulse or arrest: {worst:.1e} of it")
    print(f"largest plastic power of the wrong sign: {power:.1e} of stress times rate of strain")
    print(f"longest run: {longest:.2f} s of processor time")
    print("verdicts: " + ", ".join(f"{v} {k}" for k, v in verdicts.most_common()))
    for tol in TOLERANCES:
        print(f"tolerance {tol:g}: {n / cpu[tol]:.0f} a second of processor time")
    return count


def stepped(
    body: fs.Body, encounter: fs.Encounter, turn: np.ndarray, n: int
) -> tuple[np.ndarray, np.ndarray, bool] | None:
    """Shape (m2), velocity gradient (1/s) and whether it flowed, by the event-free integrator; None if it fails."""
    m, t0, a0 = body.material, body.dynamical_time, float(np.cbrt(np.prod(body.axes)))
    par = parameters(body.axes, body.rho, m.phi, m.c_pa, m.dilatancy, m.surface_code)
    y = np.zeros(15)
    y[:6] = components(turn @ np.diag((body.axes / a0) ** 2) @ turn.T)
    y[12:15] = turn @ body.omega * t0
    e = encounter.tide
    tide = TidePanels(e.tau / t0, e.start, e.width, e.coefficients * t0**2)
    span = encounter.t_start / t0, encounter.t_stop / t0
    steps = follow_steps(*span, n, y, par.material, tide, m.brittle)
    if not steps.done:
        return None
    w = y[12:15]
    spin = np.array([[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]])
    return tensor(y[:6]) * a0**2, (tensor(y[6:12]) + spin) / t0, steps.flowing + steps.free > 0


def verdict_of(body: fs.Body, shape: np.ndarray, gradient: np.ndarray, yielded: bool) -> str:
    """Verdict of either integrator by one rule."""
    values = np.linalg.eigvalsh(shape)
    if values[2] > LIMIT**2 * values[0]:
        return "BEYOND MODEL"
    if not yielded:
        return "INTACT"
    density = body.mass.value / (4.0 / 3.0 * np.pi * np.sqrt(np.prod(values)))
    return str(classed(bound_fraction(shape, gradient, density))[0])


def integrators(n: int, seed: int) -> Counter[str]:
    """The default at 1e-9 against the event-free integrator with halved steps, extrapolated."""
    rng = np.random.default_rng(seed)
    count: Counter[str] = Counter()
    while count["bodies"] < n:
        body, encounter, attitude = draw(rng)
        turn = fs.periapsis_axes(encounter).T @ attitude
        m = body.material
        if not fs.equilibrium(body).admissible:
            continue
        count["bodies"] += 1
        run = integrate(
            body_state(
                body.axes, body.rho, body.omega, turn, m.phi, m.c_pa, m.dilatancy, m.surface_code, m.brittle
            ),
            (encounter.t_start, encounter.t_stop),
            encounter.tide,
            limits=LIMITS._replace(axis_ratio=LIMIT),
        )
        steps = int(STEPS * (encounter.t_stop - encounter.t_start) / body.dynamical_time)
        coarse, fine = (stepped(body, encounter, turn, k * steps) for k in (1, 2))
        if run.reason == "stuck":
            count["default not converged"] += 1
            print(f"{count['bodies']}: not converged\n{said(body, encounter)}")
            continue
        yielded = any(name == "onset" for name, _, _ in run.events)
        names = [name for name, _, _ in run.events]
        count["with flow"] += yielded
        count["beyond the model"] += run.reason == "beyond model"
        if run.reason == "beyond model":  # where the other integrator continues
            continue
        if coarse is None or fine is None:
            count["event-free not converged"] += 1
            print(f"{count['bodies']}: no impulse found; {names}\n{said(body, encounter)}")
            continue
        verdicts = [verdict_of(body, *x) for x in ((run.shape, run.velocity_gradient, yielded), coarse, fine)]
        if verdicts[0] != verdicts[2]:
            settled = verdicts[1] == verdicts[2]
            count["verdicts differ"] += 1
            count["of these, its own two differ"] += not settled
            print(f"{count['bodies']}: {verdicts}; {names}\n{said(body, encounter)}")
            continue
        size = float(np.trace(fine[0]))
        claimed = np.abs(fine[0] - coarse[0]).max() / size
        apart = np.abs(2.0 * fine[0] - coarse[0] - run.shape).max() / size
        if yielded:
            count["flowed in both"] += 1
            count["apart by less than claimed"] += apart <= max(claimed, 1e-7)
            if apart > max(3.0 * claimed, 1e-6):
                count["apart by more than 3 times"] += 1
                many = stepped(body, encounter, turn, SHORTER * steps)
                left = np.inf if many is None else np.abs(many[0] - run.shape).max() / size
                # Both step sizes may find an event equally late: then the difference falls as the step does.
                count["of these, not with the step"] += left > 4.0 / SHORTER * apart
                print(
                    f"{count['bodies']}: apart {apart:.1e}, claimed {claimed:.1e}, {left:.1e} at {SHORTER} times the "
                    f"steps; {names}\n{said(body, encounter)}"
                )
    print(f"{n} flybys of bodies in equilibrium, seed {seed}; {STEPS} and {2 * STEPS} steps a dynamical time")
    for name in (
        "with flow", "beyond the model", "default not converged", "event-free not converged", "verdicts differ",
        "of these, its own two differ", "flowed in both", "apart by less than claimed", "apart by more than 3 times",
        "of these, not with the step",
    ):  # fmt: skip
        print(f"{name:30s} {count[name]:5d}")
    return count


def pile(rng: np.random.Generator, surface: str, dilatancy: float) -> Scene:
    """A pile of ordinary shape, friction and spin in an encounter in which about half of them flow."""
    body = fs.Body(
        semi_axes=np.sort(rng.uniform(0.45, 1.0, 3))[::-1] * u.km,
        density=rng.uniform(1500, 2500) * u.kg / u.m**3,
        spin_period=rng.choice([-1, 1]) * rng.uniform(5, 12) * u.h,
        material=fs.Material(
            friction_angle=rng.uniform(30, 40) * u.deg, dilatancy=dilatancy, yield_surface=surface
        ),
    )
    encounter = fs.Encounter.hyperbolic(
        "earth", rng.uniform(1.3, 2.4) * fs.R_earth, rng.uniform(1, 12) * u.km / u.s, 10 * fs.R_earth
    )
    return body, encounter, Rotation.random(random_state=int(rng.integers(1 << 31))).as_matrix()


QUANTITIES = ("semi-axes", "spin", "bound mass", "event times")


def coverage(n: int, seed: int, tolerance: float = 1e-8, tight: float = 1e-11) -> dict[str, float]:
    """Fraction of bodies with flow whose true error, against a run at `tight`, is below the measured one."""
    rng = np.random.default_rng(seed)
    floor = 1e-12
    total: Counter[str] = Counter()
    print(f"tolerance {tolerance:g}, true error against {tight:g}; {n} with flow of each, seed {seed}")
    print(f"{'yield surface':26s} {'dilatancy':>9s} " + " ".join(f"{q:>12s}" for q in QUANTITIES))
    for surface in YIELD_SURFACES:
        for dilatancy in (0.0, 1.0):
            covered: Counter[str] = Counter()
            flowed = 0
            while flowed < n:
                body, encounter, attitude = pile(rng, surface, dilatancy)
                truth = fs.flyby(body, encounter, attitude, history=False, error=False, tolerance=tight)
                if truth.onset_time is None:
                    continue
                flowed += 1
                r = fs.flyby(body, encounter, attitude, history=False, tolerance=tolerance)
                total["verdicts differ"] += truth.verdict != r.verdict
                axes = np.abs(r.semi_axes / truth.semi_axes - 1.0).max()
                spin = np.linalg.norm(r.spin_vector - truth.spin_vector) / truth.spin
                same = [x[0] for x in r.events] == [x[0] for x in truth.events]
                late = max(abs(x[1] - y[1]).value for x, y in zip(r.events, truth.events, strict=False))
                # an estimate that is nan says that the two runs behind it saw different events
                told = np.nan_to_num(r.error.event_times.value, nan=np.inf)
                total["events differ"] += not same
                covered["semi-axes"] += axes <= max(r.error.semi_axes, floor)
                covered["spin"] += spin <= max(r.error.spin, floor)
                covered["bound mass"] += abs(r.bound_fraction - truth.bound_fraction) <= max(
                    r.error.bound_fraction, floor
                )
                covered["event times"] += (late if same else np.inf) <= max(told, 1e-6)
            print(
                f"{surface:26s} {dilatancy:9g} "
                + " ".join(f"{covered[q]:>7d}/{flowed:<4d}" for q in QUANTITIES)
            )
            total.update(covered)
            total["flowed"] += flowed
    shares = {q: total[q] / total["flowed"] for q in QUANTITIES}
    print(f"{'all':26s} {'':9s} " + " ".join(f"{shares[q]:12.1%}" for q in QUANTITIES))
    for name in ("verdicts", "events"):
        print(f"{name} differ from the tight run: {total[f'{name} differ']}")
    return shares


def tolerances(n: int, seed: int) -> dict[float, dict[str, float]]:
    """Time, errors against a run at 1e-11, verdicts and coverage of the error estimate by step tolerance."""
    rng = np.random.default_rng(seed)
    scenes = [pile(rng, YIELD_SURFACES[k % 4], float(k // 4 % 2)) for k in range(n)]
    truths = [fs.flyby(*scene, history=False, error=False, tolerance=1e-11) for scene in scenes]
    flows = np.array([t.onset_time is not None for t in truths])
    print(
        f"{n} random flybys, {flows.sum()} with flow, seed {seed}; errors against 1e-11, of those with flow; "
        "median times"
    )
    print(
        "tolerance  ms: flow  rigid   axes: 50 %     99 %   spin: 50 %     99 %  verdicts differ  covered: axes    spin"
        "  events"
    )
    levels = (1e-5, 1e-6, 1e-7, 1e-8, 1e-9)
    times = np.empty((n, len(levels), 2))
    for i, k in np.ndindex(n, 2):  # in turn, so that other programs affect all tolerances alike
        for j, tolerance in enumerate(levels):
            start = time.process_time()
            fs.flyby(*scenes[i], history=False, error=False, tolerance=tolerance)
            times[i, j, k] = time.process_time() - start
    out = {}
    for took, tolerance in zip(times.min(axis=2).T, levels, strict=True):
        axes, spin = np.empty(n), np.empty(n)
        covered = np.empty((n, 3), dtype=bool)
        other = 0
        for i, (scene, truth) in enumerate(zip(scenes, truths, strict=True)):
            r = fs.flyby(*scene, history=False, tolerance=tolerance)
            other += truth.verdict != r.verdict
            axes[i] = np.abs(r.semi_axes / truth.semi_axes - 1.0).max()
            spin[i] = np.linalg.norm(r.spin_vector - truth.spin_vector) / truth.spin
            same = [x[0] for x in r.events] == [x[0] for x in truth.events]
            late = max(
                (abs(x[1] - y[1]).value for x, y in zip(r.events, truth.events, strict=False)), default=0.0
            )
            told = np.nan_to_num(r.error.event_times.value, nan=np.inf)
            covered[i] = (
                axes[i] <= max(r.error.semi_axes, 1e-12),
                spin[i] <= max(r.error.spin, 1e-12),
                (late if same else np.inf) <= max(told, 1e-6),
            )
        row = {
            "flow_ms": 1e3 * np.median(took[flows]),
            "rigid_ms": 1e3 * np.median(took[~flows]),
            "axes_50": np.quantile(axes[flows], 0.5),
            "axes_99": np.quantile(axes[flows], 0.99),
            "spin_50": np.quantile(spin[flows], 0.5),
            "spin_99": np.quantile(spin[flows], 0.99),
            "verdicts": other,
            **dict(zip(("axes", "spin", "events"), covered[flows].mean(axis=0), strict=True)),
        }
        print(
            f"{tolerance:9.0e} {row['flow_ms']:9.2f} {row['rigid_ms']:6.2f}"
            f"   {row['axes_50']:10.1e} {row['axes_99']:8.1e}   {row['spin_50']:10.1e} {row['spin_99']:8.1e}"
            f" {other:16d} {row['axes']:14.1%} {row['spin']:7.1%} {row['events']:7.1%}"
        )
        out[tolerance] = row
    return out


def verdicts(n: int, seed: int) -> Counter[str]:
    """Verdicts of bodies in equilibrium, and bounds on the mass of those that leave the model."""
    rng = np.random.default_rng(seed)
    scenes = []
    while len(scenes) < n:
        scene = draw(rng)
        if fs.equilibrium(scene[0]).admissible:
            scenes.append(scene)
    bodies, encounters, attitudes = (list(part) for part in zip(*scenes, strict=True))
    start = time.process_time()
    table = fs.flyby_many(bodies, encounters, attitudes)
    took = time.process_time() - start
    count = Counter(table.verdict.tolist())
    print(f"{n} flybys of bodies in equilibrium, seed {seed}; {1e3 * took / n:.2f} ms of processor time each")
    for name, number in count.most_common():
        print(f"{name:18s} {number:6d}  {number / n:.2%}")
    bound = table.bound_fraction[table.verdict == "BEYOND MODEL"]
    print(f"bound mass fraction of the {len(bound)} bodies BEYOND MODEL:")
    for least, most in ((0.0, 0.5), (0.5, 0.9), (0.9, 1.0 - 1e-6), (1.0 - 1e-6, 1.1)):
        share = np.mean((bound > least) & (bound <= most) | ((least == 0.0) & (bound == 0.0)))
        print(f"   {least:4.2g} to {min(most, 1.0):4.2g}  {share:6.1%}")
    return count


COMMANDS = {
    "stress": (stress, 1000, 1),
    "extremes": (extremes, 1000, 4),
    "integrators": (integrators, 300, 2),
    "coverage": (coverage, 100, 3),
    "tolerances": (tolerances, 240, 6),
    "verdicts": (verdicts, 5000, 5),
}

if __name__ == "__main__":
    words = sys.argv[1:]
    if not words or words[0] not in COMMANDS or len(words) > 3:
        raise SystemExit(__doc__)
    run, *usual = COMMANDS[words[0]]
    given = [int(x) for x in words[1:]]
    run(*given, *usual[len(given) :])
