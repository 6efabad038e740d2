"""Equilibrium of a rubble pile: the stress required by its shape and spin, and the strength required to bear it.

A rigidly rotating homogeneous ellipsoid requires the volume-averaged stress of theory.md, section 4; for
steady spin about ``a3``, ``sigma_i = (rho a_i^2/5)(omega_i^2 - 2 pi G rho A_i)`` with
``omega_1 = omega_2 = omega`` and ``omega_3 = 0``. The body can exist if that stress is inside the yield
surface of its material. A static tide ``K`` adds ``(rho/5) K_ij 2 S_i S_j/(S_i + S_j)`` (the static limit of
Holsapple & Michel 2006, 2008). The test uses the volume average: it is necessary, but not sufficient,
for equilibrium everywhere inside the body.
"""

from __future__ import annotations

from dataclasses import dataclass

import astropy.units as u
import numpy as np
from astropy.units import Quantity
from numpy.typing import ArrayLike

from flybystab.arguments import check_arguments
from flybystab.body.body import (
    DEFAULT_SURFACE,
    YIELD_SURFACES,
    Body,
    Material,
    check_body,
    refuse_cut_off,
)
from flybystab.constants import G
from flybystab.core.ellipsoid.rigid_stress import demand, invariants, load_interval, overload, rigid_stress
from flybystab.core.ellipsoid.tide import components, tensor
from flybystab.errors import InvalidInput
from flybystab.tabular import Record
from flybystab.typing import Array
from flybystab.units import brief, to_si


@dataclass(frozen=True)
class Equilibrium(Record):
    """The stress of a rigidly rotating body and the strength that it requires.

    Attributes
    ----------
    body : Body
        The body.
    stress : Quantity, shape (3, 3)
        Volume-averaged stress along the body axes, Pa, positive in tension.
    mean_pressure : Quantity
        ``-tr(stress)/3``, Pa; negative in mean tension.
    required_friction_angle : Quantity
        Mobilised friction angle, deg: the least angle that bears the stress with the body's own cohesion.
        Infinite where no angle below 90 deg does (a cohesionless body in mean tension, for example), and where the
        stress exceeds the tension cut-off.
    required_cohesion : Quantity
        Least cohesion at the body's friction angle, Pa; zero where friction alone suffices. With a tensile strength
        given as a fraction of the cohesion, it also bears the tension; infinite where a fixed one is exceeded.
    largest_tension : Quantity
        Largest principal stress, Pa: the least tensile strength; negative in compression.
    lode_angle : Quantity
        Of the deviator, deg: -30 triaxial extension, +30 triaxial compression; nan without a deviator.
    admissible : bool
        Whether the stress is inside (or on) the yield surface of the body's material.
    margin : Quantity
        Friction angle less the required one, deg; minus infinity where none suffices.
    in_tension : bool
        Whether the mean pressure is negative, so that only cohesion can hold the body.
    """

    body: Body
    stress: Quantity
    mean_pressure: Quantity
    required_friction_angle: Quantity
    required_cohesion: Quantity
    largest_tension: Quantity
    lode_angle: Quantity
    admissible: bool
    margin: Quantity
    in_tension: bool

    @property
    def required_by_surface(self) -> dict[str, Quantity]:
        """Required friction angle, deg, on the default yield surface and on the compression cone, by name."""
        c = components(self.stress.to_value(u.Pa))
        m = self.body.material
        names = dict.fromkeys((DEFAULT_SURFACE, "drucker-prager"))
        return {
            name: np.rad2deg(demand(YIELD_SURFACES.index(name), m.phi, m.c_pa, c)[0]) * u.deg
            for name in names
        }

    @check_arguments
    def other_surfaces(self, resolution: Quantity = 0.05 * u.deg) -> str:
        """Required friction, as text, on the default surface and the compression cone where it differs from the body's.

        Empty if no difference exceeds `resolution`.
        """
        resolution = to_si(resolution, u.deg, "resolution", low=0.0) * u.deg
        own = self.required_friction_angle
        parts = []
        for name, angle in self.required_by_surface.items():
            differs = angle != own if np.isinf(angle) or np.isinf(own) else abs(angle - own) > resolution
            if name != self.body.material.yield_surface and differs:
                need = brief(angle) if np.isfinite(angle) else "no friction suffices"
                parts.append(f"{name} {need}")
        return ", ".join(parts)

    def __repr__(self) -> str:
        phi = self.required_friction_angle
        need = f"needs {brief(phi)}" if np.isfinite(phi) else "no friction suffices"
        state = "tension" if self.in_tension else "compression"
        others = f" ({other})" if (other := self.other_surfaces()) else ""
        return (
            f"<Equilibrium {'' if self.admissible else 'not '}admissible: {need}{others}, required cohesion "
            f"{brief(self.required_cohesion)}, mean {state} {brief(abs(self.mean_pressure))}>"
        )


