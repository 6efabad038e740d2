"""JSON documents: numbers or null with a reason, units in the keys."""

import astropy.units as u
import numpy as np
from astropy.table import QTable

from flybystab.flybys.document import plain, table_document


def test_what_is_not_finite_is_null_with_a_reason():
    found = plain(
        {"margin_deg": -np.inf, "growth": np.float64(np.nan), "q": {"q5": 1.0, "q100": np.inf}, "n": 2}
    )
    assert found["margin_deg"] is None
    assert found["margin_deg_reason"] == "no friction angle suffices"
    assert found["growth"] is None
    assert found["growth_reason"] == "not defined or not computed"
    assert found["q"] == {"q5": 1.0, "q100": None, "q100_reason": "infinite"}
    assert found["n"] == 2
    assert plain({"margin_deg": {"q0": -np.inf}})["margin_deg"]["q0_reason"] == "no friction angle suffices"
    assert plain([np.inf, 1.0]) == [None, 1.0]


def test_a_table_names_units_as_the_flyby_does():
    table = QTable({"v_inf": [1.5] * u.km / u.s, "density": [2.0] * u.kg / u.m**3, "mass": [1] * u.one})
    (row,) = table_document(table)["rows"]
    assert row == {"v_inf_km_s": 1.5, "density_kg_m3": 2.0, "mass": 1.0}
