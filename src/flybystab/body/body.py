"""The asteroid as a homogeneous ellipsoidal rubble pile: its material, shape, density and spin."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any

import astropy.units as u
import numpy as np
from astropy.units import Quantity
from numpy.typing import NDArray

from flybystab.arguments import check_arguments
from flybystab.constants import G
from flybystab.core.material.surfaces import DEFAULT, NAMES
from flybystab.errors import InvalidInput, NotModelled, UnitMismatch, UnknownName, UnsettledBody
from flybystab.units import brief, frozen, to_si

if TYPE_CHECKING:
    from flybystab.body.shape import Shape

#: Yield surfaces, in the order of their integer codes in :mod:`flybystab.core.material.yield_surface`.
YIELD_SURFACES = NAMES
#: States of a body: one whole body at rest, and the possible states after an encounter.
STATES = ("rigid", "flowing", "dispersed", "fluid", "partly unbound", "on the ground")
#: The default yield surface, which of the four agrees best with simulations of grains. The cone through triaxial
#: compression overestimates the strength of a stretched body.
DEFAULT_SURFACE = DEFAULT
#: Bulk densities of an asteroid, kg/m3: below the lightest comets, above the heaviest metal. A value
#: outside this range is an error, usually of the unit.
DENSITY_RANGE = (50.0, 25_000.0)


@dataclass(frozen=True)
class Material:
    """A rigid, perfectly plastic granular material (theory, section 3).

    Parameters
    ----------
    friction_angle : Quantity
        Angle of internal friction, in [0, 90) deg.
    cohesion : Quantity
        Mohr-Coulomb cohesion ``Y`` (shear strength at zero pressure), Pa.
    dilatancy : float
        Below 1 the rate of strain is along the stress deviator with ``tr D = beta |D'|``, ``beta`` this fraction of the
        least slope ``k`` of the yield surface; 0 preserves volume. 1 is associative: ``D`` along the true normal.
    yield_surface : str
        One of :data:`YIELD_SURFACES`, Mohr-Coulomb by default. ``"drucker-prager"`` is the cone through triaxial
        compression.
    brittle : bool
        Whether cohesion is lost permanently at first yield.
    bulk_modulus : Quantity or None
        Plastic bulk modulus ``kappa`` of the energy criterion, Pa; None leaves it out.
    tensile_strength : Quantity or float, optional
        Tension cut-off ``T``: the yield surface is closed at ``sigma_1 <= T``. Pa, or a number for a fraction of the
        cohesion. It is used for equilibrium, spin limits, admissibility and onset of yield; flow with a cut-off is not
        modelled (:class:`~flybystab.errors.NotModelled`).

    Raises
    ------
    InvalidInput, UnitMismatch, UnknownName
    """

    friction_angle: Quantity = field(default_factory=lambda: 35.0 * u.deg)
    cohesion: Quantity = field(default_factory=lambda: 0.0 * u.Pa)
    dilatancy: float = 0.0
    yield_surface: str = DEFAULT_SURFACE
    brittle: bool = False
    bulk_modulus: Quantity | None = None
    tensile_strength: Quantity | float | None = None

    phi: float = field(init=False, repr=False)  #: friction angle, rad
    c_pa: float = field(init=False, repr=False)  #: cohesion, Pa
    t_pa: float = field(init=False, repr=False)  #: tension cut-off, Pa; infinite without one

    def __post_init__(self) -> None:
        phi_deg = to_si(self.friction_angle, u.deg, "friction_angle", low=0.0, high=90.0, open_high=True)
        object.__setattr__(self, "phi", float(np.deg2rad(phi_deg)))
        object.__setattr__(self, "c_pa", to_si(self.cohesion, u.Pa, "cohesion", low=0.0))
        dilatancy = to_si(self.dilatancy, u.dimensionless_unscaled, "dilatancy", low=0.0, high=1.0)
        object.__setattr__(self, "dilatancy", dilatancy)
        if str(self.yield_surface) not in YIELD_SURFACES:
            near = get_close_matches(str(self.yield_surface), YIELD_SURFACES, cutoff=0.4)
            raise UnknownName(
                "yield surface", str(self.yield_surface), near, f"(known: {', '.join(YIELD_SURFACES)})"
            )
        if not isinstance(self.brittle, bool | np.bool_):
            raise InvalidInput("brittle", self.brittle, "True or False")
        if self.bulk_modulus is not None:
            to_si(self.bulk_modulus, u.Pa, "bulk_modulus", low=0.0)
        object.__setattr__(self, "t_pa", self._cut_off())

    def _cut_off(self) -> float:
        """Tension cut-off, Pa."""
        t = self.tensile_strength
        if t is None:
            return float("inf")
        if isinstance(t, Quantity) and t.unit.physical_type != "dimensionless":
            return to_si(t, u.Pa, "tensile_strength", low=0.0)
        return self.c_pa * to_si(t, u.dimensionless_unscaled, "tensile_strength", low=0.0)

    @property
    def cut_off(self) -> bool:
        """Whether the yield surface is closed in tension."""
        return self.tensile_strength is not None

    @property
    def surface_code(self) -> int:
        """Integer code of the yield surface in the kernels."""
        return YIELD_SURFACES.index(self.yield_surface)

    def with_(self, **changes: Any) -> Material:
        """A copy with some parameters changed."""
        return replace(self, **changes)

    def __repr__(self) -> str:
        more = [f"dilatancy {self.dilatancy:g}"] if self.dilatancy else []
        more += ["brittle"] if self.brittle else []
        more += [] if self.bulk_modulus is None else [f"bulk modulus {brief(self.bulk_modulus)}"]
        more += [f"tensile strength {brief(self.t_pa * u.Pa)}"] if self.cut_off else []
        parts = [self.yield_surface, brief(self.friction_angle), brief(self.cohesion), *more]
        return f"<Material {', '.join(parts)}>"


def check_body(body: object) -> Body:
    """Return the body; raise InvalidInput for anything else."""
    if not isinstance(body, Body):
        raise InvalidInput("body", body, "a flybystab.Body (of an asteroid: asteroid.body)")
    return body


def refuse_cut_off(material: Material, what: str) -> None:
    """Raise NotModelled for a material with a tension cut-off."""
    if material.cut_off:
        raise NotModelled(
            f"{what} does not model a tension cut-off (tensile_strength = {material.tensile_strength}); equilibrium, "
            "spin limits, admissibility and the onset of yield do"
        )


def check_settled(body: object) -> None:
    """Raise InvalidInput for anything but a body, UnsettledBody for a body that is not at rest."""
    state = check_body(body).state
    if state != "rigid":
        raise UnsettledBody("body", body, f"one whole body at rest; this one is {state}")


@dataclass(frozen=True, eq=False)
class Body:
    """A homogeneous ellipsoid of granular material.

    Parameters
    ----------
    semi_axes : Quantity, shape (3,)
        ``a1 >= a2 >= a3``.
    density : Quantity
        Bulk density, within :data:`DENSITY_RANGE`.
    spin_period : Quantity, optional
        Period of steady rotation about ``+a3``; negative for ``-a3``. Neither this nor `spin`: no spin.
    spin : Quantity, shape (3,), optional
        Angular velocity along the axes ``a1, a2, a3``, for bodies that tumble.
    material : Material, optional
        35 degrees of friction and no cohesion by default.
    dispersed : bool, optional
        Whether an encounter has dispersed the body: its density may then be below that of any asteroid.
    state : str, optional
        ``"rigid"``: one whole body at rest in its shape. After an encounter also ``"flowing"``, ``"dispersed"``,
        ``"partly unbound"`` or ``"on the ground"``: no flyby accepts such a body.

    Attributes
    ----------
    axes, rho, omega : ndarray (3,), float, ndarray (3,)
        The same in SI floats: m, kg/m3, rad/s.

    Raises
    ------
    InvalidInput, UnitMismatch
    """

    semi_axes: Quantity
    density: Quantity
    spin_period: Quantity | None = None
    spin: Quantity | None = None
    material: Material = field(default_factory=Material)
    dispersed: bool = field(default=False, repr=False, kw_only=True)
    state: str = field(default="rigid", repr=False, kw_only=True)

    axes: NDArray[np.float64] = field(init=False, repr=False, compare=False)
    rho: float = field(init=False, repr=False, compare=False)
    omega: NDArray[np.float64] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        axes = to_si(self.semi_axes, u.m, "semi_axes", shape=(3,), low=0.0, open_low=True)
        if not (axes[0] >= axes[1] >= axes[2]):
            raise InvalidInput(
                "semi_axes", self.semi_axes, "a1 >= a2 >= a3 (sort them: a3 is the short axis)"
            )
        if not isinstance(self.material, Material):
            raise InvalidInput("material", self.material, "a Material")
        if self.spin_period is not None and self.spin is not None:
            raise InvalidInput("spin", self.spin, "either spin_period or spin, not both")
        omega = np.zeros(3)
        if self.spin_period is not None:
            period = to_si(self.spin_period, u.s, "spin_period")
            if period == 0.0:
                raise InvalidInput(
                    "spin_period", self.spin_period, "a period other than zero (leave it out for no spin)"
                )
            omega[2] = 2.0 * np.pi / period
        elif self.spin is not None:
            if u.Hz in getattr(getattr(self.spin, "unit", None), "bases", ()):
                raise UnitMismatch("spin", self.spin, "rad / s: hertz may count turns or radians")
            with u.set_enabled_equivalencies(u.dimensionless_angles()):
                omega = to_si(self.spin, u.rad / u.s, "spin", shape=(3,))
        rho = to_si(self.density, u.kg / u.m**3, "density", low=0.0, open_low=True)
        if not isinstance(self.dispersed, bool | np.bool_):
            raise InvalidInput("dispersed", self.dispersed, "True or False")
        least, most = DENSITY_RANGE
        if not (self.dispersed or least <= rho <= most):
            raise InvalidInput(
                "density", self.density, f"{least:g} to {most:g} kg / m3 (1 g / cm3 is 1000 kg / m3)"
            )
        if str(self.state) not in STATES:
            raise InvalidInput("state", self.state, f"one of {', '.join(STATES)}")
        for name in ("semi_axes", "density", "spin_period", "spin"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, frozen(getattr(self, name)))
        for name, value in (("axes", axes), ("rho", rho), ("omega", omega)):
            if isinstance(value, np.ndarray):
                value.setflags(write=False)
            object.__setattr__(self, name, value)

    @classmethod
    @check_arguments
    def from_shape(
        cls,
        shape: Shape,
        *,
        density: Quantity,
        spin_period: Quantity | None = None,
        spin: Quantity | None = None,
        material: Material | None = None,
    ) -> Body:
        """The dynamically equivalent ellipsoid of a polyhedral shape, of equal volume.

        Parameters
        ----------
        shape : Shape
            Its principal axes are those of the body, longest first.
        density, spin_period, spin, material
            As for a body of given semi-axes.
        """
        return cls(shape.ellipsoid(), density, spin_period, spin, material or Material())

    @property
    def volume(self) -> Quantity:
        """Volume, m3."""
        return 4.0 / 3.0 * np.pi * float(np.prod(self.axes)) * u.m**3

    @property
    def mass(self) -> Quantity:
        """Mass, kg."""
        return self.rho * self.volume.value * u.kg

    @property
    def mean_radius(self) -> Quantity:
        """Radius of the sphere of equal volume, m."""
        return float(np.cbrt(np.prod(self.axes))) * u.m

    @property
    def inertia(self) -> Quantity:
        """Principal moments of inertia ``(m/5)(a_j^2 + a_k^2)``, kg m2."""
        s = self.axes**2
        return self.mass.value / 5.0 * (s.sum() - s) * u.kg * u.m**2

    @property
    def dynamical_time(self) -> float:
        """``1/sqrt(pi G rho)``, s: the unit of time of the kernels."""
        return float(1.0 / np.sqrt(np.pi * G * self.rho))

    def with_(self, **changes: Any) -> Body:
        """A copy with some parameters changed; `spin` replaces `spin_period` and vice versa."""
        if "spin" in changes and "spin_period" not in changes:
            changes["spin_period"] = None
        elif "spin_period" in changes and "spin" not in changes:
            changes["spin"] = None
        return replace(self, **changes)

    def __repr__(self) -> str:
        spin = "no spin"
        if self.spin_period is not None:
            spin = f"spin period {brief(self.spin_period)}"
        elif self.spin is not None and np.any(self.omega != 0.0):
            spin = f"spin {brief(self.spin)}"
        return f"<Body {brief(self.semi_axes)}, {brief(self.density)}, {spin}, {repr(self.material)[10:-1]}>"
