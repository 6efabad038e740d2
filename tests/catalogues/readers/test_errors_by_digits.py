"""Orbits of files without errors: their digits may make them uncertain, but never determined."""

import json

import astropy.units as u
import numpy as np
import pytest
from astropy.time import Time
from orbit_files import COMET, EXTENDED, NEOWS, OPENORB, SERVICE, UNKNOWN, text

import flybystab as fs
from flybystab.catalogues.catalogue import Asteroid, catalogue
from flybystab.catalogues.readers import READERS, reader_names
from flybystab.orbit.predictability import deviations_of

APOPHIS = Asteroid.from_catalogue("Apophis").row


def without_sigmas(name):
    """The elements of Find_Orb without their errors."""
    document = json.loads(text(name))
    for thing in document["objects"].values():
        thing["elements"] = {k: v for k, v in thing["elements"].items() if "sigma" not in k}
    return json.dumps(document)


def without(name, *path):
    """A JSON file without an item."""
    document = json.loads(text(name))
    place = document
    for key in path[:-1]:
        place = place[key]
    del place[path[-1]]
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
    import csv
    import io

    rows = list(csv.DictReader(io.StringIO(text(name))))
    kept = [c for c in rows[0] if c != "condition_code" and not c.startswith("sigma")]
    out = io.StringIO()
    writer = csv.DictWriter(out, kept, extrasaction="ignore")
    writer.writeheader()
    writer.writerows(rows)
    return out.getvalue()


MPC = "principal_desig,epoch_jd_tt,a_au,e,i_deg,node_deg,peri_deg,M_deg\n2020 AB,2461000.5,1.0,.1,2,3,4,5\n"
PLAIN = {
    "OEF2.0": oef,
    "SBDB query (CSV)": lambda: query("sbdb_query_results.csv"),
    "SBDB query (JSON)": lambda: text("sbdb_query.json"),
    "SBDB answer": answer,
    "MPC table": lambda: MPC,
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


def test_every_reader_has_such_a_file():
    """But for the covariance of Find_Orb, which is nothing else."""
    assert (
        set(PLAIN) == set(reader_names()) - {"Find_Orb covariance"} == set(UNKNOWN) - {"Find_Orb covariance"}
    )


@pytest.mark.parametrize("name", PLAIN)
def test_an_orbit_without_errors_is_not_known(tmp_path, name):
    path = tmp_path / "file"
    path.write_text(PLAIN[name]())
    assert READERS[name].identify(PLAIN[name]())
    for a in catalogue(path):
        assert not deviations_of(a.orbit).known, (a.name, a.orbit.covariance)


def test_every_digit_without_an_error_is_unknown_and_few_are_uncertain(tmp_path):
    """Apophis in 2029 from JPL's elements: with all digits nothing is said of their error; four are 30,000 km."""
    columns = ("epoch", "e", "a", "i", "om", "w", "ma")
    cells = [APOPHIS[c] for c in ("epoch_jd_tdb", "e", "a_au", "i_deg", "node_deg", "peri_deg", "M_deg")]
    path = tmp_path / "x.csv"
    grades = []
    for shown in (cells, [cells[0], *(f"{float(c):.7f}" for c in cells[1:])]):
        path.write_text(",".join(("pdes", *columns)) + "\n" + ",".join(("99942", *shown)) + "\n")
        (a,) = catalogue(path)
        span = Time("2029-04-01", scale="tdb"), Time("2029-05-01", scale="tdb")
        row = fs.find_encounters(a.orbit, *span, within=0.05 * u.au, growth=True)[0]
        grades.append(str(row["predictability"]))
    assert grades[0] == "unknown"
    assert grades[1] in ("uncertain", "unknown")


def test_errors_of_a2_alone_say_nothing_of_the_elements(tmp_path):
    path = tmp_path / "x.csv"
    path.write_text(
        "pdes,epoch,e,a,i,om,w,ma,A2,A2_sigma\n99942,2461000.5,.1911,.9224,3.341,203.9,126.6,312.8,-2.9E-14,2E-16\n"
    )
    (a,) = catalogue(path)
    assert a.orbit.covariance.digits_alone
    assert np.isfinite(a.orbit.covariance.sigma).all()
