"""Orbit files of every reader: small texts, and the same with a parameter that no force model has."""

import csv
import io
import json
from pathlib import Path

FILES = Path(__file__).parent / "cases" / "files"


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


def without_sigmas(name):
    """The elements of Find_Orb without their errors."""
    document = json.loads(text(name))
    for thing in document["objects"].values():
        thing["elements"] = {k: v for k, v in thing["elements"].items() if "sigma" not in k}
    return json.dumps(document)


def answer():
    """An answer of SBDB without covariance, errors and condition code."""
    document = json.loads(text("2001VB.json"))
    document["orbit"].pop("covariance")
    document["orbit"]["condition_code"] = None
    for item in document["orbit"]["elements"]:
        item["sigma"] = None
    return json.dumps(document)


def orbit_of_mpc():
    document = json.loads(text("2020AB.json"))
    for part in ("CAR", "COM"):
        document[part]["covariance"] = {}
    return json.dumps(document)


def oef():
    lines = text("2018VP1.eq0").splitlines()
    return "\n".join(x for x in lines if not x.strip().startswith(("COV", "NOR", "! RMS", "! EIG", "! WEA")))


def query(name):
    """A query without condition code and 1-sigmas."""
    rows = list(csv.DictReader(io.StringIO(text(name))))
    kept = [c for c in rows[0] if c != "condition_code" and not c.startswith("sigma")]
    out = io.StringIO()
    writer = csv.DictWriter(out, kept, extrasaction="ignore")
    writer.writeheader()
    writer.writerows(rows)
    return out.getvalue()


MPC_PLAIN = (
    "principal_desig,epoch_jd_tt,a_au,e,i_deg,node_deg,peri_deg,M_deg\n2020 AB,2461000.5,1.0,.1,2,3,4,5\n"
)
#: Texts of orbits without errors, for every reader but that of the covariance of Find_Orb.
PLAIN = {
    "OEF2.0": oef,
    "SBDB query (CSV)": lambda: query("sbdb_query_results.csv"),
    "SBDB query (JSON)": lambda: text("sbdb_query.json"),
    "SBDB answer": answer,
    "MPC table": lambda: MPC_PLAIN,
    "MPCORB": lambda: text("apophis_2010.dat")[:105] + " " + text("apophis_2010.dat")[106:],
    "MPC orbit (JSON)": orbit_of_mpc,
    "MPC table (JSON)": lambda: json.dumps([EXTENDED]),
    "MPC web service (JSON)": lambda: json.dumps([SERVICE]),
    "MPC CometEls": lambda: text("CometEls.txt"),
    "MPC comets (JSON)": lambda: json.dumps([COMET]),
    "JPL elements": lambda: text("ELEMENTS.COMET"),
    "JPL Horizons": lambda: text("ceres_elements.txt"),
    "Sorcha, layup, OpenOrb": lambda: text("sorcha_kep.csv"),
    "NASA NeoWs": lambda: json.dumps(
        NEOWS | {"orbital_data": NEOWS["orbital_data"] | {"orbit_uncertainty": None}}
    ),
    "OpenOrb orbits": lambda: OPENORB,
    "Find_Orb elements": lambda: without_sigmas("find_orb_total.json"),
    "ECSV table": lambda: text("ceres_elements.ecsv"),
}
