"""Orbit tables from elsewhere."""

import os
from pathlib import Path

import astropy.units as u
import numpy as np
import pytest

from flybystab.errors import InvalidInput
from flybystab.survey.catalogue import Asteroid, catalogue
from flybystab.survey.formats import with_physical_data

SHARED = Path(os.environ.get("FLYBYSTAB_SHARED", Path(__file__).resolve().parents[3] / "shared")) / "data"
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


def test_neocc_orbit(tmp_path):
    path = tmp_path / "yr4.ke1"
    path.write_text(KE1)
    (a,) = catalogue(path)
    assert (a.name, a.designation) == ("2024 YR4", "2024 YR4")
    assert a.epoch.jd == 2461000.5
    assert a.quantity("a_au").value == 2.5158372264739257
    assert a.quantity("A2_au_d2").value == pytest.approx(-2.9e-14)
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
