"""Bound on the friction that an encounter can mobilise, for any attitude.

In principal axes the stress of the rigid body is ``T = 5 sigma/rho = H o (K_g + K_t + w^2 1 - w w)``, the
entries of ``H`` being ``2 S_i S_j/(S_i + S_j)``, none above ``S_1``
(:mod:`flybystab.core.ellipsoid.rigid_stress`). So a
tide of norm ``|K|`` changes ``T`` by at most ``S_1 |K|`` in any direction. It also turns the body. Per
``m/5``, with ``J_i = S_j + S_k`` and the torque ``tau <= (S_1 - S_3)|K|/sqrt2``:

- the angular momentum stays within ``Lambda = int tau dt`` of its first value;
- ``X = sum J_i (J_3 - J_i) w_i^2 = 2 E J_3 - L^2``, zero for spin about the short axis, obeys
  ``d sqrt(X)/dt <= tau sqrt((J_3 - J_1)/J_1)``, which bounds the wobble.

Both bound the change of ``w w``. Where ``J_2`` is close to ``J_3`` the spin axis may turn by a large angle in the plane
of the two short axes; up to terms in ``S_2 - S_3`` the stress then turns with it, which gives a second bound. The
smaller of the two is used.

If every stress within that distance ``d`` of the undisturbed one is inside the yield surface the body cannot yield:
INTACT is proved without integrating anything. With the gauge ``gamma = sin(phi)/k`` the yield function::

    f = |s| gamma(theta) - p sin(phi) - Y cos(phi)

is convex and isotropic, and its slope is at most ``G = sqrt(max(gamma^2 + gamma'^2) + sin^2(phi)/3)``. For a convex
section ``gamma^2 + gamma'^2`` is largest where ``gamma`` is, at the least slope ``k`` (its derivative is ``2 gamma'
(gamma + gamma'')``); for Mohr-Coulomb it is constant. The test is therefore ``f + G d <= 0``. For cones and
Mohr-Coulomb the slope of ``f`` is ``G`` at every stress, so that the test is sharp for a change of the stress of norm
``d`` in any direction. If the test fails, the dynamics has to be integrated. The result does not depend on the
attitude, the phase of the spin, the source of the tide or the material beyond first yield, since the body is rigid
until then. ``python benchmarks/honesty.py`` tests the bound with random bodies and encounters.

A body whose stress is outside the yield surface without a tide is not in equilibrium; this needs no dynamics either.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flybystab.constants import G
from flybystab.core.ellipsoid.potential import gravity_coefficients
from flybystab.core.ellipsoid.rigid_stress import invariants, overload, rigid_stress
from flybystab.core.ellipsoid.tide import TidePanels, tide_at
from flybystab.core.material.yield_surface import least_slope, required_friction, slope_over_sine
from flybystab.core.numerics.jit import kernel
from flybystab.core.verdict_codes import FAILED, INTACT, NOT_IN_EQUILIBRIUM
from flybystab.typing import Array

#: Verdicts of the quick test.
UNDECIDED = FAILED
_LARGEST = 0.5 * np.pi * (1.0 - 1e-6)


@kernel
def _holds(code: int, phi: float, cohesion: float, s: float, p: float, det: float, d: float) -> bool:
    """True if every stress within `d` of that with the invariants `s` (norm), `p` and `det` is admissible."""
    sin = np.sin(phi)
    gamma = 1.0 / slope_over_sine(code, sin, det)
    least_sin = max(sin, 1e-12)  # sin(phi)/k has a limit at phi = 0
    most = least_sin / least_slope(code, least_sin)
    return s * gamma + d * np.sqrt(most * most + sin * sin / 3.0) <= p * sin + cohesion * np.cos(phi)


@kernel
def _friction_bound(
    code: int, phi: float, cohesion: float, s: float, p: float, det: float, d: float
) -> float:
    """A friction angle (rad) at which `_holds` is true, at most `phi` if it is true there; inf if none was found."""
    if _holds(code, 0.0, cohesion, s, p, det, d):
        return 0.0
    # In tension a larger angle does not help: Y cos(phi) falls.
    high = phi if _holds(code, phi, cohesion, s, p, det, d) else _LARGEST
    if not _holds(code, high, cohesion, s, p, det, d):
        return np.inf
    low = 0.0
    for _ in range(60):
        mid = 0.5 * (low + high)
        if _holds(code, mid, cohesion, s, p, det, d):
            high = mid
        else:
            low = mid
    return high


@kernel
def disturbance(
    axes: Array, pi_g_rho: float, omega: Array, peak: float, impulse: float
) -> tuple[float, float]:
    """Bound on the change of ``T = 5 sigma/rho`` (m2/s2), and the squared spin about a3 of the reference stress.

    `axes` (m) and `omega` (rad/s) along the principal axes; `pi_g_rho` is ``pi G rho`` (s^-2), `peak` the
    largest norm of the tide (s^-2), `impulse` its time integral (1/s). Rotations of the stress are not included.
    """
    s1, s2, s3 = axes[0] ** 2, axes[1] ** 2, axes[2] ** 2
    j1, j2, j3 = s2 + s3, s1 + s3, s1 + s2
    turn = (s1 - s3) / np.sqrt(2.0) * impulse
    momentum = np.sqrt((j1 * omega[0]) ** 2 + (j2 * omega[1]) ** 2 + (j3 * omega[2]) ** 2)
    most = momentum + turn
    least = max(0.0, momentum - turn)
    wobble = j1 * (j3 - j1) * omega[0] ** 2 + j2 * (j3 - j2) * omega[1] ** 2
    wobble = (np.sqrt(wobble) + turn * np.sqrt((j3 - j1) / j1)) ** 2
    # Squares of the largest transverse rates; if two moments of inertia are equal, only the angular momentum bounds
    # them.
    w1 = (most / j1) ** 2
    w2 = (most / j2) ** 2
    side = most * most  # largest (J_1 w_1)^2 + (J_2 w_2)^2
    if wobble == 0.0:
        w1 = w2 = side = 0.0
    else:
        if j3 > j1:
            w1 = min(w1, wobble / (j1 * (j3 - j1)))
        if j3 > j2:
            w2 = min(w2, wobble / (j2 * (j3 - j2)))
            side = min(side, wobble * max(j1 / (j3 - j1), j2 / (j3 - j2)))
    high = (most / j3) ** 2
    low = max(0.0, least * least - side) / (j3 * j3)
    centre = 0.5 * (high + low)
    half = 0.5 * (high - low)
    h12, h13, h23 = 2 * s1 * s2 / (s1 + s2), 2 * s1 * s3 / (s1 + s3), 2 * s2 * s3 / (s2 + s3)
    squares = (s1 * (w2 + half)) ** 2 + (s2 * (w1 + half)) ** 2 + (s3 * (w1 + w2)) ** 2
    squares += 2.0 * (h12 * h12 * w1 * w2 + (h13 * h13 * w1 + h23 * h23 * w2) * high)
    change = np.sqrt(squares)
    # The axis turned by any angle in the plane of a2 and a3, at a rate w: the stress turned alike, and
    high = (most / j2) ** 2
    low = max(0.0, least * least - j1 * j1 * w1) / (j3 * j3)
    half = 0.5 * (high - low)
    _, g2, g3 = gravity_coefficients(s1, s2, s3)
    load = 2.0 * pi_g_rho * abs(s2 * g2 - s3 * g3)
    slip = load + (s2 - s3) * high
    turned = np.sqrt(load * load + 1.5 * slip * slip) + np.sqrt(s1 * s1 + s2 * s2) * half
    turned += np.sqrt((s2 * s2 + s3 * s3) * w1 * w1 + 2.0 * h12 * h12 * w1 * high)
    if turned < change:
        change = turned
        centre = 0.5 * (high + low)
    return change + s1 * peak, centre


@kernel
def quick_margins(
    axes: Array,
    rho: Array,
    omega: Array,
    phi: Array,
    cohesion: Array,
    code: int,
    peak: float,
    impulse: float,
    friction: Array,
    verdict: NDArray[np.int64],
) -> None:
    """Bounds and verdicts for many bodies in one tide.

    Parameters
    ----------
    axes, omega : ndarray (n, 3)
        Semi-axes, m; angular velocity along them at the start, rad/s.
    rho, phi, cohesion : ndarray (n,)
        kg/m3, rad, Pa.
    code : int
        Yield surface.
    peak, impulse : float
        Largest norm of the tide, s^-2, and its time integral, 1/s; infinite if unknown.
    friction : ndarray (n, 2)
        Out: friction angle mobilised by the free body at the start, and a bound on the largest one during the
        encounter, rad; inf if there is none.
    verdict : ndarray (n,) of int
        Out: `INTACT`, `NOT_IN_EQUILIBRIUM` or `UNDECIDED`.
    """
    stress = np.empty(6)
    none = np.zeros(6)
    spin = np.zeros(3)
    for i in range(axes.shape[0]):
        s1, s2, s3 = axes[i, 0] ** 2, axes[i, 1] ** 2, axes[i, 2] ** 2
        rate2 = np.pi * G * rho[i]
        scale = rho[i] / 5.0
        rigid_stress(s1, s2, s3, rho[i], rate2, omega[i], none, stress)
        p, s, det = invariants(stress)
        friction[i, 0] = required_friction(code, cohesion[i], s, p, det)
        if overload(code, phi[i], cohesion[i], stress) > 1e-9 * np.abs(stress).max():
            verdict[i], friction[i, 1] = NOT_IN_EQUILIBRIUM, np.inf
            continue
        if not np.isfinite(peak):
            verdict[i], friction[i, 1] = UNDECIDED, np.inf
            continue
        d, centre = disturbance(axes[i], rate2, omega[i], peak, impulse)
        spin[2] = np.sqrt(centre)
        rigid_stress(s1, s2, s3, rho[i], rate2, spin, none, stress)
        p, s, det = invariants(stress)
        friction[i, 1] = _friction_bound(code, phi[i], cohesion[i], s, p, det, scale * d)
        if _holds(code, phi[i], cohesion[i], s, p, det, scale * d):
            verdict[i] = INTACT
        else:
            verdict[i] = UNDECIDED


@kernel
def _norms(tau: float, start: float, width: float, coefficients: Array, t: Array, out: Array) -> None:
    k = np.empty(6)
    for i in range(t.shape[0]):
        tide_at(tau, start, width, coefficients, t[i], k)
        out[i] = np.sqrt(k[0] ** 2 + k[1] ** 2 + k[2] ** 2 + 2.0 * (k[3] ** 2 + k[4] ** 2 + k[5] ** 2))


def tide_size(tide: TidePanels, t_start: float, t_stop: float, points: int = 4001) -> tuple[float, float]:
    """Bounds on the norm of a tide: largest (s^-2) and time integral (1/s).

    The norm is sampled in ``u = asinh(t/tau)``, in which it varies on a scale of one, at steps of a few 1e-3; the
    bounds are raised by 0.1 percent for values between the samples.
    """
    u = np.linspace(np.arcsinh(t_start / tide.tau), np.arcsinh(t_stop / tide.tau), points)
    norm = np.empty(points)
    _norms(tide.tau, tide.start, tide.width, tide.coefficients, tide.tau * np.sinh(u), norm)
    rate = norm * tide.tau * np.cosh(u)
    impulse = float(np.sum(0.5 * (rate[1:] + rate[:-1]))) * float(u[1] - u[0])
    return 1.001 * float(norm.max()), 1.001 * impulse
