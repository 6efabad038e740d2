"""Every public result as table, data frame, dictionary, HTML and plot, and through every file format."""

import json
from dataclasses import fields, is_dataclass
from importlib import import_module
from inspect import isfunction
from pathlib import Path
from typing import get_type_hints

import astropy.units as u
import jsonschema
import matplotlib
import numpy as np
import pandas
import pytest
from astropy.table import QTable, Row, Table
from astropy.time import Time

import flybystab as fs
from flybystab import saving
from flybystab.body.recovery import pushed
from flybystab.encounter.linear_target_plane import LinearPlane
from flybystab.errors import InvalidInput
from flybystab.flybys.outcome_map import target_map
from flybystab.flybys.spin_forecast import spin_forecast
from flybystab.flybys.survival import Survival
from flybystab.io.schema import schema
from flybystab.tabular import Collection, Results, Tabular

matplotlib.use("agg")

FORMATS = [".ecsv", ".parquet", ".json", ".nc"]


def body(period=6.0):
    return fs.Body([1400, 850, 750] * u.m, 2000 * u.kg / u.m**3, period * u.h)


def encounter(radii=2.2):
    return fs.Encounter.hyperbolic("earth", radii * fs.R_earth, 5 * u.km / u.s)


ROUGH = fs.Shape.perturbed([1400, 850, 750] * u.m, amplitude=0.05, seed=2, facets=320)
SOLID = fs.Body.from_shape(ROUGH, density=2000 * u.kg / u.m**3, spin_period=6 * u.h)


def orbits():
    return [fs.Asteroid.from_catalogue(name).orbit for name in ("Apophis", "Eros")]


def rates():
    return fs.disruption_rates(orbits(), ["earth"], samples=16, seed=1)


#: One result of every public class.
MAKERS = {
    "FlybyResult": lambda: fs.flyby(body(), encounter(), robustness=True),
    "FlybyMargin": lambda: fs.flyby_margin(body(), encounter()),
    "FlybyError": lambda: fs.flyby(body(), encounter()).error,
    "Robustness": lambda: fs.flyby(body(), encounter(), robustness=True).robustness,
    "VerdictMargins": lambda: fs.flyby(body(), encounter()).margins,
    "GrainsOutcome": lambda: fs.flyby(body(), encounter(1.3), grains=30, seeds=2, model="grains").grains,
    "GrainsRun": lambda: fs.flyby(body(), encounter(1.3), grains=30, seeds=1, model="grains").grains.runs[0],
    "GrainsCourse": lambda: (
        fs.flyby(body(), encounter(1.3), grains=30, seeds=1, model="grains").grains.runs[0].course
    ),
    "Equilibrium": lambda: fs.equilibrium(body()),
    "Stability": lambda: fs.stability(body()),
    "Push": lambda: fs.push(body(), np.diag([1.0, 0.0, -1.0]), np.linspace(0.0, 0.2, 5)),
    "SpinState": lambda: fs.stability(body()).spin_state,
    "Recovery": lambda: pushed(body(), np.diag([1.0, 0.0, -1.0]), 1e10 * u.J),
    "RecoveryLimit": lambda: fs.recovery(body(), directions=2, refinements=1, searches=2, precision=0.5),
    "Requirements": lambda: fs.requirements(body(), density_sigma=200 * u.kg / u.m**3, samples=5),
    "CohesionBounds": lambda: fs.cohesion_bounds(body()),
    "ElasticStress": lambda: fs.elastic_stress(body()),
    "YieldRegion": lambda: fs.elastic_stress(body()).yield_region(),
    "ElasticChange": lambda: fs.elastic_change(body(), encounter()),
    "SurfaceSlopes": lambda: fs.shape_slopes(ROUGH, SOLID),
    "SlopeChange": lambda: fs.surface_change(SOLID, encounter(3.0), shape=ROUGH),
    "SurfaceHistory": lambda: fs.surface_history(SOLID, encounter(3.0), shape=ROUGH, instants=7),
    "RocheLobe": lambda: fs.roche_lobe(ROUGH, SOLID),
    "LobeHistory": lambda: fs.lobe_history(SOLID, encounter(3.0), shape=ROUGH),
    "ShapeSpin": lambda: fs.shape_spin(SOLID, encounter(3.0), shape=ROUGH),
    "RotationState": lambda: fs.shape_spin(SOLID, encounter(3.0), shape=ROUGH).after,
    "RefreshDistance": lambda: fs.refresh_distance(SOLID, ROUGH, attitudes=1),
    "EncounterDistribution": lambda: fs.encounter_distribution(
        orbits()[0], "earth", Time("2029-04-13", scale="tdb"), n=3
    ),
    "LinearPlane": lambda: LinearPlane(
        [1, 2] * u.km, np.eye(2) * u.km**2, 3 * u.km, 4 * u.s, np.float64(0.5), np.nan
    ),
    "StateTransition": lambda: orbits()[0].state_transition("2029-03-01"),
    "EncounterRates": lambda: fs.encounter_rates(orbits(), "earth"),
    "DisruptionRates": rates,
    "Freshness": lambda: fs.freshness(
        fs.Asteroid.from_catalogue("Apophis"), {"earth": 30000 * u.km}, span=1 * u.yr
    ),
    "History": lambda: fs.flyby(body(), encounter()).history,
    "FlybyTable": lambda: fs.flyby_many([body(), body(1.5)], [encounter(3.0), encounter(0.9)]),
    "SpinSample": lambda: fs.spin_sample(body(), encounter(3.0), n=4, seed=3),
    "SpinForecast": lambda: spin_forecast(body(), encounter(3.0), n=3),
    "CriticalValues": lambda: fs.critical(
        body(), encounter(3.0), "friction_angle", phases=2, tolerance=0.1
    ),
    "BinarySample": lambda: fs.binary_flyby(body(), encounter(3.0), 4 * u.km, samples=3),
    "OutcomeMap": lambda: fs.outcome_map(body(), [2, 3, 9] * fs.R_earth, [1, 9] * u.km / u.s, phases=4),
    "TargetMap": lambda: target_map(body(), 5 * u.km / u.s, [2, 3, 9] * fs.R_earth, 4),
    "Survival": lambda: Survival(
        verdict=np.array(["INTACT", "FAILED", "IMPACT"]),
        near=np.array([True, False, True]),
        margin=[np.inf, np.nan, -np.inf] * u.deg,
        failure=np.array(["", '=1+2, "quoted"', ""]),
        bounded=np.array([False, True, False]),
    ),
}  # fmt: skip


