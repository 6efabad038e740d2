"""Polyhedra: gravity, surfaces, freshness and stress. Usage: ``python benchmarks/shapes.py [MODE] [FILE]``.

Modes: ``gravity`` (error against facets and time; the default), ``published`` (change of the slopes of Apophis beside
published figures; FILE is an OBJ shape in km; by default a generated one), ``freshness`` (refreshing distances and
probabilities), ``stress`` (elastic stress of Apophis against Poisson's ratio), ``timing`` (of each function).
"""

import sys
import time
from functools import partial

import astropy.units as u
import numpy as np
from astropy.time import Time

import flybystab as fs
from flybystab.body.elastic_stress import elastic_stress
from flybystab.body.limit_analysis import cohesion_bounds
from flybystab.body.shape_slope import shape_slopes
from flybystab.constants import G
from flybystab.core.ellipsoid.potential import gravity_coefficients
from flybystab.flybys.elastic_change import elastic_change
from flybystab.flybys.refresh_distance import refresh_distance
from flybystab.flybys.spin_sample import spin_states
from flybystab.flybys.surface_history import lobe_history
from flybystab.population.freshness import freshness

AXES = np.array([1400.0, 850.0, 750.0])
RHO = 2000.0
RELIEF = fs.Shape.perturbed([225.0, 165.0, 155.0] * u.m, amplitude=0.06, seed=2, facets=1000)


def gravity():
    print("triangulated ellipsoid, gravity at all its facets against the closed form of the smooth one")
    print("facets  median error  largest  volume cut off  made (s)  gravity (s)  slopes (s)")
    exact = -2 * np.pi * G * RHO * np.array(gravity_coefficients(*(AXES**2)))
    small = fs.Shape.from_ellipsoid(AXES * u.m, facets=100)
    small.gravity(small.centroids, RHO * u.kg / u.m**3)  # compiles
    for facets in (500, 1000, 2000, 4000, 8000):
        start = time.perf_counter()
        shape = fs.Shape.from_ellipsoid(AXES * u.m, facets=facets)
        made = time.perf_counter() - start
        start = time.perf_counter()
        g = shape.gravity(shape.centroids, RHO * u.kg / u.m**3)[1].value
        elapsed = time.perf_counter() - start
        closed = exact * shape.centroids.value
        error = np.linalg.norm(g - closed, axis=1) / np.linalg.norm(closed, axis=1)
        cut = 1.0 - shape.volume.value / (4 / 3 * np.pi * AXES.prod())
        body = fs.Body.from_shape(shape, density=RHO * u.kg / u.m**3, spin_period=6 * u.h)
        start = time.perf_counter()
        shape_slopes(shape, body)
        slopes = time.perf_counter() - start
        print(
            f"{facets:6d}  {np.median(error):12.1e}  {error.max():7.1e}  {cut:14.1e}  {made:8.2f}"
            f"  {elapsed:11.2f}  {slopes:10.2f}"
        )


def published(file=None):
    """Valvano et al. 2022 and Kim et al. 2023: slopes of Apophis in 2029, over 16 attitudes."""
    lobe = [[160.0, 130.0, 125.0] * u.m, [130.0, 110.0, 105.0] * u.m]
    shapes = (
        {
            "ellipsoid with Gaussian relief": RELIEF,
            "contact binary": fs.Shape.contact_binary(*lobe, overlap=0.4, facets=1000),
        }
        if file is None
        else {"shape from a file": fs.Shape.read(file, unit=u.km)}
    )
    encounter = fs.Encounter.hyperbolic("earth", periapsis=38_012 * u.km, v_inf=5.841 * u.km / u.s)
    quoted = {1.29: "4 (Valvano et al. 2022)", 2.2: "2 (Valvano et al. 2022, higher density)", 3.5: ""}
    passing = {}
    for name, made in shapes.items():
        shape = made.scaled(diameter=340 * u.m)
        axes = " x ".join(f"{2 * x:.0f}" for x in shape.ellipsoid().to_value(u.m))
        print(f"{name}, {len(shape.facets)} facets, {axes} m; largest change of slope (deg), 16 attitudes")
        print("g/cm3  from before (least to most)  least to greatest slope  99 % of the area  published")
        for density, reference in quoted.items():
            body = fs.Body.from_shape(shape, density=density * u.g / u.cm**3, spin_period=30.5 * u.h)
            most, ranges, nearly, steepest = [], [], [], []
            for rotation in spin_states(body, 16, 1).rotations:
                history = fs.surface_history(body, encounter, rotation, shape=shape, instants=80)
                change = history.extremes.change.to_value(u.deg)
                order = np.argsort(change)
                share = np.cumsum(shape.facet_area.value[order]) / shape.area.value
                most.append(change.max())
                ranges.append((history.extremes.greatest - history.extremes.least).to_value(u.deg).max())
                nearly.append(change[order][np.searchsorted(share, 0.99)])
                steepest.append([history.share_refreshed(repose=x * u.deg) for x in (15, 20, 25, 30, 35)])
            print(
                f"{density:5.2f}  {np.median(most):11.2f} ({min(most):.2f} to {max(most):.2f})"
                f"  {np.median(ranges):8.2f} ({min(ranges):.2f} to {max(ranges):.2f})  {np.median(nearly):16.2f}"
                f"  {reference}".rstrip()
            )
            if density == 1.29:
                passing[name] = 100.0 * np.mean(steepest, axis=0)
        print()
    print("fraction of the area that first exceeds an angle of repose at 1.29 g/cm3 (%)")
    print("deg  " + "  ".join(passing))
    for k, angle in enumerate((15, 20, 25, 30, 35)):
        print(f"{angle:3d}  " + "  ".join(f"{values[k]:{len(name)}.2f}" for name, values in passing.items()))
    print("published: about 1 (Kim et al. 2023)")


