"""Forces on an asteroid: their table, the displacement that each causes, and the compiled acceleration.

The asteroid is massless; Sun, planets and Moon move on the ephemeris. Barycentric ICRF, m, s. Formulas:

- point masses, Newton; inside 0.9 radii a smooth core, so that the acceleration stays finite after an impact;
- 1PN: :mod:`flybystab.orbit.relativity`;
- zonal harmonics J2 to J4: ``GM Jn a^n/r^(n+2) [P'(n+1)(s) r/|r| - P'n(s) p]`` with the derivatives of Legendre
  polynomials, ``s = r.p/|r|``, p the pole, the Earth's of date; J3 and J4 of the Earth alone;
- non-gravitational: ``g(r') (A1 er + A2 et + A3 en)``, ``g(r) = alpha (r/r0)^-m [1 + (r/r0)^n]^-k`` (Marsden,
  Sekanina & Yeomans 1973), r' the heliocentric distance a time DT earlier (Yeomans & Chodas 1989);
- radiation pressure: ``(S/c) (A/m) (1 au/r)^2 er`` with the solar constant S (IAU 2015 Resolution B3), absorbing body.

A force is one entry of :data:`FORCES`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from flybystab.constants import AU, C_LIGHT, DAY
from flybystab.core.numerics.jit import kernel, pasted_kernel
from flybystab.errors import InvalidInput, UnknownName
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
from flybystab.orbit.kepler import two_body
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
_PN, _J2, _NON = N_ALL, N_ALL + 1, N_ALL + 3 + N_BODIES
_J3, _J4 = _NON - 2, _NON - 1

# Layout of a model, one flat array that a C callback can be handed as a pointer:
#   [0] length  [1] Earth/Moon ratio  [2..4] switches: 1PN, any J2, non-gravitational
#   [5..14] non-gravitational law, see NonGravitational.row  [15] address, [16] rows and [17] count of a log
#   then, with the rows of BODIES before those of BELT where both are in: head (N_ALL x 5), gm (N_ALL), radius of the
#   core (N_BODIES), zonal harmonics: J2, pole, rate of the pole (1/s), J3, J4, Jn times GM a^n (N_BODIES x 9), GM in
#   use (N_ALL; zero: left out), coefficients
_LAW, _LOG = 5, 15
LOG_ADDRESS, LOG_ROWS, LOG_COUNT = _LOG, _LOG + 1, _LOG + 2
_HEAD = 20
#: Numbers per body of its zonal harmonics: J2, pole, rate of the pole, J3, J4.
FLAT_WIDTH = 9
_GM = _HEAD + 5 * N_ALL
_INNER = _GM + N_ALL
_FLAT = _INNER + N_BODIES
_USED = _FLAT + FLAT_WIDTH * N_BODIES
_DATA = _USED + N_ALL
_GM_SUN = PLANETS["sun"].gm
INNER = 0.9
#: Laws ``g(r)`` by name: ALN, r0 (m), m, n, k. The comets' is that of water ice.
LAWS: Mapping[str, tuple[float, float, float, float, float]] = MappingProxyType(
    {
        "asteroid": (1.0, AU, 2.0, 5.093, 0.0),
        "comet": (0.1112620426, 2.808 * AU, 2.15, 5.093, 4.6142),
    }
)
#: Pressure of sunlight on an absorbing surface at 1 au, Pa.
RADIATION_PRESSURE = 1361.0 / C_LIGHT
#: Numbers of a row of :attr:`NonGravitational.row`.
LAW_SIZE = 10


@dataclass(frozen=True)
class NonGravitational:
    """Non-gravitational acceleration ``g(r') (A1 er + A2 et + A3 en)`` and radiation pressure.

    Attributes
    ----------
    a : tuple of float
        A1, A2, A3, m/s2.
    law : str
        ``"asteroid"``: ``g = (1 au/r)^2``; ``"comet"``: ``g = 0.1113 (r/r0)^-2.15 [1 + (r/r0)^5.093]^-4.6142`` with
        r0 = 2.808 au; or the five constants ALN, R0 (au), NM, NN, NK of ``ALN (r/R0)^-NM [1 + (r/R0)^NN]^-NK`` as
        numbers separated by spaces.
    delay : float
        DT: r' is the heliocentric distance this time earlier, s; positive for a maximum after perihelion.
    area_to_mass : float
        AMRAT: illuminated area over mass, m2/kg.
    """

    a: tuple[float, float, float] = (0.0, 0.0, 0.0)
    law: str = "asteroid"
    delay: float = 0.0
    area_to_mass: float = 0.0

    @property
    def active(self) -> bool:
        """Whether there is any acceleration."""
        return any(self.a) or self.area_to_mass != 0.0

    @property
    def constants(self) -> tuple[float, float, float, float, float]:
        """ALN, r0 (m), m, n, k of the law ``ALN (r/r0)^-m [1 + (r/r0)^n]^-k``.

        Raises
        ------
        UnknownName, InvalidInput
        """
        if self.law in LAWS:
            return LAWS[self.law]
        try:
            numbers = [float(word) for word in self.law.split()]
        except ValueError:
            numbers = []
        if not numbers:
            known = f"(known: {', '.join(LAWS)}, or five numbers: ALN R0 NM NN NK)"
            raise UnknownName("non-gravitational law", self.law, [], known=known)
        if len(numbers) != 5 or not np.isfinite(numbers).all() or numbers[1] <= 0.0:
            raise InvalidInput(
                "non-gravitational law", self.law, "five numbers ALN R0 NM NN NK, R0 > 0 in au"
            )
        aln, r0, m, n, k = numbers
        return aln, r0 * AU, m, n, k

    @property
    def row(self) -> Array:
        """The kernels' row: A1, A2, A3 (m/s2); ALN, r0 (m), m, n, k; DT (s); pressure/mass at 1 au (m/s2)."""
        pressure = RADIATION_PRESSURE * self.area_to_mass
        return np.array([*self.a, *self.constants, self.delay, pressure])


def model(window: Window, forces: Iterable[str], nongrav: NonGravitational | None = None) -> Array:
    """The named forces as the flat array that the kernels read.

    Raises
    ------
    UnknownName
        For a name that is not in ``FORCES``.
    """
    chosen = set(forces)
    for name in chosen - set(FORCES):
        raise UnknownName("force", name, [], known=f"(known: {', '.join(FORCES)})")
    out = np.zeros(_DATA + window.data.size)
    out[0] = out.size
    out[1] = window.gm[MOON] / window.gm[EARTH]
    out[_HEAD:_GM] = window.head.ravel()
    out[_GM : _GM + N_BODIES] = window.gm
    out[_GM + N_BODIES : _INNER] = list(BELT_GM.values())
    out[_DATA:] = window.data
    for i, name in enumerate(BODIES):
        body = PLANETS[name]
        out[_INNER + i] = INNER * body.radius
        if f"{name} point mass" in chosen:
            out[_USED + i] = window.gm[i]
        used = [f"{name} J{n}" in chosen for n in (2, 3, 4)]
        if any(used):
            out[3] = 1.0
            terms = zip(used, (body.j2, body.j3, body.j4), (2, 3, 4), strict=True)
            c2, c3, c4 = (jn * window.gm[i] * body.radius**n if there else 0.0 for there, jn, n in terms)
            row = _FLAT + FLAT_WIDTH * i
            pole, pole_rate = body.pole_motion(window.epoch)
            out[row : row + FLAT_WIDTH] = c2, *pole, *pole_rate, c3, c4
    out[2] = float("1PN" in chosen)
    for i, name in enumerate(BELT, N_BODIES):
        if f"{name} point mass" in chosen:
            out[_USED + i] = BELT_GM[name]
    if "non-gravitational" in chosen and nongrav is not None and nongrav.active:
        out[4] = 1.0
        out[_LAW:_LOG] = nongrav.row
    return out


@kernel
def bodies(model: Array, t: float, out: Array, rates: Array) -> None:
    """Write positions (m) at ``t`` into ``out[N_ALL, 3]``, velocities (m/s) of the sources of 1PN into ``rates``.

    Massive asteroids that are not in use, and velocities on which no force depends, are left out.
    """
    head = model[_HEAD:_GM].reshape((N_ALL, 5))
    data = model[_DATA:]
    state = np.empty(6)
    for i in range(N_BODIES):
        if (model[2] != 0.0 and IS_SOURCE[i]) or (model[4] != 0.0 and i == SUN):
            series_state(head, data, i, t, state)
            for j in range(3):
                out[i, j] = state[j]
                rates[i, j] = state[3 + j]
        else:
            series_position(head, data, i, t, out[i])
    # The Earth's velocity stays that of its barycentre with the Moon, 12 m/s off: the terms with it are small.
    for j in range(3):
        far = out[MOON, j]
        out[MOON, j] = out[EARTH, j] + far
        out[EARTH, j] -= model[1] * far
    for i in range(N_BODIES, N_ALL):
        if model[_USED + i] != 0.0:
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
    radial, along = zonal_factors(c2, c3, c4, d, (r[0] * px + r[1] * py + r[2] * pz) / d)
    out[0] += radial * r[0] + along * px
    out[1] += radial * r[1] + along * py
    out[2] += radial * r[2] + along * pz


@pasted_kernel
def zonal_factors(c2: float, c3: float, c4: float, d: float, s: float) -> tuple[float, float]:
    """Factors (1/s2) of the position (m) and (m/s2) of the pole in the acceleration by J2, J3, J4.

    ``d`` is the distance (m), ``s`` the sine of the latitude.
    """
    s2 = s * s
    i2 = 1.0 / (d * d)
    p2 = 3.0 * s
    p3 = 7.5 * s2 - 1.5
    p4 = s * (17.5 * s2 - 7.5)
    p5 = (39.375 * s2 - 26.25) * s2 + 1.875
    radial = (c2 * p3 + (c3 * p4 + c4 * p5 / d) / d) * i2 * i2 / d
    along = -(c2 * p2 + (c3 * p3 + c4 * p4 / d) / d) * i2 * i2
    return radial, along


@kernel
def push(law: Array, r: Array, v: Array, out: Array) -> None:
    """Add the non-gravitational acceleration (m/s2) at heliocentric ``r`` (m), ``v`` (m/s) to ``out[3]``.

    ``law`` is :attr:`NonGravitational.row`. The distance a time DT earlier is that of two-body motion.
    """
    d = np.sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2])
    sunlight = law[9] * (AU / d) ** 2 / d
    for j in range(3):
        out[j] += sunlight * r[j]
    if law[0] == 0.0 and law[1] == 0.0 and law[2] == 0.0:
        return
    x = d / law[4]
    if law[8] != 0.0:
        now = np.empty(6)
        for j in range(3):
            now[j] = r[j]
            now[3 + j] = v[j]
        before = two_body(_GM_SUN, now, -law[8])
        x = np.sqrt(before[0] ** 2 + before[1] ** 2 + before[2] ** 2) / law[4]
    if law[7] == 0.0 and law[5] == 2.0:
        g = law[3] / (x * x)
    else:
        g = law[3] * x ** (-law[5]) * (1.0 + x ** law[6]) ** (-law[7])
    h0 = r[1] * v[2] - r[2] * v[1]
    h1 = r[2] * v[0] - r[0] * v[2]
    h2 = r[0] * v[1] - r[1] * v[0]
    h = np.sqrt(h0 * h0 + h1 * h1 + h2 * h2)
    if h == 0.0:
        return
    n0, n1, n2 = h0 / h, h1 / h, h2 / h
    e0, e1, e2 = r[0] / d, r[1] / d, r[2] / d
    out[0] += g * (law[0] * e0 + law[1] * (n1 * e2 - n2 * e1) + law[2] * n0)
    out[1] += g * (law[0] * e1 + law[1] * (n2 * e0 - n0 * e2) + law[2] * n1)
    out[2] += g * (law[0] * e2 + law[1] * (n0 * e1 - n1 * e0) + law[2] * n2)


