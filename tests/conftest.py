"""Fixtures that several folders of tests share."""

import json

import astropy.units as u
import pytest
from astropy.time import Time
from reference import SHARED

from flybystab.orbit.orbit import Orbit


@pytest.fixture(autouse=True)
def no_defaults_of_the_user(monkeypatch):
    """Commands do not read the file of defaults of whoever runs the tests."""
    monkeypatch.setenv("FLYBYSTAB_CONFIG", "")


@pytest.fixture(scope="session")
def shared():
    """Folder of reference data."""
    folder = SHARED / "data"
    if not folder.is_dir():
        pytest.skip(f"reference data are not at {folder}")
    return folder


@pytest.fixture(scope="session")
def apophis(shared):
    """Apophis, JPL solution 220."""
    record = json.loads((shared / "apophis_sbdb_jpl220.json").read_text())["orbit"]
    el = {item["name"]: float(item["value"]) for item in record["elements"]}
    push = {
        item["name"]: float(item["value"]) * u.au / u.d**2 for item in record["model_pars"] if item["units"]
    }
    return Orbit.from_elements(
        epoch=Time(float(record["epoch"]), format="jd", scale="tdb"),
        a=el["a"] * u.au,
        e=el["e"],
        i=el["i"] * u.deg,
        node=el["om"] * u.deg,
        peri=el["w"] * u.deg,
        M=el["ma"] * u.deg,
        A1=push["A1"],
        A2=push["A2"],
        name="Apophis",
    )
