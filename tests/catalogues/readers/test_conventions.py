"""Frames, scales, errors and laws that a file states, or leaves out: followed, or refused by name."""

import json
from pathlib import Path

import astropy.units as u
import numpy as np
import pytest
from astropy.table import Table
from astropy.time import Time
from orbit_files import EXTENDED, SERVICE, text, with_item

import flybystab as fs
from flybystab.catalogues.catalogue import Asteroid, catalogue
from flybystab.errors import FlybystabWarning, InvalidInput, UnknownName
from flybystab.orbit.forces import NonGravitational, au_per_day2

ELEMENTS = ["objects", "Test_1001", "elements"]
SIGMAS = ("a", "e", "i", "asc_node", "arg_per", "M")
QUERY = {
    "full_name": "99942 Apophis (2004 MN4)", "epoch": "2461000.5", "e": ".1911469283812541",
    "a": ".9223803173917017", "i": "3.340958441017069", "om": "203.8996515621043", "w": "126.6728325163065",
    "ma": "312.7902829503998",
}  # fmt: skip


def read(tmp_path: Path, content: str) -> Asteroid:
    path = tmp_path / "file"
    path.write_text(content)
    return catalogue(path)[0]


def query(**more: str) -> str:
    row = QUERY | more
    return ",".join(row) + "\n" + ",".join(row.values()) + "\n"


def answer(**orbit: object) -> str:
    """Answer of the SBDB for Apophis without a covariance."""
    document = json.loads(text("sbdb_covariance_same_epoch.json"))
    del document["orbit"]["covariance"]
    document["orbit"] |= orbit
    return json.dumps(document)


def mpc(**changes: dict[str, object]) -> str:
    document = json.loads(text("2020AB.json"))
    for part, values in changes.items():
        document[part] = document.get(part, {}) | values
    return json.dumps(document)


def with_sigmas(value: str) -> list[dict[str, object]]:
    elements = json.loads(answer())["orbit"]["elements"]
    return [e | {"sigma": value} for e in elements]


SIX = {f"sigma_{c}": "0" for c in ("a", "e", "i", "om", "w", "ma")}


@pytest.mark.parametrize(
    "content",
    [
        query(**(SIX | {"sigma_e": "-1e-9"})),
        query(A2="1e-14", A2_sigma="-1e-15"),
        answer(elements=with_sigmas("-1e-9")),
        with_item("find_orb_total.json", ELEMENTS, {"e sigma": -1e-6}),
        with_item("find_orb_total.json", ELEMENTS, {"A2": 1e-14, "sigma_A2": -1e-15}),
    ],
    ids=["query", "query A2", "answer", "Find_Orb", "Find_Orb A2"],
)
def test_a_negative_sigma_is_refused(tmp_path, content):
    with pytest.raises(InvalidInput, match="sigma"):
        read(tmp_path, content)


@pytest.mark.parametrize(
    "content",
    [
        query(**SIX),
        answer(elements=with_sigmas("0"), condition_code=None),
        with_item("find_orb_total.json", ELEMENTS, {f"{c} sigma": 0 for c in SIGMAS}),
        "name,epoch_jd_tdb,a_au,e,i_deg,node_deg,peri_deg,M_deg,"
        + ",".join(f"sigma_{c}" for c in ("a_au", "e", "i_deg", "node_deg", "peri_deg", "M_deg"))
        + "\nX,2461000.5,.9223803,.1911469,3.34095,203.8996,126.6728,312.7902,0,0,0,0,0,0\n",
    ],
    ids=["query", "answer", "Find_Orb", "columns of the catalogue"],
)
def test_sigmas_of_zero_are_not_errors_of_zero(tmp_path, content):
    """An orbit is not determined because a program wrote zeros: its errors are unknown, or those of its digits."""
    covariance = read(tmp_path, content).orbit.covariance
    assert covariance is None or covariance.digits_alone


@pytest.mark.parametrize(
    ("content", "named"),
    [
        (query(equinox="B1950"), "equinox = B1950"),
        (answer(equinox="B1950"), "equinox = B1950"),
        (text("ceres_elements.txt").replace("J2000", "B1950"), "reference frame"),
        (text("ceres_vectors.txt").replace("Ecliptic of J2000.0", "FK4/B1950.0"), "reference frame"),
        (mpc(system_data={"refsys": "Equatorial"}), "Equatorial"),
        (mpc(system_data={"refplane": "Equatorial"}), "Equatorial"),
        (query(epoch_mjd="60000"), "epoch_mjd"),
    ],
)
def test_other_frames_and_contradictory_epochs_are_refused(tmp_path, content, named):
    with pytest.raises(InvalidInput, match=named):
        read(tmp_path, content)


