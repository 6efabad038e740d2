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

The springs turn with the pair: about ``n`` at the mean spin of the two grains, otherwise with ``n``.
"""

from __future__ import annotations

import numpy as np

from flybystab.core.grains.neighbours import Pairs
from flybystab.core.grains.state import Contact, Grains
from flybystab.core.numerics.jit import kernel
from flybystab.typing import Array


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
    x = g.x
    radius = g.radius
    n = radius.shape[0]
    account = ledger.shape[0] > 0
    stored = 0.0
    lost = 0.0
    for i in range(n):
        xi, yi, zi, ri = x[i, 0], x[i, 1], x[i, 2], radius[i]
        fx = fy = fz = tx = ty = tz = 0.0
        for at in range(np.uint64(p.first[i]), np.uint64(p.first[i + 1])):
            j = np.uint64(p.other[at])
            nx, ny, nz = x[j, 0] - xi, x[j, 1] - yi, x[j, 2] - zi
            rj = radius[j]
            reach = ri + rj
            d2 = nx * nx + ny * ny + nz * nz
            if d2 >= reach * reach:
                if p.touching[at]:
                    p.touching[at] = False
                    if account:
                        h = p.spring[at]
                        patch = p.constant[at, 0]
                        lost += 0.5 * c.k_s * (h[0] * h[0] + h[1] * h[1] + h[2] * h[2])
                        lost += 0.5 * c.k_n * patch * patch * (h[3] * h[3] + h[4] * h[4] + h[5] * h[5])
                        lost += c.k_s * patch * patch * h[6] * h[6]
                    for k in range(7):
                        p.spring[at, k] = 0.0
                continue
            p.touching[at] = True
            dist = np.sqrt(d2)
            inverse = 1.0 / dist
            nx *= inverse
            ny *= inverse
            nz *= inverse
            d = reach - dist
            li, lj = ri - 0.5 * d, rj - 0.5 * d
            patch, root = p.constant[at, 0], p.constant[at, 1]
            ux, uy, uz = u[j, 0] - u[i, 0], u[j, 1] - u[i, 1], u[j, 2] - u[i, 2]
            un = ux * nx + uy * ny + uz * nz
            c_n = c.damping_n * root
            normal = c.k_n * d - c_n * un
            push = max(normal, 0.0)
            area = 4.0 * patch * patch
            # slip of the contact points
            six, siy, siz = s[i, 0], s[i, 1], s[i, 2]
            sjx, sjy, sjz = s[j, 0], s[j, 1], s[j, 2]
            ax, ay, az = li * six + lj * sjx, li * siy + lj * sjy, li * siz + lj * sjz
            ux -= un * nx + ay * nz - az * ny
            uy -= un * ny + az * nx - ax * nz
            uz -= un * nz + ax * ny - ay * nx
            # tangential spring: turned with the pair, lengthened by the slip, kept normal to n
            turn = 0.5 * dt * ((six + sjx) * nx + (siy + sjy) * ny + (siz + sjz) * nz)
            qx, qy, qz = p.spring[at, 0], p.spring[at, 1], p.spring[at, 2]
            ax = qx + turn * (ny * qz - nz * qy) + dt * ux
            ay = qy + turn * (nz * qx - nx * qz) + dt * uy
            az = qz + turn * (nx * qy - ny * qx) + dt * uz
            along = ax * nx + ay * ny + az * nz
            ax -= along * nx
            ay -= along * ny
            az -= along * nz
            c_s = c.damping_s * root
            px, py, pz = c.k_s * ax + c_s * ux, c.k_s * ay + c_s * uy, c.k_s * az + c_s * uz
            most = c.mu_s * push
            size = px * px + py * py + pz * pz
            if size > most * most:
                share = most / np.sqrt(size)
                px *= share
                py *= share
                pz *= share
                ax, ay, az = px / c.k_s, py / c.k_s, pz / c.k_s
            if account:
                before = 0.5 * c.k_s * (qx * qx + qy * qy + qz * qz)
                after = 0.5 * c.k_s * (ax * ax + ay * ay + az * az)
                lost += c_n * un * un * dt + dt * (px * ux + py * uy + pz * uz) - (after - before)
                stored += 0.5 * c.k_n * d * d - c.cohesion * area * d + after
            p.spring[at, 0], p.spring[at, 1], p.spring[at, 2] = ax, ay, az
            normal -= c.cohesion * area
            px -= normal * nx
            py -= normal * ny
            pz -= normal * nz
            fx += px
            fy += py
            fz += pz
            force[j, 0] -= px
            force[j, 1] -= py
            force[j, 2] -= pz
            ax, ay, az = ny * pz - nz * py, nz * px - nx * pz, nx * py - ny * px
            mx, my, mz = lj * ax, lj * ay, lj * az
            tx += li * ax
            ty += li * ay
            tz += li * az
            if patch > 0.0:
                # rolling: rotation of j relative to i without its part along n
                wx, wy, wz = sjx - six, sjy - siy, sjz - siz
                wn = wx * nx + wy * ny + wz * nz
                wx -= wn * nx
                wy -= wn * ny
                wz -= wn * nz
                qx, qy, qz = p.spring[at, 3], p.spring[at, 4], p.spring[at, 5]
                ax = qx + turn * (ny * qz - nz * qy) + dt * wx
                ay = qy + turn * (nz * qx - nx * qz) + dt * wy
                az = qz + turn * (nx * qy - ny * qx) + dt * wz
                along = ax * nx + ay * ny + az * nz
                ax -= along * nx
                ay -= along * ny
                az -= along * nz
                k_r, c_r = c.k_n * patch * patch, c_n * patch * patch
                px, py, pz = k_r * ax + c_r * wx, k_r * ay + c_r * wy, k_r * az + c_r * wz
                most = c.mu_r * patch * push
                size = px * px + py * py + pz * pz
                if size > most * most:
                    share = most / np.sqrt(size)
                    px *= share
                    py *= share
                    pz *= share
                    ax, ay, az = px / k_r, py / k_r, pz / k_r
                # twisting
                k_t, c_t = 2.0 * c.k_s * patch * patch, 2.0 * c_s * patch * patch
                twist = p.spring[at, 6]
                angle = twist + dt * wn
                moment = k_t * angle + c_t * wn
                most *= c.mu_t * c.mu_s / c.mu_r if c.mu_r > 0.0 else 0.0
                if abs(moment) > most:
                    moment = most if moment > 0.0 else -most
                    angle = moment / k_t
                if account:
                    after = 0.5 * k_r * (ax * ax + ay * ay + az * az) + 0.5 * k_t * angle * angle
                    before = 0.5 * k_r * (qx * qx + qy * qy + qz * qz) + 0.5 * k_t * twist * twist
                    lost += dt * (px * wx + py * wy + pz * wz + moment * wn) - (after - before)
                    stored += after
                p.spring[at, 3], p.spring[at, 4], p.spring[at, 5], p.spring[at, 6] = ax, ay, az, angle
                px += moment * nx
                py += moment * ny
                pz += moment * nz
                tx += px
                ty += py
                tz += pz
                mx -= px
                my -= py
                mz -= pz
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
