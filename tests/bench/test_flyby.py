"""The benchmark of one flyby: other libraries integrate the same equations."""

import importlib.util

import numpy as np
import pytest

from flybystab.bench import flyby
from flybystab.bench.flyby import lines, rows


def test_all_methods_converge_to_the_same_shape(monkeypatch):
    monkeypatch.setattr(flyby, "STARTS", 1)
    monkeypatch.setattr(flyby, "METHODS", {"Radau": (1e-6,), "LSODA": (1e-6, 1e-8)})
    table = rows(repeat=1)
    errors = {(r["method"], r["setting"]): r["error_relative"] for r in table}
    assert errors["default", "tol 1e-08"] < 1e-8
    assert errors["SciPy Radau", "rtol 1e-06"] < 1e-6
    assert errors["SciPy LSODA", "rtol 1e-08"] < errors["SciPy LSODA", "rtol 1e-06"] < 1e-2
    assert all(np.isfinite(r["cpu_over_default_at_1e-6"]) for r in table)
    assert ("numbalsoda: not installed" in lines(table)[-1]) == (
        importlib.util.find_spec("numbalsoda") is None
    )


@pytest.mark.skipif(importlib.util.find_spec("numbalsoda") is None, reason="numbalsoda not installed")
def test_numbalsoda_is_the_same_method_as_that_of_scipy(monkeypatch):
    monkeypatch.setattr(flyby, "STARTS", 1)
    monkeypatch.setattr(flyby, "METHODS", {"LSODA": (1e-8,)})
    errors = {r["method"]: r["error_relative"] for r in rows(repeat=1)}
    assert errors["numbalsoda"] == pytest.approx(errors["SciPy LSODA"], rel=1e3)
    assert errors["numbalsoda"] < 1e-5
