"""Orbit files of agencies and programs: states, covariances and close approaches against published values."""

import re
from pathlib import Path

import astropy.units as u
import numpy as np
import pytest
from astropy.time import Time

import flybystab as fs
from flybystab.catalogues.catalogue import catalogue
from flybystab.catalogues.readers.covariances import covariance_of
from flybystab.constants import AU, DAY
from flybystab.errors import InvalidInput
from flybystab.orbit.elements import GM_TOTAL

FILES = Path(__file__).parent / "files"
AU_KM = AU / 1e3


def closest(asteroid, start, stop, within, planet="earth"):
    """The closest encounter: JD (TDB), distance (km) and the sigma of its distance by the linear map (km)."""
    found = fs.find_encounters(
        asteroid.orbit,
        Time(start, scale="tdb"),
        Time(stop, scale="tdb"),
        within=within * u.au,
        planets=(planet,),
    )
    k = int(np.argmin(found["distance"].to_value(u.km)))
    return found["time"][k].tdb, found["distance"][k].to_value(u.km)


def sigma_of_distance(asteroid, start, stop, within):
    """One sigma of the distance (km), from the pairs of sigma points."""
    pairs = asteroid.orbit.sigma_points()

    def distance(orbit):
        found = fs.find_encounters(
            orbit,
            Time(start, scale="tdb"),
            Time(stop, scale="tdb"),
            within=within * u.au,
            planets=("earth",),
        )
        return found["distance"][0].to_value(u.km)

    return np.sqrt(sum((0.5 * (distance(a) - distance(b))) ** 2 for a, b in pairs))


def separation(a, b):
    """Distance (km) of two orbits that have one epoch."""
    assert a.epoch == b.epoch
    return float(np.linalg.norm((a.orbit.position - b.orbit.position).to_value(u.km)))


# 12: equinoctial elements of NEODyS


def test_equinoctial_elements():
    (a,) = catalogue(FILES / "2018VP1.eq0")
    assert a.name == "2018 VP1"
    time, distance = closest(a, "2018-10-01", "2018-12-01", 0.05)
    assert distance == pytest.approx(151078.0, abs=100.0)  # JPL
    assert abs((time - Time("2018-11-02T18:20", scale="tdb")).to_value(u.min)) < 2.0


def test_a_covariance_of_equinoctial_elements_is_that_of_keplerian_ones():
    """Sigma of the mean longitude and of the mean motion carry over: the spread along the orbit after two years."""
    (a,) = catalogue(FILES / "2018VP1.eq0")
    covariance = a.orbit.covariance
    assert covariance.elements == "equinoctial"
    x, _ = covariance.samples(4000, 1)
    states, _ = covariance.deviations(x)
    axis = np.array(
        [
            1.0 / (2.0 / np.linalg.norm(s[:3]) - s[3:] @ s[3:] / 1.32712440041279419e20)
            for s in states + covariance.states(covariance.values[None])
        ]
    )
    assert np.std(axis) / AU == pytest.approx(5.66778e-4, rel=0.04)  # RMS line of the file


@pytest.mark.slow
def test_impact_probability_of_2018_vp1():
    """JPL Sentry had 0.0041 for 2020-11-02; the linear map is good to a factor of two that far behind a passage."""
    (a,) = catalogue(FILES / "2018VP1.eq0")
    found = fs.encounter_distribution(a.orbit, "earth", Time("2020-11-02", scale="tdb"), n=20, seed=1)
    assert 0.002 < found.linear.impact_probability < 0.009


# 13: the MPC's own orbits


def test_an_mpc_orbit_by_its_two_sets_of_elements(tmp_path):
    path = FILES / "2020AB.json"
    (a,) = catalogue(path)
    text = path.read_text()
    (tmp_path / "car.json").write_text(text.replace('"COM"', '"COM_"'))
    (b,) = catalogue(tmp_path / "car.json")
    assert b.orbit.covariance.elements == "cartesian"
    assert separation(a, b) < 0.1
    sigmas = []
    for x in (a, b):
        time, distance = closest(x, "2019-12-01", "2020-02-01", 0.05)
        assert distance == pytest.approx(2573900.0, abs=100.0)
        assert abs((time - Time("2019-12-29T14:06:34", scale="tdb")).to_value(u.s)) < 5.0
        sigmas.append(sigma_of_distance(x, "2019-12-01", "2020-02-01", 0.05))
    assert sigmas[0] == pytest.approx(sigmas[1], rel=0.02)
    assert sigmas[0] == pytest.approx(830.0, rel=0.1)  # by 200 clones, which are good to 5 %
    # A matrix with the axes of the ecliptic that is taken for one of the ICRF gives 2,508 km.


