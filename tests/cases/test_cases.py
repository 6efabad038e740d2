"""Orbit files as the agencies publish them, and what is read from them."""

import gzip
from pathlib import Path

import astropy.units as u
import numpy as np
import pytest
from astropy.time import Time
from reference import need_ephemeris

import flybystab as fs
from flybystab.catalogues import readers
from flybystab.catalogues.catalogue import Asteroid, catalogue
from flybystab.catalogues.designations import unpacked, unpacked_date
from flybystab.errors import FlybystabWarning, InvalidInput

FILES = Path(__file__).parent / "files"
AU_KM = 149597870.7


def closest(asteroid, start, stop, within):
    """The first encounter with the Earth: JD (TDB) and distance, km."""
    found = fs.find_encounters(
        getattr(asteroid, "orbit", asteroid),
        Time(start, scale="tdb"),
        Time(stop, scale="tdb"),
        within=within * u.au,
    )
    return found["time"][0].tdb.jd, found["distance"][0].to_value(u.km)


def test_a_covariance_at_the_epoch_of_the_orbit_needs_no_elements_of_its_own():
    (a,) = catalogue(FILES / "sbdb_covariance_same_epoch.json")
    assert a.orbit.covariance.correlated
    _, distance = closest(a, "2029-04-01", "2029-05-01", 0.05)
    assert distance == pytest.approx(37724.5, abs=5.0)  # JPL, solution 199; one sigma is 232 km
    (b,) = catalogue(FILES / "2001VB.json")
    assert b.covariance is not None


@pytest.mark.parametrize("name", ["bennu_nocov", "bennu_cov"])
def test_parameters_that_are_not_modelled_are_refused_by_name(name):
    """The density of JPL's thermal model; AMRAT beside it is modelled."""
    with pytest.raises(InvalidInput, match="parameters = RHO:"):
        catalogue(FILES / f"{name}.json")


def test_a_comet_with_a_delayed_maximum_meets_jupiter_where_jpl_has_it():
    """67P, solution K154/2: 1959-02-04 06:24 TDB, 0.0515584492 au; without DT 207,600 km farther."""
    need_ephemeris("de440")
    (a,) = catalogue(FILES / "67P.json")
    assert a.orbit.nongrav.delay == pytest.approx(35.07142445377104 * 86400.0, rel=1e-15)
    assert a.orbit.covariance.names[-1] == "DT"
    assert a.orbit.covariance.sigma[-1] > 0.0
    t = fs.find_encounters(
        a.orbit,
        *(Time(x, scale="tdb") for x in ("1958-06-01", "1959-10-01")),
        ["jupiter"],
        0.1 * u.au,
        ephemeris="de440",
    )
    assert t["distance"][0].to_value(u.km) == pytest.approx(0.0515584492070597 * AU_KM, abs=100.0)


def test_an_unknown_parameter_is_refused(tmp_path):
    path = tmp_path / "x.json"
    path.write_text((FILES / "67P.json").read_text().replace('"DT"', '"XYZ"'))
    with pytest.raises(InvalidInput, match="XYZ"):
        catalogue(path)


def test_the_delay_of_a_comet_in_a_query(tmp_path):
    path = tmp_path / "x.csv"
    path.write_text((FILES / "comets.csv").read_text().replace("-12,,", "-12,,35"))
    delays = [a.orbit.nongrav.delay for a in catalogue(path)]
    assert max(delays) == 35.0 * 86400.0
    assert delays.count(0.0) == len(delays) - 1


@pytest.mark.parametrize(
    ("name", "row", "span", "au"),
    [
        ("321P", 3, ("2020-02-01", "2020-03-01"), 0.22665410843796),
        ("249P", 1, ("2020-06-01", "2020-07-01"), 0.428991134008876),
    ],
)
def test_comets_of_a_query_have_the_law_of_comets(name, row, span, au):
    """JPL's close approaches; with an acceleration that falls as 1/r2 they are 18,800 and 430 km off."""
    a = catalogue(FILES / "comets.csv")[row]
    assert a.orbit.nongrav.law == "comet"
    assert closest(a, *span, 0.5)[1] == pytest.approx(au * AU_KM, abs=10.0)


