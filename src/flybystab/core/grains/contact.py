"""Contact of soft spheres: normal, sliding, rolling and twisting, with history.

Linear springs and dashpots (Cundall & Strack 1979; Schwartz et al. 2012; rolling and twisting of a contact patch of
radius ``beta R``: Zhang et al. 2017). With ``n`` the unit vector from grain i to grain j, overlap ``d``, reduced radius
``R = r_i r_j/(r_i + r_j)``, levers ``l = r - d/2`` and slip velocity
``u_t = (v_j - v_i)_t - (l_i w_i + l_j w_j) x n``:

- normal force ``k_n d - C_n u_n`` less the cohesion ``c (2 beta R)^2``;
- tangential force ``k_s S + C_s u_t``, ``dS/dt = u_t``, at most ``mu_s N``, ``N`` the repulsive part of the normal
  force;
- rolling moment: stiffness ``k_n (beta R)^2``, at most ``mu_r beta R N``;
- twisting moment: stiffness ``2 k_s (beta R)^2``, at most ``mu_t mu_s beta R N``.

The springs rotate with the pair: about ``n`` at the mean spin of the two grains, and with the direction of ``n``.
"""

from __future__ import annotations

import numpy as np

from flybystab.core.grains.neighbours import N_SPRING, Pairs
from flybystab.core.grains.state import Contact, Grains
from flybystab.core.numerics.jit import inlined, kernel
from flybystab.typing import Array

Vector = tuple[float, float, float]


@inlined
def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inlined
def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@inlined
def _tangential(a: Vector, n: Vector) -> Vector:
    """Part of a vector normal to the unit vector `n`."""
    along = _dot(a, n)
    return a[0] - along * n[0], a[1] - along * n[1], a[2] - along * n[2]


@inlined
def _elongated(spring: Vector, rate: Vector, n: Vector, turn: float, dt: float) -> Vector:
    """Spring after a step: turned by `turn` about `n`, elongated at `rate`, its part along `n` removed."""
    c = _cross(n, spring)
    longer = (
        spring[0] + turn * c[0] + dt * rate[0],
        spring[1] + turn * c[1] + dt * rate[1],
        spring[2] + turn * c[2] + dt * rate[2],
    )
    return _tangential(longer, n)


@inlined
def _resistance(
    spring: Vector, rate: Vector, stiffness: float, damping: float, most: float
) -> tuple[Vector, Vector]:
    """Force (or moment) of a spring and a dashpot, limited to the norm `most`, and the spring.

    If the limit is exceeded the contact slides (or rolls), and the spring is shortened to the limit.
    """
    force = (
        stiffness * spring[0] + damping * rate[0],
        stiffness * spring[1] + damping * rate[1],
        stiffness * spring[2] + damping * rate[2],
    )
    size = _dot(force, force)
    if size > most * most:
        share = most / np.sqrt(size)
        force = (force[0] * share, force[1] * share, force[2] * share)
        spring = (force[0] / stiffness, force[1] / stiffness, force[2] / stiffness)
    return force, spring


@inlined
def _twisting(
    twist: float, rate: float, stiffness: float, damping: float, most: float, dt: float
) -> tuple[float, float]:
    """Moment about the normal, limited to `most`, and the angle of the spring after a step."""
    angle = twist + dt * rate
    moment = stiffness * angle + damping * rate
    if abs(moment) > most:
        moment = most if moment > 0.0 else -most
        angle = moment / stiffness
    return moment, angle


@inlined
def _slip(u: Vector, un: float, n: Vector, arm: Vector) -> Vector:
    """Tangential part of the relative velocity of the contact points.

    `u` is that of the centres, `un` its part along the normal `n`, `arm` the sum ``l_i w_i + l_j w_j``.
    """
    return (
        u[0] - (un * n[0] + arm[1] * n[2] - arm[2] * n[1]),
        u[1] - (un * n[1] + arm[2] * n[0] - arm[0] * n[2]),
        u[2] - (un * n[2] + arm[0] * n[1] - arm[1] * n[0]),
    )


@kernel
def _released(c: Contact, p: Pairs, at: int) -> float:
    """Clear the history of a contact that has opened; returns the energy of its springs."""
    p.touching[at] = False
    h = p.spring[at]
    patch = p.constant[at, 0]
    lost = 0.5 * c.k_s * (h[0] * h[0] + h[1] * h[1] + h[2] * h[2])
    lost += 0.5 * c.k_n * patch * patch * (h[3] * h[3] + h[4] * h[4] + h[5] * h[5])
    lost += c.k_s * patch * patch * h[6] * h[6]
    for k in range(N_SPRING):
        p.spring[at, k] = 0.0
    return lost


