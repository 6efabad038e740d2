"""Contact of the body with the surface of the planet.

With ``n`` the unit vector to the planet, a body with the shape tensor ``S`` extends ``h = sqrt(n.S.n)`` from its centre
along ``n`` (the support function of the ellipsoid). It touches the ground where the height of its centre is ``h``. The
sphere of the planet, of radius R, is replaced by its tangent plane: ``h`` is too large by at most ``a1^2/(2 R)``, 8 cm
for ``a1`` = 1 km at the Earth.

The height of the centre is below the longest semi-axis for a few seconds, far less than a step of the dynamics. This
part of a step is located first, and only this part is searched.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flybystab.core.dynamics.state import N_FULL, N_RIGID, RIGID, W_SCRATCH, RigidShape, rotation_matrix
from flybystab.core.dynamics.steppers import explicit_at, implicit_at
from flybystab.core.dynamics.workspace import Workspace
from flybystab.core.ellipsoid.tide import panel_at
from flybystab.core.numerics.jit import kernel
from flybystab.typing import Array

_GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)
#: Samples per radian of rotation or unit of strain, and the least and the largest number of samples.
_DENSE, _LEAST, _MOST = 16, 8, 4000


class Ground(NamedTuple):
    """Position of the planet relative to the body as a function of time.

    Attributes
    ----------
    tau, start, width : float
        As in :class:`flybystab.core.ellipsoid.tide.TidePanels`.
    floor : float
        Radius of the ground: distance from the planet's centre, m.
    least : float
        Least height of the body's centre above the ground, at closest approach, m; negative below the ground.
    unit : float
        Unit of length of the states, m.
    coefficients : ndarray, shape (panels, degree + 1, 3)
        Chebyshev coefficients of the position, m, frame of the tide; no ground if there are no panels.
    """

    tau: float
    start: float
    width: float
    floor: float
    least: float
    unit: float
    coefficients: Array


def no_ground() -> Ground:
    """A `Ground` without panels, for a body that cannot reach a planet."""
    return Ground(1.0, 0.0, 1.0, 0.0, np.inf, 1.0, np.zeros((0, 1, 3)))


@kernel
def _direction(t: float, ground: Ground, n: Array) -> float:
    """Height (m) of the centre above the ground at time `t`; writes the unit vector ``n[3]`` along the position."""
    c = ground.coefficients
    i, x = panel_at(ground.tau, ground.start, ground.width, c.shape[0], t)
    r2 = 0.0
    for j in range(3):
        b1 = 0.0
        b2 = 0.0
        for k in range(c.shape[1] - 1, 0, -1):
            b1, b2 = c[i, k, j] + 2.0 * x * b1 - b2, b1
        n[j] = c[i, 0, j] + x * b1 - b2
        r2 += n[j] * n[j]
    r = np.sqrt(r2)
    for j in range(3):
        n[j] /= r
    return r - ground.floor


@kernel
def _reach(regime: int, y: Array, rigid: RigidShape, n: Array, m: Array) -> float:
    """Extent ``sqrt(n.S.n)`` of the body along ``n[3]``, in units of the body; `m` is scratch (3, 3)."""
    if regime == RIGID:
        rotation_matrix(y, m)
        s = 0.0
        for i, square in enumerate((rigid.s1, rigid.s2, rigid.s3)):
            along = m[0, i] * n[0] + m[1, i] * n[1] + m[2, i] * n[2]
            s += square * along * along
        return np.sqrt(s)
    s = y[0] * n[0] * n[0] + y[1] * n[1] * n[1] + y[2] * n[2] * n[2]
    s += 2.0 * (y[3] * n[0] * n[1] + y[4] * n[0] * n[2] + y[5] * n[1] * n[2])
    return np.sqrt(s)


class Step(NamedTuple):
    """A step just made, from ``ws.y`` at `t` to ``ws.y1`` at ``t + h``, with its dense output."""

    regime: int
    explicit: bool
    t: float
    h: float
    rigid: RigidShape


@kernel
def _gap(when: float, step: Step, ground: Ground, ws: Workspace, n: Array) -> float:
    """Height of the body's lowest point above the ground at the time `when` of a step, m; `n` is scratch (3,)."""
    x = (when - step.t) / step.h
    if step.regime == RIGID:
        explicit_at(x, ws.y, N_RIGID, ws.dense, ws.ys)
    elif step.explicit:
        explicit_at(x, ws.y, N_FULL, ws.dense, ws.ys)
    else:
        implicit_at(x, ws.y, N_FULL, ws.dense, ws.y1, ws.ys)
    height = _direction(when, ground, n)
    return height - ground.unit * _reach(step.regime, ws.ys, step.rigid, n, ws.work.m[W_SCRATCH])