def point_tide(
    mass_parameter: Quantity, distance: Quantity, direction: ArrayLike | Quantity = (1.0, 0.0, 0.0)
) -> Quantity:
    """Tidal tensor ``(GM/d^3)(3 n n - 1)`` of a point mass, shape (3, 3), s^-2, in body axes.

    Parameters
    ----------
    mass_parameter : Quantity
        ``G M``, m3/s2.
    distance : Quantity
        From the centre of the body.
    direction : array_like, shape (3,)
        Of the point mass, along the body axes ``a1, a2, a3``; normalised here.
    """
    gm = to_si(mass_parameter, u.m**3 / u.s**2, "mass_parameter", low=0.0)
    d = to_si(distance, u.m, "distance", low=0.0, open_low=True)
    n = to_si(direction, u.dimensionless_unscaled, "direction", shape=(3,))
    length = np.linalg.norm(n)
    if length == 0.0:
        raise InvalidInput("direction", direction, "a vector other than zero")
    n = n / length
    return gm / d**3 * (3.0 * np.outer(n, n) - np.eye(3)) / u.s**2


def synchronous(body: Body, mass_parameter: Quantity, distance: Quantity) -> Body:
    """The body with the spin of a circular orbit, ``omega^2 = GM/d^3`` about ``a3`` (of negligible mass)."""
    gm = to_si(mass_parameter, u.m**3 / u.s**2, "mass_parameter", low=0.0)
    d = to_si(distance, u.m, "distance", low=0.0, open_low=True)
    return body.with_(spin=np.array([0.0, 0.0, np.sqrt(gm / d**3)]) * u.rad / u.s)


def stress_components(body: Body, tide: Quantity | None = None) -> Array:
    """Six components (``xx, yy, zz, xy, xz, yz``, body axes, Pa) of the stress that rigid rotation requires."""
    out = np.empty(6)
    s = body.axes**2
    rigid_stress(s[0], s[1], s[2], body.rho, np.pi * G * body.rho, body.omega, tide_components(tide), out)
    return out


def tide_components(tide: Quantity | None) -> Array:
    """Six components of a tidal tensor given as a symmetric (3, 3) quantity in body axes; zeros for None."""
    if tide is None:
        return np.zeros(6)
    k = to_si(tide, u.s**-2, "tide", shape=(3, 3))
    if not np.allclose(k, k.T, rtol=1e-9, atol=1e-12 * np.abs(k).max()):
        raise InvalidInput("tide", tide, "a symmetric tensor")
    return components(0.5 * (k + k.T))


def equilibrium(body: Body, tide: Quantity | None = None) -> Equilibrium:
    """Stress, mobilised friction and margin of a body at its present spin.

    Parameters
    ----------
    body : Body
        Any spin vector; off the principal axes the result is the instantaneous one of a tumbling body.
    tide : Quantity, shape (3, 3), optional
        Static tidal tensor in body axes, s^-2, e.g. from :func:`point_tide`. For the Roche problem pass
        it together with the :func:`synchronous` body.

    Returns
    -------
    Equilibrium
    """
    check_body(body)
    m = body.material
    c = stress_components(body, tide)
    p, s, _ = invariants(c)
    phi_required, cohesion = demand(m.surface_code, m.phi, m.c_pa, c)
    tension = float(np.linalg.eigvalsh(tensor(c))[-1])
    holds = tension <= m.t_pa
    if not holds:
        phi_required = np.inf
    cohesion = max(cohesion, cohesion_for(m, tension))
    required = np.rad2deg(phi_required)
    return Equilibrium(
        body=body,
        stress=tensor(c) * u.Pa,
        mean_pressure=p * u.Pa,
        required_friction_angle=required * u.deg,
        required_cohesion=cohesion * u.Pa,
        largest_tension=tension * u.Pa,
        lode_angle=(np.rad2deg(_lode_angle(c)) if s > 0.0 else np.nan) * u.deg,
        admissible=bool(holds and overload(m.surface_code, m.phi, m.c_pa, c) <= 0.0),
        margin=(np.rad2deg(m.phi) - required) * u.deg,
        in_tension=bool(p < 0.0),
    )


def _lode_angle(c: Array) -> float:
    """Lode angle, rad, from the principal stresses ``sigma_1 >= sigma_2 >= sigma_3`` of ``c[6]``.

    ``tan(theta) = (2 sigma_2 - sigma_1 - sigma_3)/(sqrt3 (sigma_1 - sigma_3))`` keeps all digits at the corners, where
    the arcsine of the determinant has half of them.
    """
    low, middle, high = np.linalg.eigvalsh(tensor(c))
    return float(np.arctan2((middle - low) - (high - middle), np.sqrt(3.0) * (high - low)))