def with_parameters(names: list[str], values: list[float], **model: bool) -> str:
    document = json.loads(text("2020AB.json"))
    for part in ("CAR", "COM"):
        document[part]["coefficient_names"] += names
        document[part]["coefficient_values"] += values
        document[part]["covariance"] = {}
    document["non_grav_booleans"] = {"non_gravs": True, "non_grav_model": model}
    return json.dumps(document)


def test_comet_models_of_the_mpc(tmp_path):
    names, values = ["A1", "A2", "A3", "DT"], [1e-9, -2e-10, 3e-11, 35.0]
    a = read(tmp_path, with_parameters(names[:2], values[:2], marsden=True, yarkovski=False)).orbit
    assert a.nongrav == NonGravitational((*(au_per_day2(x) for x in values[:2]), 0.0), "comet")
    b = read(tmp_path, with_parameters(names, values, yc=True)).orbit
    expected = NonGravitational(tuple(au_per_day2(x) for x in values[:3]), "comet", 35.0 * 86400.0)
    assert b.nongrav == expected


@pytest.mark.parametrize(
    ("content", "named"),
    [
        (with_parameters(["A1"], [1e-9]), "A1 without a law"),
        (with_parameters(["A1"], [1e-9], yabushita=True), "yabushita"),
        (with_parameters([], [], yarkovsky=True), "yarkovsky"),
        (with_parameters([], []), "non_gravs"),
        (with_parameters(["yarkovsky"], [1.0], XYZ=True), "XYZ"),
    ],
)
def test_models_of_the_mpc_without_law_or_parameter_are_refused(tmp_path, content, named):
    with pytest.raises(InvalidInput, match=f"non-gravitational parameters = {named}"):
        read(tmp_path, content)


def test_accelerations_of_an_impossible_size_are_refused(tmp_path):
    """1e-10 au/d2 taken for au/d2 would exceed the gravity of the Sun."""
    a = read(tmp_path, with_parameters(["A1"], [25.0], marsden=True))
    with pytest.raises(InvalidInput, match="A1_au_d2"):
        _ = a.orbit


def test_the_comet_model_of_find_orb_with_a_delay(tmp_path):
    """Four parameters belong to one model alone (``FORCE_MODEL_COMET_FOUR_PARAM``)."""
    item = {"A1": 1e-9, "A2": -2e-10, "A3": 3e-11, "T0": 35.0, "sigma_A1": 1e-11, "sigma_T0": 2.0}
    a = read(tmp_path, with_item("find_orb_total.json", ELEMENTS, item)).orbit
    expected = NonGravitational(tuple(au_per_day2(x) for x in (1e-9, -2e-10, 3e-11)), "comet", 35.0 * 86400.0)
    assert a.nongrav == expected
    assert a.covariance.names[-2:] == ("A1", "DT")
    np.testing.assert_allclose(a.covariance.sigma[-2:], [au_per_day2(1e-11), 2.0 * 86400.0])


@pytest.mark.parametrize("names", [("A1", "A2"), ("A1", "A2", "A3"), ("A2", "AMR")])
def test_find_orb_does_not_name_the_law_of_two_or_three_parameters(tmp_path, names):
    item = dict.fromkeys(names, 1e-9)
    with pytest.raises(InvalidInput, match=f"{', '.join(names)} without a law"):
        read(tmp_path, with_item("find_orb_total.json", ELEMENTS, item))


@pytest.mark.parametrize(("name", "law"), [("67P/Churyumov", "comet"), ("99942", "")])
def test_the_law_of_a_comet_in_columns_of_the_catalogue(tmp_path, name, law):
    row = f"{name},2461000.5,3.46,.64,7.0,50.0,12.0,92.0,1e-9\n"
    a = read(tmp_path, "name,epoch_jd_tdb,a_au,e,i_deg,node_deg,peri_deg,M_deg,A1_au_d2\n" + row)
    assert a.row.get("nongrav_law", "") == law
    assert a.orbit.nongrav.law == (law or "asteroid")


