"""Third-degree moments of a polyhedron, and the torque of the tide to third degree.

The tide of a point mass ``GM`` at ``R = R n`` acts on an element at ``x`` from the centre of mass with the acceleration
``K x + L:xx/2 + ...``, where ``K = (GM/R^3)(3 n n - 1)`` and ``L = (3 GM/R^4)(5 n n n - 3 sym(n 1))`` are the second
and third derivatives of its potential. The torque is ``N_i = eps_ijk [M_jl K_kl + T_jlm L_klm/2 + ...]`` with the
moments ``M = int rho x x dV`` and ``T = int rho x x x dV``.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flybystab.typing import Array

Integers = NDArray[np.int64]


def third_moments(vertices: Array, facets: Integers) -> Array:
    """``int x x x dV`` of a closed mesh, (3, 3, 3), m6, about the origin.

    Sum over the tetrahedra ``0, a, b, c``. With ``s = a + b + c`` the integral over one of volume ``V`` is ``V/120``
    times ``s s s + sum_p (p p s + p s p + s p p) + 2 sum_p p p p`` over its corners ``p``, since the integral of a
    product of barycentric coordinates to the powers ``k`` is ``6 V prod(k!)/(3 + sum k)!``.
    """
    corners = [vertices[facets[:, i]] for i in range(3)]
    volumes = np.einsum("ni,ni->n", corners[0], np.cross(corners[1], corners[2])) / 6.0
    s = sum(corners)
    out = np.einsum("n,ni,nj,nk->ijk", volumes, s, s, s)
    for p in corners:
        mixed = np.einsum("n,ni,nj,nk->ijk", volumes, p, p, s)
        out += mixed + mixed.transpose(0, 2, 1) + mixed.transpose(2, 0, 1)
        out += 2.0 * np.einsum("n,ni,nj,nk->ijk", volumes, p, p, p)
    return np.asarray(out / 120.0)


def tide_gradient(gm: float, position: Array) -> Array:
    """Third derivatives ``L`` (3, 3, 3), m^-1 s^-2, of the potential of a point mass at `position` from the body, m."""
    r = float(np.linalg.norm(position))
    n = position / r
    eye = np.eye(3)
    mixed = np.einsum("i,jk->ijk", n, eye)
    sym = mixed + mixed.transpose(1, 0, 2) + mixed.transpose(2, 1, 0)
    return np.asarray(3.0 * gm / r**4 * (5.0 * np.einsum("i,j,k->ijk", n, n, n) - sym))


def octupole_torque(third: Array, gm: float, position: Array) -> Array:
    """Torque (3,), m2/s2 per mass, of the third moments `third` (m3, per mass) in the tide of a point mass."""
    product = 0.5 * np.einsum("jlm,klm->jk", third, tide_gradient(gm, position))
    return np.array(
        [product[1, 2] - product[2, 1], product[2, 0] - product[0, 2], product[0, 1] - product[1, 0]]
    )


def quadrupole_torque(second: Array, tide: Array) -> Array:
    """Torque (3,), m2/s2 per mass, of the second moments `second` (3, 3), m2 per mass, in a tidal tensor (3, 3)."""
    product = second @ tide
    return np.array(
        [product[1, 2] - product[2, 1], product[2, 0] - product[0, 2], product[0, 1] - product[1, 0]]
    )
