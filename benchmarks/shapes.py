"""Gravity and slopes of polyhedra: error against facets and time. Usage: ``python benchmarks/shapes.py``."""

import time

import astropy.units as u
import numpy as np

import flybystab as fs
from flybystab.body.shape_slope import shape_slopes
from flybystab.constants import G
from flybystab.core.ellipsoid.potential import gravity_coefficients

AXES = np.array([1400.0, 850.0, 750.0])
RHO = 2000.0


def main():
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
        gravity = time.perf_counter() - start
        closed = exact * shape.centroids.value
        error = np.linalg.norm(g - closed, axis=1) / np.linalg.norm(closed, axis=1)
        cut = 1.0 - shape.volume.value / (4 / 3 * np.pi * AXES.prod())
        body = fs.Body.from_shape(shape, density=RHO * u.kg / u.m**3, spin_period=6 * u.h)
        start = time.perf_counter()
        shape_slopes(shape, body)
        slopes = time.perf_counter() - start
        print(
            f"{facets:6d}  {np.median(error):12.1e}  {error.max():7.1e}  {cut:14.1e}  {made:8.2f}"
            f"  {gravity:11.2f}  {slopes:10.2f}"
        )


if __name__ == "__main__":
    main()
