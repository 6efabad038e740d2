"""Constraints on density, friction and cohesion from shape and spin."""

from __future__ import annotations

from dataclasses import dataclass

import astropy.units as u
import numpy as np
from astropy.units import Quantity

from flybystab.arguments import check_arguments
from flybystab.arguments import levels as checked_levels
from flybystab.body.body import DENSITY_RANGE, Body
from flybystab.body.equilibrium import stress_components, tide_components
from flybystab.constants import G
from flybystab.core.ellipsoid.rigid_stress import demand, overload, rigid_stress, spin_interval
from flybystab.core.numerics.jit import kernel
from flybystab.errors import InvalidInput
from flybystab.tabular import Tabular
from flybystab.typing import Array
from flybystab.units import brief, to_si, whole


@dataclass(frozen=True)
class Requirements(Tabular):
    """Requirements on the material, sampled over the uncertain shape, spin and density.

    Attributes
    ----------
    friction_angle : Quantity, shape (samples,)
        Least friction angle with the body's cohesion, deg; inf where none suffices.
    cohesion : Quantity, shape (samples,)
        Least cohesion at the body's friction angle, Pa.
    least_density, greatest_density : Quantity, shape (samples,)
        Densities between which friction alone (no cohesion) supports the body at its friction angle, kg/m3;
        nan where no density does, inf where there is no upper end.
    in_tension : Quantity, shape (samples,)
        Mean tension of the body, Pa (zero where it is in compression).
    """

    friction_angle: Quantity
    cohesion: Quantity
    least_density: Quantity
    greatest_density: Quantity
    in_tension: Quantity

    @check_arguments
    def quantiles(self, name: str, levels: tuple[float, ...] = (0.1587, 0.5, 0.8413)) -> Quantity:
        """Quantiles of one of the attributes, e.g. ``r.quantiles("cohesion")``: median and 1-sigma ends."""
        values = getattr(self, name, None)
        if not isinstance(values, Quantity):
            raise InvalidInput("name", name, "the name of a quantity of this result")
        # Nearest-rank quantiles stay defined next to inf.
        return (
            np.quantile(values.value, checked_levels(levels, "levels"), method="inverted_cdf") * values.unit
        )

    def probability_of_tension(self) -> float:
        """Fraction of the samples in mean tension, which friction cannot support."""
        return float(np.mean(self.in_tension.value > 0.0))

    def __repr__(self) -> str:
        tension = self.probability_of_tension()
        phi, cohesion = self.quantiles("friction_angle")[1], self.quantiles("cohesion")[1]
        return (
            f"<Requirements {len(self.cohesion)} samples: friction {brief(phi)}, cohesion {brief(cohesion)} "
            f"(medians), in tension with probability {tension:.2g}>"
        )


@check_arguments
def density_intervals(body: Body, tide: Quantity | None = None) -> Quantity:
    """Densities at which the body, with its shape, spin and material, is in admissible equilibrium.

    Returns
    -------
    Quantity, shape (n, 2)
        Intervals inside :data:`flybystab.body.body.DENSITY_RANGE`, kg/m3. Without cohesion there is at most
        one: below it the body flies apart, above it an elongated body collapses. With cohesion there may be a second
        interval at low densities.

    Notes
    -----
    The overload is scanned on 600 densities and its sign changes are bisected; an interval narrower than
    1.1 % could be missed.
    """
    m = body.material
    ends = _density_crossings(
        body.axes**2, body.omega, tide_components(tide), m.surface_code, m.phi, m.c_pa, *DENSITY_RANGE
    )
    return ends.reshape(-1, 2) * u.kg / u.m**3


def required_cohesion(body: Body, friction_angle: Quantity, tide: Quantity | None = None) -> Quantity:
    """Least cohesion for one or many friction angles, Pa, in the shape of `friction_angle`."""
    phi = np.asarray(
        to_si(friction_angle, u.rad, "friction_angle", shape=None, low=0.0, high=np.pi / 2, open_high=True)
    )
    c = stress_components(body, tide)
    code = body.material.surface_code
    return np.array([demand(code, f, 0.0, c)[1] for f in phi.ravel()]).reshape(phi.shape) * u.Pa


