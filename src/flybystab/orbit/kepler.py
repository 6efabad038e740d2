"""Two-body motion counted from periapsis, one formula for ellipse, parabola and hyperbola.

Universal variable ``x`` with ``dx/dt = sqrt(gm)/r``, starting at periapsis (``r.v = 0``), Stumpff functions
``c_k(psi)`` of ``psi = alpha x^2``, ``alpha = -f/q`` (e.g. Danby 1992, section 6.9):

    sqrt(gm) t = q x + e x^3 c3,   r = q + e x^2 c2,
    X = q - x^2 c2,   Y = sqrt(q (1 + e)) x c1,

X toward periapsis and Y along the velocity there. The shape is given by ``f = e - 1 = q v_inf^2/gm`` instead of e, and
for f >= 0 all terms have the same sign: there is no cancellation, also for v_inf -> 0. Lengths in m, times in s, gm
in m3/s2; any consistent units will do.
"""

from __future__ import annotations

import numpy as np

from flybystab.core.numerics.jit import kernel
from flybystab.typing import Array


@kernel
def stumpff(psi: float) -> tuple[float, float, float, float]:
    """Stumpff functions c0, c1, c2, c3 of ``psi`` (positive: ellipse), dimensionless."""
    if abs(psi) < 1.0:
        # c2 and c3 by their series in Horner form; the 11th term is below 1e-21.
        c2 = 1.0
        c3 = 1.0
        for k in range(10, 0, -1):
            c2 = 1.0 - psi * c2 / ((2 * k + 1) * (2 * k + 2))
            c3 = 1.0 - psi * c3 / ((2 * k + 2) * (2 * k + 3))
        c2 *= 0.5
        c3 /= 6.0
        return 1.0 - psi * c2, 1.0 - psi * c3, c2, c3
    if psi > 0.0:
        z = np.sqrt(psi)
        s = np.sin(0.5 * z)
        return np.cos(z), np.sin(z) / z, 2.0 * s * s / psi, (z - np.sin(z)) / (psi * z)
    z = np.sqrt(-psi)
    s = np.sinh(0.5 * z)
    return np.cosh(z), np.sinh(z) / z, -2.0 * s * s / psi, -(np.sinh(z) - z) / (psi * z)


@kernel
def time_at_anomaly(gm: float, q: float, f: float, x: float) -> float:
    """Time since periapsis (s) at universal variable ``x`` (m^1/2)."""
    _, _, _, c3 = stumpff(-f / q * x * x)
    return (q * x + (1.0 + f) * x * x * x * c3) / np.sqrt(gm)


@kernel
def anomaly_at_distance(q: float, f: float, r: float) -> float:
    """Universal variable (m^1/2) on the outbound leg at distance ``r`` (m); nan if the orbit does not reach it."""
    w = (r - q) / (1.0 + f)
    if w < 0.0:
        return np.nan
    a = -f / q
    s = np.sqrt(0.5 * abs(a) * w)  # sinh(z/2) or sin(z/2), z = x sqrt|alpha|
    if s < 1e-8:
        return np.sqrt(2.0 * w)
    if a < 0.0:
        return np.sqrt(2.0 * w) * np.arcsinh(s) / s
    return np.sqrt(2.0 * w) * np.arcsin(s) / s


@kernel
def time_at_distance(gm: float, q: float, f: float, r: float) -> float:
    """Time (s) from periapsis to distance ``r`` (m) on the outbound leg; nan if the orbit does not reach it."""
    return time_at_anomaly(gm, q, f, anomaly_at_distance(q, f, r))


