"""Structural stability of a rubble pile: the energy criterion of theory.md, section 5.

Three levels, weakest first: admissible (the stress is inside the yield surface); stable to infinitesimal perturbations;
stable to finite ones. A perturbation is a rate of strain that is held for some time, in the frame in which the body has
no relative angular momentum, at fixed angular momentum. Its kinetic energy is ``K(0) + t P1 + t^2/2 P2 + t^3/6 P3 +
...``: friction dissipates ``-P1``, and the deformation grows once the energy from gravity and spin (``P2``) exceeds it.
The pressure in flow is that required by the flow rule, not that of the equilibrium. The critical energy and strain are
the least over all directions of strain, at second order, third order and from the barrier along paths of constant
direction, up to the axis ratio of 6:1 at which the homogeneous model ends. The second order is a certified minimum for
associative flow on a circular cone and the result of a search otherwise.

Limits of the criterion: holding the direction of strain is a constraint, so that the barrier over such
paths is an upper bound of the least barrier over all of them: a body need not recover from less. For flow that is
not associative no potential exists and the number is an estimate. The differences between the three orders show
its quality; :func:`flybystab.recovery` integrates the full dynamics of perturbed bodies and is the reference: over
16 directions it gives 0.92 to 1.44 of the barrier, with and without cohesion (``python benchmarks/stability.py push``).

With a dilatancy below that of associative flow, a body near yield can have critical energies of zero although it is
admissible: once it flows, its pressure is the reaction to the flow rule, which can be less than that of the
equilibrium, so that friction no longer stops it. An example is 1 : 1 : 0.6 with ``omega^2/(pi G rho)`` = 0.8 and 28.2
deg, of which it requires 27.9: any perturbation grows at first. It does not necessarily leave the model, which takes
0.12 of the binding energy (Mohr-Coulomb, dilatancy 0).

Without a plastic bulk modulus the pressure is that reaction. With one, ``kappa``, it starts at the pressure of
equilibrium and falls as the material dilates, ``pdot = -kappa tr D``. Under associative flow neither has an effect:
the work of the stress does not depend on the pressure.
These results are derived from the governing equations of Sharma (2013, sections 1-3); the later sections of
that paper were not available, and its figures are not claimed to be reproduced.
"""

from __future__ import annotations

from dataclasses import dataclass

import astropy.units as u
import numpy as np
from astropy.units import Quantity

from flybystab.arguments import check_arguments
from flybystab.body.body import DEFAULT_SURFACE, Body, check_body
from flybystab.body.equilibrium import Equilibrium, equilibrium, spin_limits
from flybystab.body.perturbation import (
    BodyUnits,
    Orders,
    Push,
    body_units,
    flow_cohesion,
    push,
    strain_rate,
    unit_deviator,
)
from flybystab.body.spin_state import SpinState, spin_state
from flybystab.constants import G
from flybystab.core.ellipsoid.potential import carlson_fd
from flybystab.core.energy import stability_row as columns
from flybystab.core.energy.perturbation import Ellipsoid, ellipsoid, loss_rate
from flybystab.core.energy.potential import MASS
from flybystab.core.energy.stability_row import classify
from flybystab.tabular import Record
from flybystab.typing import Array
from flybystab.units import to_si

__all__ = [
    "LEVELS",
    "BodyUnits",
    "Orders",
    "Push",
    "Stability",
    "body_units",
    "flow_cohesion",
    "push",
    "stability",
    "unit_deviator",
]

LEVELS = (
    "inadmissible",
    "admissible",
    "stable to infinitesimal perturbations",
    "stable to finite perturbations at second order",
)


