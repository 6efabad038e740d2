"""Polyhedral shapes: mass properties, checks, files and gravity against closed forms and a second implementation."""

import gzip
import re
import sys

import astropy.units as u
import numpy as np
import pytest

import flybystab as fs
from flybystab.body.mesh import mass_properties
from flybystab.constants import G
from flybystab.core.ellipsoid.potential import gravity_coefficients
from flybystab.errors import InvalidInput, MissingExtra, UnitMismatch

AXES = np.array([1400.0, 850.0, 750.0])

#: A box of 1 x 2 x 3 m with a corner at the origin.
BOX = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 2.0) for z in (0.0, 3.0)])
QUADS = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
BOX_FACETS = np.array([t for a, b, c, d in QUADS for t in ((a, b, c), (a, c, d))])


def box():
    return fs.Shape(BOX * u.m, BOX_FACETS)


def test_box_has_the_mass_properties_of_a_box():
    shape = box()
    assert shape.volume.to_value(u.m**3) == pytest.approx(6.0, rel=1e-14)
    assert shape.area.to_value(u.m**2) == pytest.approx(22.0, rel=1e-14)
    assert shape.origin.to_value(u.m) == pytest.approx([0.5, 1.0, 1.5], rel=1e-14)
    # J/m = (b^2 + c^2)/12, smallest about the longest side
    assert shape.inertia.value == pytest.approx([5 / 12, 10 / 12, 13 / 12], rel=1e-13)
    # equal inertia ratios: a_i^2/5 proportional to side^2/12; equal volume
    sides = np.array([3.0, 2.0, 1.0])
    expected = sides * np.cbrt(6.0 / (4.0 / 3.0 * np.pi * 6.0))
    assert shape.ellipsoid().value == pytest.approx(expected, rel=1e-13)
    # the principal frame leads back to the file
    back = shape.vertices.value @ shape.rotation.T + shape.origin.value
    assert back == pytest.approx(BOX, abs=1e-14)
    assert np.linalg.det(shape.rotation) == pytest.approx(1.0)


def test_ellipsoid_comes_back_at_second_order_in_the_facet_size():
    errors = []
    for facets in (1000, 4000):
        shape = fs.Shape.from_ellipsoid(AXES * u.m, facets=facets)
        exact = 4 / 3 * np.pi * AXES.prod()
        lost = 1.0 - shape.volume.value / exact
        assert lost == pytest.approx(11.6 / facets, rel=0.05)
        errors.append(np.abs(shape.ellipsoid().value / AXES - 1.0).max())
    assert errors[1] < 1.2e-3
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.35)


def test_mass_properties_are_those_of_trimesh():
    trimesh = pytest.importorskip("trimesh")
    shape = fs.Shape.perturbed(AXES * u.m, amplitude=0.1, seed=3, facets=1000)
    points = shape.vertices.value + np.array([10.0, -20.0, 30.0])
    other = trimesh.Trimesh(points, shape.facets, process=False)
    ours = mass_properties(points, np.asarray(shape.facets))
    assert ours.volume == pytest.approx(other.volume, rel=1e-12)
    assert ours.centre == pytest.approx(other.center_mass, rel=1e-9)
    inertia = np.trace(ours.second_moment) * np.eye(3) - ours.second_moment
    assert inertia == pytest.approx(other.moment_inertia, rel=1e-9, abs=1e-9 * inertia.max())


def test_scaling():
    shape = box().scaled(diameter=340 * u.m)
    assert 2 * shape.mean_radius.to_value(u.m) == pytest.approx(340.0, rel=1e-13)
    assert box().scaled(volume=48 * u.m**3).area.value == pytest.approx(88.0, rel=1e-13)
    with pytest.raises(InvalidInput, match="either diameter or volume"):
        box().scaled()