@pytest.fixture(scope="module")
def results():
    made = {}

    def get(name):
        if name not in made:
            made[name] = MAKERS[name]()
        return made[name]

    return get


def subclasses(kind):
    direct = kind.__subclasses__()
    return {c.__name__ for c in direct}.union(*(subclasses(c) for c in direct))


def assert_equal(a, b):
    """Exact, in value, unit and type, through all fields."""
    assert type(a) is type(b) or (np.isscalar(a) and np.isscalar(b) and not isinstance(a, str)), (a, b)
    if isinstance(a, u.Quantity):
        assert a.unit == b.unit
        assert a.value.dtype == b.value.dtype if isinstance(a.value, np.ndarray) else True
        np.testing.assert_array_equal(a.value, b.value)
    elif isinstance(a, np.ndarray):
        assert a.dtype.kind == b.dtype.kind
        assert a.shape == b.shape
        np.testing.assert_array_equal(a, b)
    elif isinstance(a, Table):
        assert a.colnames == b.colnames
        for name in a.colnames:
            assert_equal(a[name], b[name])
    elif isinstance(a, Row):
        for name in a.colnames:
            assert_equal(a[name], b[name])
    elif isinstance(a, Time):
        assert a.scale == b.scale
        assert np.all(a == b)
    elif isinstance(a, tuple | list):
        assert len(a) == len(b)
        for x, y in zip(a, b, strict=True):
            assert_equal(x, y)
    elif isinstance(a, dict):
        assert a.keys() == b.keys()
        for key, value in a.items():
            assert_equal(value, b[key])
    elif is_dataclass(a):
        for f in fields(a):
            assert_equal(getattr(a, f.name), getattr(b, f.name))
    elif type(a).__name__ == "CubicHermiteSpline":
        assert_equal(a.c, b.c)
        assert_equal(a.x, b.x)
    else:
        assert a == b or (a != a and b != b)


def returned(function):
    """Class that a public function returns."""
    try:
        return get_type_hints(function).get("return")
    except NameError:  # a type that is imported for type checking only
        return None


#: Public classes that are arguments and no results.
ARGUMENTS = {"Asteroid", "Body", "Covariance", "Encounter", "Material", "Orbit", "Pile", "PileState", "Shape"}


def test_every_public_class_of_results_has_the_methods():
    public = [getattr(fs, name) for name in fs.__all__]
    found = {x for x in public if isinstance(x, type) and is_dataclass(x)}
    found |= {r for f in public if isfunction(f) and is_dataclass(r := returned(f))}
    assert len(found) > 40
    results = {x for x in found if x.__name__ not in ARGUMENTS}
    assert {x.__name__ for x in results if not issubclass(x, Results)} == set()
    assert {x.__name__ for x in results} <= set(MAKERS)


def test_all_results_are_listed():
    for package in ("body", "encounter", "flybys", "orbit", "population", "screening"):
        folder = Path(fs.__file__).parent / package
        for module in folder.glob("[a-z]*.py"):
            import_module(f"flybystab.{package}.{module.stem}")
    assert subclasses(Results) - {"Record", "Tabular", "Collection"} == set(MAKERS)


@pytest.mark.parametrize("suffix", FORMATS)
@pytest.mark.parametrize("name", MAKERS)
def test_saved_and_read(results, name, suffix, tmp_path):
    result = results(name)
    path = result.save(tmp_path / f"x{suffix}")
    found = type(result).read(path)
    assert_equal(found, result)
    assert repr(found) == repr(result)
    ours, theirs = result.to_table(), found.to_table()
    assert theirs.meta == ours.meta
    for column in ours.colnames:
        assert_equal(ours[column], theirs[column])


