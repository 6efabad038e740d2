"""Random flybys over the whole domain: does any hang, fail, lose its numbers, gain energy or change its verdict?

python benchmarks/campaign.py [N [SEED]]     default 2000 flybys, seed 1

Semi-axes to 1 : 0.1 : 0.1, 1 m to 1000 km, 1000 to 4000 kg/m3, any spin up to 1.2 times the cohesionless limit of a
sphere, any attitude; friction 0.1 to 60 deg, the four surfaces, dilatancy 0 to 1, cohesion or none, brittle or not;
Earth at 1.01 to 5 radii with 0 to 20 km/s. Each is run at a tolerance of 1e-7 and of 1e-9. Energy is checked where it
can only fall: the plastic power along the flow, and the kinetic energy across every impulse and arrest.
"""

from __future__ import annotations

import sys
import time
from collections import Counter

import astropy.units as u
import numpy as np
from scipy.spatial.transform import Rotation

import flybystab as fs
from flybystab.aggregate.body import YIELD_SURFACES
from flybystab.constants import G
from flybystab.errors import NotConverged

TOLERANCES = (1e-7, 1e-9)
#: Axis ratio where the model is left: above that of the longest bodies drawn.
LIMIT = 12.0


def draw(rng: np.random.Generator) -> tuple[fs.Body, fs.Encounter, np.ndarray]:
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


def energy_gains(r: fs.FlybyResult, body: fs.Body) -> float:
    """Largest share of the kinetic energy gained where it can only fall."""
    h = r.history
    shape, gradient = h.shape.to_value(u.m**2), h.velocity_gradient.to_value(1 / u.s)
    kinetic = 0.5 * np.einsum("nij,njk,nik->n", gradient, shape, gradient)
    t = h.time.to_value(u.s)
    gain = 0.0
    for i in np.flatnonzero((np.diff(t) == 0.0) & (h.regime[1:] != h.regime[:-1])):
        own = 4.0 * np.pi * G * body.rho / 3.0 * np.trace(shape[i])  # of the order of the self-gravity
        gain = max(gain, (kinetic[i + 1] - kinetic[i]) / max(kinetic[i], 1e-12 * own))
    return gain


def main(n: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    count: Counter[str] = Counter()
    verdicts: Counter[str] = Counter()
    cpu = dict.fromkeys(TOLERANCES, 0.0)
    worst = 0.0
    for i in range(n):
        body, encounter, attitude = draw(rng)
        found = []
        for tol in TOLERANCES:
            start = time.process_time()
            try:
                r = fs.flyby(
                    body, encounter, attitude, tolerance=tol, error=False, history=tol == TOLERANCES[0],
                    max_axis_ratio=LIMIT,
                )  # fmt: skip
            except NotConverged as reason:
                count["not converged"] += 1
                print(f"{i}: {reason}\n   {body}\n   {encounter.distance:.1f} {encounter.v_inf}")
                break
            cpu[tol] += time.process_time() - start
            found.append(r)
            numbers = [*r.semi_axes.value, *r.spin_vector.value, r.bound_fraction, r.end_time.value]
            if not np.all(np.isfinite(numbers)):
                count["not finite"] += 1
                print(f"{i}: not finite\n   {body}")
        if len(found) < len(TOLERANCES):
            continue
        count["ran"] += 1
        verdicts[str(found[0].verdict)] += 1
        count["with flow"] += found[0].onset_time is not None
        count["loss of contact"] += any(name == "loss of contact" for name, _ in found[0].events)
        count["jam"] += any(name == "jam" for name, _ in found[0].events)
        gain = energy_gains(found[0], body)
        worst = max(worst, gain)
        if gain > 1e-6:
            count["energy gained"] += 1
            print(f"{i}: energy gained {gain:.1e}\n   {body}\n   {encounter.distance:.1f} {encounter.v_inf}")
        if found[0].verdict != found[1].verdict:
            count["verdicts differ"] += 1
            print(f"{i}: {found[0].verdict} at {TOLERANCES[0]:g}, {found[1].verdict} at {TOLERANCES[1]:g}")
            print(f"   {[str(e[0]) for e in found[0].events]} {[str(e[0]) for e in found[1].events]}")
            print(f"   {body}\n   {encounter.distance:.1f} {encounter.v_inf}")
    print(f"{n} flybys, seed {seed}; tolerances {TOLERANCES[0]:g} and {TOLERANCES[1]:g}")
    for name in ("ran", "with flow", "loss of contact", "jam"):
        print(f"{name:18s} {count[name]:6d}")
    for name in ("not converged", "not finite", "energy gained", "verdicts differ"):
        print(f"{name:18s} {count[name]:6d}  {count[name] / n:.2%}")
    print(f"largest gain of energy across an impulse or arrest: {worst:.1e} of the kinetic energy")
    print("verdicts: " + ", ".join(f"{v} {k}" for k, v in verdicts.most_common()))
    for tol in TOLERANCES:
        print(f"tolerance {tol:g}: {count['ran'] / cpu[tol]:.0f} a second of processor time")


if __name__ == "__main__":
    if len(sys.argv) > 3:
        raise SystemExit(__doc__)
    main(*(int(x) for x in (sys.argv[1:] + ["2000", "1"][len(sys.argv) - 1 :])))
