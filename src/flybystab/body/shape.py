"""The shape of an asteroid as a polyhedron, from radar, lightcurves or spacecraft images."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import astropy.units as u
import numpy as np
from astropy.units import Quantity
from numpy.typing import NDArray

from flybystab.arguments import check_arguments
from flybystab.body.generated_shapes import FACETS, distance_to_surface, gaussian_relief, sphere_mesh
from flybystab.body.mesh import MassProperties, edges_of, mass_properties, self_intersections
from flybystab.body.shape_files import facet_fields, read_mesh, write_mesh
from flybystab.constants import G
from flybystab.core.polyhedron.gravity import polyhedron_gravity
from flybystab.core.polyhedron.moments import third_moments
from flybystab.errors import InvalidInput, MissingExtra, UnitMismatch
from flybystab.typing import Array
from flybystab.units import brief, frozen, to_si, whole

Integers = NDArray[np.int64]

if TYPE_CHECKING:
    from pyvista import PolyData


@dataclass(frozen=True, eq=False)
class Shape:
    """A closed, homogeneous polyhedron in its principal frame.

    The vertices are kept relative to the centre of mass and along the principal axes of inertia: ``x`` along the axis
    of least inertia (the longest extent), ``z`` along that of greatest inertia. :attr:`rotation` and :attr:`origin`
    give the transformation to the frame of the file.

    Parameters
    ----------
    vertices : Quantity, shape (v, 3)
    facets : array_like of int, shape (f, 3)
        Corners of each triangle, numbered from 0, counter-clockwise seen from outside. If all facets are
        oriented inwards, the orientation is reversed.

    Attributes
    ----------
    origin : Quantity, shape (3,)
        Centre of mass in the frame of the vertices that were given.
    rotation : ndarray (3, 3)
        Rotation, principal axes -> frame of the vertices that were given.

    Raises
    ------
    InvalidInput, UnitMismatch
        For an open or self-intersecting surface, facets not oriented alike, or without volume; the message names the
        facets.
    """

    #: Saved and restored field by field: the constructor turns the vertices into principal axes.
    _stored: ClassVar[tuple[str, ...]] = (
        "vertices", "facets", "origin", "rotation", "_edges", "_sides", "_mass"
    )  # fmt: skip
    _verbatim: ClassVar[bool] = True

    vertices: Quantity
    facets: Integers

    origin: Quantity = field(init=False, repr=False)
    rotation: Array = field(init=False, repr=False)
    _edges: Integers = field(init=False, repr=False)
    _sides: Integers = field(init=False, repr=False)
    _mass: MassProperties = field(init=False, repr=False)

    def __post_init__(self) -> None:
        points = to_si(self.vertices, u.m, "vertices", shape=None)
        facets = np.asarray(self.facets)
        if points.ndim != 2 or points.shape[1] != 3 or len(points) < 4:
            raise InvalidInput("vertices", np.shape(points), "shape (v, 3) with at least 4 vertices")
        if facets.ndim != 2 or facets.shape[1] != 3 or facets.dtype.kind not in "iu":
            raise InvalidInput("facets", np.shape(facets), "whole numbers of shape (f, 3)")
        facets = facets.astype(np.int64)
        if facets.min() < 0 or facets.max() >= len(points):
            raise InvalidInput("facets", int(facets.max()), f"vertices numbered from 0 to {len(points) - 1}")
        edges, sides = edges_of(facets)
        mass = mass_properties(points, facets)
        extent = float(np.ptp(points, axis=0).max())
        if abs(mass.volume) <= 1e-9 * extent**3:
            raise InvalidInput("vertices", f"volume {mass.volume:g} m3", "a solid body")
        if mass.volume < 0.0:
            facets = np.ascontiguousarray(facets[:, ::-1])
            edges, sides = edges_of(facets)
            mass = mass_properties(points, facets)
        crossing = self_intersections(points, facets)
        if len(crossing):
            few = ", ".join(map(str, crossing[:8]))
            raise InvalidInput(
                "facets", f"numbers {few} (from 0; {len(crossing)} in all)", "facets that do not intersect"
            )
        axes = _principal_axes(mass.second_moment)
        local = (points - mass.centre) @ axes
        moment = axes.T @ mass.second_moment @ axes
        local.setflags(write=False)
        facets.setflags(write=False)
        for name, value in (
            ("vertices", frozen(local * u.m)),
            ("facets", facets),
            ("origin", frozen(mass.centre * u.m)),
            ("rotation", axes),
            ("_edges", edges),
            ("_sides", sides),
            ("_mass", MassProperties(mass.volume, np.zeros(3), moment)),
        ):
            object.__setattr__(self, name, value)

    @classmethod
    @check_arguments
    def read(cls, path: str | Path, *, unit: u.UnitBase) -> Shape:
        """A shape from a file.

        Parameters
        ----------
        path : path
            OBJ, PLY, STL, a PDS vertex-facet or ICQ table, or a DAMIT ``shape.txt``; the format is detected from the
            content. See :mod:`flybystab.body.shape_files`.
        unit : Unit
            Of the coordinates in the file: no format states it.

        Raises
        ------
        InvalidInput, UnitMismatch
        """
        vertices, facets = read_mesh(Path(path))
        return cls(vertices * length_unit(unit), facets)

    @classmethod
    def from_ellipsoid(cls, semi_axes: Quantity, *, facets: int = FACETS) -> Shape:
        """A triangulated ellipsoid with its vertices on the surface; about ``12/facets`` of the volume is cut off."""
        axes = to_si(semi_axes, u.m, "semi_axes", shape=(3,), low=0.0, open_low=True)
        directions, triangles = sphere_mesh(facets)
        return cls(directions * axes * u.m, triangles)

    @classmethod
    def perturbed(
        cls, semi_axes: Quantity, *, amplitude: float, seed: int, degree: int = 8, facets: int = FACETS
    ) -> Shape:
        """An ellipsoid with Gaussian relief.

        Parameters
        ----------
        semi_axes : Quantity, shape (3,)
        amplitude : float
            Standard deviation of the logarithm of the radius, 0 to 0.3.
        seed : int
        degree : int
            Highest degree of the relief; the variance by degree falls as ``1/l^2`` from ``l = 2``.
        facets : int
        """
        axes = to_si(semi_axes, u.m, "semi_axes", shape=(3,), low=0.0, open_low=True)
        size = to_si(amplitude, u.dimensionless_unscaled, "amplitude", low=0.0, high=0.3)
        highest = whole(degree, "degree", 2)
        directions, triangles = sphere_mesh(facets)
        relief = gaussian_relief(directions, highest, np.random.default_rng(whole(seed, "seed", 0)))
        return cls(directions * np.exp(size * relief)[:, None] * axes * u.m, triangles)

    @classmethod
    def contact_binary(
        cls, first: Quantity, second: Quantity, *, overlap: float = 0.2, facets: int = FACETS
    ) -> Shape:
        """Two ellipsoidal lobes that overlap along their long axes.

        Parameters
        ----------
        first, second : Quantity, shape (3,)
            Semi-axes of the lobes; the first of each lies along the line of their centres.
        overlap : float
            Depth of the overlap over the smaller of the two first semi-axes, above 0 to 1.
        facets : int

        Notes
        -----
        The union of two convex bodies is star-shaped about any point that both contain: the radius in a direction is
        the larger of the two.
        """
        one = to_si(first, u.m, "first", shape=(3,), low=0.0, open_low=True)
        two = to_si(second, u.m, "second", shape=(3,), low=0.0, open_low=True)
        depth = to_si(overlap, u.dimensionless_unscaled, "overlap", low=0.0, high=1.0, open_low=True)
        depth *= min(one[0], two[0])
        # the common point lies in the middle of the overlap
        shift_one, shift_two = -(one[0] - 0.5 * depth), two[0] - 0.5 * depth
        directions, triangles = sphere_mesh(facets)
        radius = np.maximum(
            distance_to_surface(directions, one, shift_one), distance_to_surface(directions, two, shift_two)
        )
        return cls(directions * radius[:, None] * u.m, triangles)

    @property
    def volume(self) -> Quantity:
        """Volume, m3."""
        return self._mass.volume * u.m**3

    @cached_property
    def facet_area(self) -> Quantity:
        """Area of each facet, m2."""
        return 0.5 * np.linalg.norm(self._crosses, axis=1) * u.m**2

    @property
    def area(self) -> Quantity:
        """Surface area, m2."""
        return self.facet_area.sum()

    @cached_property
    def normals(self) -> Array:
        """Outward unit normals of the facets, ``(f, 3)``."""
        crosses = self._crosses
        return crosses / np.linalg.norm(crosses, axis=1)[:, None]

    @cached_property
    def centroids(self) -> Quantity:
        """Centroids of the facets, ``(f, 3)``, m."""
        return self.vertices.value[self.facets].mean(axis=1) * u.m

    @property
    def inertia(self) -> Quantity:
        """Principal moments of inertia over the mass, ``J/m``, m2, smallest first."""
        second = np.diag(self._mass.second_moment) / self._mass.volume
        return (second.sum() - second) * u.m**2

    @cached_property
    def second_moments(self) -> Array:
        """Principal second moments over the volume, ``int x_i^2 dV/V``, shape (3,), m2, greatest first."""
        return np.diag(self._mass.second_moment) / self._mass.volume

    @cached_property
    def third_moments(self) -> Array:
        """Third moments over the volume, ``int x_i x_j x_k dV/V``, shape (3, 3, 3), m3, principal frame."""
        return third_moments(self.vertices.value, self.facets) / self._mass.volume

    @property
    def mean_radius(self) -> Quantity:
        """Radius of the sphere of equal volume, m."""
        return float(np.cbrt(3.0 * self._mass.volume / (4.0 * np.pi))) * u.m

    def ellipsoid(self) -> Quantity:
        """Semi-axes, m, of the dynamically equivalent ellipsoid of equal volume.

        Its second moments ``a_i^2/5`` per mass, and so its principal moments of inertia, are in the same ratios as
        those of the shape.
        """
        axes = np.sqrt(5.0 * np.diag(self._mass.second_moment) / self._mass.volume)
        scale = np.cbrt(3.0 * self._mass.volume / (4.0 * np.pi * np.prod(axes)))
        return scale * axes * u.m

    @check_arguments
    def scaled(self, *, diameter: Quantity | None = None, volume: Quantity | None = None) -> Shape:
        """The same shape scaled to another size.

        Parameters
        ----------
        diameter : Quantity
            Diameter of the sphere of equal volume.
        volume : Quantity
            Either this or `diameter`.
        """
        if (diameter is None) == (volume is None):
            raise InvalidInput("diameter", diameter, "either diameter or volume")
        if diameter is not None:
            factor = to_si(diameter, u.m, "diameter", low=0.0, open_low=True) / (2.0 * self.mean_radius.value)
        else:
            asked = to_si(volume, u.m**3, "volume", low=0.0, open_low=True)
            factor = float(np.cbrt(asked / self._mass.volume))
        return Shape(self.vertices * factor, self.facets)

    def gravity(self, points: Quantity, density: Quantity) -> tuple[Quantity, Quantity, Quantity]:
        """Potential, acceleration and gradient tensor of the homogeneous polyhedron.

        Parameters
        ----------
        points : Quantity, shape (n, 3)
            Principal frame; no point on an edge.
        density : Quantity

        Returns
        -------
        potential : Quantity, shape (n,)
            m2/s2, positive (the specific potential energy is its negative).
        acceleration : Quantity, shape (n, 3)
            m/s2.
        gradient : Quantity, shape (n, 3, 3)
            s^-2; on a facet its normal component is not defined.
        """
        x = to_si(points, u.m, "points", shape=None)
        rho = to_si(density, u.kg / u.m**3, "density", low=0.0, open_low=True)
        if x.ndim != 2 or x.shape[1] != 3:
            raise InvalidInput("points", np.shape(x), "shape (n, 3)")
        n = len(x)
        potential, gradient, hessian = np.empty(n), np.empty((n, 3)), np.empty((n, 3, 3))
        polyhedron_gravity(
            np.ascontiguousarray(self.vertices.value), self.facets, self.normals, self._edges, self._dyads,
            np.ascontiguousarray(x), potential, gradient, hessian,
        )  # fmt: skip
        factor = G * rho
        return (
            factor * potential * u.m**2 / u.s**2,
            factor * gradient * u.m / u.s**2,
            factor * hessian / u.s**2,
        )

    @cached_property
    def facet_gravity(self) -> tuple[Array, Array]:
        """Potential (f,) and acceleration (f, 3) at the centroids of the facets over the density, SI; computed once."""
        one = 1.0 * u.kg / u.m**3
        potential, acceleration, _ = self.gravity(self.centroids, one)
        return potential.value, acceleration.value

    @check_arguments
    def write(self, path: str | Path, fields: Mapping[str, Quantity] | None = None) -> None:
        """Write the mesh and quantities by facet, as legacy VTK (for ParaView and pyvista) or PLY.

        Parameters
        ----------
        path : path
            Ends in ``.vtk`` or ``.ply``.
        fields : mapping of str to Quantity, shape (f,), optional
            Names without spaces; the unit is appended to the name. Coordinates are in m, principal frame.
        """
        write_mesh(Path(path), self.vertices.value, self.facets, fields or {})

    @check_arguments
    def to_pyvista(self, fields: Mapping[str, Quantity] | None = None) -> PolyData:
        """The mesh for pyvista, with quantities by facet: ``.plot(scalars=...)`` shows it in three dimensions.

        Parameters
        ----------
        fields : mapping of str to Quantity, shape (f,), optional
            As in `write`.

        Returns
        -------
        pyvista.PolyData
            Coordinates in m, principal frame.

        Raises
        ------
        MissingExtra
            pyvista is not installed.
        """
        try:
            from pyvista import PolyData
        except ImportError:
            raise MissingExtra("pyvista", "pyvista", "a mesh in three dimensions") from None
        mesh = PolyData.from_regular_faces(self.vertices.value, self.facets.tolist())
        for name, values in facet_fields(fields or {}, len(self.facets)).items():
            mesh.cell_data[name] = values
        return mesh

    def __repr__(self) -> str:
        return f"<Shape {len(self.facets)} facets, {brief(self.ellipsoid())} (equivalent semi-axes)>"

    @cached_property
    def _crosses(self) -> Array:
        a, b, c = (self.vertices.value[self.facets[:, i]] for i in range(3))
        return np.cross(b - a, c - a)

    @cached_property
    def _dyads(self) -> Array:
        """``n_A (x) n_A^e + n_B (x) n_B^e`` of each edge; ``n^e``: outward normal of the edge in the facet."""
        x = self.vertices.value
        along = x[self._edges[:, 1]] - x[self._edges[:, 0]]
        along /= np.linalg.norm(along, axis=1)[:, None]
        left, right = self.normals[self._sides[:, 0]], self.normals[self._sides[:, 1]]
        outward_left, outward_right = np.cross(along, left), np.cross(right, along)
        return np.einsum("ni,nj->nij", left, outward_left) + np.einsum("ni,nj->nij", right, outward_right)


def length_unit(unit: str | u.UnitBase, name: str = "unit") -> u.UnitBase:
    """A unit of length, from its name or as it is.

    Raises
    ------
    InvalidInput, UnitMismatch
    """
    try:
        found = u.Unit(unit)
    except (TypeError, ValueError):
        raise InvalidInput(name, unit, "a unit of length, such as m or km") from None
    if not found.is_equivalent(u.m):
        raise UnitMismatch(name, found, "a unit of length, such as m or km")
    return found


def _principal_axes(second: Array) -> Array:
    """Right-handed principal axes as columns, largest second moment first."""
    _, axes = np.linalg.eigh(second)
    axes = axes[:, ::-1].copy()
    # of the two directions of an axis, the one closer to the axis of the file
    for i in range(2):
        k = np.argmax(np.abs(axes[:, i]))
        if axes[k, i] < 0.0:
            axes[:, i] = -axes[:, i]
    axes[:, 2] = np.cross(axes[:, 0], axes[:, 1])
    return axes