def test_yarkovsky_of_the_mpc_is_a2(tmp_path):
    """Parameters of 2062 Aten by the MPC (schema 0.7): JPL has A2 = -1.3e-14 au/d2."""
    text = (FILES / "2020AB.json").read_text()
    text = text.replace('"peri_time"\n', '"peri_time", "yarkovsky"\n').replace(
        "58833.391454245\n", "58833.391454245, -0.000155007978983756\n"
    )
    text = text.replace('"cov55": 2.865499052870847e-08', '"cov55": 2.865499052870847e-08, "cov66": 1.75e-10')
    for k in range(6):
        text = text.replace('"cov66"', f'"cov{k}6": 0.0, "cov66"', 1)
    (tmp_path / "y.json").write_text(text)
    (a,) = catalogue(tmp_path / "y.json")
    assert a.row["A2_au_d2"] == repr(-0.000155007978983756 * 1e-10)
    assert a.orbit.covariance.names[-1] == "A2"
    assert a.orbit.covariance.sigma[-1] == pytest.approx(np.sqrt(1.75e-10) * 1e-10 * AU / DAY**2)


# 14: packed names on the command line


@pytest.mark.parametrize(
    "name", ["99942 Apophis (2004 MN4)", "K04M04N", "(99942) Apophis", "99942 (2004 MN4)"]
)
def test_full_names_find_an_asteroid(name):
    assert fs.Asteroid.from_catalogue(name).number == 99942


# 15, 16: tables of comets


def test_comets_of_the_mpc():
    hale_bopp, neowise, halley = catalogue(FILES / "CometEls.txt")
    assert [c.designation for c in (hale_bopp, neowise, halley)] == ["C/1995 O1", "C/2020 F3", "1P"]
    time, distance = closest(neowise, "2020-07-01", "2020-08-01", 0.7)
    assert distance / AU_KM == pytest.approx(0.6918, abs=1e-3)
    assert abs((time - Time("2020-07-23T01:13", scale="tdb")).to_value(u.h)) < 0.5


def test_a_parabola(tmp_path):
    text = (FILES / "CometEls.txt").read_text().splitlines()[1].replace("0.999191", "1.000000")
    (tmp_path / "x").write_text(text)
    (a,) = catalogue(tmp_path / "x")
    position, velocity = a.orbit.position.to_value(u.m), a.orbit.velocity.to_value(u.m / u.s)
    energy = 0.5 * velocity @ velocity - 1.32712440041279419e20 / np.linalg.norm(position)
    assert abs(energy) < 1e-9 * (velocity @ velocity)
    _, distance = closest(a, "2020-07-01", "2020-08-01", 0.7)
    assert distance / AU_KM == pytest.approx(0.6918, abs=0.01)


def test_fragments_of_shoemaker_levy_9():
    """Their passage of Jupiter in July 1992: 1.31 +- 0.02 radii (NSSDC)."""
    fragments = catalogue(FILES / "ELEMENTS.COMET")
    assert [f.designation for f in fragments] == ["D/1993 F2-A", "D/1993 F2-K", "D/1993 F2-W"]
    time, distance = closest(fragments[0], "1992-06-01", "1992-08-01", 0.01, "jupiter")
    assert distance / 71492.0 == pytest.approx(1.31, abs=0.02)
    assert time.isot.startswith("1992-07-07T")


