"""The option --shape: text, documents, maps, report, scenario, screening."""

import json

import astropy.units as u
import numpy as np
import pytest
from astropy.time import Time

import flybystab as fs
from flybystab.cli.main import main
from flybystab.errors import InvalidInput, UnitMismatch

SHAPE = fs.Shape.perturbed([217.0, 154.0, 147.0] * u.m, amplitude=0.02, seed=2, facets=300)
FLYBY = ("flyby", "Apophis", "--date", "2029-04-13", "--attitudes", "4")


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    """An OBJ file in km."""
    path = tmp_path_factory.mktemp("shape") / "model.obj"
    lines = [f"v {x:.9f} {y:.9f} {z:.9f}" for x, y, z in SHAPE.vertices.to_value(u.km)]
    lines += [f"f {a} {b} {c}" for a, b, c in SHAPE.facets + 1]
    path.write_text("\n".join(lines) + "\n")
    return path


def run(capsys, *words):
    status = main([str(w) for w in words])
    captured = capsys.readouterr()
    return status, captured.out, captured.err


def test_flyby_of_a_shape(capsys, model, tmp_path):
    mesh = tmp_path / "fields.vtk"
    status, out, err = run(capsys, *FLYBY, "--shape", model, "--map", mesh, "--json")
    assert status == 0, err
    found = json.loads(out)
    assert found["surface"]["facets"] == len(SHAPE.facets)
    assert found["semi_axes_m"] == pytest.approx(SHAPE.ellipsoid().value, rel=1e-6)
    assert 0.3 < found["surface"]["largest_rise_deg"] < 3.0
    assert found["surface"]["share_rising_by_deg"]["0.5"] >= found["surface"]["share_rising_by_deg"]["1"]
    text = mesh.read_text()
    assert "slope_closest_deg" in text
    assert f"POLYGONS {len(SHAPE.facets)}" in text


def test_flyby_of_a_shape_as_text_with_a_picture(capsys, model, tmp_path):
    picture = tmp_path / "map.png"
    status, out, err = run(capsys, *FLYBY, "--shape", model, "--shape-unit", "catalogue", "--map", picture)
    assert status == 0, err
    assert "mean radius 170 m" in out  # the catalogue's
    assert "largest change of slope" in out
    assert picture.read_bytes()[:4] == b"\x89PNG"


def test_slopes_at_rest(capsys, model):
    status, out, err = run(capsys, "stability", "Apophis", "--shape", model, "--json")
    assert status == 0, err
    found = json.loads(out)["surface"]
    assert 0.0 < found["slope_deg"]["median"] < found["slope_deg"]["most"] < 40.0
    assert "slopes at rest" in run(capsys, "stability", "Apophis", "--shape", model)[1]


def test_report_with_a_map(capsys, model, tmp_path):
    page = tmp_path / "apophis.html"
    words = ("report", *FLYBY[1:], "--samples", 1, "--shape", model, "--output", page)
    assert run(capsys, *words)[0] == 0
    text = page.read_text()
    assert "<h2>Surface</h2>" in text
    assert text.count("<img") == 4
    assert "equivalent ellipsoid of a polyhedron" in text


def test_scenario_with_a_shape(capsys, model, tmp_path):
    path = tmp_path / "shape.toml"
    model_copy = tmp_path / "model.obj"
    model_copy.write_text(model.read_text())
    body = 'shape = "model.obj"\nshape_unit = "km"\ndensity = "2 g / cm3"\nspin_period = "30 h"\n'
    encounter = '[encounter]\nperiapsis = "5.96 R_earth"\nv_inf = "5.84 km / s"\n'
    path.write_text("[body]\n" + body + encounter)
    status, out, err = run(capsys, "scenario", path, "--json")
    assert status == 0, err
    assert json.loads(out)["surface"]["facets"] == len(SHAPE.facets)
    path.write_text("[body]\n" + body.replace('shape_unit = "km"\n', "") + encounter)
    assert "shape_unit" in run(capsys, "scenario", path)[2]
    path.write_text("[body]\n" + body + 'semi_axes = "3, 2, 1 m"\n' + encounter)
    assert "body.semi_axes" in run(capsys, "scenario", path)[2]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--shape", "none.obj"), "none.obj"),
        (("--map", "x.png"), "--shape"),
        (("--shape-unit", "kg", "--shape", "MODEL"), "unit of length"),
        (("--shape-unit", "bananas", "--shape", "MODEL"), "unit of length"),
        (("--shape", "MODEL", "--map", "x.doc"), ".vtk"),
    ],
)
def test_wrong_options(capsys, model, words, message):
    status, _, err = run(capsys, *FLYBY, *(model if w == "MODEL" else w for w in words))
    assert status in (1, 2)
    assert message in err