def test_printed_digits_of_a_hyperbola(tmp_path):
    """Of a query with a and M; those of an ellipse are the subject of test_errors_by_digits."""
    a = read(tmp_path, query(a="-3.7", e="1.2", ma="10.5"))
    assert a.orbit.covariance.digits_alone
    assert a.orbit.covariance.sigma[0] == pytest.approx(0.05 / np.sqrt(3.0) * u.au.to(u.m))


@pytest.mark.parametrize("nothing", ["null", "NaN", "None", "--"])
def test_missing_values_of_other_programs(tmp_path, nothing):
    a = read(tmp_path, query(A1=nothing, H=nothing, diameter=nothing, rot_per=nothing))
    assert not a.orbit.nongrav.active
    assert not a.knows("H_mag")


def test_one_object_in_place_of_a_list(tmp_path):
    for one in (EXTENDED, SERVICE):
        found = [read(tmp_path, json.dumps(x)).row for x in (one, [one])]
        assert found[0] == found[1]
    assert catalogue(SERVICE)[0].epoch == catalogue([SERVICE])[0].epoch


def horizons() -> Table:
    """The table of astroquery for Apophis, by a, M and by q, Tp."""
    values = {
        "targetname": "99942 Apophis (2004 MN4)", "datetime_jd": 2461000.5 * u.d, "H": 19.09 * u.mag,
        "e": 0.1911469283812541, "q": 0.7460701534 * u.au, "incl": 3.340958441017069 * u.deg,
        "Omega": 203.8996515621043 * u.deg, "w": 126.6728325163065 * u.deg, "Tp_jd": 2461042.9319 * u.d,
        "n": 1.112600168 * u.deg / u.d, "M": 312.7902829503998 * u.deg, "a": 0.9223803173917017 * u.au,
    }  # fmt: skip
    table = Table({c: [getattr(v, "value", v)] for c, v in values.items()}, masked=True)
    for c, v in values.items():
        table[c].unit = getattr(v, "unit", None)
    return table


@pytest.mark.parametrize("masked", [("H",), ("a",), ("a", "M", "n"), ("q", "Tp_jd"), ("n",)])
def test_masked_columns_are_not_given(masked):
    table = horizons()
    for c in masked:
        table[c].mask = True
    (a,), (b,) = catalogue(table), catalogue(horizons())
    assert a.knows("H_mag") == ("H" not in masked)
    assert np.linalg.norm((a.orbit.position - b.orbit.position).to_value(u.km)) < 400.0


@pytest.mark.parametrize("masked", ["e", "incl", "datetime_jd"])
def test_a_masked_element_is_refused(masked):
    table = horizons()
    table[masked].mask = True
    with pytest.raises(InvalidInput, match="elements = without"):
        catalogue(table)


def test_an_epoch_of_a_table_in_utc_warns():
    table = horizons()
    table["datetime_jd"] = Time([2461000.5], format="jd", scale="utc")
    with pytest.warns(FlybystabWarning, match="UTC"):
        catalogue(table)


@pytest.mark.parametrize(
    "name",
    [
        "Bennu (101955)",
        "20101955",
        "2101955",
        "a0101955",
        "Bénnu",
        "K99R36Q",
        "J99R36Q",
        "(101955) Bennu (1999 RQ36)",
    ],
)
def test_ways_to_write_a_name(name):
    if name == "K99R36Q":  # 2099 RQ36
        with pytest.raises(UnknownName, match="2099 RQ36"):
            fs.Asteroid.from_catalogue(name)
    else:
        assert fs.Asteroid.from_catalogue(name).number == 101955


def test_dashes_and_accents_of_names():
    assert fs.Asteroid.from_catalogue("Ra\u2013Shalom").number == 2100
    assert fs.Asteroid.from_catalogue("Phaëthon").number == 3200


@pytest.mark.parametrize(
    "document",
    [
        {
            "code": "200",
            "message": "specified object was not found",
            "moreInfo": "https://ssd-api.jpl.nasa.gov",
        },
        {"code": "300", "message": "specified query matched more than one object", "list": [{"pdes": "1"}]},
    ],
)
def test_the_message_of_an_answer_without_an_orbit_is_shown(tmp_path, document):
    with pytest.raises(InvalidInput, match=document["message"]):
        read(tmp_path, json.dumps(document))