def test_numbered_asteroids_of_jpl(tmp_path):
    """The layout of ELEMENTS.NUMBR and of ELEMENTS.UNNUM."""
    (tmp_path / "ELEMENTS.NUMBR").write_text(
        " Num   Name              Epoch      a          e        i         "
        "w        Node        M         H    G   Ref\n"
        "------ ----------------- ----- ---------- ---------- "
        "--------- --------- --------- ----------- ----- ---- ----------\n"
        "     1 Ceres             55400  2.7653485 0.07913825  10.58682 "
        " 72.58981  80.39320 113.4104434  3.34 0.12 JPL 30\n"
    )
    (a,) = catalogue(tmp_path / "ELEMENTS.NUMBR")
    assert (a.number, a.name, a.row["a_au"], a.row["M_deg"]) == (1, "Ceres", "2.7653485", "113.4104434")
    assert (a.row["node_deg"], a.row["peri_deg"], a.row["H_mag"]) == ("80.39320", "72.58981", "3.34")
    assert "digits" in a.orbit.covariance.caveat
    (tmp_path / "ELEMENTS.UNNUM").write_text(
        "Designation   Epoch      a          e        i         w        Node        M         H    G   Ref\n"
        "------------- ----- ----------- ---------- --------- --------- --------- ----------- ----- ---- ----------\n"
        "1927 LA       57000   3.3352066 0.32988100  17.68060 316.88680 194.60870 263.7376000 10.96 0.15 JPL 2\n"
    )
    (b,) = catalogue(tmp_path / "ELEMENTS.UNNUM")
    assert (b.designation, b.row["a_au"], b.epoch.jd) == ("1927 LA", "3.3352066", 2457000.5)


# 17: Horizons


def test_horizons_gives_one_orbit_by_elements_and_vectors():
    a, b = (catalogue(FILES / f"ceres_{kind}.txt")[0] for kind in ("elements", "vectors"))
    assert (a.number, a.name, a.epoch.jd) == (1, "Ceres", 2451544.5)
    assert separation(a, b) < 0.002
    (c,) = catalogue(FILES / "ceres_elements.ecsv")
    assert separation(a, c) < 1e-6


TEXT = """Target body name: 1 Ceres (A801 AA)               {source: JPL#48}
Center body name: Sun (10)                        {source: DE441}
Center-site name: BODY CENTER
Keplerian GM    : 2.9591220828411951E-04 au^3/d^2
Output units    : AU-D, deg, Julian Day Number (Tp)
Reference frame : Ecliptic of J2000.0
$$SOE
2451544.500000000 = A.D. 2000-Jan-01 00:00:00.0000 TDB
 EC= 7.837505574674922E-02 QR= 2.549670145428669E+00 IN= 1.058336066935565E+01
 OM= 8.049436497808115E+01 W = 7.392278720553115E+01 Tp=  2451516.163103133207
 N = 2.141950384425567E-01 MA= 6.069622713669460E+00 TA= 7.121194154895409E+00
 A = 2.766494289599058E+00 AD= 2.983318433769447E+00 PR= 1.680711199557247E+03
$$EOE
"""


def test_horizons_text_that_is_no_csv(tmp_path):
    (tmp_path / "x.txt").write_text(TEXT)
    (a,) = catalogue(tmp_path / "x.txt")
    assert separation(a, catalogue(FILES / "ceres_elements.txt")[0]) < 1e-6


def test_horizons_in_json(tmp_path):
    """Without ``format=text`` the API puts the same text into a JSON document."""
    import json

    (tmp_path / "x").write_text(
        json.dumps({"signature": {"source": "NASA/JPL Horizons API"}, "result": TEXT})
    )
    (a,) = catalogue(tmp_path / "x")
    assert separation(a, catalogue(FILES / "ceres_elements.txt")[0]) < 1e-6


PAGE = """*******************************************************************************
JPL/HORIZONS                  1 Ceres (A801 AA)            2021-Sep-22 17:02:01
Rec #:       1 (+COV) Soln.date: 2021-Apr-13_11:04:44   # obs: 1075 (1995-2021)

IAU76/J2000 helio. ecliptic osc. elements (au, days, deg., period=Julian yrs):

  EPOCH=  2458849.5 ! 2020-Jan-01.00 (TDB)         Residual RMS= .24563
   EC= .07687465013145245  QR= 2.556401146697176   TP= 2458240.1791309435
   OM= 80.3011901917491    W=  73.80896808746482   IN= 10.59127767086216
   A= 2.769289292143484    MA= 130.3159688200986   ADIST= 2.982177437589792

Asteroid physical parameters (km, seconds, rotational period in hours):
   GM= 62.6284             RAD= 469.7              ROTPER= 9.07417
   H= 3.53                 G= .120                 B-V= .713
*******************************************************************************
"""


def test_the_page_of_an_object(tmp_path):
    """Its state as Horizons prints it beside the elements: X = 1.007608869613381 au, ... (ICRF)."""
    (tmp_path / "x.txt").write_text(PAGE)
    (a,) = catalogue(tmp_path / "x.txt")
    state = [1.007608869613381, -2.390064275223502, -1.332124522752402]
    np.testing.assert_allclose(a.orbit.position.to_value(u.au), state, atol=1e-12)
    assert (a.row["H_mag"], a.row["diameter_m"], a.row["spin_period_h"]) == ("3.53", "939400", "9.07417")


