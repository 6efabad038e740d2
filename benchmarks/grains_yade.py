"""The reference flyby in this package and in Yade, one run of each on one core: time and outcome.

python benchmarks/grains_yade.py [--grains N] [--periapsis Q] [--seed K]

Both codes start from the same grains with the same spin and the same tide (Earth, v_inf 5 km/s, from 10 Earth
radii). Yade 2023.02 (Debian package ``yade``) has Hertz-Mindlin contacts with friction 0.6, a rolling moment of at most
0.1 of the normal force times the radius, and a restitution of 0.3; gravity, the direct sum, is given to it every 10 s,
as in this package. Skipped where ``yade`` is missing.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import tempfile
import time
from pathlib import Path

import astropy.units as u
import numpy as np

from flybystab.bench.grains import _run, body, earth
from flybystab.body.pile import make_pile
from flybystab.core.ellipsoid.tide import tide_at
from flybystab.core.grains.clumps import LINK, friends_of_friends, moments, semi_axes
from flybystab.core.grains.state import Grains
from flybystab.flybys.batch import span_of

#: Run inside Yade: reads ``start.npz`` in the working directory, writes ``end.npz``.
SCRIPT = '''
import time
import numpy as np
from yade import O, Vector3, FrictMat, utils

given = np.load("start.npz")
x, v, w, radius, mass = (given[k] for k in ("x", "v", "w", "radius", "mass"))
tides, times, interval = given["tides"], given["times"], float(given["interval"])
G = 6.6743e-11
density = mass / (4.0 / 3.0 * np.pi * radius**3)
for i in range(len(x)):
    material = O.materials.append(
        FrictMat(young=float(given["young"]), poisson=0.2, frictionAngle=np.arctan(0.6), density=float(density[i]))
    )
    O.bodies.append(utils.sphere(Vector3(*x[i]), float(radius[i]), material=material))
    O.bodies[-1].state.vel = Vector3(*v[i])
    O.bodies[-1].state.angVel = Vector3(*w[i])


def pull():
    p = np.array([b.state.pos for b in O.bodies])
    u = np.array([b.state.vel for b in O.bodies])
    p = p + 0.5 * interval * u
    d = p[None] - p[:, None]
    r2 = (d**2).sum(axis=2)
    np.fill_diagonal(r2, np.inf)
    a = G * ((mass[None] / (r2 * np.sqrt(r2)))[..., None] * d).sum(axis=1)
    k = np.array([np.interp(O.time + 0.5 * interval, times, tides[:, i]) for i in range(6)])
    tide = np.array([[k[0], k[3], k[4]], [k[3], k[1], k[5]], [k[4], k[5], k[2]]])
    f = mass[:, None] * (a + p @ tide)
    for i in range(len(f)):
        O.forces.setPermF(i, Vector3(*f[i]))


O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb()], verletDist=float(0.15 * radius.mean())),
    InteractionLoop(
        [Ig2_Sphere_Sphere_ScGeom6D()],
        [Ip2_FrictMat_FrictMat_MindlinPhys(en=0.3, es=0.3, krot=0.1, ktwist=0.0, eta=0.1)],
        [Law2_ScGeom_MindlinPhys_Mindlin(includeMoment=True)],
    ),
    PyRunner(command="pull()", virtPeriod=interval, initRun=True),
    NewtonIntegrator(damping=0.0),
]
O.dt = 0.5 * utils.PWaveTimeStep()
steps = int(round((times[-1] - times[0]) / O.dt))
begun = time.process_time()
O.run(steps, True)
cpu = time.process_time() - begun
np.savez(
    "end.npz", cpu=cpu, steps=steps,
    x=[b.state.pos for b in O.bodies], v=[b.state.vel for b in O.bodies], w=[b.state.angVel for b in O.bodies],
)
'''  # fmt: skip


def main(arguments: list[str] | None = None) -> None:
    """Run both codes and print a table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--grains", type=int, default=541)
    parser.add_argument("--periapsis", type=float, default=2.0, help="Earth radii")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args(arguments)
    if shutil.which("yade") is None:
        print("skipped: yade is not installed (Debian package yade)")
        return
    asteroid, passage = body(), earth(options.periapsis)
    pile = make_pile(asteroid, options.grains, options.seed)
    g, m0 = pile.simulation.grains, asteroid.mass.to_value(u.kg)
    start, stop, _ = span_of(passage)
    times = np.arange(start, stop + 20.0, 20.0)
    tides = np.empty((len(times), 6))
    for t, row in zip(times, tides, strict=True):
        tide = passage.tide
        tide_at(tide.tau, tide.start, tide.width, tide.coefficients, float(t), row)
    speed = pile.length / pile.time
    radius, mass = g.radius * pile.length, g.mass * m0
    # the stiffness of this package at the contact of two mean grains, by Hertz at the same mean overlap
    stiffness = pile.simulation.contact.k_n * m0 / pile.time**2
    overlap = 0.004 * radius.mean()
    young = 0.75 * stiffness * (1.0 - 0.2**2) * 2.0 / np.sqrt(0.5 * radius.mean() * overlap)
    with tempfile.TemporaryDirectory() as folder:
        np.savez(
            Path(folder) / "start.npz", x=g.x * pile.length, v=g.v * speed, w=g.w / pile.time, radius=radius, mass=mass,
            tides=tides, times=times - times[0], interval=10.0, young=young,
        )  # fmt: skip
        (Path(folder) / "run.py").write_text(SCRIPT)
        begun = time.monotonic()
        done = subprocess.run(
            ["yade", "-n", "-x", "-j", "1", "run.py"],
            cwd=folder,
            capture_output=True,
            text=True,
            timeout=3600,
        )
        if not (Path(folder) / "end.npz").is_file():
            print(f"yade failed: {(done.stderr or done.stdout)[-2000:]}")
            return
        end = dict(np.load(Path(folder) / "end.npz"))
        wall = time.monotonic() - begun
    after = Grains(end["x"] / pile.length, end["v"] / speed, end["w"] * pile.time, g.radius, g.mass)
    label = np.empty(len(g.mass), np.int64)
    friends_of_friends(after, LINK, label)
    member = label == np.argmax(np.bincount(label))
    total, _, _, inertia, _ = moments(after, member)
    axes = semi_axes(total, inertia)[0] * pile.length
    _run(3.0, 0, 100)  # compiled
    run, cpu = _run(options.periapsis, options.seed, options.grains)
    at = int(np.abs(run.course.time.to_value(u.s) - stop).argmin())
    ours = run.course.semi_axes[at].to_value(u.m)
    print(
        f"{options.grains} grains, {options.periapsis:g} Earth radii, one core; shapes at the end of the encounter"
    )
    print("                   cpu (s)     steps   ns/grain/step   largest   a1 (m)   a2/a1   a3/a1")
    for name, seconds, steps, share, a in (
        ("this package", cpu, run.steps, run.course.largest_fraction[at], ours),
        ("Yade", float(end["cpu"]), int(end["steps"]), total, axes),
    ):
        print(
            f"{name:16s} {seconds:9.1f} {steps:9d} {1e9 * seconds / steps / options.grains:15.0f} {share:9.3f} "
            f"{a[0]:8.0f} {a[1] / a[0]:7.3f} {a[2] / a[0]:7.3f}"
        )
    print(f"ratio of the times {float(end['cpu']) / cpu:.0f} (Yade with its start {wall:.0f} s of wall time)")


if __name__ == "__main__":
    main()
