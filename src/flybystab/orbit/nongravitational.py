"""Non-gravitational acceleration of an asteroid or comet, and its derivatives.

Marsden, Sekanina & Yeomans (1973): ``g(r') (A1 er + A2 et + A3 en)`` with ``g(r) = alpha (r/r0)^-m [1 + (r/r0)^n]^-k``;
r' is the heliocentric distance a time DT earlier (Yeomans & Chodas 1989). Radiation pressure:
``(S/c) (A/m) (1 au/r)^2 er`` with the solar constant S (IAU 2015 Resolution B3), for an absorbing body.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from flybystab.constants import AU, C_LIGHT, DAY
from flybystab.core.numerics.jit import inlined, kernel
from flybystab.errors import InvalidInput, UnknownName
from flybystab.orbit.kepler import two_body
from flybystab.orbit.planets import PLANETS
from flybystab.typing import Array

_GM_SUN = PLANETS["sun"].gm
#: Laws ``g(r)`` by name: ALN, r0 (m), m, n, k. That of comets is the sublimation of water ice.
LAWS: Mapping[str, tuple[float, float, float, float, float]] = MappingProxyType(
    {
        "asteroid": (1.0, AU, 2.0, 5.093, 0.0),
        "comet": (0.1112620426, 2.808 * AU, 2.15, 5.093, 4.6142),
    }
)
#: Pressure of sunlight on an absorbing surface at 1 au, Pa.
RADIATION_PRESSURE = 1361.0 / C_LIGHT
#: Rows of the derivatives by the parameters A1, A2, A3, DT and AMRAT.
BY_A1, BY_DT, BY_AMRAT = 0, 3, 4
N_PARAMETERS = 5
#: Steps of central differences: over the heliocentric distance and over the speed; of DT, s.
_RELATIVE_STEP, _DELAY_STEP = 1e-4, 0.01 * DAY


class NonGravitationalParameters(NamedTuple):
    """Parameters of the acceleration as the kernels read them, SI.

    Attributes
    ----------
    a1, a2, a3 : float
        Radial, transverse and normal acceleration at ``g = 1``, m/s2.
    alpha, r0, m, n, k : float
        Constants of ``g(r)``; r0 in m.
    delay : float
        DT, s.
    pressure : float
        Radiation pressure at 1 au times area over mass, m/s2.
    """

    a1: float
    a2: float
    a3: float
    alpha: float
    r0: float
    m: float
    n: float
    k: float
    delay: float
    pressure: float


N_LAW = len(NonGravitationalParameters._fields)
#: No acceleration.
NONE = NonGravitationalParameters(*[0.0] * N_LAW)


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
        """True if there is any acceleration."""
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
    def parameters(self) -> NonGravitationalParameters:
        """The parameters in SI, for the kernels."""
        pressure = RADIATION_PRESSURE * self.area_to_mass
        return NonGravitationalParameters(*map(float, (*self.a, *self.constants, self.delay, pressure)))


@inlined
def parameters_of(row: Array) -> NonGravitationalParameters:
    """The parameters from an array ``row[N_LAW]`` in the order of the fields."""
    return NonGravitationalParameters(
        row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7], row[8], row[9]
    )


@inlined
def has_forces(law: NonGravitationalParameters) -> bool:
    """True if A1, A2 or A3 differs from zero."""
    return law.a1 != 0.0 or law.a2 != 0.0 or law.a3 != 0.0


@inlined
def acts(law: NonGravitationalParameters) -> bool:
    """True if there is any acceleration."""
    return has_forces(law) or law.pressure != 0.0


@kernel
def add_nongravitational(law: NonGravitationalParameters, r: Array, v: Array, out: Array) -> None:
    """Add the acceleration (m/s2) at heliocentric ``r`` (m), ``v`` (m/s) to ``out[3]``.

    The distance a time DT earlier is that of two-body motion.
    """
    d = np.sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2])
    sunlight = law.pressure * (AU / d) ** 2 / d
    for j in range(3):
        out[j] += sunlight * r[j]
    if not has_forces(law):
        return
    x = d / law.r0
    if law.delay != 0.0:
        now = np.empty(6)
        for j in range(3):
            now[j] = r[j]
            now[3 + j] = v[j]
        before = two_body(_GM_SUN, now, -law.delay)
        x = np.sqrt(before[0] ** 2 + before[1] ** 2 + before[2] ** 2) / law.r0
    if law.k == 0.0 and law.m == 2.0:
        g = law.alpha / (x * x)
    else:
        g = law.alpha * x ** (-law.m) * (1.0 + x**law.n) ** (-law.k)
    h0 = r[1] * v[2] - r[2] * v[1]
    h1 = r[2] * v[0] - r[0] * v[2]
    h2 = r[0] * v[1] - r[1] * v[0]
    h = np.sqrt(h0 * h0 + h1 * h1 + h2 * h2)
    if h == 0.0:
        return
    n0, n1, n2 = h0 / h, h1 / h, h2 / h
    e0, e1, e2 = r[0] / d, r[1] / d, r[2] / d
    out[0] += g * (law.a1 * e0 + law.a2 * (n1 * e2 - n2 * e1) + law.a3 * n0)
    out[1] += g * (law.a1 * e1 + law.a2 * (n2 * e0 - n0 * e2) + law.a3 * n1)
    out[2] += g * (law.a1 * e2 + law.a2 * (n0 * e1 - n1 * e0) + law.a3 * n2)


@kernel
def add_nongravitational_gradient(law: NonGravitationalParameters, r: Array, v: Array, a: Array) -> None:
    """Add the gradient of the acceleration by position (1/s2) and velocity (1/s) to ``a[3, 6]``.

    Central differences.
    """
    x, w = r.copy(), v.copy()
    ends = np.empty((2, 3))
    sizes = np.empty(2)
    sizes[0] = _RELATIVE_STEP * np.sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2])
    sizes[1] = _RELATIVE_STEP * np.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    for m in range(6):
        h = sizes[m // 3]
        moved, at = (x, r) if m < 3 else (w, v)
        for side in range(2):
            moved[m % 3] = at[m % 3] + (h if side == 0 else -h)
            ends[side] = 0.0
            add_nongravitational(law, x, w, ends[side])
        moved[m % 3] = at[m % 3]
        for j in range(3):
            a[j, m] += 0.5 * (ends[0, j] - ends[1, j]) / h


@kernel
def _changed(
    law: NonGravitationalParameters, a1: float, a2: float, a3: float, delay: float, pressure: float
) -> NonGravitationalParameters:
    """The same ``g(r)`` with other values of the free parameters."""
    return NonGravitationalParameters(a1, a2, a3, law.alpha, law.r0, law.m, law.n, law.k, delay, pressure)


def deviated(law: NonGravitationalParameters, change: Array) -> NonGravitationalParameters:
    """The law with A1, A2, A3, DT and AMRAT changed by ``change[N_PARAMETERS]``, SI."""
    return _changed(
        law,
        law.a1 + change[BY_A1],
        law.a2 + change[BY_A1 + 1],
        law.a3 + change[BY_A1 + 2],
        law.delay + change[BY_DT],
        law.pressure + RADIATION_PRESSURE * change[BY_AMRAT],
    )


@kernel
def nongravitational_by_parameters(
    law: NonGravitationalParameters, r: Array, v: Array, by_delay: bool, out: Array
) -> None:
    """Write the derivatives of the acceleration by A1, A2, A3, DT and AMRAT (SI) into ``out[N_PARAMETERS, 3]``.

    ``r`` (m) and ``v`` (m/s) are heliocentric. The derivative by DT is a central difference, and zero unless `by_delay`
    is set; the acceleration is linear in the other parameters.
    """
    out[:] = 0.0
    for j in range(3):
        one, two, three = (1.0 if j == 0 else 0.0), (1.0 if j == 1 else 0.0), (1.0 if j == 2 else 0.0)
        unit = _changed(law, one, two, three, law.delay, 0.0)
        add_nongravitational(unit, r, v, out[BY_A1 + j])
    add_nongravitational(_changed(law, 0.0, 0.0, 0.0, law.delay, RADIATION_PRESSURE), r, v, out[BY_AMRAT])
    if by_delay and has_forces(law):
        earlier = np.zeros(3)
        add_nongravitational(
            _changed(law, law.a1, law.a2, law.a3, law.delay + _DELAY_STEP, 0.0), r, v, out[BY_DT]
        )
        add_nongravitational(
            _changed(law, law.a1, law.a2, law.a3, law.delay - _DELAY_STEP, 0.0), r, v, earlier
        )
        for j in range(3):
            out[BY_DT, j] = 0.5 * (out[BY_DT, j] - earlier[j]) / _DELAY_STEP
