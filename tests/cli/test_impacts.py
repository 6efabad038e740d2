"""``flybystab impacts``: possible impacts as text and as a document, and their hazard scales."""

import json

import astropy.units as u
import numpy as np
import pytest
from astropy.table import QTable
from astropy.time import Time

from flybystab.cli.impacts import _add_scales, _lines
from flybystab.cli.main import main

MOON = ("--planet", "moon", "--from", "2032-12-15", "--to", "2032-12-30", "--orbits", "101")


def test_2024_yr4_and_the_moon(capsys, shared):
    """CNEOS: 4.3 %. The hazard scales belong to impacts on the Earth."""
    file = str(shared / "neocc" / "2024YR4.ke1")
    assert main(["impacts", file, *MOON, "--mass", "2e8", "--json"]) == 0
    (row,) = json.loads(capsys.readouterr().out)["rows"]
    assert row["probability"] == pytest.approx(0.043, abs=0.01)
    assert row["v_inf_km_s"] == pytest.approx(13.9, abs=0.1)
    assert "palermo" not in row
    assert main(["impacts", file, *MOON]) == 0
    assert "1 possible impact on moon" in capsys.readouterr().out


def test_scales_of_bennu_in_2182():
    """Farnocchia et al. (2021): 1 in 2,700 on 2182-09-24; -1.59 on the Palermo scale."""
    table = QTable()
    table["time"] = Time(["2182-09-24"], scale="tdb")
    table["probability"] = np.array([0.00037])
    table["sigma"] = np.array([0.3])
    for name, value, unit in (("width", 50.0, u.km), ("stretching", 1e6, u.km), ("v_inf", 5.99, u.km / u.s)):
        table[name] = np.array([value]) * unit
    table.meta["planet"] = "earth"
    _add_scales(table, 7.329e10 * u.kg, Time("2021-08-11", scale="tdb"))
    assert table["energy_Mt"][0] == pytest.approx(1400.0, rel=0.05)
    assert table["palermo"][0] == pytest.approx(-1.59, abs=0.05)
    assert "Palermo" in _lines(table)[0]


@pytest.mark.parametrize(
    ("words", "status", "message"),
    [(["--mass", "-1"], 1, "--mass"), (["--orbits", "1"], 1, "n"), (["--planet", "vulcan"], 1, "vulcan")],
)
def test_bad_arguments_are_named(capsys, words, status, message):
    found = main(
        ["impacts", "Apophis", "--from", "2029-04-01", "--to", "2029-05-01", "--orbits", "3", *words]
    )
    assert found in (status, 2)
    assert message in capsys.readouterr().err