@pytest.mark.parametrize("name", MAKERS)
def test_forms(results, name):
    result = results(name)
    table, frame = QTable(result), result.to_pandas()
    if isinstance(result, Tabular | Collection):
        pandas.testing.assert_frame_equal(pandas.DataFrame(result), frame)
    assert table.meta["result"] == name
    rows = len(result) if isinstance(result, Collection) else 1
    assert len(table) == len(frame) == (np.prod(result._grid()) if isinstance(result, Tabular) else rows)
    assert table.colnames
    assert not any(part.startswith("_") for part in table.colnames)
    json.dumps(result.to_dict(), allow_nan=False)
    json.dumps(table.meta, allow_nan=False)
    page = result._repr_html_()
    assert page.count("<th>") < 40
    assert page.count("<tr>") <= 30
    assert "&lt;" + name in page


@pytest.mark.parametrize("name", MAKERS)
def test_json_follows_its_schema(results, name, tmp_path):
    found = json.loads(results(name).save(tmp_path / "x.json").read_text())
    jsonschema.validate(found, schema(found["schema"]), jsonschema.Draft202012Validator)


@pytest.mark.parametrize(
    "name",
    [
        "FlybyResult",
        "History",
        "FlybyTable",
        "SpinSample",
        "CriticalValues",
        "OutcomeMap",
        "TargetMap",
        "Survival",
        "Stability",
        "Requirements",
        "SurfaceSlopes",
        "SlopeChange",
        "SurfaceHistory",
        "EncounterDistribution",
        "EncounterRates",
        "DisruptionRates",
        "SpinForecast",
        "BinarySample",
        "GrainsOutcome",
        "GrainsCourse",
        "GrainsRun",
        "LinearPlane",
        "Push",
    ],
)
def test_plots(results, name):
    import matplotlib.pyplot as plt

    axes = np.atleast_1d(results(name).plot())
    assert all(a.has_data() for a in axes)
    assert axes[-1].get_xlabel()
    plt.close("all")


def test_without_a_figure(results):
    with pytest.raises(InvalidInput, match="a result that has a figure"):
        results("Equilibrium").plot()


def test_csv_quotes_formulas(results, tmp_path):
    text = results("Survival").save(tmp_path / "x.csv").read_text().splitlines()
    assert text[0] == "verdict,near,margin_deg,failure,bounded"
    assert text[2] == 'FAILED,False,nan,"=1+2, ""quoted""",True'


def test_maps_as_data_sets(results):
    outcomes = results("OutcomeMap")
    data = outcomes.to_xarray()
    assert dict(data.sizes) == {"periapsis": 3, "v_inf": 2, "phase": 4}
    assert data["v_inf"].attrs["units"] == "km / s"
    np.testing.assert_array_equal(data["verdict"].values.astype(str), outcomes.verdict)
    row = outcomes.to_table()[4 * 2 + 4 + 1]
    assert (row["periapsis"], row["v_inf"]) == (3 * fs.R_earth, 9 * u.km / u.s)
    assert row["phase"] == 45 * u.deg
    assert row["verdict"] == outcomes.verdict[1, 1, 1]


def test_refused_files(results, tmp_path):
    sample = results("SpinSample")
    path = sample.save(tmp_path / "x.json")
    with pytest.raises(InvalidInput, match="overwrite=True"):
        sample.save(path)
    sample.save(path, overwrite=True)
    with pytest.raises(InvalidInput, match="a saved History, not SpinSample"):
        type(results("History")).read(path)
    with pytest.raises(InvalidInput, match="ends in"):
        sample.save(tmp_path / "x.xlsx")
    path.write_text('{"schema": "table/1"}')
    with pytest.raises(InvalidInput, match="a file written by save"):
        type(sample).read(path)
    cut = sample.save(tmp_path / "y.ecsv")
    cut.write_text("\n".join(cut.read_text().splitlines()[:-1]) + "\n")
    with pytest.raises(InvalidInput, match="cut off"):
        type(sample).read(cut)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["x.json", "y.ecsv"]


def test_metadata_of_unknown_classes_is_refused():
    with pytest.raises(KeyError):
        saving.decoded({"class": "Popen", "args": ["true"]})


def test_classes_that_were_moved_are_read_under_their_former_address():
    found = fs.push(body(), np.diag([1.0, -0.5, -0.5]), [0.01, 0.02])
    text = json.dumps(saving.encoded(found))
    assert "flybystab.body.perturbation:Push" in text
    old = json.loads(text.replace("flybystab.body.perturbation:", "flybystab.body.stability:"))
    restored = saving.decoded(old)
    assert type(restored) is type(found)
    assert np.array_equal(restored.loss.barrier, found.loss.barrier)
    with pytest.raises(KeyError):  # a class of another package that the module imports
        saving.decoded({"class": "flybystab.body.stability:Quantity"})