def test_contact_binary_of_equal_spheres_has_the_volume_of_their_union():
    r, depth = 100.0, 0.3
    sphere = [r, r, r] * u.m
    shape = fs.Shape.contact_binary(sphere, sphere, overlap=depth, facets=20_000)
    h = 0.5 * depth * r  # height of each of the two caps that make the lens
    union = 2 * 4 / 3 * np.pi * r**3 - 2 * np.pi * h**2 * (3 * r - h) / 3
    assert shape.volume.value == pytest.approx(union, rel=3e-3)
    assert np.ptp(shape.vertices.value[:, 0]) == pytest.approx(4 * r - depth * r, rel=2e-3)


def test_body_of_a_shape():
    shape = fs.Shape.from_ellipsoid(AXES * u.m)
    body = fs.Body.from_shape(shape, density=2 * u.g / u.cm**3, spin_period=6 * u.h)
    assert body.axes == pytest.approx(AXES, rel=1e-3)
    assert body.volume.value == pytest.approx(shape.volume.value, rel=1e-12)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        # without facet 0 its neighbours 1, 5 and 11 are open: 0, 4 and 10 of those left
        (lambda v, f: (v, f[1:]), r"numbers 0, 4, 10 \(from 0\).*open edge"),
        (lambda v, f: (v, np.vstack([f[:1, ::-1], f[1:]])), r"numbers 0.*oriented opposite"),
        (lambda v, f: (v, np.vstack([f, f[:1]])), r"numbers 0.*share an edge with more"),
        (lambda v, f: (v * [1, 1, 0], f), "a solid body"),
        (lambda v, f: (v, f + 1), "numbered from 0 to 7"),
        (lambda v, f: (v[:, :2], f), "shape"),
        (lambda v, f: (v, f.astype(float)), "whole numbers"),
    ],
)
def test_bad_meshes_are_named(change, message):
    vertices, facets = change(BOX, BOX_FACETS)
    with pytest.raises(InvalidInput, match=message):
        fs.Shape(vertices * u.m, facets)


def test_a_surface_turned_inside_out_is_turned_back():
    shape = fs.Shape(BOX * u.m, BOX_FACETS[:, ::-1])
    assert np.all(np.einsum("ni,ni->n", shape.normals, shape.centroids.value) > 0)


def test_self_intersection_is_found_and_named():
    sphere = fs.Shape.from_ellipsoid([1.0, 1.0, 1.0] * u.m, facets=200)
    points = sphere.vertices.value.copy()
    k = int(np.argmax(points[:, 0]))
    points[k] = [-3.0, 0.0, 0.0]  # pulled through the opposite side
    with pytest.raises(InvalidInput, match="do not intersect") as refused:
        fs.Shape(points * u.m, sphere.facets)
    named = {int(x) for x in re.search(r"numbers ([\d, ]+)", str(refused.value))[1].split(",") if x.strip()}
    # the facets about the vertex pierce others: those named are among the two groups
    about = set(np.flatnonzero((sphere.facets == k).any(axis=1)).tolist())
    assert named & about
    opposite = set(np.flatnonzero(sphere.centroids.value[:, 0] < 0.0).tolist())
    assert named <= about | opposite


def test_units_are_needed():
    with pytest.raises(UnitMismatch):
        fs.Shape(BOX, BOX_FACETS)


def _obj(v, f):
    return "".join(f"v {x} {y} {z}\n" for x, y, z in v) + "".join(
        f"f {a}//1 {b}//1 {c}//1\n" for a, b, c in f + 1
    )


def _damit(v, f):
    return (
        f"{len(v)} {len(f)}\n"
        + "".join(f"{x} {y} {z}\n" for x, y, z in v)
        + "".join(f"3\n{a} {b} {c}\n" for a, b, c in f + 1)
    )


def _tab(v, f):
    rows = [f"{i + 1:6d} {x:.6f} {y:.6f} {z:.6f}" for i, (x, y, z) in enumerate(v)]
    rows += [f"{i + 1:6d} {a} {b} {c}" for i, (a, b, c) in enumerate(f + 1)]
    return f"{len(v)} {len(f)}\n" + "\n".join(rows) + "\n"


def _two_counts(v, f):
    _, *rows = _tab(v, f).splitlines()
    return "\n".join([str(len(v)), *rows[: len(v)], str(len(f)), *rows[len(v) :]])


