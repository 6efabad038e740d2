"""Tables of encounters, verdicts and bounds: still QTables, with the methods of the other results."""

import json
import pickle
import re

import astropy.units as u
import jsonschema
import matplotlib
import numpy as np
import pytest
from astropy.table import QTable, join, vstack
from astropy.time import Time

import flybystab as fs
from flybystab.encoding import decoded, encoded
from flybystab.errors import InvalidInput, UnknownName
from flybystab.io.schema import schema
from flybystab.result_table import KNOWN_BY, SHOWN, ResultTable
from flybystab.screening.results import read_results

matplotlib.use("agg")

START, STOP = "2026-01-01", "2050-01-01"


@pytest.fixture(scope="module")
def tables():
    apophis = fs.Asteroid.from_catalogue("Apophis")
    days = Time(["2032-12-22", "2039-12-22"], scale="tdb")
    return {
        "encounters": fs.find_encounters(apophis, START, STOP, ["earth", "venus"], within=0.2 * u.au),
        "encounters with verdicts": fs.screen(["Apophis", "YORP"], START, STOP, within=0.1 * u.au, samples=8),
        "bounds on the material": fs.infer(
            apophis.body, [], densities=[1000, 2000] * u.kg / u.m**3, cohesions=[0, 1] * u.Pa
        ),
        "possible impacts": ResultTable(
            {"time": days, "sigma": [1.0, 2.0], "probability": [1e-3, 1e-6]}, meta={"planet": "earth"}
        ),
    }


KINDS = list(SHOWN)


def same(a, b):
    assert a.colnames == b.colnames
    for name in a.colnames:
        x, y = a[name], b[name]
        assert getattr(x, "unit", None) == getattr(y, "unit", None)
        assert x.info.description == y.info.description
        if isinstance(x, Time):
            assert np.all(abs((x - y).to_value(u.s)) < 1e-4)
        elif np.asarray(x).dtype.kind == "f":
            np.testing.assert_allclose(np.asarray(y), np.asarray(x), rtol=1e-15, err_msg=name)
        else:
            assert list(x) == list(y)


@pytest.mark.parametrize("kind", KINDS)
def test_operations_of_astropy_keep_the_class(tables, kind):
    table = tables[kind]
    assert isinstance(table, QTable)
    assert table.kind() == kind
    for made in (
        table[:1],
        table[[True] + [False] * (len(table) - 1)],
        table.copy(),
        vstack([table, table], metadata_conflicts="silent"),
        pickle.loads(pickle.dumps(table)),
        decoded(encoded(table)),
    ):
        assert type(made) is ResultTable
        assert made.kind() == kind
    assert type(table[table.colnames[:2]]) is ResultTable
    assert type(table.to_table()) is QTable
    assert table[0].table is table
    name = table.colnames[0]
    assert len(join(table[[name]], table[[name]], name)) >= 1


@pytest.mark.parametrize("suffix", [".ecsv", ".parquet", ".json", ".nc"])
@pytest.mark.parametrize("kind", KINDS)
def test_saved_and_read(tables, kind, suffix, tmp_path):
    table = tables[kind]
    path = table.save(tmp_path / f"x{suffix}")
    found = ResultTable.read(path)
    assert type(found) is ResultTable
    same(table, found)
    assert {k: v for k, v in found.meta.items() if k != "rows"} == dict(table.meta)
    if suffix in (".ecsv", ".parquet"):
        same(found, read_results(path))
    with pytest.raises(InvalidInput, match="overwrite=True"):
        table.save(path)
    if suffix == ".json":
        jsonschema.validate(json.loads(path.read_text()), schema("result/1"))


def test_a_table_without_rows(tables, tmp_path):
    empty = tables["encounters"][:0]
    assert "0 encounters" in empty._repr_html_()
    assert len(empty.to_pandas()) == 0
    for suffix in (".ecsv", ".json", ".parquet"):
        assert len(ResultTable.read(empty.save(tmp_path / f"x{suffix}"))) == 0
    assert empty.plot() is not None


@pytest.mark.parametrize("kind", KINDS)
def test_a_notebook_shows_the_main_columns(tables, kind):
    table = tables[kind]
    page = table._repr_html_()
    head = page[: page.index("</thead>")]
    assert head.count("<th>") <= 10
    assert f"<p>{len(table)} {kind}</p>" in page
    rest = len(table.colnames) - head.count("<th>")
    assert (f"{rest} more columns" in page) == (rest > 0)
    assert KNOWN_BY[kind] <= set(SHOWN[kind])


def test_dates_and_numbers_of_a_notebook_are_short(tables):
    page = tables["encounters"]._repr_html_()
    assert "<td>2029-04-13 21:46:12</td>" in page
    assert re.search(r"<td>38011\.3\d{0,2}</td>", page)
    assert tables["encounters"]["distance"].info.format is None  # the table itself is unchanged


def test_frames_and_dictionaries_name_units(tables):
    table = tables["encounters"]
    frame, columns = table.to_pandas(), table.to_dict()
    np.testing.assert_array_equal(frame["distance_km"], table["distance"].to_value(u.km))
    np.testing.assert_array_equal(frame["position_y_km"], table["position"][:, 1].to_value(u.km))
    assert str(frame["time_tdb"].dtype) == "datetime64[ms]"
    assert str(frame["time_tdb"][0]).startswith("2029-04-13 21:46:12")
    assert list(columns) == list(frame.columns)
    assert columns["time_tdb"][0].startswith("2029-04-13T21:46:12.")
    json.dumps(columns, allow_nan=False)
    assert table.to_pandas(index="asteroid").index[0] == "Apophis"
    verdicts = tables["encounters with verdicts"].to_pandas()
    np.testing.assert_allclose(
        verdicts["distance_km"], tables["encounters with verdicts"]["distance"].to_value(u.km)
    )
    assert verdicts["verdict"].tolist() == tables["encounters with verdicts"]["verdict"].tolist()


def test_csv_has_the_columns_of_the_frame(tables, tmp_path):
    table = tables["encounters"]
    head = table.save(tmp_path / "x.csv").read_text().splitlines()[0]
    assert head.split(",") == list(table.to_pandas().columns)


@pytest.mark.parametrize("kind", KINDS)
def test_plots(tables, kind):
    axes = tables[kind].plot()
    assert axes.has_data()
    assert axes.get_xlabel()
    assert axes.get_ylabel()


def test_what_cannot_be_plotted_or_read(tables, tmp_path):
    with pytest.raises(InvalidInput, match="a table of encounters"):
        tables["encounters"][["asteroid", "planet"]].plot()
    with pytest.raises(UnknownName, match="friction_equilibrium"):
        tables["bounds on the material"].plot(column="x")
    with pytest.raises(InvalidInput, match="No such file"):
        ResultTable.read(tmp_path / "none.json")
    path = fs.stability(fs.Body([2, 1, 1] * u.m, 2 * u.g / u.cm**3, 6 * u.h)).save(tmp_path / "s.json")
    with pytest.raises(InvalidInput, match="a saved table, not a Stability"):
        ResultTable.read(path)


def test_astropy_formats_are_read_as_before(tables, tmp_path):
    tables["possible impacts"][["sigma", "probability"]].write(tmp_path / "x.csv", format="ascii.csv")
    found = ResultTable.read(tmp_path / "x.csv", format="ascii.csv")
    assert type(found) is ResultTable
    assert found["sigma"].tolist() == [1.0, 2.0]