def test_horizons_vectors_of_the_icrf_in_km_relative_to_the_barycentre(tmp_path):
    """The same state, turned, shifted by the Sun of the ephemeris and in other units."""
    (a,) = catalogue(FILES / "ceres_vectors.txt")
    bary = a.orbit.at(a.epoch, "ssb")
    numbers = [f"{x:.15E}" for x in (*bary[0].to_value(u.km), *bary[1].to_value(u.km / u.s))]
    text = (FILES / "ceres_vectors.txt").read_text()
    cells = next(line for line in text.splitlines() if line.startswith("2451544.5")).split(",")
    cells[2:8] = numbers
    text = text.replace("Sun (10) ", "Solar System Barycenter (0) ").replace("AU-D", "KM-S")
    text = text.replace("Ecliptic of J2000.0", "ICRF")
    text = "\n".join(",".join(cells) if line.startswith("2451544.5") else line for line in text.splitlines())
    (tmp_path / "v.csv").write_text(text)
    (b,) = catalogue(tmp_path / "v.csv")
    assert separation(a, b) < 1e-3
    # An answer from before 2021 is relative to the barycentre of DE431, 115 km away.
    (tmp_path / "v.csv").write_text(re.sub(r"(Barycenter .*)DE441", r"\1DE431", text))
    (c,) = catalogue(tmp_path / "v.csv")
    assert separation(a, c) == pytest.approx(120.0, abs=10.0)


@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        ("Sun (10)", "Earth (399)", "centre"),
        ("Ecliptic of J2000.0", "Body equator of date", "frame"),
        ("AU-D", "LY-D", "units"),
        ("TDB\n EC", "UT\n EC", "time scale"),
        ("2.9591220828411951E-04", "8.887692445125634E-10", "Keplerian GM"),
    ],
)
def test_horizons_refuses_other_centres_frames_and_units(tmp_path, old, new, match):
    (tmp_path / "x.txt").write_text(TEXT.replace(old, new))
    with pytest.raises(InvalidInput, match=match):
        catalogue(tmp_path / "x.txt")


NONGRAV = """Comet non-gravitational force model (AMRAT=m^2/kg;A1-A3=au/d^2;DT=days;R0=au):
   AMRAT=  0.                                      DT=  0.
   A1= 4.887055233121E-10  A2= 1.554720290005E-10  A3= 0.
 Standard model:
   ALN=  .1112620426   NK=  4.6142   NM=  2.15     NN=  5.093    R0=  2.808
***********
"""


def test_horizons_has_the_law_of_its_accelerations(tmp_path):
    path = tmp_path / "x.txt"
    path.write_text(NONGRAV + TEXT)
    (a,) = catalogue(path)
    assert a.orbit.nongrav.law == "comet"
    assert a.row["A1_au_d2"] == "4.887055233121e-10"
    path.write_text(NONGRAV.replace("DT=  0.", "DT=  35.07").replace("AMRAT=  0.", "AMRAT= 1.5E-4") + TEXT)
    (b,) = catalogue(path)
    assert b.orbit.nongrav.delay == pytest.approx(35.07 * DAY, rel=1e-15)
    assert b.orbit.nongrav.area_to_mass == 1.5e-4
    path.write_text(NONGRAV.replace("R0=  2.808", "R0=  5.0") + TEXT)  # of carbon monoxide
    (c,) = catalogue(path)
    assert c.orbit.nongrav.constants == (0.1112620426, 5.0 * AU, 2.15, 5.093, 4.6142)
    path.write_text(NONGRAV.replace("R0=  2.808", "R0=  5.0").replace("NM=  2.15", "") + TEXT)
    with pytest.raises(InvalidInput, match="law"):
        catalogue(path)


# 18: FORMAT tables


def test_formats_of_layup_agree():
    """One fit of (3666) Holman, written by layup relative to the barycentre and to the Sun."""
    (a,) = catalogue(FILES / "layup_bcart_eq.csv")
    (b,) = catalogue(FILES / "layup_com.csv")
    assert a.number == 3666
    assert separation(a, b) < 1.0
    # The state is that of the file: sigma of x of the file, 4.7e-7 au.
    assert a.orbit.covariance.sigma[0] == pytest.approx(np.sqrt(2.1828329316902996e-13) * AU)


