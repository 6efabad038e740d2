"""Forces on an asteroid: their table, the displacement that each causes, and the compiled acceleration.

The asteroid is massless; Sun, planets and Moon move on the ephemeris. Barycentric ICRF, m, s. Formulas:

- Newtonian point masses; a smooth core inside 0.9 radii, so that the acceleration is finite after an impact;
- 1PN: :mod:`flybystab.orbit.relativity`;
- zonal harmonics J2 to J4: ``GM Jn a^n/r^(n+2) [P'(n+1)(s) r/|r| - P'n(s) p]`` with the derivatives of Legendre
  polynomials, ``s = r.p/|r|``, p the pole (for the Earth that of date); J3 and J4 of the Earth only;
- non-gravitational acceleration and radiation pressure: :mod:`flybystab.orbit.nongravitational`.

A force is one entry of :data:`FORCES`.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from flybystab.constants import AU, DAY
from flybystab.core.numerics.jit import inlined, kernel
from flybystab.errors import UnknownName
from flybystab.orbit.ephemeris import (
    BELT,
    BELT_GM,
    BODIES,
    EARTH,
    MOON,
    N_ALL,
    N_BODIES,
    SUN,
    Window,
    series_position,
    series_state,
)
from flybystab.orbit.nongravitational import (
    N_LAW,
    NONE,
    NonGravitational,
    NonGravitationalParameters,
    add_nongravitational,
    parameters_of,
)
from flybystab.orbit.planets import PLANETS
from flybystab.orbit.relativity import IS_SOURCE, one_pn
from flybystab.typing import Array

#: Names of all forces, in the order in which their accelerations are reported.
FORCES = (
    *(f"{name} point mass" for name in (*BODIES, *BELT)),
    "1PN",
    *(f"{name} J2" for name in BODIES),
    "earth J3",
    "earth J4",
    "non-gravitational",
)
# Places of forces in FORCES, after the point masses.
_BY_1PN, _BY_J2 = N_ALL, N_ALL + 1
_BY_J3, _BY_J4, _BY_NONGRAVITATIONAL = range(N_ALL + 1 + N_BODIES, N_ALL + 4 + N_BODIES)

#: Radius of the smooth core over that of the body.
INNER = 0.9


class ForceModel(NamedTuple):
    """The forces on an asteroid and the ephemeris from which they are computed.

    Rows of bodies are those of ``BODIES``, then those of ``BELT`` where an array has both.

    Attributes
    ----------
    moon_ratio : float
        GM of the Moon over that of the Earth.
    relativity, oblate, nongravitational : bool
        True if the first post-Newtonian terms, any zonal harmonic, the non-gravitational acceleration act.
    law : NonGravitationalParameters
    head, data : ndarray, shape (N_ALL, 5), ndarray
        Chebyshev series of the bodies, as in :class:`flybystab.orbit.ephemeris.Window`.
    gm, used : ndarray, shape (N_ALL,)
        GM of the bodies, and as it acts on the asteroid (zero: left out), m3/s2.
    inner : ndarray, shape (N_ALL,)
        Radius of the smooth core, m; zero for asteroids.
    harmonics : ndarray, shape (N_BODIES, 3)
        ``Jn GM a^n`` of J2, J3, J4, m^(n+3)/s2; zero: left out.
    poles : ndarray, shape (N_BODIES, 6)
        Pole at t = 0 and its rate, 1/s.
    """

    moon_ratio: float
    relativity: bool
    oblate: bool
    nongravitational: bool
    law: NonGravitationalParameters
    head: Array
    gm: Array
    used: Array
    inner: Array
    harmonics: Array
    poles: Array
    data: Array


# A model as one flat array, to which a C callback gets a pointer: its length, three numbers of a log of steps (address,
# rows, rows written), then the fields of ForceModel in their order, before the last of them (data) the last times at
# which the bodies were computed: number of the next to be replaced, times, positions and velocities.
_LENGTH, LOG_ADDRESS, LOG_ROWS, LOG_COUNT, _MOON_RATIO, _RELATIVITY, _OBLATE, _NONGRAVITATIONAL, _LAW = range(
    9
)
_HEAD = _LAW + N_LAW
_GM = _HEAD + 5 * N_ALL
_USED = _GM + N_ALL
_INNER = _USED + N_ALL
_HARMONICS = _INNER + N_ALL
_POLES = _HARMONICS + 3 * N_BODIES
_NEXT = _POLES + 6 * N_BODIES
_TIMES = _NEXT + 1
#: Times in a step of IAS15, which iterates: at its start and at seven nodes.
_KEPT = 8
_PLACES = _TIMES + _KEPT
_RATES = _PLACES + 3 * N_ALL * _KEPT
_DATA = _RATES + 3 * N_BODIES * _KEPT


def force_model(window: Window, forces: Iterable[str], nongrav: NonGravitational | None = None) -> ForceModel:
    """The named forces in a window.

    Raises
    ------
    UnknownName
        For a name that is not in ``FORCES``.
    """
    chosen = set(forces)
    for name in chosen - set(FORCES):
        raise UnknownName("force", name, [], known=f"(known: {', '.join(FORCES)})")
    gm = np.array([*window.gm, *BELT_GM.values()])
    point = [f"{name} point mass" in chosen for name in (*BODIES, *BELT)]
    inner = np.zeros(N_ALL)
    harmonics, poles = np.zeros((N_BODIES, 3)), np.zeros((N_BODIES, 6))
    for i, name in enumerate(BODIES):
        body = PLANETS[name]
        inner[i] = INNER * body.radius
        for k, (n, jn) in enumerate(zip((2, 3, 4), (body.j2, body.j3, body.j4), strict=True)):
            if f"{name} J{n}" in chosen:
                harmonics[i, k] = jn * window.gm[i] * body.radius**n
        if any(f"{name} J{n}" in chosen for n in (2, 3, 4)):
            poles[i] = np.concatenate(body.pole_motion(window.epoch))
    active = "non-gravitational" in chosen and nongrav is not None and nongrav.active
    return ForceModel(
        moon_ratio=float(window.gm[MOON] / window.gm[EARTH]),
        relativity="1PN" in chosen,
        oblate=bool(harmonics.any()),
        nongravitational=active,
        law=nongrav.parameters if active and nongrav is not None else NONE,
        head=window.head,
        gm=gm,
        used=np.where(point, gm, 0.0),
        inner=inner,
        harmonics=harmonics,
        poles=poles,
        data=window.data,
    )


def model(window: Window, forces: Iterable[str], nongrav: NonGravitational | None = None) -> Array:
    """The named forces as one flat array for :mod:`flybystab.orbit.ias15`; errors as of :func:`force_model`."""
    its = force_model(window, forces, nongrav)
    fields = [np.ravel(field) for field in its]
    out = np.concatenate([np.zeros(_MOON_RATIO), *fields[:-1], np.zeros(_DATA - _NEXT), fields[-1]])
    out[_LENGTH] = out.size
    out[_TIMES:_PLACES] = np.nan
    return out


def with_law(flat: Array, law: NonGravitationalParameters) -> Array:
    """A copy of a :func:`model` with a non-gravitational acceleration that acts, even if it is zero."""
    out = np.array(flat)
    out[_NONGRAVITATIONAL] = 1.0
    out[_LAW:_HEAD] = law
    out[_TIMES:_PLACES] = np.nan  # the velocity of the Sun may not have been computed
    return out


@inlined
def unpacked(flat: Array) -> ForceModel:
    """The forces in a flat array of :func:`model`; the arrays are views."""
    return ForceModel(
        flat[_MOON_RATIO],
        flat[_RELATIVITY] != 0.0,
        flat[_OBLATE] != 0.0,
        flat[_NONGRAVITATIONAL] != 0.0,
        parameters_of(flat[_LAW:_HEAD]),
        flat[_HEAD:_GM].reshape((N_ALL, 5)),
        flat[_GM:_USED],
        flat[_USED:_INNER],
        flat[_INNER:_HARMONICS],
        flat[_HARMONICS:_POLES].reshape((N_BODIES, 3)),
        flat[_POLES:_NEXT].reshape((N_BODIES, 6)),
        flat[_DATA:],
    )


@kernel
def bodies(model: ForceModel, t: float, out: Array, rates: Array) -> None:
    """Write positions (m) at ``t`` into ``out[N_ALL, 3]``, velocities (m/s) of the sources of 1PN into ``rates``.

    Massive asteroids that are not in use, and velocities on which no force depends, are left out.
    """
    head, data = model.head, model.data
    state = np.empty(6)
    for i in range(N_BODIES):
        if (model.relativity and IS_SOURCE[i]) or (model.nongravitational and i == SUN):
            series_state(head, data, i, t, state)
            for j in range(3):
                out[i, j] = state[j]
                rates[i, j] = state[3 + j]
        else:
            series_position(head, data, i, t, out[i])
    # For the Earth the velocity of the Earth-Moon barycentre is used, with an error of 12 m/s: its terms are small.
    for j in range(3):
        far = out[MOON, j]
        out[MOON, j] = out[EARTH, j] + far
        out[EARTH, j] -= model.moon_ratio * far
    for i in range(N_BODIES, N_ALL):
        if model.used[i] != 0.0:
            series_position(head, data, i, t, out[i])
            for j in range(3):
                out[i, j] += out[SUN, j]


@kernel
def zonal(c2: float, c3: float, c4: float, pole: Array, t: float, r: Array, out: Array) -> None:
    """Add the acceleration (m/s2) by J2, J3, J4 at ``r`` (m) to ``out[3]``; ``cn = Jn GM a^n`` (m^(n+3)/s2).

    ``pole[:3]`` is the pole at ``t = 0`` and ``pole[3:6]`` its rate, 1/s.
    """
    d = np.sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2])
    px, py, pz = pole[0] + t * pole[3], pole[1] + t * pole[4], pole[2] + t * pole[5]
    radial, along = zonal_factors(c2, c3, c4, 1.0 / d, (r[0] * px + r[1] * py + r[2] * pz) / d)
    out[0] += radial * r[0] + along * px
    out[1] += radial * r[1] + along * py
    out[2] += radial * r[2] + along * pz


@inlined
def zonal_factors(c2: float, c3: float, c4: float, i: float, s: float) -> tuple[float, float]:
    """Factors (1/s2) of the position (m) and (m/s2) of the pole in the acceleration by J2, J3, J4.

    ``i`` is the inverse of the distance (1/m), ``s`` the sine of the latitude.
    """
    s2 = s * s
    i4 = (i * i) * (i * i)
    p2 = 3.0 * s
    p3 = 7.5 * s2 - 1.5
    p4 = s * (17.5 * s2 - 7.5)
    p5 = (39.375 * s2 - 26.25) * s2 + 1.875
    radial = (c2 * p3 + (c3 * p4 + c4 * p5 * i) * i) * (i4 * i)
    along = -(c2 * p2 + (c3 * p3 + c4 * p4 * i) * i) * i4
    return radial, along


@kernel
def core(s: float) -> float:
    """``s^(-3/2)`` continued into ``s < 1`` by its first nine Taylor terms at 1: finite and smooth.

    At a jump of a low derivative the step of a high-order integrator would collapse.
    """
    x = 1.0 - s
    out = 1.0
    term = 1.0
    for n in range(1, 9):
        term *= x * (0.5 + n) / n
        out += term
    return out


@kernel
def fade(s: float) -> float:
    """Smooth switch, four derivatives continuous: 0 for ``s <= 1/2``, 1 for ``s >= 1``."""
    if s >= 1.0:
        return 1.0
    x = max(2.0 * s - 1.0, 0.0)
    return x**5 * (126.0 + x * (-420.0 + x * (540.0 + x * (-315.0 + 70.0 * x))))


@inlined
def _add_oblateness(model: ForceModel, t: float, places: Array, x: Array, out: Array) -> None:
    """Add the acceleration (m/s2) by all zonal harmonics at ``x`` (m) to ``out[3]``."""
    d = np.empty(3)
    for i in range(N_BODIES):
        c2, c3, c4 = model.harmonics[i, 0], model.harmonics[i, 1], model.harmonics[i, 2]
        if c2 != 0.0 or c3 != 0.0 or c4 != 0.0:
            r2 = 0.0
            for j in range(3):
                d[j] = x[j] - places[i, j]
                r2 += d[j] * d[j]
            w = fade(r2 / model.inner[i] ** 2)
            zonal(w * c2, w * c3, w * c4, model.poles[i], t, d, out)


@kernel
def acceleration_among(
    model: ForceModel, t: float, places: Array, rates: Array, x: Array, v: Array, out: Array
) -> None:
    """Write into ``out[3]`` the acceleration (m/s2) at ``t`` (s), ``x`` (m), ``v`` (m/s); bodies at ``places`` (m)."""
    ax = ay = az = potential = 0.0
    g = np.zeros(3)
    for i in range(N_ALL):
        gm = model.used[i]
        if gm == 0.0:
            continue
        dx = places[i, 0] - x[0]
        dy = places[i, 1] - x[1]
        dz = places[i, 2] - x[2]
        r2 = dx * dx + dy * dy + dz * dz
        inner = model.inner[i]
        c = gm / (r2 * np.sqrt(r2)) if r2 > inner * inner else gm * core(r2 / (inner * inner)) / inner**3
        ax += c * dx
        ay += c * dy
        az += c * dz
        if i < N_BODIES and r2 > inner * inner:
            g[0] += c * dx
            g[1] += c * dy
            g[2] += c * dz
            potential += c * r2
    out[0] = ax
    out[1] = ay
    out[2] = az
    if model.oblate:
        _add_oblateness(model, t, places, x, out)
    if model.relativity:
        one_pn(model.gm, model.used, model.inner, places, rates, g, potential, x, v, out)
    if model.nongravitational:
        add_nongravitational(model.law, x - places[SUN], v - rates[SUN], out)


@kernel
def acceleration(flat: Array, t: float, x: Array, v: Array, out: Array) -> None:
    """Write into ``out[3]`` the acceleration (m/s2) at ``t`` (s), ``x`` (m), ``v`` (m/s) by a :func:`model`.

    The places of the bodies at the last times are kept in ``flat``.
    """
    its = unpacked(flat)
    times = flat[_TIMES:_PLACES]
    slot = -1
    for k in range(_KEPT):
        if times[k] == t:
            slot = k
    new = slot < 0
    if new:
        slot = int(flat[_NEXT])
        flat[_NEXT] = (slot + 1) % _KEPT
        times[slot] = t
    places = flat[_PLACES:_RATES].reshape((_KEPT, N_ALL, 3))[slot]
    rates = flat[_RATES:_DATA].reshape((_KEPT, N_BODIES, 3))[slot]
    if new:
        bodies(its, t, places, rates)
    acceleration_among(its, t, places, rates, x, v, out)


def shares(window: Window, t: Array, states: Array, nongrav: NonGravitational | None) -> dict[str, float]:
    """Order of magnitude of the displacement, m, that each force causes by the end of a track.

    ``3 int |a_i(t)| (t_end - t) dt`` along the track: a velocity change at t displaces a free particle by its product
    with ``t_end - t``, and a tangential one on an orbit by three times that. Close encounters amplify it further.

    Parameters
    ----------
    window : Window
    t : ndarray, shape (n,)
        Times, s, increasing or decreasing; the displacement is that at the last.
    states : ndarray, shape (n, 6)
        Barycentric track, m and m/s.
    nongrav : NonGravitational or None
    """
    full = force_model(window, FORCES, nongrav)
    sizes = np.empty((t.size, len(FORCES)))
    _sizes(full, np.ascontiguousarray(t), np.ascontiguousarray(states), sizes)
    weight = 3.0 * np.abs(t[-1] - t)
    values = sizes * weight[:, None]
    integral = np.abs(0.5 * np.diff(t) @ (values[1:] + values[:-1]))
    return {name: float(value) for name, value in zip(FORCES, integral, strict=True)}


@kernel
def _length(a: Array) -> float:
    return np.sqrt(a[0] ** 2 + a[1] ** 2 + a[2] ** 2)


@kernel
def _oblateness_sizes(model: ForceModel, t: float, places: Array, x: Array, out: Array) -> None:
    """Write the size (m/s2) of the acceleration by each zonal harmonic at ``x`` (m) into a row of `_sizes`."""
    a = np.empty(3)
    for i in range(N_BODIES):
        c2, c3, c4 = model.harmonics[i, 0], model.harmonics[i, 1], model.harmonics[i, 2]
        d = x - places[i]
        a[:] = 0.0
        zonal(c2, 0.0, 0.0, model.poles[i], t, d, a)
        out[_BY_J2 + i] = _length(a)
        if i == EARTH:
            a[:] = 0.0
            zonal(0.0, c3, 0.0, model.poles[i], t, d, a)
            out[_BY_J3] = _length(a)
            a[:] = 0.0
            zonal(0.0, 0.0, c4, model.poles[i], t, d, a)
            out[_BY_J4] = _length(a)


@kernel
def _sizes(model: ForceModel, t: Array, states: Array, out: Array) -> None:
    """Write the size (m/s2) of each force of ``FORCES`` at each point of a track into ``out[n, forces]``."""
    places = np.empty((N_ALL, 3))
    rates = np.zeros((N_BODIES, 3))
    a = np.empty(3)
    for n in range(t.size):
        x, v = states[n, :3], states[n, 3:]
        bodies(model, t[n], places, rates)
        potential = 0.0
        for i in range(N_ALL):
            r2 = np.sum((x - places[i]) ** 2)
            out[n, i] = model.gm[i] / r2
            if i < N_BODIES:
                potential += model.gm[i] / np.sqrt(r2)
        _oblateness_sizes(model, t[n], places, x, out[n])
        r = x - places[SUN]
        g = -model.gm[SUN] / np.sum(r * r) ** 1.5 * r
        a[:] = 0.0
        one_pn(model.gm, model.gm, model.inner, places, rates, g, potential, x, v, a)
        out[n, _BY_1PN] = _length(a)
        a[:] = 0.0
        if model.nongravitational:
            add_nongravitational(model.law, r, v - rates[SUN], a)
        out[n, _BY_NONGRAVITATIONAL] = _length(a)


def au_per_day2(value: float) -> float:
    """Acceleration in m/s2 from one in au/d2."""
    return value * AU / DAY**2