@pytest.mark.parametrize("write", [_obj, _damit, _tab, _two_counts])
@pytest.mark.parametrize("packed", [False, True])
def test_text_formats_are_known_by_content(tmp_path, write, packed):
    path = tmp_path / "shape.dat"
    data = write(BOX, BOX_FACETS).encode()
    path.write_bytes(gzip.compress(data) if packed else data)
    shape = fs.Shape.read(path, unit=u.km)
    assert shape.volume.to_value(u.km**3) == pytest.approx(6.0, rel=1e-12)


@pytest.mark.parametrize("kind", ["stl", "ply", "obj"])
def test_formats_of_trimesh(tmp_path, kind):
    trimesh = pytest.importorskip("trimesh")
    path = tmp_path / f"shape.{kind}"
    trimesh.Trimesh(BOX, BOX_FACETS, process=False).export(path)
    assert fs.Shape.read(path, unit=u.m).volume.value == pytest.approx(6.0, rel=1e-6)


def test_icq_cube(tmp_path):
    """Six grids of 3 x 3 vertices over a cube of side 2, edges stored twice."""
    grid = np.linspace(-1.0, 1.0, 3)
    faces = []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            for s in grid:
                for t in grid[:: int(sign)]:
                    point = np.empty(3)
                    point[axis], point[(axis + 1) % 3], point[(axis + 2) % 3] = sign, s, t
                    faces.append(point)
    text = "2\n" + "\n".join(" ".join(f"{x:.5f}" for x in p) for p in faces) + "\n"
    path = tmp_path / "cube.txt"
    path.write_text(text)
    shape = fs.Shape.read(path, unit=u.m)
    assert shape.volume.value == pytest.approx(8.0, rel=1e-12)
    assert len(shape.facets) == 48


def test_vtk_holds_the_mesh_and_its_fields(tmp_path):
    shape = box()
    shape.write(tmp_path / "box.vtk", {"area": shape.facet_area})
    lines = (tmp_path / "box.vtk").read_text().splitlines()
    k = lines.index("POINTS 8 double")
    assert np.loadtxt(lines[k + 1 : k + 9]) == pytest.approx(shape.vertices.value)
    k = lines.index("SCALARS area_m2 double 1")
    assert sum(map(float, lines[k + 2 : k + 14])) == pytest.approx(22.0)
    shape.write(tmp_path / "box.ply", {"area": shape.facet_area})
    again = fs.Shape.read(tmp_path / "box.ply", unit=u.m)
    assert again.volume.value == pytest.approx(shape.volume.value, rel=1e-9)
    body = (tmp_path / "box.ply").read_text().split("end_header\n")[1].splitlines()
    assert "property double area_m2" in (tmp_path / "box.ply").read_text()
    assert sum(float(line.split()[4]) for line in body[8:]) == pytest.approx(22.0)
    shape.write(tmp_path / "bare.ply")
    assert fs.Shape.read(tmp_path / "bare.ply", unit=u.m).area.value == pytest.approx(22.0)
    with pytest.raises(InvalidInput, match="one for each facet"):
        shape.write(tmp_path / "box.vtk", {"area": shape.facet_area[:5]})
    with pytest.raises(InvalidInput, match=r"\.vtk"):
        shape.write(tmp_path / "box.stl")


def test_pyvista_reads_the_fields(tmp_path):
    pyvista = pytest.importorskip("pyvista")
    shape = box()
    shape.write(tmp_path / "box.vtk", {"area": shape.facet_area})
    mesh = pyvista.read(tmp_path / "box.vtk")
    assert mesh.cell_data["area_m2"] == pytest.approx(shape.facet_area.value, rel=1e-8)
    assert mesh.volume == pytest.approx(6.0, rel=1e-6)
    direct = shape.to_pyvista({"area": shape.facet_area})
    assert direct.cell_data["area_m2"] == pytest.approx(shape.facet_area.value)
    assert direct.volume == pytest.approx(6.0)
    with pytest.raises(InvalidInput, match="one for each facet"):
        shape.to_pyvista({"area": shape.facet_area[:5]})