def test_the_total_mass_is_the_sum_of_the_planets():
    """Planets without their satellites, which are 3e-7 of the whole."""
    from flybystab.orbit.ephemeris import BELT_GM, BODIES
    from flybystab.orbit.planets import PLANETS

    total = sum(PLANETS[name].gm for name in BODIES) + sum(BELT_GM.values())
    assert 0.0 < GM_TOTAL / total - 1.0 < 4e-7


@pytest.mark.parametrize("kind", ["BKEP", "BCOM", "BCART", "CART", "KEP", "COM", "CAREQ"])
def test_every_format_gives_the_same_orbit(tmp_path, kind):
    """The orbit of sorcha_kep.csv written in each FORMAT by independent two-body formulas."""
    from flybystab.catalogues.readers.conversion import heliocentric_state
    from flybystab.orbit.elements import GM_SUN, ecliptic_to_icrf, elements_from_state

    (a,) = catalogue(FILES / "sorcha_kep.csv")
    jd = a.epoch.jd
    state = np.concatenate([a.orbit.position.to_value(u.m), a.orbit.velocity.to_value(u.m / u.s)])
    zero = np.zeros(6) + 1.0
    if kind.startswith("B"):
        state = state - (heliocentric_state(jd, zero, "ssb") - zero)
    if kind in ("BKEP", "BCOM", "KEP", "COM"):
        q, e, i, node, peri, since = elements_from_state(state, GM_TOTAL if kind.startswith("B") else GM_SUN)
        gm = GM_TOTAL if kind.startswith("B") else GM_SUN
        angles = np.degrees([i, node, peri])
        if kind.endswith("KEP"):
            axis = q / (1.0 - e)
            values = [axis / AU, e, *angles, np.degrees(since * np.sqrt(gm / axis**3))]
            names = "a,e,inc,node,argPeri,ma"
        else:
            values = [q / AU, e, *angles, jd - 2400000.5 - since / DAY]
            names = "q,e,inc,node,argPeri,t_p_MJD_TDB"
    else:
        turn = np.eye(3) if kind == "CAREQ" else ecliptic_to_icrf().T
        values = [*(turn @ state[:3] / AU), *(turn @ state[3:] / AU * DAY)]
        names = "x,y,z,xdot,ydot,zdot"
    cells = ",".join(f"{v:.17g}" for v in values)
    (tmp_path / "x.csv").write_text(
        f"ObjID,FORMAT,{names},epochMJD_TDB\n1998 WD8,{kind},{cells},{jd - 2400000.5}\n"
    )
    (b,) = catalogue(tmp_path / "x.csv")
    assert separation(a, b) < 0.02


def test_openorb_with_and_without_a_header(tmp_path):
    """The state that JPL gives for the object of the file is 415 km from the two-body elements after 12 years."""
    (a,) = catalogue(FILES / "oorb.des")
    (tmp_path / "x.des").write_text((FILES / "oorb.des").read_text().splitlines()[1] + "\n")
    (b,) = catalogue(tmp_path / "x.des")
    assert separation(a, b) == 0.0
    time = Time(50100.3674396757, format="mjd", scale="tdb")
    position, _ = a.orbit.at(time)
    c, s = np.cos(np.radians(84381.448 / 3600)), np.sin(np.radians(84381.448 / 3600))
    x, y, z = position.to_value(u.au)
    jpl = np.array([-0.52266867184861, 0.935304708306426, 0.0134637474765193])
    assert np.linalg.norm(np.array([x, c * y + s * z, c * z - s * y]) - jpl) * AU_KM < 450.0


ORB = """# OpenOrb orbit file
#
#
#-0001-|-0002-|-0003-|-0004-|-0005-|-0006-|-0007-|-0008-
"""