def cohesion_for(material: Material, tension: float) -> float:
    """Least cohesion, Pa, with which the tension cut-off of a material bears a largest principal stress, Pa."""
    t = material.tensile_strength
    if t is None or tension <= 0.0:
        return 0.0
    if isinstance(t, Quantity) and t.unit.physical_type != "dimensionless":
        return 0.0 if tension <= material.t_pa else np.inf
    share = float(u.Quantity(t).to_value(u.dimensionless_unscaled))
    return tension / share if share > 0.0 else np.inf


@check_arguments
def spin_limits(body: Body, friction_angle: Quantity | None = None) -> Quantity:
    """Slowest and fastest steady spin about ``a3`` that the material can bear.

    Parameters
    ----------
    body : Body
        Its own spin is not used.
    friction_angle : Quantity, shape (...), optional
        One or many angles in place of the body's own.

    Returns
    -------
    Quantity, shape (..., 2)
        Angular rates, rad/s; nan where the material bears no spin. With a lower limit above zero the shape is too
        elongated to exist without spin.
    """
    base, load = _spin_line(body)
    limits = _loads(body, friction_angle, base, load)
    if body.material.cut_off:  # both are diagonal
        with np.errstate(divide="ignore"):
            most = float(np.min((body.material.t_pa - base[:2]) / load[:2]))
        if base[2] > body.material.t_pa or not most >= 0.0:
            most = np.nan
        limits[..., 1] = np.minimum(limits[..., 1], most)
        limits[~(limits[..., 0] <= limits[..., 1])] = np.nan
    return limits**0.5 * u.rad / u.s


@check_arguments
def failure_distance(
    body: Body,
    mass_parameter: Quantity,
    friction_angle: Quantity | None = None,
    *,
    direction: ArrayLike | Quantity = (1.0, 0.0, 0.0),
    synchronous: bool = False,
) -> Quantity:
    """Distance from a point mass inside which a static tide exceeds the strength of the body.

    Parameters
    ----------
    body : Body
        With its own spin, unless `synchronous`.
    mass_parameter : Quantity
        ``G M`` of the planet.
    friction_angle : Quantity, shape (...), optional
        One or many angles in place of the body's own.
    direction : array_like, shape (3,)
        Of the planet, in body axes; the long axis by default (the weakest attitude of an elongated body).
    synchronous : bool
        Spin ``omega^2 = GM/d^3`` about ``a3`` instead of the body's own: a satellite on a circular orbit.

    Returns
    -------
    Quantity, shape (...)
        Metres; zero where the body withstands any tide, nan where it fails even far from the planet.

    Notes
    -----
    The stress is affine in ``GM/d^3``, so that the tides that the body withstands form one interval. A synchronous
    body may require a tide: the distance beyond which it fails is not returned.
    """
    refuse_cut_off(body.material, "failure_distance")
    gm = to_si(mass_parameter, u.m**3 / u.s**2, "mass_parameter", low=0.0, open_low=True)
    unit = point_tide(1.0 * u.m**3 / u.s**2, 1.0 * u.m, direction)
    load = _tide_load(body, components(unit.value))
    if synchronous:
        base = stress_components(body.with_(spin=np.zeros(3) * u.rad / u.s))
        load = load + _spin_line(body)[1]
    else:
        base = stress_components(body)
    limits = _loads(body, friction_angle, base, load)
    low, high = limits[..., 0], limits[..., 1]
    if not synchronous:
        high = np.where(low > 0.0, np.nan, high)
    return np.cbrt(gm / high) * u.m


def _spin_line(body: Body) -> tuple[Array, Array]:
    """Stress without spin, and its change per unit of ``omega^2`` about ``a3``."""
    load = np.zeros(6)
    load[:2] = body.rho / 5.0 * body.axes[:2] ** 2
    return stress_components(body.with_(spin=np.zeros(3) * u.rad / u.s)), load


def _tide_load(body: Body, k: Array) -> Array:
    """Stress that a tide of six components `k` adds, per unit of `k`."""
    s = body.axes**2
    pairs = np.array(
        [s[0], s[1], s[2], *(2 * s[i] * s[j] / (s[i] + s[j]) for i, j in ((0, 1), (0, 2), (1, 2)))]
    )
    return body.rho / 5.0 * k * pairs


def _loads(body: Body, friction_angle: Quantity | None, base: Array, load: Array) -> Array:
    m = body.material
    if friction_angle is None:
        phi = np.array(m.phi)
    else:
        phi = np.asarray(
            to_si(
                friction_angle, u.rad, "friction_angle", shape=None, low=0.0, high=np.pi / 2, open_high=True
            )
        )
    out = np.array([load_interval(base, load, m.surface_code, f, m.c_pa) for f in phi.ravel()])
    return out.reshape(*phi.shape, 2)
