"""Every public result as table, data frame, dictionary, HTML and plot, and through every file format."""

import json
from dataclasses import fields
from importlib import import_module
from pathlib import Path

import astropy.units as u
import jsonschema
import matplotlib
import numpy as np
import pytest
from astropy.table import QTable

import flybystab as fs
from flybystab import saving
from flybystab.errors import InvalidInput
from flybystab.flybys.outcome_map import target_map
from flybystab.flybys.spin_forecast import spin_forecast
from flybystab.flybys.survival import Survival
from flybystab.io.schema import schema
from flybystab.tabular import Record, Results, Tabular

matplotlib.use("agg")

FORMATS = [".ecsv", ".parquet", ".json", ".nc"]


def body(period=6.0):
    return fs.Body([1400, 850, 750] * u.m, 2000 * u.kg / u.m**3, period * u.h)


def encounter(radii=2.2):
    return fs.Encounter.hyperbolic("earth", radii * fs.R_earth, 5 * u.km / u.s)


MAKERS = {
    "FlybyResult": lambda: fs.flyby(body(), encounter()),
    "FlybyMargin": lambda: fs.flyby_margin(body(), encounter()),
    "Equilibrium": lambda: fs.equilibrium(body()),
    "Stability": lambda: fs.stability(body()),
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
    return {c.__name__ for s in kind.__subclasses__() for c in (s, *s.__subclasses__())}


def assert_equal(a, b):
    """Exact, in value, unit and type."""
    if isinstance(a, u.Quantity):
        assert a.unit == b.unit
        np.testing.assert_array_equal(a.value, b.value)
    elif isinstance(a, np.ndarray):
        assert a.dtype.kind == b.dtype.kind
        np.testing.assert_array_equal(a, b)
    elif isinstance(a, tuple):
        for x, y in zip(a, b, strict=True):
            assert_equal(x, y)
    elif type(a).__name__ in saving.KNOWN:
        assert type(a) is type(b)
        for f in fields(a):
            assert_equal(getattr(a, f.name), getattr(b, f.name))
    else:
        assert a == b


def test_all_results_are_listed():
    for package in ("body", "encounter", "flybys", "population", "screening"):
        folder = Path(fs.__file__).parent / package
        for module in folder.glob("[a-z]*.py"):
            import_module(f"flybystab.{package}.{module.stem}")
    assert subclasses(Results) - {"Record", "Tabular"} == set(MAKERS)


@pytest.mark.parametrize("suffix", FORMATS)
@pytest.mark.parametrize("name", MAKERS)
def test_saved_and_read(results, name, suffix, tmp_path):
    result = results(name)
    path = result.save(tmp_path / f"x{suffix}")
    found = type(result).read(path)
    if isinstance(result, Tabular):
        for f in fields(result):
            assert_equal(getattr(result, f.name), getattr(found, f.name))
        assert repr(found) == repr(result)
    else:
        table = result.to_table()
        assert found.meta == table.meta
        assert found.colnames == table.colnames
        for column in table.colnames:
            ours, theirs = (
                x if isinstance(x, u.Quantity) else np.asarray(x) for x in (table[column], found[column])
            )
            assert_equal(ours, theirs)


@pytest.mark.parametrize("name", MAKERS)
def test_forms(results, name):
    result = results(name)
    table, frame = QTable(result), result.to_pandas()
    assert table.meta["result"] == name
    assert len(table) == len(frame) == (1 if isinstance(result, Record) else len(result))
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