@kernel
def core(s: float) -> float:
    """``s^(-3/2)`` continued into ``s < 1`` by its first nine Taylor terms at 1: finite and smooth.

    A jump in any low derivative would stop a high-order integrator with adaptive steps.
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


@kernel
def acceleration_among(
    model: Array, t: float, places: Array, rates: Array, x: Array, v: Array, out: Array
) -> None:
    """Write into ``out[3]`` the acceleration (m/s2) at ``t`` (s), ``x`` (m), ``v`` (m/s); bodies at ``places`` (m)."""
    ax = ay = az = potential = 0.0
    g = np.zeros(3)
    for i in range(N_ALL):
        gm = model[_USED + i]
        if gm == 0.0:
            continue
        dx = places[i, 0] - x[0]
        dy = places[i, 1] - x[1]
        dz = places[i, 2] - x[2]
        r2 = dx * dx + dy * dy + dz * dz
        inner = model[_INNER + i] if i < N_BODIES else 0.0
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
    if model[3] != 0.0:
        d = np.empty(3)
        for i in range(N_BODIES):
            p = _FLAT + FLAT_WIDTH * i
            if model[p] != 0.0 or model[p + 7] != 0.0 or model[p + 8] != 0.0:
                r2 = 0.0
                for j in range(3):
                    d[j] = x[j] - places[i, j]
                    r2 += d[j] * d[j]
                w = fade(r2 / model[_INNER + i] ** 2)
                c2, c3, c4 = w * model[p], w * model[p + 7], w * model[p + 8]
                zonal(c2, c3, c4, model[p + 1 : p + 7], t, d, out)
    if model[2] != 0.0:
        gms, used, inners = model[_GM : _GM + N_BODIES], model[_USED : _USED + N_BODIES], model[_INNER:_FLAT]
        one_pn(gms, used, inners, places, rates, g, potential, x, v, out)
    if model[4] != 0.0:
        r = np.empty(3)
        u = np.empty(3)
        for j in range(3):
            r[j] = x[j] - places[SUN, j]
            u[j] = v[j] - rates[SUN, j]
        push(model[_LAW:_LOG], r, u, out)


@kernel
def acceleration(model: Array, t: float, x: Array, v: Array, out: Array) -> None:
    """Write into ``out[3]`` the acceleration (m/s2) at ``t`` (s), ``x`` (m), ``v`` (m/s)."""
    places = np.empty((N_ALL, 3))
    rates = np.zeros((N_BODIES, 3))
    bodies(model, t, places, rates)
    acceleration_among(model, t, places, rates, x, v, out)


def shares(window: Window, t: Array, states: Array, nongrav: NonGravitational | None) -> dict[str, float]:
    """Order of magnitude of the displacement, m, that each force causes by the end of a track.

    ``3 int |a_i(t)| (t_end - t) dt`` along the track: a velocity change at t displaces a free particle by its product
    with ``t_end - t``, and a tangential one on an orbit by three times that. Close passages amplify it further.

    Parameters
    ----------
    window : Window
    t : ndarray, shape (n,)
        Times, s, increasing or decreasing; the displacement is that at the last.
    states : ndarray, shape (n, 6)
        Barycentric track, m and m/s.
    nongrav : NonGravitational or None
    """
    full = model(window, FORCES, nongrav)
    sizes = np.empty((t.size, len(FORCES)))
    _sizes(full, np.ascontiguousarray(t), np.ascontiguousarray(states), sizes)
    weight = 3.0 * np.abs(t[-1] - t)
    values = sizes * weight[:, None]
    integral = np.abs(0.5 * np.diff(t) @ (values[1:] + values[:-1]))
    return {name: float(value) for name, value in zip(FORCES, integral, strict=True)}


@kernel
def _sizes(model: Array, t: Array, states: Array, out: Array) -> None:
    """Write the size (m/s2) of each force of ``FORCES`` at each point of a track into ``out[n, forces]``."""
    places = np.empty((N_ALL, 3))
    rates = np.zeros((N_BODIES, 3))
    a = np.empty(3)
    g = np.empty(3)
    d = np.empty(3)
    for n in range(t.size):
        bodies(model, t[n], places, rates)
        for i in range(N_ALL):
            r2 = 0.0
            for j in range(3):
                d[j] = states[n, j] - places[i, j]
                r2 += d[j] * d[j]
            out[n, i] = model[_GM + i] / r2
            if i >= N_BODIES:
                continue
            p = _FLAT + FLAT_WIDTH * i
            c2, c3, c4, pole = model[p], model[p + 7], model[p + 8], model[p + 1 : p + 7]
            a[:] = 0.0
            zonal(c2, 0.0, 0.0, pole, t[n], d, a)
            out[n, _J2 + i] = np.sqrt(a[0] ** 2 + a[1] ** 2 + a[2] ** 2)
            if i == EARTH:
                a[:] = 0.0
                zonal(0.0, c3, 0.0, pole, t[n], d, a)
                out[n, _J3] = np.sqrt(a[0] ** 2 + a[1] ** 2 + a[2] ** 2)
                a[:] = 0.0
                zonal(0.0, 0.0, c4, pole, t[n], d, a)
                out[n, _J4] = np.sqrt(a[0] ** 2 + a[1] ** 2 + a[2] ** 2)
        r = states[n, :3] - places[SUN]
        w = states[n, 3:] - rates[SUN]
        a[:] = 0.0
        potential = 0.0
        for i in range(N_BODIES):
            potential += model[_GM + i] / np.sqrt(np.sum((states[n, :3] - places[i]) ** 2))
        for j in range(3):
            g[j] = -model[_GM + SUN] * r[j] / np.sum(r * r) ** 1.5
        gms = model[_GM : _GM + N_BODIES]
        one_pn(
            gms,
            gms,
            model[_INNER:_FLAT],
            places,
            rates,
            g,
            potential,
            states[n, :3],
            states[n, 3:],
            a,
        )
        out[n, _PN] = np.sqrt(a[0] ** 2 + a[1] ** 2 + a[2] ** 2)
        a[:] = 0.0
        if model[4] != 0.0:
            push(model[_LAW:_LOG], r, w, a)
        out[n, _NON] = np.sqrt(a[0] ** 2 + a[1] ** 2 + a[2] ** 2)


def au_per_day2(value: float) -> float:
    """Acceleration in m/s2 from one in au/d2."""
    return value * AU / DAY**2
