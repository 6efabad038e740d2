"""Gravity of a homogeneous polyhedron in closed form (Werner & Scheeres 1997, Celest. Mech. Dyn. Astron. 65, 313).

With the edge dyads ``E = n_A (x) n_A^A + n_B (x) n_B^B``, the facet dyads ``F = n (x) n``, the edge potentials
``L = ln[(r_i + r_j + e)/(r_i + r_j - e)]`` and the signed solid angles ``w`` of the facets, all seen from the field
point (``r_e``, ``r_f`` from there to any point of the edge or facet)::

    U      =  (G rho/2) [sum_e r_e.E r_e L - sum_f r_f.F r_f w]
    grad U = -G rho [sum_e E r_e L - sum_f F r_f w]
    grad grad U = G rho [sum_e E L - sum_f F w]

Acceleration is ``+grad U``. The kernels return the sums without the factor ``G rho``.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flybystab.core.numerics.jit import kernel
from flybystab.typing import Array

Integers = NDArray[np.int64]


@kernel
def solid_angle(a: Array, b: Array, c: Array) -> float:
    """Signed solid angle, sr, of the triangle ``a b c`` seen from the origin (Van Oosterom & Strackee 1983).

    Positive if its normal points away from the origin.
    """
    la = np.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])
    lb = np.sqrt(b[0] * b[0] + b[1] * b[1] + b[2] * b[2])
    lc = np.sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2])
    triple = (
        a[0] * (b[1] * c[2] - b[2] * c[1])
        + a[1] * (b[2] * c[0] - b[0] * c[2])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
    )
    ab = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    bc = b[0] * c[0] + b[1] * c[1] + b[2] * c[2]
    ca = c[0] * a[0] + c[1] * a[1] + c[2] * a[2]
    return 2.0 * np.arctan2(triple, la * lb * lc + ab * lc + bc * la + ca * lb)


@kernel
def polyhedron_gravity(
    vertices: Array,
    facets: Integers,
    normals: Array,
    edges: Integers,
    dyads: Array,
    points: Array,
    potential: Array,
    gradient: Array,
    hessian: Array,
) -> None:
    """Potential, its gradient and its second derivatives at field points, over ``G rho``.

    Parameters
    ----------
    vertices, facets : ndarray (v, 3), ndarray of int (f, 3)
        m; corners counter-clockwise seen from outside.
    normals : ndarray (f, 3)
        Outward unit normals.
    edges, dyads : ndarray of int (e, 2), ndarray (e, 3, 3)
        Ends of each edge, and its dyad.
    points : ndarray (n, 3)
        Field points, m; none may lie on an edge.
    potential, gradient, hessian : ndarray (n,), (n, 3), (n, 3, 3)
        Written: m2, m, dimensionless. On a facet the normal second derivative is discontinuous and is not defined.
    """
    a, b, c = np.empty(3), np.empty(3), np.empty(3)
    for n in range(points.shape[0]):
        value = 0.0
        for i in range(3):
            gradient[n, i] = 0.0
            for j in range(3):
                hessian[n, i, j] = 0.0
        for e in range(edges.shape[0]):
            ra, rb, length = 0.0, 0.0, 0.0
            for i in range(3):
                a[i] = vertices[edges[e, 0], i] - points[n, i]
                b[i] = vertices[edges[e, 1], i] - points[n, i]
                ra += a[i] * a[i]
                rb += b[i] * b[i]
                length += (b[i] - a[i]) ** 2
            ra, rb, length = np.sqrt(ra), np.sqrt(rb), np.sqrt(length)
            log = np.log((ra + rb + length) / (ra + rb - length))
            for i in range(3):
                row = dyads[e, i, 0] * a[0] + dyads[e, i, 1] * a[1] + dyads[e, i, 2] * a[2]
                value += 0.5 * a[i] * row * log
                gradient[n, i] -= row * log
                for j in range(3):
                    hessian[n, i, j] += dyads[e, i, j] * log
        for f in range(facets.shape[0]):
            height = 0.0
            for i in range(3):
                a[i] = vertices[facets[f, 0], i] - points[n, i]
                b[i] = vertices[facets[f, 1], i] - points[n, i]
                c[i] = vertices[facets[f, 2], i] - points[n, i]
                height += normals[f, i] * a[i]
            angle = solid_angle(a, b, c)
            value -= 0.5 * height * height * angle
            for i in range(3):
                gradient[n, i] += normals[f, i] * height * angle
                for j in range(3):
                    hessian[n, i, j] -= normals[f, i] * normals[f, j] * angle
        potential[n] = value