@kernel
def anomaly_at_time(gm: float, q: float, f: float, t: float) -> float:
    """Universal variable (m^1/2) at ``t`` s since periapsis: the inverse of :func:`time_at_anomaly`."""
    e = 1.0 + f
    s = np.sqrt(gm) * abs(t)
    a = -f / q
    turn = 0.0
    if a > 0.0:
        period = 2.0 * np.pi / (a * np.sqrt(a))
        turns = np.floor(s / period + 0.5)
        s -= turns * period
        turn = turns * 2.0 * np.pi / np.sqrt(a)
    sign = 1.0
    if s < 0.0:
        s = -s
        sign = -1.0
    # The cubic q x + e x^3/6 = s bounds the root from above on a hyperbola and from below on an ellipse.
    h = np.sqrt(2.0 * q / e)
    x = 2.0 * h * np.sinh(np.arcsinh(3.0 * s / (2.0 * q * h)) / 3.0)
    low = 0.0
    if a < 0.0:
        high = x
        b = np.sqrt(-a)  # e sinh(b x) = (-a) b s + b x <= with the bound for x
        y = np.arcsinh((-a * b * s + b * x) / e) / b
        if y < high:
            high = y
            x = y
    elif a > 0.0:
        high = np.pi / np.sqrt(a)
        if x > high:
            x = high
    else:
        high = x
    high *= 1.0 + 1e-12
    for _ in range(200):
        _, _, c2, c3 = stumpff(a * x * x)
        miss = q * x + e * x * x * x * c3 - s
        r = q + e * x * x * c2
        if miss > 0.0:
            high = min(high, x)
        else:
            low = max(low, x)
        y = x - miss / r
        if not (low <= y <= high):
            y = 0.5 * (low + high)
        if abs(y - x) <= 2e-16 * abs(y):
            x = y
            break
        x = y
    x = sign * x + turn
    return x if t >= 0.0 else -x


@kernel
def state_at_time(gm: float, q: float, f: float, t: float, out: Array) -> None:
    """Write X, Y (m) and their rates (m/s) at ``t`` s since periapsis into ``out[4]``."""
    x = anomaly_at_time(gm, q, f, t)
    c0, c1, c2, _ = stumpff(-f / q * x * x)
    r = q + (1.0 + f) * x * x * c2
    b = np.sqrt(q * (2.0 + f))
    rate = np.sqrt(gm) / r
    out[0] = q - x * x * c2
    out[1] = b * x * c1
    out[2] = -rate * x * c1
    out[3] = rate * b * c0


@kernel
def states_at_times(gm: float, q: float, f: float, t: Array) -> Array:
    """X, Y (m) and their rates (m/s), shape (n, 4), at times ``t``, shape (n,), s since periapsis."""
    out = np.empty((t.size, 4))
    for i in range(t.size):
        state_at_time(gm, q, f, t[i], out[i])
    return out


@kernel
def two_body(gm: float, state: Array, t: float) -> Array:
    """State, shape (6,), `t` s after a state (m, m/s) of any conic, by universal variables.

    ``sqrt(gm) t = r0 x + (r0.v0/sqrt(gm)) x^2 c2 + (1 - alpha r0) x^3 c3`` increases with x (its derivative is the
    distance), so that Newton's method is safeguarded by a bracket.
    """
    root = np.sqrt(gm)
    r0 = np.sqrt(state[0] ** 2 + state[1] ** 2 + state[2] ** 2)
    sigma = (state[0] * state[3] + state[1] * state[4] + state[2] * state[5]) / root
    alpha = 2.0 / r0 - (state[3] ** 2 + state[4] ** 2 + state[5] ** 2) / gm
    s = root * t
    sign = 1.0 if s >= 0.0 else -1.0
    step = sign * max(abs(s) * alpha, np.sqrt(r0)) if alpha > 0.0 else sign * np.sqrt(r0)
    near = 0.0
    far = step
    for _ in range(400):  # bracket: doubled until it contains the time
        _, _, c2, c3 = stumpff(alpha * far * far)
        if sign * (r0 * far + sigma * far**2 * c2 + (1.0 - alpha * r0) * far**3 * c3 - s) >= 0.0:
            break
        near = far
        far *= 2.0
    x = far
    r = r0
    for _ in range(200):
        c0, c1, c2, c3 = stumpff(alpha * x * x)
        miss = r0 * x + sigma * x * x * c2 + (1.0 - alpha * r0) * x**3 * c3 - s
        r = r0 * c0 + sigma * x * c1 + x * x * c2
        if sign * miss >= 0.0:
            far = x
        else:
            near = x
        y = x - miss / r
        if not (min(near, far) <= y <= max(near, far)):
            y = 0.5 * (near + far)
        done = abs(y - x) <= 4e-16 * abs(y)
        x = y
        if done:
            break
    c0, c1, c2, c3 = stumpff(alpha * x * x)
    r = r0 * c0 + sigma * x * c1 + x * x * c2
    f = 1.0 - x * x * c2 / r0
    g = (r0 * x * c1 + sigma * x * x * c2) / root
    df = -root * x * c1 / (r * r0)
    dg = 1.0 - x * x * c2 / r
    out = np.empty(6)
    for j in range(3):
        out[j] = f * state[j] + g * state[3 + j]
        out[3 + j] = df * state[j] + dg * state[3 + j]
    return out
