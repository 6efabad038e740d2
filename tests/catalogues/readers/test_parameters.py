"""Parameters of force models that are not modelled: every reader refuses them by name."""

import json
from pathlib import Path

import numpy as np
import pytest

from flybystab.catalogues import readers
from flybystab.catalogues.catalogue import Asteroid, catalogue
from flybystab.catalogues.readers import READERS, reader_names
from flybystab.catalogues.readers.native import read_native
from flybystab.catalogues.readers.parameters import MODELLED, NOT_MODELLED
from flybystab.errors import InvalidInput, UnknownName
from flybystab.orbit.forces import NonGravitational

FILES = Path(__file__).parents[2] / "cases" / "files"


def text(name):
    return (FILES / name).read_text()


def with_item(name, path, item):
    """A JSON file with an item added to the list or mapping at `path`."""
    document = json.loads(text(name))
    place = document
    for key in path:
        place = place[key]
    place.append(item) if isinstance(place, list) else place.update(item)
    return json.dumps(document)


def sbdb_query(name):
    """The answer of a query with one more field."""
    document = json.loads(text("sbdb_query.json"))
    document["fields"].append(name)
    for row in document["data"]:
        row.append("3")
    return json.dumps(document)


def mpc_orbit(name):
    """An orbit of the MPC with one more coefficient."""
    document = json.loads(text("2020AB.json"))
    for part in ("CAR", "COM"):
        document[part]["coefficient_names"].append(name)
        document[part]["coefficient_values"].append(3.0)
    return json.dumps(document)


OPENORB = (
    "# OpenOrb\n#\n#\n#-0001-|-0002-|-0003-|-0004-|-0005-|-0006-|-0007-|-0008-\n"
    "2020 AB          1.6E+00 0.4E+00 4.8E+00 2.8E+02 1.5E+02 7.5E+01 2020  5 31.00000\n"
)
NEOWS = {
    "name": "433 Eros (A898 PA)", "absolute_magnitude_h": 10.31, "is_potentially_hazardous_asteroid": False,
    "orbital_data": {
        "orbit_id": "659", "orbit_uncertainty": "0", "epoch_osculation": "2461000.5", "equinox": "J2000",
        "eccentricity": ".2228359407071628", "semi_major_axis": "1.458120998474684",
        "inclination": "10.82846651399785", "ascending_node_longitude": "304.2701025753316",
        "perihelion_argument": "178.9297536744151", "mean_anomaly": "310.5543277370992",
        "perihelion_distance": "1.133199", "perihelion_time": "2461088.83",
        "orbit_class": {"orbit_class_type": "AMO"},
    },
}  # fmt: skip
HORIZONS = (
    "Comet non-gravitational force model (AMRAT=m^2/kg;A1-A3=au/d^2;DT=days;R0=au):\n"
    "   AMRAT=  0.       DT=  0.\n   A1= 4.8E-10  A2= 0.  XYZ= 3.\n*****\n"
)
EXTENDED = {"Epoch": 2461000.5, "M": 1.0, "Peri": 2.0, "Node": 3.0, "i": 4.0, "e": 0.1, "n": 1.0, "a": 0.99}
SERVICE = {
    "epoch_jd": "2457000.5", "mean_anomaly": "1", "argument_of_perihelion": "2", "ascending_node": "3",
    "inclination": "4", "eccentricity": "0.1", "semimajor_axis": "1.2", "mean_daily_motion": "0.75",
}  # fmt: skip
COMET = {
    "Designation_and_name": "C/2020 F3 (NEOWISE)", "Year_of_perihelion": 2020, "Month_of_perihelion": 7,
    "Day_of_perihelion": 3.6813, "Perihelion_dist": 0.294707, "e": 0.999191, "i": 128.9373, "Node": 61.0112,
    "Peri": 37.2744,
}  # fmt: skip
MPC = (
    "principal_desig,epoch_jd_tt,a_au,e,i_deg,node_deg,peri_deg,M_deg,XYZ\n2020 AB,2461000.5,1,.1,2,3,4,5,6\n"
)
ELEMENTS = text("ELEMENTS.COMET").splitlines()
UNKNOWN = {
    "OEF2.0": text("2018VP1.eq0").replace("LSP   0  0    6", "LSP   1  3    6") + " NGR  0.0 -1e-4 3.0\n",
    "SBDB query (CSV)": text("no_pdes.csv").replace("\n", ",XYZ\n", 1).rstrip("\n") + ",3\n",
    "SBDB query (JSON)": sbdb_query("XYZ"),
    "SBDB answer": with_item("2001VB.json", ["orbit"], {"model_pars": [{"name": "XYZ", "value": "3"}]}),
    "MPC table": MPC,
    "MPCORB": text("apophis_2010.dat").rstrip("\n") + " XYZ= 3.0\n",
    "MPC orbit (JSON)": mpc_orbit("XYZ"),
    "MPC table (JSON)": json.dumps([EXTENDED | {"XYZ": 3.0}]),
    "MPC web service (JSON)": json.dumps([SERVICE | {"XYZ": "3.0"}]),
    "MPC CometEls": text("CometEls.txt").splitlines()[0] + " XYZ=3.0\n",
    "MPC comets (JSON)": json.dumps([COMET | {"XYZ": 3.0}]),
    "JPL elements": "\n".join([ELEMENTS[0] + "          XYZ", ELEMENTS[1] + " ---", ELEMENTS[2] + "      3.0"]),
    "JPL Horizons": HORIZONS + text("ceres_elements.txt"),
    "Sorcha, layup, OpenOrb": text("sorcha_kep.csv").replace("\n", ",XYZ\n", 1).rstrip("\n") + ",3\n",
    "NASA NeoWs": json.dumps(NEOWS | {"orbital_data": NEOWS["orbital_data"] | {"XYZ": "3"}}),
    "OpenOrb orbits": OPENORB.replace("# OpenOrb", "# OpenOrb XYZ = 3.0"),
    "Find_Orb elements": with_item("find_orb_total.json", ["objects", "Test_1001", "elements"], {"XYZ": 3.0}),
    "Find_Orb covariance": json.dumps(
        json.loads(text("find_orb_covar.json")) | {"covar": [[float(i == j) for i in range(7)] for j in range(7)]}
    ),
    "ECSV table": text("ceres_elements.ecsv")
    .replace("# - {name: P,", "# - {name: XYZ, datatype: float64}\n# - {name: P,")
    .replace(" Q P\n", " Q XYZ P\n")
    .replace(" 1680.711199557247", " 3.0 1680.711199557247"),
}  # fmt: skip


def test_every_reader_has_such_a_file():
    assert set(UNKNOWN) == set(reader_names())


@pytest.mark.parametrize("name", UNKNOWN)
def test_an_unknown_parameter_is_refused_by_name(tmp_path, name):
    path = tmp_path / "file"
    path.write_text(UNKNOWN[name])
    assert readers.reader_of(UNKNOWN[name]).name == name
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
        assert [r.name for r in READERS.values() if r.identify(content)] == [name]


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
    assert b.orbit.nongrav.row[-1] == pytest.approx(2e-3 * 1370.0 / 299792458.0, rel=1e-9)
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