def test_a_minor_planet_of_the_same_table_keeps_the_inverse_square():
    assert catalogue(FILES / "comets.csv")[0].orbit.nongrav.law == "asteroid"


@pytest.mark.parametrize(
    ("row", "span", "truth"),
    [
        (1, ("2017-08-25", "2017-09-10"), 7066521.0),  # Florence
        (2, ("2017-12-10", "2017-12-24"), 10312033.0),  # Phaethon
    ],
)
def test_four_printed_digits_are_an_error_that_covers_the_truth(row, span, truth):
    a = catalogue(FILES / "sbdb_query_results.csv")[row]
    orbit = a.orbit
    assert "digits" in orbit.covariance.caveat
    nominal = closest(a, *span, 0.15)[1]
    moved = [closest(clone, *span, 0.3)[1] for clone in orbit.clones(8, seed=1)]
    assert abs(truth - nominal) < 3.0 * np.std(moved)


def test_columns_of_a_query_that_define_an_orbit():
    (a,) = catalogue(FILES / "no_pdes.csv")
    (b,) = catalogue(FILES / "epoch_mjd.csv")
    assert a.number == b.number == 3122
    assert b.epoch.jd == 2459800.5
    (c,) = catalogue(FILES / "q_tp.csv")
    (d,) = catalogue(FILES / "sbdb_query.json")
    for x in (c, d):
        assert closest(x, "2020-01-01", "2020-02-01", 0.1)[1] == pytest.approx(13588539.1, abs=20.0)  # JPL


@pytest.mark.parametrize(
    "name", ["2023BU.ke0", "sbdb_covariance_same_epoch.json", "comets.csv", "apophis_2010.dat"]
)
def test_the_content_decides_not_the_suffix(tmp_path, name):
    raw = (FILES / name).read_bytes()
    rows = [a.row["a_au"] for a in catalogue(FILES / name)]
    for other, data in (("x.txt", raw), ("X.JSON", raw), ("x.ke1", raw), ("x.csv.gz", gzip.compress(raw))):
        (tmp_path / other).write_bytes(data)
        assert [a.row["a_au"] for a in catalogue(tmp_path / other)] == rows


def test_an_spk_kernel_is_named(tmp_path):
    (tmp_path / "x.bsp").write_bytes(b"DAF/SPK \xa3")
    with pytest.raises(InvalidInput, match="SPK"):
        catalogue(tmp_path / "x.bsp")


def test_mpcorb():
    (a,) = catalogue(FILES / "apophis_2010.dat")
    assert (a.number, a.name, a.epoch.jd) == (99942, "Apophis", 2455400.5)
    assert closest(a, "2029-04-01", "2029-05-01", 0.05)[1] == pytest.approx(36001.0, abs=60.0)


@pytest.mark.parametrize(
    ("packed", "plain"),
    [
        ("K04M04N", "2004 MN4"),
        ("J99R36Q", "1999 RQ36"),
        ("K08T03C", "2008 TC3"),
        ("~0K8Q", "697402"),
        ("a0001", "360001"),
        ("00433", "433"),
        ("2004 MN4", "2004 MN4"),
    ],
)
def test_packed_designations(packed, plain):
    assert unpacked(packed) == plain


def test_a_packed_designation_finds_an_asteroid():
    assert Asteroid.from_catalogue("K04M04N").number == 99942
    assert unpacked_date("K107N") == 2455400.5


def test_an_epoch_of_elements_in_utc_warns():
    elements = {"a": 0.92 * u.au, "e": 0.19, "M": 312.0 * u.deg} | dict.fromkeys(
        ("i", "node", "peri"), 3.0 * u.deg
    )
    with pytest.warns(FlybystabWarning, match="UTC"):
        fs.Orbit.from_elements(Time(2461000.5, format="jd"), **elements)