def test_orbit_files_of_openorb(tmp_path):
    """Keplerian, cometary and cartesian lines of one orbit, in the widths of the Fortran formats."""
    (a,) = catalogue(FILES / "sorcha_kep.csv")
    orbit = [2.7423446, 0.0251904999999999, 6.21767, 69.84901, 33.18081, 154.5357]

    def line(values, rest):
        return f"{'1998 WD8':16s}" + "".join(f" {v:21.14E}" for v in values) + rest + "\n"

    path = tmp_path / "x.orb"
    path.write_text(ORB + line(orbit, " 2023  9 13.00000"))
    (b,) = catalogue(path)
    assert separation(a, b) < 1e-3
    state = np.concatenate([a.orbit.position.to_value(u.au), a.orbit.velocity.to_value(u.au / u.d)])
    c, s = np.cos(np.radians(84381.448 / 3600)), np.sin(np.radians(84381.448 / 3600))
    turn = np.array([[1, 0, 0], [0, c, s], [0, -s, c]])
    values = np.concatenate([turn @ state[:3], turn @ state[3:]])
    tags = "|".join(f"-{k:04d}-" for k in (1, 39, 40, 41, 42, 43, 44, 74, *range(9, 30)))
    sigma = [1e-7, 2e-7, 3e-7, 1e-9, 2e-9, 3e-9]
    errors = "".join(f" {x:15.7E}" for x in (*sigma, 0.5, *[0.0] * 14))
    path.write_text(ORB.rpartition("#-")[0] + f"#{tags}\n" + line(values, f" {60200.0:16.10f}" + errors))
    (d,) = catalogue(path)
    assert separation(a, d) < 0.01
    assert d.orbit.covariance.correlated
    # x is the same axis in ecliptic and equator; y is not.
    assert d.orbit.covariance.sigma[0] == pytest.approx(1e-7 * AU)
    assert np.trace(d.orbit.covariance.matrix[:3, :3]) == pytest.approx(14e-14 * AU**2)


def test_columns_of_sorcha_in_any_order_and_with_tabs(tmp_path):
    text = "ObjID\t\ta\t\te\tinc\tnode\targPeri\tma\tepochMJD_TDB\tFORMAT\n"
    text += "2010_TU149\t2.2103867\t0.8245336\t1.9679\t58.91911\t92.60419\t324.21145\t60200\tKEP\n"
    (tmp_path / "x").write_text("# comment\n" + text)
    (a,) = catalogue(tmp_path / "x")
    assert (a.row["a_au"], a.epoch.jd) == ("2.2103867", 2460200.5)


def test_a_covariance_of_elements_in_unknown_units_is_refused(tmp_path):
    header, row = (FILES / "layup_com.csv").read_text().splitlines()
    names = ",".join(f"cov_{i}_{j}" for i in range(6) for j in range(6))
    (tmp_path / "x.csv").write_text(f"{header},{names}\n{row},{','.join(['1e-12'] * 36)}\n")
    with pytest.raises(InvalidInput, match="BCART_EQ"):
        catalogue(tmp_path / "x.csv")


# 19: Find_Orb


def test_find_orb():
    (a,) = catalogue(FILES / "find_orb_total.json")
    assert a.name == "Test_1001"
    assert not a.orbit.covariance.correlated
    time, distance = closest(a, "2031-08-01", "2031-09-15", 0.05)
    assert distance == pytest.approx(42608.0, abs=2000.0)
    assert time.isot.startswith("2031-08-25")
    (b,) = catalogue(FILES / "find_orb_covar.json")
    state = [2.40431779633740117, -2.0586498601048886, 1.56463294002342372e-05]
    x, y, z = b.orbit.position.to_value(u.au)
    c, s = np.cos(np.radians(84381.448 / 3600)), np.sin(np.radians(84381.448 / 3600))
    np.testing.assert_allclose([x, c * y + s * z, c * z - s * y], state, atol=1e-12)
    assert closest(b, "2031-08-01", "2031-09-15", 0.05)[1] == pytest.approx(23944.0, abs=2000.0)
    # 436 km between the two files at the epoch of the elements
    position, _ = b.orbit.at(a.epoch)
    assert np.linalg.norm((position - a.orbit.position).to_value(u.km)) == pytest.approx(436.0, abs=5.0)


def test_a_cartesian_covariance_of_the_ecliptic_is_turned():
    """The variance along the pole of the ecliptic stays there."""
    matrix = np.diag([1e-14, 1e-14, 4e-12, 1e-18, 1e-18, 1e-18])
    names = ("x", "y", "z", "vx", "vy", "vz")
    found = covariance_of(2461000.5, names, [1.0, 0.2, 0.1, 0.0, 0.017, 0.0], matrix, "", "x")
    pole = np.array([0.0, -np.sin(np.radians(84381.448 / 3600)), np.cos(np.radians(84381.448 / 3600))])
    assert pole @ found.matrix[:3, :3] @ pole == pytest.approx(4e-12 * AU**2, rel=1e-6)