@check_arguments
def requirements(
    body: Body,
    *,
    semi_axes_sigma: Quantity | None = None,
    density_sigma: Quantity | None = None,
    spin_period_sigma: Quantity | None = None,
    samples: int = 4000,
    seed: int = 0,
) -> Requirements:
    """Propagate the uncertainty of shape, spin and density to bounds on friction, cohesion and density.

    Parameters
    ----------
    body : Body
        In steady spin about ``a3``, with nominal values.
    semi_axes_sigma : Quantity, shape (3,), optional
        One-sigma errors of the semi-axes; sampled axes are sorted again.
    density_sigma, spin_period_sigma : Quantity, optional
        One-sigma errors.
    samples, seed : int
        Size of the sample and seed of its generator: the same seed gives the same sample.

    Returns
    -------
    Requirements

    Notes
    -----
    Each quantity is log-normal with its nominal value as median and ``sigma/value`` as the deviation of its
    logarithm, so that none turns negative.
    """
    if body.omega[0] != 0.0 or body.omega[1] != 0.0:
        raise InvalidInput("spin", body.spin, "steady spin about a3")
    if samples < 1:
        raise InvalidInput("samples", samples, "a positive integer")
    rng = np.random.default_rng(whole(seed, "seed", 0))

    def spread(
        value: Array, sigma: Quantity | None, unit: u.UnitBase, name: str, shape: tuple[int, ...]
    ) -> Array:
        z = rng.standard_normal((samples, *shape))  # drawn even if unused: adding an error keeps the others
        if sigma is None:
            return np.broadcast_to(value, (samples, *shape)).copy()
        s = to_si(sigma, unit, name, shape=shape, low=0.0)
        with np.errstate(invalid="ignore"):
            return value * np.exp(z * np.where(value != 0.0, s / np.abs(value), 0.0))

    axes = spread(body.axes, semi_axes_sigma, u.m, "semi_axes_sigma", (3,))
    rho = spread(np.array(body.rho), density_sigma, u.kg / u.m**3, "density_sigma", ())
    if spin_period_sigma is not None and body.omega[2] == 0.0:
        raise InvalidInput("spin_period_sigma", spin_period_sigma, "a body that spins")
    period = np.array(2 * np.pi / abs(body.omega[2])) if body.omega[2] != 0.0 else np.array(np.inf)
    omega = 2 * np.pi / spread(period, spin_period_sigma, u.s, "spin_period_sigma", ())
    m = body.material
    out = _sample_requirements(-np.sort(-axes, axis=1), rho, omega, m.surface_code, m.phi, m.c_pa, G)
    density = u.kg / u.m**3
    return Requirements(
        np.rad2deg(out[0]) * u.deg, out[1] * u.Pa, out[2] * density, out[3] * density, out[4] * u.Pa
    )


@kernel
def _sample_requirements(
    axes: Array, rho: Array, omega: Array, code: int, phi: float, cohesion: float, g: float
) -> Array:
    """Rows: friction (rad), cohesion (Pa), least and greatest cohesionless density (kg/m3), tension (Pa)."""
    n = rho.size
    out = np.empty((5, n))
    w = np.zeros(3)
    tide = np.zeros(6)
    stress = np.empty(6)
    for i in range(n):
        s1, s2, s3 = axes[i, 0] ** 2, axes[i, 1] ** 2, axes[i, 2] ** 2
        w[2] = omega[i]
        rigid_stress(s1, s2, s3, rho[i], np.pi * g * rho[i], w, tide, stress)
        out[0, i], out[1, i] = demand(code, phi, cohesion, stress)
        low, high = spin_interval(s1, s2, s3, code, phi, 0.0)
        scaled = omega[i] ** 2 / (np.pi * g)
        out[2, i] = scaled / high
        out[3, i] = scaled / low if low > 0.0 else (np.inf if low == 0.0 else np.nan)
        out[4, i] = max(0.0, (stress[0] + stress[1] + stress[2]) / 3.0)
    return out


@kernel
def _density_overload(
    s: Array, rho: float, omega: Array, tide: Array, code: int, phi: float, cohesion: float, stress: Array
) -> float:
    rigid_stress(s[0], s[1], s[2], rho, np.pi * G * rho, omega, tide, stress)
    return overload(code, phi, cohesion, stress)


@kernel
def _density_crossings(
    s: Array, omega: Array, tide: Array, code: int, phi: float, cohesion: float, low: float, high: float
) -> Array:
    """Ends of the admissible densities inside ``[low, high]``, in pairs."""
    n = 600
    ends = np.empty(2 * n + 2)
    count = 0
    stress = np.empty(6)
    step = np.log(high / low) / (n - 1)
    x0 = low
    ok0 = _density_overload(s, x0, omega, tide, code, phi, cohesion, stress) <= 0.0
    if ok0:
        ends[0] = low
        count = 1
    for i in range(1, n):
        x1 = low * np.exp(i * step)
        ok1 = _density_overload(s, x1, omega, tide, code, phi, cohesion, stress) <= 0.0
        if ok1 != ok0:
            a, b = x0, x1
            for _ in range(100):
                mid = 0.5 * (a + b)
                if mid in (a, b):
                    break
                if (_density_overload(s, mid, omega, tide, code, phi, cohesion, stress) <= 0.0) == ok0:
                    a = mid
                else:
                    b = mid
            ends[count] = a if ok0 else b
            count += 1
        x0 = x1
        ok0 = ok1
    if ok0:
        ends[count] = high
        count += 1
    return ends[:count].copy()
