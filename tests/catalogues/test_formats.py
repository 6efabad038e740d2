"""Orbit tables from elsewhere."""

import pickle

import astropy.units as u
import numpy as np
import pytest
import reference

from flybystab.catalogues.catalogue import Asteroid, catalogue
from flybystab.catalogues.completion import with_physical_data
from flybystab.errors import InvalidInput

SHARED = reference.SHARED / "data"
ELEMENTS = ("epoch_jd_tdb", "a_au", "e", "i_deg", "node_deg", "peri_deg", "M_deg")

KE1 = """format  = 'OEF2.0'       ! file format
refsys  = ECLM J2000     ! default reference system
END_OF_HEADER
2024YR4
! Keplerian elements: a, e, i, long. node, arg. peric., mean anomaly
 KEP   2.5158372264739257E+00  6.6147231358488334E-01   3.4081591689601 271.3638 134.3660211574287  89.8
 MJD     61000.000000000 TDT
 MAG  24.047  0.150
 NGR   0.00000000000000E+00 -2.9E-04
"""
KE1_ROW = "name,epoch_jd_tdb,a_au,e,i_deg,node_deg,peri_deg,M_deg\nX,2461000.5,1.3,.3,1,2,3,4\n"


def test_sbdb_query(tmp_path):
    path = tmp_path / "q.csv"
    path.write_text(
        "pdes,full_name,name,epoch,e,a,i,om,w,ma,H,diameter,diameter_sigma,rot_per,A2,spec_B,condition_code\n"
        "99942,99942 Apophis (2004 MN4),Apophis,2459000.5,.19,.92,3,4,5,6,19,0.34,0.04,30.4,-2.9E-14,Sq,0\n"
        "2020 AB1, (2020 AB1),,2459000.5,.5,2.1,3,4,5,6,25.1,,,,,,\n"
    )
    a, b = catalogue(path)
    assert (a.name, a.number, a.designation) == ("Apophis", 99942, "2004 MN4")
    assert a.quantity("diameter_m") == 340 * u.m
    assert a.quantity("A2_au_d2").value == -2.9e-14
    assert (b.name, b.number, b.designation) == ("2020 AB1", None, "2020 AB1")
    assert b.epoch.jd == 2459000.5
    assert not b.knows("diameter_m")
    full, same = with_physical_data([a, b])
    assert full.tumbles
    assert full.row["a_au"] == ".92"
    assert full.row["orbit_source"].startswith("JPL SBDB")
    assert full.body.axes == pytest.approx(Asteroid.from_catalogue("Apophis").body.axes)
    assert same is b


def test_a_number_alone_is_shown_as_people_know_it(tmp_path):
    """Name, else designation, else the number; found by each of them."""
    path = tmp_path / "q.csv"
    path.write_text(
        "pdes,name,epoch,e,a,i,om,w,ma\n"
        "153958,,2461200.5,.45,1.7,4.6,144,197,72\n"
        "433,,2461200.5,.22,1.46,10.8,304,178,310\n"
        "9999999,,2461200.5,.22,1.46,10.8,304,178,310\n"
    )
    rows = catalogue(path)
    assert [a.name for a in rows] == ["2002 AM31", "Eros", "9999999"]
    assert [a.number for a in rows] == [153958, 433, 9999999]
    assert rows[0].label == "(153958) 2002 AM31"
    for name in ("153958", 153958, "2002 AM31", "2002am31"):
        assert Asteroid.from_file(path, name).number == 153958
    assert Asteroid.from_file(path, 9999999).designation == ""
    neocc = tmp_path / "a.ke1"
    neocc.write_text(KE1.replace("2024YR4", "99942"))
    assert catalogue(neocc)[0].label == "(99942) Apophis"


def test_neocc_orbit(tmp_path):
    path = tmp_path / "yr4.ke1"
    path.write_text(KE1)
    (a,) = catalogue(path)
    assert (a.name, a.designation) == ("2024 YR4", "2024 YR4")
    assert a.epoch.jd == 2461000.5
    assert a.quantity("a_au").value == 2.5158372264739257
    assert a.quantity("A2_au_d2").value == pytest.approx(-2.9e-14)
    path.write_text(KE1.replace(" NGR   0.0", " NGR   0.2"))
    assert catalogue(path)[0].orbit.nongrav.area_to_mass == pytest.approx(0.2e-3 * 1370.0 / 1361.0)
    path.write_text(KE1.replace("ECLM", "EQUM"))
    with pytest.raises(InvalidInput, match="OEF2"):
        catalogue(path)
    path.write_text("KEP 1 2")
    with pytest.raises(InvalidInput, match="OEF2"):
        catalogue(path)