@kernel
def contact_forces(
    g: Grains, u: Array, s: Array, c: Contact, p: Pairs, dt: float, force: Array, torque: Array, ledger: Array
) -> None:
    """Add the forces and torques of all contacts; advance their history by `dt`.

    Parameters
    ----------
    u, s : ndarray (n, 3)
        Velocities and angular velocities at the time of the positions.
    force, torque : ndarray (n, 3)
        Added to.
    ledger : ndarray (2,) or (0,)
        If given: energy stored in the springs (overwritten), energy dissipated (added to).
    """
    x, radius = g.x, g.radius
    account = ledger.shape[0] > 0
    stored = lost = 0.0
    for i in range(radius.shape[0]):
        xi, yi, zi, ri = x[i, 0], x[i, 1], x[i, 2], radius[i]
        fx = fy = fz = tx = ty = tz = 0.0
        for at in range(np.uint64(p.first[i]), np.uint64(p.first[i + 1])):
            j = np.uint64(p.other[at])
            dx, dy, dz = x[j, 0] - xi, x[j, 1] - yi, x[j, 2] - zi
            rj = radius[j]
            reach = ri + rj
            d2 = dx * dx + dy * dy + dz * dz
            if d2 >= reach * reach:
                if p.touching[at]:
                    lost += _released(c, p, at)
                continue
            p.touching[at] = True
            dist = np.sqrt(d2)
            inverse = 1.0 / dist
            n = (dx * inverse, dy * inverse, dz * inverse)
            d = reach - dist
            li, lj = ri - 0.5 * d, rj - 0.5 * d
            patch, root = p.constant[at, 0], p.constant[at, 1]
            si, sj = (s[i, 0], s[i, 1], s[i, 2]), (s[j, 0], s[j, 1], s[j, 2])
            v = (u[j, 0] - u[i, 0], u[j, 1] - u[i, 1], u[j, 2] - u[i, 2])
            # normal
            vn = _dot(v, n)
            c_n, c_s = c.damping_n * root, c.damping_s * root
            repulsion = c.k_n * d - c_n * vn
            load = max(repulsion, 0.0)
            attraction = c.cohesion * (4.0 * patch * patch)
            # sliding
            arm = (li * si[0] + lj * sj[0], li * si[1] + lj * sj[1], li * si[2] + lj * sj[2])
            v = _slip(v, vn, n, arm)
            turn = 0.5 * dt * _dot((si[0] + sj[0], si[1] + sj[1], si[2] + sj[2]), n)
            old = (p.spring[at, 0], p.spring[at, 1], p.spring[at, 2])
            f, new = _resistance(_elongated(old, v, n, turn, dt), v, c.k_s, c_s, c.mu_s * load)
            p.spring[at, 0], p.spring[at, 1], p.spring[at, 2] = new
            if account:
                before, after = 0.5 * c.k_s * _dot(old, old), 0.5 * c.k_s * _dot(new, new)
                lost += c_n * vn * vn * dt + dt * _dot(f, v) - (after - before)
                stored += 0.5 * c.k_n * d * d - attraction * d + after
            push = repulsion - attraction
            f = (f[0] - push * n[0], f[1] - push * n[1], f[2] - push * n[2])
            fx, fy, fz = fx + f[0], fy + f[1], fz + f[2]
            force[j, 0] -= f[0]
            force[j, 1] -= f[1]
            force[j, 2] -= f[2]
            moment = _cross(n, f)
            tx, ty, tz = tx + li * moment[0], ty + li * moment[1], tz + li * moment[2]
            mx, my, mz = lj * moment[0], lj * moment[1], lj * moment[2]
            if patch > 0.0:
                # rolling and twisting
                w = (sj[0] - si[0], sj[1] - si[1], sj[2] - si[2])
                wn = _dot(w, n)
                w = _tangential(w, n)
                k_r, c_r = c.k_n * patch * patch, c_n * patch * patch
                most = c.mu_r * patch * load
                old = (p.spring[at, 3], p.spring[at, 4], p.spring[at, 5])
                moment, new = _resistance(_elongated(old, w, n, turn, dt), w, k_r, c_r, most)
                k_t, c_t = 2.0 * c.k_s * patch * patch, 2.0 * c_s * patch * patch
                most *= c.mu_t * c.mu_s / c.mu_r if c.mu_r > 0.0 else 0.0
                twist = p.spring[at, 6]
                axial, angle = _twisting(twist, wn, k_t, c_t, most, dt)
                p.spring[at, 3], p.spring[at, 4], p.spring[at, 5] = new
                p.spring[at, 6] = angle
                if account:
                    after = 0.5 * k_r * _dot(new, new) + 0.5 * k_t * angle * angle
                    before = 0.5 * k_r * _dot(old, old) + 0.5 * k_t * twist * twist
                    lost += dt * (_dot(moment, w) + axial * wn) - (after - before)
                    stored += after
                moment = (moment[0] + axial * n[0], moment[1] + axial * n[1], moment[2] + axial * n[2])
                tx, ty, tz = tx + moment[0], ty + moment[1], tz + moment[2]
                mx, my, mz = mx - moment[0], my - moment[1], mz - moment[2]
            torque[j, 0] += mx
            torque[j, 1] += my
            torque[j, 2] += mz
        force[i, 0] += fx
        force[i, 1] += fy
        force[i, 2] += fz
        torque[i, 0] += tx
        torque[i, 1] += ty
        torque[i, 2] += tz
    if account:
        ledger[0] = stored
        ledger[1] += lost
