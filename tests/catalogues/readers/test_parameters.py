"""Parameters of force models that are not modelled: every reader refuses them by name."""

import json

import numpy as np
import pytest
from orbit_files import COMET, EXTENDED, MPC, NEOWS, OPENORB, SERVICE, UNKNOWN, text, with_item

from flybystab.catalogues import readers
from flybystab.catalogues.catalogue import Asteroid, catalogue
from flybystab.catalogues.readers import READERS
from flybystab.catalogues.readers.native import read_native
from flybystab.catalogues.readers.parameters import MODELLED, NOT_MODELLED
from flybystab.errors import InvalidInput, UnknownName
from flybystab.orbit.forces import NonGravitational


def test_every_reader_has_such_a_file():
    assert set(UNKNOWN) == set(READERS.names)


@pytest.mark.parametrize("name", UNKNOWN)
def test_an_unknown_parameter_is_refused_by_name(tmp_path, name):
    path = tmp_path / "file"
    path.write_text(UNKNOWN[name])
    assert readers.READERS.of(UNKNOWN[name]).name == name
    with pytest.raises(InvalidInput, match=r"(?s)non-gravitational parameters.*(XYZ|parameter [37])"):
        catalogue(path)


def test_a_column_that_the_catalogue_does_not_have_is_refused():
    with pytest.raises(UnknownName, match="XYZ"):
        read_native("name,a_au,XYZ\nx,1.0,2.0\n", "x.csv")


@pytest.mark.parametrize("name", UNKNOWN)
def test_the_same_file_without_it_is_read(tmp_path, name):
    """Only the unknown parameter is refused: each file of the table is otherwise in order."""
    plain = {
        "OEF2.0": text("2018VP1.eq0"), "SBDB query (CSV)": text("no_pdes.csv"), "MPCORB": text("apophis_2010.dat"),
        "SBDB query (JSON)": text("sbdb_query.json"), "SBDB answer": text("2001VB.json"),
        "MPC orbit (JSON)": text("2020AB.json"), "MPC table (JSON)": json.dumps([EXTENDED]),
        "MPC web service (JSON)": json.dumps([SERVICE]), "MPC CometEls": text("CometEls.txt"),
        "MPC comets (JSON)": json.dumps([COMET]), "JPL elements": text("ELEMENTS.COMET"),
        "JPL Horizons": text("ceres_elements.txt"), "Sorcha, layup, OpenOrb": text("sorcha_kep.csv"),
        "OpenOrb orbits": OPENORB, "NASA NeoWs": json.dumps(NEOWS),
        "Find_Orb elements": text("find_orb_total.json"), "Find_Orb covariance": text("find_orb_covar.json"),
        "ECSV table": text("ceres_elements.ecsv"), "MPC table": MPC.replace(",XYZ", "").replace(",5,6", ",5"),
    }  # fmt: skip
    (tmp_path / "file").write_text(plain[name])
    assert len(catalogue(tmp_path / "file")[0].orbit.position) == 3


def test_formats_do_not_overlap():
    """Each file is recognised by one reader alone."""
    for name, content in UNKNOWN.items():
        assert [r.name for r in READERS if r.identify(content)] == [name]


def test_the_table_of_parameters_is_consistent():
    assert set(MODELLED) == set(NOT_MODELLED)
    assert not any(set(MODELLED[agency]) & set(NOT_MODELLED[agency]) for agency in MODELLED)


@pytest.mark.parametrize("column", ["a2", "a1_unc", "A2"])
def test_accelerations_of_layup_are_refused(tmp_path, column):
    path = tmp_path / "x.csv"
    path.write_text(text("sorcha_kep.csv").replace("\n", f",{column}\n", 1).rstrip("\n") + ",1e-13\n")
    with pytest.raises(InvalidInput, match=r"A[12]"):
        catalogue(path)