@pytest.mark.skipif(not SHARED.is_dir(), reason="the source tables are not here")
@pytest.mark.parametrize("name", ["nea_sbdb_fullprec_2026-07.csv.gz", "nea_sbdb_fullprec_2020-09.csv.gz"])
def test_public_tables_have_complete_orbits(name):
    asteroids = catalogue(SHARED / name)
    assert len(asteroids) > 4000
    assert all(a.knows(*ELEMENTS, "name") for a in asteroids)
    assert len({a.row["number"] or a.designation for a in asteroids}) == len(asteroids)
    e = np.array([float(a.row["e"]) for a in asteroids])
    assert np.all((e >= 0) & (e < 1))


@pytest.mark.skipif(not SHARED.is_dir(), reason="the source tables are not here")
def test_agencies_agree_on_apophis_and_bennu():
    for number in ("99942", "101955"):
        (a,) = catalogue(SHARED / "neocc" / f"{number}.ke1")
        ours = Asteroid.from_catalogue(number)
        assert float(a.row["i_deg"]) == pytest.approx(float(ours.row["i_deg"]), abs=5e-3)
        if a.row["epoch_jd_tdb"] == ours.row["epoch_jd_tdb"]:
            assert float(a.row["a_au"]) == pytest.approx(float(ours.row["a_au"]), abs=1e-8)


@pytest.mark.skipif(not SHARED.is_dir(), reason="the source tables are not here")
@pytest.mark.parametrize("name", ["99942", "101955", "433", "65803", "2024YR4"])
def test_neocc_covariance_has_the_published_sigmas(name):
    path = SHARED / "neocc" / f"{name}.ke1"
    (a,) = catalogue(path)
    covariance = a.orbit.covariance
    rms = next(line.split()[2:] for line in path.read_text().splitlines() if line.startswith("! RMS"))
    units = [u.au, u.one, *[u.deg] * 4, 1e-10 * u.au / u.d**2]
    published = [(float(x) * k).si.value for x, k in zip(rms, units[: len(rms)], strict=True)]
    np.testing.assert_allclose(covariance.sigma, published, rtol=1e-4)
    assert covariance.names == ("a", "e", "i", "node", "peri", "M", "A2")[: len(rms)]
    assert covariance.correlated
    # The correlations that the file prints for readers are those of the matrix.
    upper = [c for line in path.read_text().splitlines() if line.startswith(" COR") for c in line.split()[1:]]
    ours = covariance.matrix / np.outer(covariance.sigma, covariance.sigma)
    np.testing.assert_allclose(ours[np.triu_indices(len(rms))], np.array(upper, dtype=float), atol=1e-9)


def test_neocc_covariance_that_does_not_fit_is_refused(tmp_path):
    path = tmp_path / "yr4.ke1"
    path.write_text(KE1 + " COV 1.0 2.0 3.0\n")
    with pytest.raises(InvalidInput, match="COV"):
        catalogue(path)


def test_sbdb_answer_with_its_covariance(tmp_path):
    from importlib import resources

    text = resources.files("flybystab.data").joinpath("covariances", "99942.json").read_text()
    path = tmp_path / "apophis.json"
    path.write_text(text)
    (a,) = catalogue(path)
    assert (a.name, a.number, a.designation, a.epoch.jd) == ("Apophis", 99942, "2004 MN4", 2461000.5)
    assert a.quantity("A1_au_d2").value == 5e-13
    covariance = pickle.loads(pickle.dumps(a)).orbit.covariance
    assert covariance.names == ("e", "q", "tp", "node", "peri", "i", "A1", "A2")
    assert covariance.epoch.jd == 2459215.5
    days = covariance.sigma[covariance.names.index("tp")] / 86400
    assert days == pytest.approx(6.49530087949757e-07, rel=1e-9)
    assert np.rad2deg(covariance.sigma[3]) == pytest.approx(3.06869659837637e-06, rel=1e-9)
    assert covariance.values[2] == pytest.approx((2459101.039422462638 - 2459215.5) * 86400, abs=1e-3)
    path.write_text(text.replace('"tp"', '"tperi"'))
    with pytest.raises(InvalidInput, match="tp"):
        catalogue(path)
    other = text.replace('"value": "2.",', '"value": "2.15",', 1)  # the exponent NM
    assert other != text
    path.write_text(other)
    with pytest.raises(InvalidInput, match="comet"):
        catalogue(path)
    path.write_text("{}")
    with pytest.raises(InvalidInput, match="SBDB"):
        catalogue(path)


def test_sigmas_alone_are_marked(tmp_path):
    ours = Asteroid.from_catalogue("Toutatis")
    covariance = ours.orbit.covariance
    assert not covariance.correlated
    assert "without correlations" in covariance.source
    np.testing.assert_allclose(covariance.sigma[0], ours.quantity("sigma_a_au").to_value(u.m))
    assert Asteroid.from_catalogue("Apophis").orbit.covariance.correlated
    assert Asteroid.from_catalogue("Bennu").orbit.covariance.source == "ESA NEOCC (101955.ke1)"
    path = tmp_path / "plain.csv"
    path.write_text(KE1_ROW)
    (a,) = catalogue(path)
    assert a.orbit.covariance is None