def test_pyvista_is_an_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyvista", None)
    with pytest.raises(MissingExtra, match="pyvista"):
        box().to_pyvista()


@pytest.mark.parametrize("text", ["", "hello world\n", "4 4\n0 0 0\n1 0 0\n", "v 0 0 0\nv 1 0 0\nf 1 2 3\n"])
def test_files_that_are_no_mesh(tmp_path, text):
    path = tmp_path / "x.obj"
    path.write_text(text)
    with pytest.raises(InvalidInput):
        fs.Shape.read(path, unit=u.m)
    with pytest.raises(InvalidInput, match="a readable file"):
        fs.Shape.read(tmp_path / "absent", unit=u.m)


def test_gravity_is_that_of_another_implementation(capfd):
    library = pytest.importorskip("polyhedral_gravity")
    shape = fs.Shape.perturbed(AXES * u.m, amplitude=0.1, seed=1, facets=400)
    points = np.array([[2500.0, 100.0, -50.0], [100.0, 2000.0, 900.0], [50.0, 40.0, 30.0]])
    potential, acceleration, gradient = shape.gravity(points * u.m, 2000 * u.kg / u.m**3)
    solid = library.Polyhedron(
        (shape.vertices.value, shape.facets), 2000.0, integrity_check=library.PolyhedronIntegrity.DISABLE
    )
    constant = 6.67430e-11 / G
    for k, (phi, g, t) in enumerate(library.evaluate(solid, points)):
        assert potential[k].value == pytest.approx(phi / constant, rel=1e-9)
        assert acceleration[k].value == pytest.approx(np.array(g) / constant, rel=1e-7, abs=1e-12)
        xx, yy, zz, xy, xz, yz = t
        tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) / constant
        assert gradient[k].value == pytest.approx(tensor, rel=1e-6, abs=1e-14)


def test_gravity_inside_and_outside_obeys_poisson_and_is_the_gradient():
    shape = fs.Shape.perturbed(AXES * u.m, amplitude=0.08, seed=5, facets=600)
    rho = 1500 * u.kg / u.m**3
    h = 1.0
    for x, inside in (([300.0, 100.0, -200.0], True), ([2200.0, 300.0, 100.0], False)):
        stencil = np.array(x) + h * np.array([[0, 0, 0], *np.eye(3), *-np.eye(3)])
        potential, acceleration, gradient = shape.gravity(stencil * u.m, rho)
        numeric = (potential.value[1:4] - potential.value[4:7]) / (2 * h)
        assert acceleration.value[0] == pytest.approx(numeric, rel=1e-5, abs=1e-10)
        jacobian = (acceleration.value[1:4] - acceleration.value[4:7]) / (2 * h)
        assert gradient.value[0] == pytest.approx(jacobian, rel=1e-4, abs=1e-12)
        source = -4 * np.pi * G * 1500.0 if inside else 0.0
        assert np.trace(gradient.value[0]) == pytest.approx(
            source, abs=1e-10 * 4 * np.pi * G * 1500.0 + 1e-17
        )


def test_gravity_at_the_facets_of_an_ellipsoid_is_the_closed_form():
    shape = fs.Shape.from_ellipsoid(AXES * u.m, facets=4000)
    _, acceleration, _ = shape.gravity(shape.centroids, 2000 * u.kg / u.m**3)
    a = np.array(gravity_coefficients(*(AXES**2)))
    exact = -2 * np.pi * G * 2000.0 * a * shape.centroids.value
    error = np.linalg.norm(acceleration.value - exact, axis=1) / np.linalg.norm(exact, axis=1)
    assert np.median(error) < 2e-3
    assert error.max() < 1e-2


@pytest.mark.parametrize("facets", [2**70, 1_000_001])
def test_shapes_of_too_many_facets_are_refused(facets):
    with pytest.raises(InvalidInput, match="at most 1,000,000"):
        fs.Shape.from_ellipsoid(AXES * u.m, facets=facets)