def test_an_asteroid_with_a_shape_is_screened_by_its_equivalent_ellipsoid():
    plain = fs.Asteroid.from_catalogue("Apophis")
    shaped = plain.with_shape(SHAPE)
    assert shaped.body.axes == pytest.approx(SHAPE.ellipsoid().value, rel=1e-12)
    relative = [plain.quantity("semi_axis_a_sigma_m") / plain.semi_axes[0]]
    relative.append(shaped.quantity("semi_axis_a_sigma_m") / shaped.semi_axes[0])
    assert relative[1].value == pytest.approx(relative[0].value, rel=1e-12)
    table = fs.screen([shaped], "2029-04-01", "2029-05-01")
    attitude = shaped.attitude(0 * u.deg)
    encounter = fs.Encounter.from_orbit(shaped.orbit, "earth", Time("2029-04-13", scale="tdb"))
    result = fs.flyby(shaped.body, encounter, fs.periapsis_axes(encounter) @ attitude)
    margin = table["margin"][0].to_value(u.deg)
    assert margin == pytest.approx(result.margin.to_value(u.deg), abs=0.5)
    ordinary = fs.screen([plain], "2029-04-01", "2029-05-01")["margin"][0].to_value(u.deg)
    assert abs(margin - ordinary) > 0.01
    with pytest.raises(InvalidInput, match="Shape"):
        plain.with_shape(None)


def test_screening_of_a_shape_in_the_shell(capsys, model, tmp_path):
    span = ("--from", "2029-04-01", "--to", "2029-05-01", "--json")
    table = tmp_path / "shape.ecsv"
    status, out, err = run(capsys, "screen", "Apophis", *span, "--shape", model, "--output", table)
    assert status == 0, err
    shaped = fs.Asteroid.from_catalogue("Apophis").with_shape(SHAPE)
    expected = fs.screen([shaped], "2029-04-01", "2029-05-01")["margin"][0].to_value(u.deg)
    assert json.loads(out)["rows"][0]["margin_deg"] == pytest.approx(expected, abs=1e-3)
    words = ("screen", "Apophis", "Bennu", "--shape", model, "--output", tmp_path / "two.ecsv")
    assert "one asteroid" in run(capsys, *words)[2]


def test_bounds_on_the_material_of_a_shape(capsys, model):
    """The equivalent ellipsoid of the shape is longer than a sphere of its volume and needs more friction."""
    span = ("--from", "2029-04-01", "--to", "2029-05-01", "--within", "0.001", "--attitudes", "2", "--json")
    status, out, err = run(capsys, "infer", "Apophis", *span, "--shape", model)
    assert status == 0, err
    shaped = fs.Asteroid.from_catalogue("Apophis").with_shape(SHAPE)
    expected = fs.infer(shaped, attitudes=2)["friction_equilibrium"].to_value(u.deg)
    got = [row["friction_equilibrium_deg"] for row in json.loads(out)["rows"]]
    assert got == pytest.approx(expected, abs=1e-3)
    plain = fs.infer(fs.Asteroid.from_catalogue("Apophis"), attitudes=2)["friction_equilibrium"].to_value(
        u.deg
    )
    assert np.abs(expected - plain).max() > 0.01


def test_units_of_shapes_are_lengths(model):
    with pytest.raises(UnitMismatch, match="unit of length"):
        fs.Shape.read(model, unit=u.s)
    assert np.allclose(fs.Shape.read(model, unit="km").ellipsoid(), SHAPE.ellipsoid(), rtol=1e-6)