def test_area_over_mass_of_find_orb_and_of_orbfit(tmp_path):
    """m2/kg; m2/ton with a solar constant of 1370 W/m2: the accelerations agree to the digits of the constants."""
    path = tmp_path / "x"
    item = {"AMR": 2e-3, "sigma_AMR": 1e-4}
    path.write_text(with_item("find_orb_total.json", ["objects", "Test_1001", "elements"], item))
    (a,) = catalogue(path)
    assert a.orbit.nongrav.area_to_mass == 2e-3
    assert a.orbit.nongrav.a == (0.0, 0.0, 0.0)
    assert a.orbit.covariance.names[-1] == "AMRAT"
    assert a.orbit.covariance.sigma[-1] == pytest.approx(1e-4)
    path.write_text(text("2018VP1.eq0").replace("LSP   0  0    6", "LSP   1  2    6") + " NGR  2.0 -1e-4\n")
    (b,) = catalogue(path)
    assert b.orbit.nongrav.area_to_mass == pytest.approx(2e-3 * 1370.0 / 1361.0)
    assert b.orbit.nongrav.parameters.pressure == pytest.approx(2e-3 * 1370.0 / 299792458.0, rel=1e-9)
    assert float(b.row["A2_au_d2"]) == pytest.approx(-1e-14, rel=1e-15)
    document = json.loads(text("2020AB.json"))
    for part in ("CAR", "COM"):
        document[part]["coefficient_names"].append("srp")
        document[part]["coefficient_values"].append(2.0)
        document[part]["covariance"] = {}
    path.write_text(json.dumps(document))
    assert catalogue(path)[0].orbit.nongrav == NonGravitational(area_to_mass=b.orbit.nongrav.area_to_mass)


def test_an_estimated_area_over_mass_of_orbfit_is_in_the_covariance(tmp_path):
    content = text("2018VP1.eq0").replace("LSP   0  0    6", "LSP   1  2    7   1")
    content = content.replace("LSP   1  2    7   1", "LSP   1  2    7   1\n NGR  2.0 0.0")
    lines = content.splitlines()
    rows = [k for k, line in enumerate(lines) if line.strip().startswith("COV")]
    upper = np.zeros((7, 7))
    upper[np.triu_indices(6)[0], np.triu_indices(6)[1]] = [
        float(c) for k in rows for c in lines[k].split()[1:]
    ]
    upper[6, 6] = 0.25
    cells = upper[np.triu_indices(7)]
    lines[rows[0] : rows[-1] + 1] = [
        " COV  " + " ".join(f"{x:.15e}" for x in cells[k : k + 3]) for k in range(0, 28, 3)
    ]
    lines = [line for line in lines if not line.startswith("! RMS")]
    (tmp_path / "x").write_text("\n".join(lines) + "\n")
    (a,) = catalogue(tmp_path / "x")
    assert a.orbit.covariance.names[-1] == "AMRAT"
    assert a.orbit.covariance.sigma[-1] == pytest.approx(0.5e-3 * 1370.0 / 1361.0)


@pytest.mark.parametrize("key", ["A1", "T0", "dx"])
def test_find_orb_does_not_say_which_law_its_parameters_have(tmp_path, key):
    path = tmp_path / "x.json"
    path.write_text(with_item("find_orb_total.json", ["objects", "Test_1001", "elements"], {key: 1e-9}))
    with pytest.raises(InvalidInput, match=key):
        catalogue(path)


def test_yarkovsky_of_find_orb(tmp_path):
    path = tmp_path / "x.json"
    item = {"A2": -2.9e-14, "sigma_A2": 1e-15}
    path.write_text(with_item("find_orb_total.json", ["objects", "Test_1001", "elements"], item))
    (a,) = catalogue(path)
    assert a.orbit.nongrav.law == "asteroid"
    assert a.orbit.nongrav.a[1] < 0.0
    assert a.orbit.covariance.names[-1] == "A2"


def test_lists_of_neows(tmp_path):
    """A browse page, and a feed by date; Eros against the embedded catalogue, another epoch and solution."""
    path = tmp_path / "x.json"
    for document in (
        {"near_earth_objects": [NEOWS, NEOWS]},
        {"near_earth_objects": {"2026-01-01": [NEOWS, NEOWS]}},
    ):
        path.write_text(json.dumps(document))
        assert [a.number for a in catalogue(path)] == [433, 433]
    a, b = catalogue(path)[0].orbit, Asteroid.from_catalogue("Eros").orbit
    difference = a.position - b.at(a.epoch)[0]
    assert float(np.linalg.norm(difference.to_value("km"))) < 100.0
