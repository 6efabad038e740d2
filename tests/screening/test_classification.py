"""The structural stability of a catalogue agrees with that of its bodies one by one."""

import astropy.units as u
import numpy as np
import pytest

from flybystab.body.body import Material
from flybystab.body.equilibrium import equilibrium
from flybystab.body.stability import LEVELS, stability
from flybystab.catalogues.asteroid import Asteroid
from flybystab.errors import UnknownName
from flybystab.screening.classification import ANGLES, COLUMNS, classification, counts

NAMES = ["Apophis", "1950 DA", "Anteros", "Eros"]


@pytest.fixture(scope="module")
def table():
    return classification(NAMES)


def test_rows_are_those_of_single_bodies(table):
    assert table.colnames == list(COLUMNS)
    assert list(table["asteroid"]) == NAMES
    for row, name in zip(table, NAMES, strict=True):
        body = Asteroid.from_catalogue(name).body
        e = equilibrium(body)
        assert row["error"] == ""
        if not row["drawn"]:
            assert row["required_friction_angle"].value == pytest.approx(e.required_friction_angle.value)
            assert row["critical_energy"].value == pytest.approx(
                stability(body).critical_energy.barrier.value, rel=2e-3
            )
        for angle in ANGLES:
            firmer = body.with_(material=Material(friction_angle=angle * u.deg))
            assert row[f"level_{angle:g}"] >= min(1, stability(firmer).level)


def test_1950_da_is_in_tension_and_the_others_are_not(table):
    da = table[NAMES.index("1950 DA")]
    assert da["in_tension"]
    assert np.isinf(da["required_friction_angle"].value)
    assert da["level_40"] == 0
    assert da["critical_energy"].value == 0.0
    assert 40 < da["required_cohesion"].value < 90
    assert list(table["in_tension"]) == [False, True, False, False]
    assert counts(table)["40 deg"][LEVELS[0]] == 1
    assert sum(counts(table)["30 deg"].values()) == len(NAMES)


def test_cohesion_holds_what_friction_cannot():
    held = classification(["1950 DA"], material=Material(cohesion=100 * u.Pa))
    assert held["critical_energy"][0].value > 0.0
    assert held["required_cohesion"][0].value < 100
    # the friction needed without cohesion is a column of its own
    assert np.isinf(held["required_friction_angle"][0].value)
    assert held.meta["cohesion_Pa"] == 100.0


def test_a_file_of_orbits_is_completed_and_says_what_it_does_not_know(tmp_path):
    head = "pdes,name,class,pha,H,diameter,epoch,e,a,i,om,w,ma"
    orbit = "2461200.5,0.2,1.1,3,10,20,30"
    file = tmp_path / "three.csv"
    file.write_text(
        f"{head}\n99942,Apophis,ATE,True,19.1,,{orbit}\n2099 AB1,,APO,False,22.0,,{orbit}\n"
        f"2099 AB2,,APO,False,,,{orbit}\n"
    )
    t = classification(file)
    assert "spin period" not in t["drawn"][0]
    assert "spin period" in t["drawn"][1]
    assert "elongation" in t["drawn"][1]
    assert np.isfinite(t["required_friction_angle"][1].value)
    assert "size" in t["error"][2]
    assert np.isnan(t["critical_energy"][2].value)


def test_an_unknown_asteroid_is_named():
    with pytest.raises(UnknownName):
        classification(["Apophys"])