def test_a_reader_is_one_registered_function(tmp_path, monkeypatch):
    readers.READERS.of("")  # imports the modules of the package
    monkeypatch.setattr(readers.READERS, "_found", dict(readers.READERS._found))

    contents = readers.Contents("a, e, i, node, peri, M", "none", "none", "none")

    @readers.reader("test", lambda text: text.startswith("MINE "), contents)
    def read(text, file):
        return [({"name": text.split()[1]}, None)]

    (tmp_path / "x.any").write_text("MINE Own")
    assert [a.name for a in catalogue(tmp_path / "x.any")] == ["Own"]


FULL = {
    "epoch": "2461000.5", "epoch_mjd": "61000", "epoch_cal": "20251121.0", "e": ".1911469283812541",
    "a": ".9223803173917017", "q": ".7460701534", "ad": "1.098690481", "n": "1.112600168", "per": "323.5663561",
    "i": "3.340958441017069", "om": "203.8996515621043", "w": "126.6728325163065", "ma": "312.7902829503998",
    "tp": "2461042.9319", "tp_cal": "20260102.4319",
}  # fmt: skip


@pytest.mark.parametrize(
    "columns",
    [
        "epoch e a i om w ma",
        "epoch_mjd e a i om w ma",
        "epoch_cal e a i om w ma",
        "epoch e q i om w tp",
        "epoch_cal e q i om w tp_cal",
        "epoch e a i om w tp",
        "epoch e n i om w ma",
        "epoch e per i om w ma",
        "epoch e ad i om w ma",
        "epoch q ad i om w ma",
        "epoch a ad i om w ma",
        "epoch q a i om w tp",
        "epoch e q i om w ma",
    ],
)
def test_any_columns_that_define_an_orbit(tmp_path, columns):
    """Apophis, with a mean motion and so on of ten digits; the state is that of a, e and M within these digits."""
    names = columns.split()
    rows = {key: ",".join(FULL[c] for c in key.split()) for key in (columns, "epoch e a i om w ma")}
    found = []
    for key, row in rows.items():
        (tmp_path / "x.csv").write_text(
            f"full_name,{key.replace(' ', ',')}\n99942 Apophis (2004 MN4),{row}\n"
        )
        found.append(catalogue(tmp_path / "x.csv")[0])
    assert found[0].epoch == found[-1].epoch
    difference = found[0].orbit.position - found[-1].orbit.position
    loose = 400.0 if {"tp", "tp_cal"} & set(names) else 40.0  # four decimals of a day: 4 s
    assert np.linalg.norm(difference.to_value(u.km)) < loose


@pytest.mark.parametrize(
    ("lacking", "named"), [("w", "w"), ("ma", "ma or tp"), ("a", "a or q"), ("epoch", "epoch or")]
)
def test_a_jpl_query_without_a_column_says_which(tmp_path, lacking, named):
    names = [c for c in ("epoch", "e", "a", "i", "om", "w", "ma") if c != lacking]
    path = tmp_path / "x.csv"
    path.write_text("full_name," + ",".join(names) + "\nx," + ",".join(FULL[c] for c in names) + "\n")
    with pytest.raises(InvalidInput, match=f"JPL query without {named}"):
        catalogue(path)


def test_one_sigmas_do_not_hide_few_digits(tmp_path):
    """1-sigmas of 1e-9 beside elements of four digits: the digits are the error."""
    header, row = (FILES / "sbdb_query_results.csv").read_text().splitlines()[:2]
    sigmas = [f"sigma_{c}" for c in ("a", "e", "i", "om", "w", "ma")]
    path = tmp_path / "x.csv"
    path.write_text(f"{header},{','.join(sigmas)}\n{row},{','.join(['1e-9'] * 6)}\n")
    (a,) = catalogue(path)
    (b,) = [catalogue(FILES / "sbdb_query_results.csv")[0]]
    assert "digits" in a.orbit.covariance.caveat
    spread = [
        np.linalg.norm(
            x.orbit.covariance.deviations(x.orbit.covariance.values + x.orbit.covariance.factor.T)[0][:, :3]
        )
        for x in (a, b)
    ]
    assert spread[0] == pytest.approx(spread[1], rel=0.05)


