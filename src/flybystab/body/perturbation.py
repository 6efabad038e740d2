"""Perturbation of a body with a fixed direction of strain: powers and loss of its kinetic energy against strain.

The perturbation is a rate of strain, in the frame in which the body has no relative angular momentum, at fixed angular
momentum (theory.md, section 5); the least critical energies over all directions are those of
:func:`flybystab.stability`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, NamedTuple, TypeVar, cast

import astropy.units as u
import numpy as np
from astropy.units import Quantity
from numpy.typing import ArrayLike

from flybystab.arguments import check_arguments
from flybystab.body.body import Body, refuse_cut_off
from flybystab.constants import G
from flybystab.core.ellipsoid.tide import tensor
from flybystab.core.energy.perturbation import (
    Ellipsoid,
    ellipsoid,
    loss_at,
    powers,
    rate_of_strain,
    slope_of_flow,
)
from flybystab.errors import InvalidInput
from flybystab.tabular import Record
from flybystab.typing import Array
from flybystab.units import to_si

T = TypeVar("T")

#: A numpy boolean, as all flags of the kernels: each kernel is compiled for one type.
WITH_INERTIA = cast(bool, np.bool_(False))


class Orders(NamedTuple, Generic[T]):
    """Values at second order, at third order and from the barrier."""

    second: T
    third: T
    barrier: T


class BodyUnits(NamedTuple):
    """Units of the energy kernels for one body: mean radius, and time, energy, stress and momentum, in SI."""

    length: float
    time: float
    energy: float
    stress: float
    momentum: float


def body_units(body: Body) -> BodyUnits:
    """Units in which the mean radius, the density and ``pi G rho`` of a body are one."""
    a = float(np.cbrt(np.prod(body.axes)))
    t = body.dynamical_time
    stress = np.pi * G * body.rho**2 * a**2
    return BodyUnits(a, t, stress * a**3, stress, body.rho * a**5 / t)


def flow_cohesion(body: Body) -> float:
    """Cohesion of a body while it flows, Pa: none where it is brittle, since a deforming body is at yield."""
    return 0.0 if body.material.brittle else body.material.c_pa


@dataclass(frozen=True, repr=False)
class Push(Record):
    """Perturbation with one direction of strain: powers, and loss of its kinetic energy against strain.

    Attributes
    ----------
    direction : ndarray, shape (3, 3)
        Rate of strain in body axes, ``|D'| = 1``.
    powers : tuple of Quantity
        ``P1, P2, P3``, J: the kinetic energy is ``K(0) + t P1 + t^2/2 P2 + t^3/6 P3`` at strain ``t``.
    strain : ndarray
        Strains.
    loss : Orders of Quantity
        Kinetic energy lost at these strains, J: to second order, to third order, and whole.
    """

    direction: Array
    powers: tuple[Quantity, Quantity, Quantity]
    strain: Array
    loss: Orders[Quantity]


@check_arguments
def push(
    body: Body, direction: ArrayLike | Quantity, strain: ArrayLike | Quantity, *, dilatancy: float = 1.0
) -> Push:
    """Kinetic energy lost by a perturbation in a given direction, against strain.

    Parameters
    ----------
    body : Body
        The body.
    direction : array_like, shape (3, 3)
        Symmetric rate of strain in body axes; only its deviator counts, scaled to one. The trace follows from
        `dilatancy`.
    strain : array_like
        Strains at which to compute the loss.

    Returns
    -------
    Push
    """
    d = unit_deviator(direction)
    r2, r6 = np.sqrt(2.0), np.sqrt(6.0)
    x = np.array(
        [
            (d[0, 0] - d[1, 1]) / r2,
            (d[0, 0] + d[1, 1] - 2 * d[2, 2]) / r6,
            r2 * d[0, 1],
            r2 * d[0, 2],
            r2 * d[1, 2],
        ]
    )
    m = body.material
    refuse_cut_off(m, "push")
    units = body_units(body)
    s1, s2, s3 = body.axes**2
    scene = ellipsoid(
        s1,
        s2,
        s3,
        body.omega * units.time,
        m.surface_code,
        m.phi,
        flow_cohesion(body) / units.stress,
        to_si(dilatancy, u.dimensionless_unscaled, "dilatancy", low=0.0, high=1.0),
        0.0 if m.bulk_modulus is None else m.bulk_modulus.to_value(u.Pa) / units.stress,
    )
    p1, p2, p3 = powers(scene, x)
    t = to_si(strain, u.dimensionless_unscaled, "strain", shape=None)
    second = -(t * p1 + t**2 / 2 * p2)
    whole = np.array([_loss(scene, x, ti) for ti in t.ravel()]).reshape(t.shape)
    joule = units.energy * u.J
    return Push(
        direction=strain_rate(scene, x)[0],
        powers=(p1 * joule, p2 * joule, p3 * joule),
        strain=t,
        loss=Orders(second * joule, (second - t**3 / 6 * p3) * joule, whole * joule),
    )


def _loss(scene: Ellipsoid, x: Array, t: float) -> float:
    """Energy that the perturbation has lost at strain `t`, in the units of the kernels."""
    return float(loss_at(scene, x, t, WITH_INERTIA))


def strain_rate(scene: Ellipsoid, x: Array) -> tuple[Array, bool]:
    """Rate of strain (3, 3) of a direction in the variables of the kernels, and whether it is at the apex."""
    if not np.all(np.isfinite(x)):
        return np.full((3, 3), np.nan), False
    _, trace = slope_of_flow(scene, x)
    d = np.empty(6)
    rate_of_strain(x, trace, d)
    return tensor(d), bool(np.sum(x * x) < 1.0 - 1e-6)


def unit_deviator(direction: ArrayLike | Quantity) -> Array:
    """Deviator (3, 3) of the symmetric part of a rate of strain, scaled to ``|D'| = 1``."""
    d = to_si(direction, u.dimensionless_unscaled, "direction", shape=(3, 3))
    d = 0.5 * (d + d.T)
    d = d - np.trace(d) / 3.0 * np.eye(3)
    size = np.linalg.norm(d)
    if size == 0.0:
        raise InvalidInput("direction", direction, "a rate of strain with a deviator")
    return d / size