@dataclass(frozen=True)
class Stability(Record):
    """Result of the energy criterion.

    Attributes
    ----------
    body : Body
        The body.
    equilibrium : Equilibrium
        Its stress and required friction.
    dilatancy : float
        ``beta/min k`` of the test; 1 is associative flow.
    level : int
        0 inadmissible, 1 admissible, 2 stable to infinitesimal perturbations, 3 to finite ones of any direction
        at second order; :data:`LEVELS` names them.
    admissible, stable_infinitesimal : bool
        The first two levels. Strictly inside the yield surface friction stops any small enough perturbation. On it
        ``P2 < 0`` along the direction that flows first decides for associative flow; otherwise whether the overload
        of the body at rest falls along its flow, whose direction turns with the stress.
    critical_energy : Orders of Quantity
        Least kinetic energy of deformation, J, that a perturbation of fixed direction needs to overcome friction; inf
        where none does at that order. The barrier is the least energy that leads to the strain at which slow flow
        continues by itself, or out of the model (`barrier_kind`). Below associative flow there may be directions in
        which friction does not stop a perturbation that keeps its direction, although the body is stable and the
        dynamics turn the direction and stop it: the series to second and third order are then nan, the barrier is not.
    critical_strain : Orders of float
        Least strain ``e t`` (measured with ``|D'| = 1``) at which a perturbation begins to grow, at second and third
        order; for the barrier, the strain at which the least barrier is passed. In a direction at the apex
        of the yield surface ``tr D = k`` instead measures it.
    directions : Orders of ndarray, shape (3, 3)
        Rate of strain in body axes that has the least critical energy.
    direction : ndarray, shape (3, 3)
        That of the second order.
    at_apex : Orders of bool
        Whether that direction dilates faster than the flow rule of the cone (apex of the yield surface).
    barrier_kind : str
        "maximum": beyond the barrier the deformation gains energy; "edge": there the axis ratio passes 6:1, while
        friction still prevails; "none": no path reaches either; "inadmissible": the body is not in equilibrium.
    spread : float
        Largest over least critical energy of the three orders, less one: the error of the approximation.
    binding_energy : Quantity
        ``(3/5) G m^2 R_F``, J, for scale.
    curvature_at_yield : float
        ``Phi''/(p V)`` along the direction that flows first if only the required friction were available;
        negative: stability requires more friction than equilibrium. nan without a deviator.
    stable_at_yield : bool
        True if `curvature_at_yield` is positive.
    kappa_crit : Quantity or None
        Plastic bulk modulus above which a body at yield is unstable, Pa; None for associative or
        volume-preserving flow, where ``kappa`` has no effect.
    spin_limits : Quantity, shape (2,)
        Slowest and fastest spin about ``a3``, rad/s, that the shape and material bear.
    critical_momentum : Quantity, shape (2,)
        Angular momentum about ``a3``, kg m2/s, to be removed or added until one of them is reached; nan for
        bodies that do not spin about ``a3``. For perturbations that add angular momentum this is the limit, not the
        critical energy.
    steady : bool
        Whether the spin is about a principal axis; for a tumbling body the criterion holds at the present instant.
    spin_state : SpinState
        State of rotation. Spin about the middle axis is an unstable motion, with the growth rate given there,
        regardless of the level: the criterion holds the angular velocity constant for the short time of a deformation.
    """

    body: Body
    equilibrium: Equilibrium
    dilatancy: float
    level: int
    admissible: bool
    stable_infinitesimal: bool
    critical_energy: Orders[Quantity]
    critical_strain: Orders[float]
    directions: Orders[Array]
    at_apex: Orders[bool]
    barrier_kind: str
    spread: float
    binding_energy: Quantity
    curvature_at_yield: float
    stable_at_yield: bool
    kappa_crit: Quantity | None
    spin_limits: Quantity
    critical_momentum: Quantity
    steady: bool
    spin_state: SpinState

    @property
    def direction(self) -> Array:
        """Rate of strain in body axes with the least critical energy at second order."""
        return np.asarray(self.directions.second)

    @property
    def barrier_by_surface(self) -> dict[str, Quantity]:
        """Energy barrier, J, on the default yield surface and on the compression cone, by name."""
        found = {}
        for name in dict.fromkeys((DEFAULT_SURFACE, "drucker-prager")):
            material = self.body.material
            own = name == material.yield_surface
            other = self.body.with_(material=material.with_(yield_surface=name))
            found[name] = (
                self if own else stability(other, dilatancy=self.dilatancy)
            ).critical_energy.barrier
        return found

    @check_arguments
    def other_surfaces(self, resolution: float = 0.01) -> str:
        """Barrier, as text, on the default surface and the compression cone where it differs from the body's.

        Empty if no relative difference exceeds `resolution`.
        """
        own = self.critical_energy.barrier.value
        parts = []
        for name, energy in self.barrier_by_surface.items():
            differs = not np.isclose(energy.value, own, rtol=resolution, atol=0.0)
            if name != self.body.material.yield_surface and differs:
                parts.append(f"{name} {energy.value:.3g} J")
        return ", ".join(parts)

    @property
    def verdict(self) -> str:
        """Description of the level."""
        return LEVELS[self.level]

    def __repr__(self) -> str:
        shares = [float(e / self.binding_energy) for e in self.critical_energy]
        energies = ["undefined" if np.isnan(x) else f"{x:.3g}" for x in shares]
        rotation = (
            "" if self.spin_state.steady and not self.spin_state.unstable else self.spin_state.description
        )
        return (
            f"<Stability {self.verdict}; critical energy over binding energy {', '.join(energies)} "
            f"(second order, third order, barrier){'; ' + rotation if rotation else ''}>"
        )


