"""One asteroid of a catalogue: its body and its orbit, built from its record."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import astropy.units as u
import numpy as np
from astropy.time import Time
from astropy.units import Quantity

from flybystab.arguments import check_arguments, vector
from flybystab.body.body import Body, Material
from flybystab.body.shape import Shape
from flybystab.catalogues.catalogued_orbit import catalogued_orbit, epoch_of
from flybystab.catalogues.record import BODILY, ORBITAL, SHAPE, Record
from flybystab.catalogues.spin_solutions import SpinSolution, solutions_of
from flybystab.catalogues.tumbling import attitude_matrix, ecliptic_direction, free_spin, tumbling_state
from flybystab.errors import InvalidInput
from flybystab.typing import Array
from flybystab.units import to_si

if TYPE_CHECKING:
    from flybystab.orbit.covariance import Covariance
    from flybystab.orbit.orbit import Orbit

#: Version of the embedded catalogue: date of its newest source.
CATALOGUE_DATE = "2026-07"


@dataclass(frozen=True, eq=False, init=False)
class Asteroid(Record):
    """An asteroid with its orbit and body, from a row of a catalogue or from given values.

    Parameters
    ----------
    row : mapping of str to str, optional
        A row of a catalogue.
    material : Material, optional
        Material of the body; catalogues do not contain one. By default that of `body`, or without a body a friction
        angle of 35 degrees.
    file : str
        File from which the row was read; "given values" by default.
    covariance : Covariance, optional
        Covariance of the orbit, if it is published; by default as described in :attr:`orbit`.
    orbit : Orbit, optional
        Replaces the elements of the row and their covariance.
    body : Body, optional
        Replaces semi-axes, density, period and material. It must rotate about its short axis.
    pole : Quantity (2,), optional
        Ecliptic longitude and latitude (J2000) of the spin pole.
    sigmas : mapping, optional
        1-sigma errors of ``axes`` (one length or three), ``density`` and ``period``, which a screening samples.
    sources : mapping, optional
        Sources of ``axes``, ``diameter``, ``density``, ``period``, ``pole`` and ``orbit``.
    name : str, optional
        By default the name of the orbit.

    Raises
    ------
    InvalidInput, UnitMismatch, UnknownName
        For an invalid value.

    Examples
    --------
    >>> import astropy.units as u
    >>> import flybystab as fs
    >>> orbit = fs.Asteroid.from_catalogue("Apophis").orbit
    >>> body = fs.Body(semi_axes=[200, 170, 150] * u.m, density=2000 * u.kg / u.m**3, spin_period=5 * u.h)
    >>> mine = fs.Asteroid(orbit=orbit, body=body, sigmas={"density": 300 * u.kg / u.m**3}, name="mine")
    >>> mine.body.density
    <Quantity 2000. kg / m3>
    """

    row: Mapping[str, str]
    material: Material = field(default_factory=Material)
    file: str = "given values"
    covariance: Covariance | None = field(default=None, repr=False)
    own_orbit: Orbit | None = field(default=None, repr=False)

    @check_arguments
    def __init__(
        self,
        row: Mapping[str, str] | None = None,
        material: Material | None = None,
        file: str | None = None,
        covariance: Covariance | None = None,
        own_orbit: Orbit | None = None,
        *,
        orbit: Orbit | None = None,
        body: Body | None = None,
        pole: Quantity | None = None,
        sigmas: Mapping[str, Quantity] | None = None,
        sources: Mapping[str, str] | None = None,
        name: str = "",
    ) -> None:
        given = dict(row or {})
        if orbit is not None or body is not None:
            from flybystab.catalogues import given as columns

            if orbit is not None:
                own_orbit = columns.checked_orbit(orbit)
                given |= columns.orbit_columns(own_orbit, name)
            elif name:
                given["name"] = name
            if body is not None:
                given |= columns.body_columns(body)
                material = material or body.material
        if pole is not None or sigmas or sources:
            from flybystab.catalogues import given as columns

            given |= columns.pole_columns(pole) if pole is not None else {}
            given |= columns.error_columns(sigmas or {}) | columns.source_columns(sources or {})
        for key, value in (
            ("row", given if row is None or given != row else row),
            ("material", material or Material()),
            ("file", "given values" if file is None else file),
            ("covariance", covariance),
            ("own_orbit", own_orbit),
        ):
            object.__setattr__(self, key, value)

    @classmethod
    @check_arguments
    def from_catalogue(cls, name: str | int, material: Material | None = None) -> Asteroid:
        """The asteroid with this number, name or designation in the embedded catalogue.

        Parameters
        ----------
        name : str or int
            For example "Apophis", 99942, "2004 MN4" or "(99942) Apophis"; case and spaces are ignored.
        material : Material, optional
            Material of the body.

        Raises
        ------
        UnknownName
            There is no such asteroid; the message lists similar names.
        """
        from flybystab.catalogues.catalogue import catalogue, find

        return find(catalogue(), name, "the embedded catalogue").with_material(material)

    @classmethod
    @check_arguments
    def from_file(cls, path: str | Path, name: str | int, material: Material | None = None) -> Asteroid:
        """The asteroid with this number, name or designation in a file, of any format of :func:`catalogue`."""
        from flybystab.catalogues.catalogue import catalogue, find

        return find(catalogue(path), name, str(path)).with_material(material)

    @check_arguments
    def with_material(self, material: Material | None) -> Asteroid:
        """The same asteroid with another material (None: unchanged)."""
        return self if material is None else replace(self, material=material)

    @check_arguments
    def with_shape(self, shape: Shape) -> Asteroid:
        """The same asteroid with the equivalent ellipsoid of a polyhedral shape (:meth:`Body.from_shape`).

        The semi-axes are marked as measured. Their relative errors are kept from the row, since a shape model does not
        include errors. Pole and spin state refer to the principal axes of the shape.

        Raises
        ------
        InvalidInput
            `shape` is not a Shape. A tumbling solution that is impossible for the moments of inertia of the shape
            raises it later, when the body is built.
        """
        if not isinstance(shape, Shape):
            raise InvalidInput("shape", shape, "a flybystab.Shape")
        from flybystab.catalogues import given as columns

        return replace(self, row=dict(self.row) | columns.shape_columns(self, shape))

    def with_physical(self, *files: str | Path) -> Asteroid:
        """The same asteroid with its physical parameters replaced by those in files, each with its source.

        Parameters
        ----------
        *files : str or Path
            Files in a format of :mod:`flybystab.catalogues.physical`: an SBDB answer with ``phys_par``, a card of
            SsODNet, a spin file of DAMIT, a table of the LCDB or of spin solutions. The spin solutions of all files are
            alternatives (:attr:`spin_solutions`).

        Raises
        ------
        InvalidInput
            A file cannot be read, or does not contain this asteroid.
        """
        from flybystab.catalogues.physical import with_physical

        return with_physical(self, *files)

    @cached_property
    def spin_solutions(self) -> tuple[SpinSolution, ...]:
        """Alternative spin solutions with weights, from which a screening draws; empty if there are none."""
        return solutions_of(self.row)

    @check_arguments
    def with_tumbling(
        self,
        precession_period: Quantity,
        rotation_period: Quantity,
        mode: str = "SAM",
        *,
        inertia: tuple[float, float] | None = None,
    ) -> Asteroid:
        """The same asteroid with another tumbling solution of its lightcurves.

        Parameters
        ----------
        precession_period, rotation_period : Quantity
            Periods ``P_phi`` and ``P_psi`` (:mod:`flybystab.catalogues.tumbling`).
        mode : str
            "SAM" (short-axis mode) or "LAM" (long-axis mode).
        inertia : (float, float), optional
            Ratios ``J1/J3`` and ``J2/J3`` of the moments of inertia. The semi-axes are replaced by those of the
            homogeneous ellipsoid with these ratios and the same volume.
        """
        from flybystab.catalogues import given as columns

        changed = columns.tumbling_columns(precession_period, rotation_period, mode)
        if inertia is not None:
            changed |= columns.inertia_columns(self.semi_axes, inertia)
        return replace(self, row=dict(self.row) | changed)

    def __reduce__(self) -> tuple[type[Asteroid], tuple[object, ...]]:
        # Excludes the cached orbit and body, which are rebuilt when needed.
        return Asteroid, (dict(self.row), self.material, self.file, self.covariance, self.own_orbit)

    def __repr__(self) -> str:
        return f"<Asteroid {self.label}>"

    @check_arguments
    def completed(self, other: Asteroid) -> Asteroid:
        """The same asteroid with missing physical values and names taken from another row."""
        row = dict(self.row)
        if other.row.get("name") and row.get("name", "") in ("", row.get("designation"), row.get("number")):
            row["name"] = other.row["name"]
        # Columns of size, shape and spin are replaced together: mixing two rows would be inconsistent.
        for c, v in other.row.items():
            if c not in ORBITAL and (not row.get(c) or c in BODILY):
                row[c] = v
        return replace(self, row=row)

    @property
    def epoch(self) -> Time:
        """Epoch of the elements, TDB."""
        return epoch_of(self)

    @cached_property
    def orbit(self) -> Orbit:
        """The orbit, from the elements of the row and A1, A2, A3, DT, AMRAT (zero if unknown).

        The elements are a, e, i, node, peri, M, or q and the time of perihelion in place of a and M.

        The covariance is the first available of: the one given for the asteroid; the one included in the package; a
        diagonal matrix from the 1-sigmas of the row, marked as uncorrelated; an estimate from printed digits and U
        (:mod:`flybystab.catalogues.orbit_errors`). Otherwise it is None.
        """
        return catalogued_orbit(self, self.covariance) if self.own_orbit is None else self.own_orbit

    @property
    def tumbles(self) -> bool:
        """Whether the row has a complete tumbling solution (two periods and a mode)."""
        return self.knows("tumbling_mode", "precession_period_h", "rotation_period_h")

    @property
    def semi_axes(self) -> Quantity:
        """Semi-axes ``a >= b >= c``, m.

        Raises
        ------
        InvalidInput
            Another order, or a volume that is not that of the diameter of the row (factor 3: another unit).
        """
        axes = np.array([self._number(c) for c in SHAPE])
        given = " x ".join(f"{x:g}" for x in axes)
        if not axes[0] >= axes[1] >= axes[2]:
            raise InvalidInput(", ".join(SHAPE), given, f"a >= b >= c for {self.label} in {self.file}")
        if self.row.get("diameter_m"):
            diameter, wanted = 2.0 * float(np.cbrt(axes.prod())), self._number("diameter_m")
            if not wanted / 3.0 < diameter < 3.0 * wanted:
                raise InvalidInput(
                    ", ".join(SHAPE),
                    given,
                    f"semi-axes in m with the volume of a sphere of diameter_m = {wanted:g} "
                    f"for {self.label} in {self.file}",
                )
        return axes * u.m

    @cached_property
    def body(self) -> Body:
        """The body, with the `material` of the asteroid; for a tumbler at phase zero of its rotation."""
        return self.body_with()

    @check_arguments
    def body_with(self, material: Material | None = None, *, phase: float = 0.0) -> Body:
        """The body with a given material and, for a tumbler, at a given phase.

        Parameters
        ----------
        material : Material, optional
            By default that of the asteroid.
        phase : float
            For a tumbler: phase as a fraction of its rotation period, which determines the direction of the spin vector
            in the body.

        Returns
        -------
        Body
            Homogeneous ellipsoid, spinning about its short axis or with the angular velocity of the tumbling solution
            (that with the two observed periods). A tumbler without a solution spins about its short axis with its main
            lightcurve period, which is listed in `assumptions`.
        """
        material = material or self.material
        missing = [c for c in (*SHAPE, "density_kg_m3") if not self.row.get(c)]
        if not self.tumbles and not self.row.get("spin_period_h"):
            missing.append("spin_period_h")
        if missing:
            raise InvalidInput(
                ", ".join(missing),
                "(empty)",
                f"values for {self.label} in {self.file}: specify them (--axes, --density, --period; "
                "Asteroid(body=...)), or take them from a population (--assume, screen())",
            )
        density = self.quantity("density_kg_m3")
        if not self.tumbles:
            period = self.quantity("spin_period_h")
            return Body(semi_axes=self.semi_axes, density=density, spin_period=period, material=material)
        spin = self.angular_velocities(np.array([phase]))[0]
        return Body(semi_axes=self.semi_axes, density=density, spin=spin * u.rad / u.s, material=material)

    @check_arguments
    def angular_velocities(self, phase: Array) -> Array:
        """Angular velocities along the body axes, rad/s, shape (n, 3), at phases of the rotation, shape (n,).

        All rows are equal for a body that does not tumble.
        """
        if self.tumbles:
            moments, momentum, j = self._tumbling
            return free_spin(moments, momentum, j, phase)[0]
        return np.tile(self.body_with().omega, (len(phase), 1))

    @cached_property
    def _tumbling(self) -> tuple[Array, float, float]:
        """Moments of inertia per mass (m2) of the ellipsoid, angular momentum per mass, L^2/(2E) per mass."""
        squares = self.semi_axes.value**2
        moments = (squares.sum() - squares) / 5.0
        precession, rotation = (
            self._number(c) * 3600.0 for c in ("precession_period_h", "rotation_period_h")
        )
        return moments, *tumbling_state(moments, precession, rotation, self.row["tumbling_mode"])

    @property
    def pole(self) -> Array | None:
        """Unit vector (ICRF) of the spin pole, or of the angular momentum of a tumbler; None if unknown."""
        if not self.knows("pole_ecl_lon_deg", "pole_ecl_lat_deg"):
            return None
        lon, lat = (np.radians(self._number(c)) for c in ("pole_ecl_lon_deg", "pole_ecl_lat_deg"))
        return ecliptic_direction(float(lon), float(lat))

    @check_arguments
    def attitude(
        self, angle: Quantity, *, phase: float = 0.0, pole: Sequence[float] | Array | None = None
    ) -> Array:
        """Rotation from body axes to ICRF.

        Parameters
        ----------
        angle : Quantity
            Rotation angle about the pole; unpredictable for a date decades away.
        phase : float
            Phase of a tumbler, as in `body_with`.
        pole : ndarray (3,), optional
            Direction, ICRF, of the angular momentum instead of the catalogued one.

        Returns
        -------
        ndarray (3, 3)

        Raises
        ------
        InvalidInput
            No pole is known and none is given.
        """
        direction = self.pole if pole is None else vector(pole, "pole")
        if direction is None:
            raise InvalidInput("pole", "(unknown)", f"a direction: the catalogue has no pole of {self.label}")
        momentum = np.array([0.0, 0.0, 1.0])
        if self.tumbles:
            moments, size, j = self._tumbling
            momentum = moments * free_spin(moments, size, j, np.array([phase]))[0][0]
        return attitude_matrix(momentum, direction, to_si(angle, u.rad, "angle"))

    @property
    def assumptions(self) -> tuple[str, ...]:
        """Description of the assumed values of the body."""
        out = []
        if self.row.get("drawn"):
            out.append("median of the population: " + self.row["drawn"].replace(";", ", "))
        elif any(c in self.assumed for c in SHAPE):
            out.append("shape from size and lightcurve amplitude")
        if "density_kg_m3" in self.assumed and not self.row.get("drawn"):
            out.append("density")
        if self.spin_solutions:
            total = sum(s.weight for s in self.spin_solutions)
            weight = max(s.weight for s in self.spin_solutions) / total
            out.append(f"one of {len(self.spin_solutions)} alternative spin solutions (weight {weight:.0%})")
        if self.pole is None:
            out.append("pole unknown")
        if "spin_state" in self.assumed:
            out.append("principal-axis spin")
        if "tumbling" in self.row.get("spin_state", "") and not self.tumbles:
            out.append("tumbling replaced by principal-axis spin")
        if self.row.get("unchecked"):
            out.append("quoted, not checked: " + self.row["unchecked"].replace(";", ", "))
        return tuple(out)


def identity(asteroid: Asteroid) -> str:
    """The number, designation or name that identifies an asteroid in random streams and in a journal."""
    return str(asteroid.number) if asteroid.number is not None else asteroid.designation or asteroid.name
