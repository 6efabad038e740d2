"""Histories and samples as tables, data frames and dictionaries."""

import json

import astropy.units as u
import numpy as np
import pytest
from astropy.table import QTable

import flybystab as fs


@pytest.fixture(scope="module")
def history():
    body = fs.Body([1400, 850, 750] * u.m, 2000 * u.kg / u.m**3, 6 * u.h)
    return fs.flyby(body, fs.Encounter.hyperbolic("earth", 2.2 * fs.R_earth, 5 * u.km / u.s)).history


def test_a_history_as_a_table(history):
    for table in (QTable(history), history.to_table()):
        assert len(table) == len(history)
        assert table["distance"].unit == history.distance.unit
        assert table["shape"].shape == (len(history), 3, 3)
        np.testing.assert_array_equal(table["semi_axes"], history.semi_axes)


def test_a_history_as_a_data_frame(history):
    frame = history.to_pandas()
    assert len(frame) == len(history)
    np.testing.assert_array_equal(frame["semi_axes_2_m"], history.semi_axes[:, 1].to_value(u.m))
    np.testing.assert_array_equal(frame["shape_13_m2"], history.shape[:, 0, 2].to_value(u.m**2))
    assert frame["regime"].tolist() == history.regime.tolist()


def test_a_history_as_a_dictionary(history):
    found = json.loads(json.dumps(history.to_dict(), allow_nan=False))
    assert found["time_s"] == history.time.to_value(u.s).tolist()
    phi = history.required_friction_angle.to_value(u.rad)
    (name,) = (k for k in found if k.startswith("required_friction_angle"))
    assert [x is None for x in found[name]] == (~np.isfinite(phi)).tolist()


def test_a_sample_of_attitudes():
    body = fs.Body([1400, 850, 750] * u.m, 2000 * u.kg / u.m**3, 6 * u.h)
    encounter = fs.Encounter.hyperbolic("earth", 3 * fs.R_earth, 5 * u.km / u.s)
    sample = fs.spin_sample(body, encounter, n=5, seed=3)
    table = sample.to_table()
    assert len(table) == 5
    assert table.meta["seed"] == 3
    assert table["verdict"].tolist() == sample.verdict.tolist()
    assert sample.to_pandas()["spin_ratio"].tolist() == sample.spin_ratio.tolist()


def test_many_flybys_as_a_data_frame():
    bodies = [fs.Body([1400, 850, 750] * u.m, 2000 * u.kg / u.m**3, p * u.h) for p in (6, 8)]
    table = fs.flyby_many(bodies, [fs.Encounter.hyperbolic("earth", 3 * fs.R_earth, 5 * u.km / u.s)] * 2)
    frame = table.to_pandas()
    assert frame["verdict"].tolist() == table.verdict.tolist()
    assert frame["margin_deg"].tolist() == table.margin.to_value(u.deg).tolist()
    assert len(QTable(table)) == 2


def test_a_flyby_as_a_dictionary():
    body = fs.Body([1400, 850, 750] * u.m, 2000 * u.kg / u.m**3, 6 * u.h)
    result = fs.flyby(body, fs.Encounter.hyperbolic("earth", 3 * fs.R_earth, 5 * u.km / u.s))
    found = json.loads(json.dumps(result.to_dict(), allow_nan=False))
    assert found["margin_deg"] == result.margin.to_value(u.deg)
    assert found["schema"] == "flyby/1"