def stability(body: Body, *, dilatancy: float | None = 1.0) -> Stability:
    """Three levels of stability of a body, with the least critical energy and strain.

    Parameters
    ----------
    body : Body
        With its spin and material.
    dilatancy : float or None
        ``beta/min k``: 1 (default) is associative flow, the classical energy criterion; 0 preserves volume;
        None takes that of the material.

    Notes
    -----
    A tension cut-off of the material counts for admissibility and spin limits. The energies are those without it, an
    upper bound.

    Returns
    -------
    Stability
    """
    check_body(body)
    m = body.material
    beta = m.dilatancy if dilatancy is None else dilatancy
    beta = to_si(beta, u.dimensionless_unscaled, "dilatancy", low=0.0, high=1.0)
    units = body_units(body)
    row = np.empty(columns.COLUMNS)
    found = np.empty((columns.DIRECTIONS, 5))
    kappa = 0.0 if m.bulk_modulus is None else m.bulk_modulus.to_value(u.Pa)
    s1, s2, s3 = body.axes**2
    spin, code, cohesion = body.omega * units.time, m.surface_code, m.c_pa / units.stress
    flowing, modulus = flow_cohesion(body) / units.stress, kappa / units.stress
    e = equilibrium(body)
    classify(s1, s2, s3, spin, code, m.phi, cohesion, flowing, beta, modulus, 5, row, found)
    if not e.admissible and row[columns.LEVEL] > 0 and m.cut_off:
        row[columns.LEVEL] = 0
        row[columns.ENERGY_2 : columns.STRAIN_B + 1] = 0.0
    scene = ellipsoid(s1, s2, s3, spin, code, m.phi, flowing, beta, modulus)
    energies = Orders(
        *(row[i] * units.energy * u.J for i in (columns.ENERGY_2, columns.ENERGY_3, columns.ENERGY_B))
    )
    strains = Orders(*(float(row[i]) for i in (columns.STRAIN_2, columns.STRAIN_3, columns.STRAIN_B)))
    values = np.array([q.value for q in energies])
    finite = np.all(np.isfinite(values)) and values.min() > 0.0
    rotation = spin_state(body)
    limits = spin_limits(body)
    rate = abs(body.omega[2])
    about_a3 = body.omega[0] == 0.0 and body.omega[1] == 0.0
    j3 = body.inertia[2].to_value(u.kg * u.m**2)
    margin = (
        np.array([rate - limits[0].value, limits[1].value - rate]) * j3 if about_a3 else np.full(2, np.nan)
    )
    curvature = float(row[columns.CURVATURE])
    binding = 0.6 * G * body.mass.value**2 * _inverse_radius(body)
    directions = [strain_rate(scene, found[i]) for i in (0, 2, 4)]
    return Stability(
        body=body,
        equilibrium=e,
        dilatancy=beta,
        level=int(row[columns.LEVEL]),
        admissible=bool(row[columns.LEVEL] >= 1),
        stable_infinitesimal=bool(row[columns.LEVEL] >= 2),
        critical_energy=energies,
        critical_strain=strains,
        directions=Orders(*(d for d, _ in directions)),
        at_apex=Orders(*(a for _, a in directions)),
        barrier_kind=_kind(scene, found[4], row),
        spread=float(values.max() / values.min() - 1.0) if finite else np.inf,
        binding_energy=binding * u.J,
        curvature_at_yield=curvature,
        stable_at_yield=bool(curvature > 0.0),
        kappa_crit=None if np.isnan(row[columns.KAPPA]) else row[columns.KAPPA] * units.stress * u.Pa,
        spin_limits=limits,
        critical_momentum=margin * u.kg * u.m**2 / u.s,
        steady=rotation.steady,
        spin_state=rotation,
    )


def _kind(scene: Ellipsoid, x: Array, row: Array) -> str:
    """End of the path of the least barrier."""
    if row[columns.LEVEL] < 1:
        return "inadmissible"
    energy, strain = row[columns.ENERGY_B], row[columns.STRAIN_B]
    if not np.isfinite(energy):
        return "none"
    return "edge" if strain > 0.0 and loss_rate(scene, x, strain) > 1e-6 * MASS else "maximum"


def _inverse_radius(body: Body) -> float:
    """``R_F(a1^2, a2^2, a3^2)``, 1/m."""
    return float(carlson_fd(*(body.axes**2))[0])