@kernel
def _crossing(low: float, high: float, size: float, ground: Ground, n: Array) -> float:
    """The time between `low` and `high` at which the height of the centre is `size` (m), by bisection."""
    falling = _direction(high, ground, n) < size
    for _ in range(60):
        mid = 0.5 * (low + high)
        if (_direction(mid, ground, n) < size) == falling:
            high = mid
        else:
            low = mid
        if high - low < 1e-15 * (1.0 + abs(mid)):
            break
    return low if falling else high


@kernel
def _extent(step: Step, ground: Ground, ws: Workspace) -> tuple[float, float]:
    """Upper bound of the longest semi-axis in a step (m), and the norm of ``L`` (or spin) at its end.

    For deformable bodies the bound is ``sqrt(1.1 tr S)``.
    """
    y, y1 = ws.y, ws.y1
    if step.regime == RIGID:
        size = max(step.rigid.s1, step.rigid.s2, step.rigid.s3)
        turn = np.sqrt(y1[4] ** 2 + y1[5] ** 2 + y1[6] ** 2)
    else:
        # no eigenvalue of S is above its trace
        size = 1.1 * max(y[0] + y[1] + y[2], y1[0] + y1[1] + y1[2])
        turn = 0.0
        for i in range(6, 15):
            turn += y1[i] ** 2
        turn = np.sqrt(turn)
    return ground.unit * np.sqrt(size), turn


@kernel
def may_touch(step: Step, ground: Ground, ws: Workspace) -> bool:
    """True where the least height of the centre in a step is below the bound on the longest semi-axis."""
    if ground.coefficients.shape[0] == 0:
        return False
    size, _ = _extent(step, ground, ws)
    lowest = min(max(0.0, step.t), step.t + step.h)
    return size >= ground.least and _direction(lowest, ground, np.empty(3)) < size


@kernel
def contact_time(step: Step, ground: Ground, ws: Workspace) -> float:
    """Time at which the body first touches the ground in a step; infinite if it does not.

    Overwrites ``ws.ys``. The interpolant ``ws.dense`` is needed only where `may_touch` is true.
    """
    if not may_touch(step, ground, ws):
        return np.inf
    size, turn = _extent(step, ground, ws)
    t = step.t
    end = t + step.h
    lowest = min(max(0.0, t), end)
    n = np.empty(3)
    a, b = t, end
    if _direction(t, ground, n) >= size:
        a = _crossing(t, lowest, size, ground, n)
    if _direction(end, ground, n) >= size:
        b = _crossing(lowest, end, size, ground, n)
    count = min(_MOST, _LEAST + int(_DENSE * turn * (b - a)))
    before = f = _gap(a, step, ground, ws, n)
    if f <= 0.0:
        return a
    spacing = (b - a) / count
    for j in range(1, count + 1):
        at = a + j * spacing if j < count else b
        after = _gap(at, step, ground, ws, n)
        if after <= 0.0:
            return _root(at - spacing, at, step, ground, ws, n)
        # a minimum between two samples, or next to the end of the part
        if (f <= before and f <= after) or (j == count and after < f):
            low, value = _dip(max(a, at - 2.0 * spacing), at, step, ground, ws, n)
            if value <= 0.0:
                return _root(max(a, at - 2.0 * spacing), low, step, ground, ws, n)
        before, f = f, after
    return np.inf


@kernel
def _root(low: float, high: float, step: Step, ground: Ground, ws: Workspace, n: Array) -> float:
    """Zero of the gap between the times `low` (positive gap) and `high` (gap not positive), by bisection."""
    for _ in range(60):
        mid = 0.5 * (low + high)
        if _gap(mid, step, ground, ws, n) <= 0.0:
            high = mid
        else:
            low = mid
        if high - low < 1e-15 * (1.0 + abs(mid)):
            break
    return high


@kernel
def _dip(a: float, b: float, step: Step, ground: Ground, ws: Workspace, n: Array) -> tuple[float, float]:
    """Minimum of the gap between the times `a` and `b` by golden section: time and value (m)."""
    x1 = b - _GOLDEN * (b - a)
    x2 = a + _GOLDEN * (b - a)
    f1 = _gap(x1, step, ground, ws, n)
    f2 = _gap(x2, step, ground, ws, n)
    for _ in range(30):
        if f1 > f2:
            a = x1
            x1, f1 = x2, f2
            x2 = a + _GOLDEN * (b - a)
            f2 = _gap(x2, step, ground, ws, n)
        else:
            b = x2
            x2, f2 = x1, f1
            x1 = b - _GOLDEN * (b - a)
            f1 = _gap(x1, step, ground, ws, n)
    return (x1, f1) if f1 < f2 else (x2, f2)