def fresh():
    """Refreshing distances of the Earth, and P(fresh) of asteroids with them."""
    body = fs.Body.from_shape(RELIEF, density=2 * u.g / u.cm**3, spin_period=8 * u.h)
    print("10 % of the area refreshed at the Earth, v_inf 12 km/s, 2 g/cm3, 8 h, 4 attitudes")
    print("rise (deg)  distance (radii)  P(fresh), weathering 1 Myr: Apophis  Bennu  Itokawa  Eros")
    names = ("Apophis", "Bennu", "Itokawa", "Eros")
    for rise in (0.2, 0.5, 1.0, 2.0, 5.0):
        r = refresh_distance(body, RELIEF, rise=rise * u.deg, area=0.1, attitudes=4)
        found = [
            freshness(
                fs.Asteroid.from_catalogue(name),
                {"earth": r.distance},
                now=Time("2026-01-01", scale="tdb"),
                span=50 * u.yr,
            ).probability
            for name in names
        ]
        print(f"{rise:10.1f}  {r.radii:16.2f}  {'':29}" + "  ".join(f"{p:6.3f}" for p in found))
    print("published: 5 to 16 radii, weathering within 1 Myr (Nesvorny et al. 2010, DeMeo et al. 2014)")


def stress():
    """Elastic stress of Apophis at rest and its change on 13 April 2029."""
    apophis = fs.Asteroid.from_catalogue("Apophis")
    encounter = fs.Encounter.from_orbit(apophis.orbit, "earth", Time("2029-04-13", scale="tdb"))
    frame = fs.periapsis_axes(encounter)
    print("Apophis, 2.6 g/cm3; change on 13 April 2029: largest von Mises stress, 8 phases")
    print("Poisson  change (Pa)   needed cohesion at 35 deg (Pa)  at depth  volume at yield with 1 Pa")
    rng = np.random.default_rng(0)
    phases = rng.random((8, 2))
    for nu in (0.0, 0.1, 0.25, 0.4, 0.49):
        changes = []
        for turn, phase in phases:
            attitude = frame @ apophis.attitude(360 * turn * u.deg, phase=float(phase))
            body = apophis.body_with(phase=float(phase))
            changes.append(elastic_change(body, encounter, attitude, poisson=nu).largest.value)
        region = elastic_stress(apophis.body, poisson=nu).yield_region(fs.Material(cohesion=1 * u.Pa))
        print(
            f"{nu:7.2f}  {min(changes):.2f} to {max(changes):.2f}  {region.required_cohesion.value:30.2f}"
            f"  {region.depth:8.2f}  {100 * region.share:24.0f} %"
        )
    print("published: 0.5 Pa (finite elements, other shapes and measures)")
    print(
        "\nlimit analysis: cohesion (Pa) necessary for the whole and sufficient for every part, and the elastic one"
    )
    print("body                                   necessary  sufficient  elastic, Poisson 0.25")
    rotators = {
        "Apophis at rest": apophis.body,
        "sphere of 500 m, 2 g/cm3, 2 h": fs.Body([500] * 3 * u.m, 2 * u.g / u.cm**3, 2 * u.h),
        "700 x 500 x 400 m, 2 g/cm3, 1.5 h": fs.Body([700, 500, 400] * u.m, 2 * u.g / u.cm**3, 1.5 * u.h),
        "25 x 20 x 18 m, 2 g/cm3, 0.1 h": fs.Body([25, 20, 18] * u.m, 2 * u.g / u.cm**3, 0.1 * u.h),
    }
    for name, body in rotators.items():
        bounds = cohesion_bounds(body)
        elastic = elastic_stress(body).yield_region().required_cohesion.value
        print(f"{name:37}  {bounds.necessary.value:9.1f}  {bounds.sufficient.value:10.1f}  {elastic:21.1f}")


def timing():
    """Time of each function on shapes of two sizes."""
    encounter = fs.Encounter.hyperbolic("earth", periapsis=38_012 * u.km, v_inf=5.841 * u.km / u.s)
    print("time (s), second call     1,000 facets  4,000 facets")
    times = {}
    for facets in (1000, 4000):
        shape = fs.Shape.perturbed([225.0, 165.0, 155.0] * u.m, amplitude=0.06, seed=2, facets=facets)
        body = fs.Body.from_shape(shape, density=RHO * u.kg / u.m**3, spin_period=30.5 * u.h)
        for name, call in {
            "surface_history, 200 rows": partial(fs.surface_history, body, encounter, shape=shape),
            "lobe_history": partial(lobe_history, body, encounter, shape=shape),
            "shape_spin without octupole": partial(fs.shape_spin, body, encounter, shape=shape, error=1e-4),
            "shape_spin with octupole": partial(fs.shape_spin, body, encounter, shape=shape, error=1e-8),
            "elastic_change": partial(elastic_change, body, encounter),
        }.items():
            call()
            start = time.perf_counter()
            call()
            times.setdefault(name, []).append(time.perf_counter() - start)
    for name, (few, many) in times.items():
        print(f"{name:28}  {few:8.2f}  {many:12.2f}")


if __name__ == "__main__":
    modes = {
        "gravity": gravity,
        "published": published,
        "freshness": fresh,
        "stress": stress,
        "timing": timing,
    }
    mode, *words = sys.argv[1:] or ["gravity"]
    if mode not in modes:
        sys.exit(f"no mode {mode}; there are {', '.join(modes)}")
    modes[mode](*words)