def test_an_answer_of_few_digits_is_no_better_than_its_digits(tmp_path):
    """The default of the API, without full-prec, rounds the elements but not their errors."""
    text = (FILES / "sbdb_covariance_same_epoch.json").read_text()
    (a,) = catalogue(FILES / "sbdb_covariance_same_epoch.json")
    for value in (a.row["a_au"], a.row["e"], *(a.row[c] for c in ("i_deg", "node_deg", "peri_deg", "M_deg"))):
        text = text.replace(f'"{value}"', f'"{float(value):.4g}"')
    (tmp_path / "x.json").write_text(text)
    (b,) = catalogue(tmp_path / "x.json")
    assert a.orbit.covariance.correlated
    assert "digits" in b.orbit.covariance.caveat


def test_a_covariance_that_is_no_matrix_names_the_query(tmp_path):
    import json

    document = json.loads((FILES / "2001VB.json").read_text())
    matrix = document["orbit"]["covariance"]["data"]
    document["orbit"]["covariance"]["data"] = [x for line in matrix for x in line]
    (tmp_path / "x.json").write_text(json.dumps(document))
    with pytest.raises(InvalidInput, match="cov=mat"):
        catalogue(tmp_path / "x.json")


@pytest.mark.parametrize(
    "path", sorted(p for p in FILES.iterdir() if p.suffix != ".gz"), ids=lambda p: p.name
)
def test_line_ends_and_marks_do_not_matter(tmp_path, path):
    """Windows line ends, a byte-order mark and a missing last line end change nothing."""
    text = path.read_text()

    def outcome(raw):
        (tmp_path / path.name).write_bytes(raw)
        try:
            return [
                (a.row, None if a.covariance is None else a.covariance.matrix.tolist())
                for a in catalogue(tmp_path / path.name)
            ]
        except InvalidInput as error:
            return str(error)

    expected = outcome(text.encode())
    assert outcome(text.replace("\n", "\r\n").encode()) == expected
    assert outcome(b"\xef\xbb\xbf" + text.encode()) == expected
    assert outcome(text.rstrip("\n").encode()) == expected


@pytest.mark.parametrize(
    "epoch", [Time(2461000.5, format="jd"), Time("2025-11-21"), Time(61000, format="mjd")]
)
def test_an_epoch_of_a_state_in_utc_warns(epoch):
    with pytest.warns(FlybystabWarning, match="epoch is in UTC"):
        fs.Orbit.from_state(epoch, [1.0, 0.0, 0.1] * u.au, [0.0, 0.017, 0.0] * u.au / u.d)


def test_a_time_of_perihelion_in_utc_warns():
    """At any time of the day: the epoch beside it is in TDB."""
    elements = {"q": 0.7 * u.au, "e": 1.1} | dict.fromkeys(("i", "node", "peri"), 3.0 * u.deg)
    with pytest.warns(FlybystabWarning, match="Tp is in UTC"):
        fs.Orbit.from_elements(
            Time(2461000.5, format="jd", scale="tdb"), Tp=Time("2026-01-02T10:20"), **elements
        )


def test_elements_of_the_equator():
    epoch = Time(2461000.5, format="jd", scale="tdb")
    elements = {"a": 0.92 * u.au, "e": 0.19, "M": 312.0 * u.deg}
    elements |= dict.fromkeys(("i", "node", "peri"), 30.0 * u.deg)
    a, b = (fs.Orbit.from_elements(epoch, frame=frame, **elements) for frame in ("equator", "ICRF"))
    np.testing.assert_array_equal(a.position.value, b.position.value)
    # The inclination to the equator is the angle of the orbit's pole to the axis of the frame.
    pole = np.cross(a.position.value, a.velocity.value)
    assert np.degrees(np.arccos(pole[2] / np.linalg.norm(pole))) == pytest.approx(30.0, abs=1e-10)
