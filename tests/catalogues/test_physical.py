"""Physical parameters from files of JPL, SsODNet, DAMIT, the LCDB and a user, and alternative spin solutions."""

import gzip
import json

import numpy as np
import pytest

import flybystab as fs
from flybystab.catalogues.physical import PHYSICAL_READERS, read_physical
from flybystab.catalogues.spin_solutions import SpinSolution, chosen, solution_columns, solutions_of
from flybystab.cli.main import main
from flybystab.errors import InvalidInput
from flybystab.screening.draws import Attitudes, draws


def quantity(value, error):
    return {"value": value, "error": {"min": -error, "max": error}}


#: Physical parameters of Bennu in the form of the SBDB API (values of JPL 118).
ANSWER = {
    "object": {"des": "101955", "fullname": "101955 Bennu (1999 RQ36)", "spkid": "20101955"},
    "phys_par": [
        {"name": "H", "value": "20.21", "sigma": None, "units": None, "ref": "MPO"},
        {"name": "diameter", "value": ".48444", "sigma": ".00041", "units": "km", "ref": "Goossens (2021)"},
        {
            "name": "extent",
            "value": ".5047x.4918x.4567",
            "sigma": ".0005",
            "units": "km",
            "ref": "Goossens (2021)",
        },
        {"name": "GM", "value": "4.8904E-9", "sigma": "9E-13", "units": "km^3/s^2", "ref": "Goossens (2021)"},
        {"name": "density", "value": "1.194", "sigma": ".003", "units": "g/cm^3", "ref": "Goossens (2021)"},
        {"name": "rot_per", "value": "4.296061", "sigma": "2e-06", "units": "h", "ref": "Daly (2020)"},
        {"name": "pole", "value": "85.4522/-60.3678", "sigma": None, "units": "deg", "ref": "Daly (2020)"},
    ],
}
#: The card of Bennu of 2026-06 (SsODNet 1.2.1), without what is not read.
CARD = {
    "id": "Bennu", "name": "Bennu", "number": 101955, "aliases": ["101955", "1999 RQ36"],
    "ssocard": {"version": "1.2.1"},
    "parameters": {"physical": {
        "absolute_magnitude": {"H": quantity(20.68, 0.01), "G": quantity(0.15, 0.01)},
        "diameter": quantity(0.488, 0.019) | {"bibref": [{"shortbib": "Barnouin+2019"}]},
        "ellipsoid": {"a/b": quantity(1.027, 0.0), "a/c": quantity(1.105, 0.001), "b/c": quantity(1.077, 0.001),
                      "bibref": [{"shortbib": "Barnouin+2019"}]},
        "mass": quantity(73303956923.07692, 5261538.46),
        "density": quantity(1204.673, 140.796) | {"bibref": [{"shortbib": "Berthier+2023"}]},
        "taxonomy": {"class": "B", "complex": "B", "bibref": [{"shortbib": "Mahlke+2022"}]},
        "spins": [{
            "id_spin": 1, "period": quantity(4.296057, 2e-6), "period_type": "sidereal",
            "long": quantity(71.067, 0.12), "lat": quantity(-83.322, 0.09), "bibref": [{"shortbib": "Barnouin+2019"}],
        }],
    }},
}  # fmt: skip
SPIN = "  252  -63  12.13237\n2451933.95456  0.0\n"
MIRROR = "  72.5  -50.1  12.1324\r\n2451933.95456  0.0\r\n0.1 -0.5 0.1\r\n"
LCDB = (
    "Number,Name,Desig,Family,CSource,Class,DiamSource,DiamFlag,Diam,HSource,10-H,HBand,GSource,G,G2,AlbSource,"
    "AlbFlag,Albedo,PFlag,19-Period,PerDesc,AmpFlag,AmpMin,23-AmpMax,U,Notes,IsBinary,Pole,Survey,ExNotes,Private\n"
    "433,Eros,1898 DQ,9101,A,S*,D,-,23.93,L,10.47,V,A,0.24,-9.99,A,-,0.20,-,5.270,-,-,0.06,1.40,3,-,-,Y,-,N,N\n"
    "887,Alinda,1918 DB,9101,A,S*,D,-,5.26,L,13.76,V,A,0.24,-9.99,A,-,0.20,-,28.41,-,-,0.12,0.35,2,-,-,Y,-,N,N\n"
    "887,Alinda,1918 DB,9101,A,S*,D,-,5.26,L,13.76,V,A,0.24,-9.99,A,-,0.20,-,73.97,-,-,0.12,0.35,2,-,-,Y,-,N,N\n"
    "887,Alinda,1918 DB,9101,A,S*,D,-,5.26,L,13.76,V,A,0.24,-9.99,A,-,0.20,-,11.0,-,-,0.12,0.35,1+,-,-,Y,-,N,N\n"
    "99942,Apophis,2004 MN4,9101,A,S,D,-,-9.99,L,18.94,V,A,0.24,-9.99,A,-,-9.99,-,30.56,-,-,0.3,1.14,3,T,-,Y,-,N,N\n"
)
SOLUTIONS = (
    "period_h,sigma_h,lon_deg,lat_deg,weight,source\n5.2,0.01,10,20,3,A\n7.8,,190,-20,1,B\n10.4,0.1,,,1,C\n"
)


def write(path, content):
    path.write_text(json.dumps(content) if isinstance(content, dict) else content)
    return path


def test_a_card_of_ssodnet(tmp_path):
    a = fs.Asteroid.from_catalogue("Bennu").with_physical(write(tmp_path / "c.json", CARD))
    axes = a.semi_axes.value
    assert axes[0] / axes[1] == pytest.approx(1.027)
    assert axes[1] / axes[2] == pytest.approx(1.077)
    assert np.prod(axes) == pytest.approx(244.0**3)
    assert a.body.density.value == 1204.673
    assert a.row["density_sigma_kg_m3"] == "140.796"
    assert (a.row["spin_period_h"], a.row["spin_period_sigma_h"]) == ("4.296057", "2e-06")
    assert (a.row["pole_ecl_lon_deg"], a.row["pole_ecl_lat_deg"]) == ("71.067", "-83.322")
    assert a.sources["density"] == "SsODNet: Berthier+2023 (c.json)"
    assert (
        a.sources["diameter"]
        == a.sources["semi_axes"]
        == a.sources["pole"]
        == "SsODNet: Barnouin+2019 (c.json)"
    )
    assert (a.row["taxonomic_class"], a.row["H_mag"]) == ("B", "20.68")
    assert a.spin_solutions == ()
    assert a.orbit.nongrav == fs.Asteroid.from_catalogue("Bennu").orbit.nongrav


def test_the_mass_of_a_card_gives_the_density(tmp_path):
    card = json.loads(json.dumps(CARD))
    del card["parameters"]["physical"]["density"]
    a = fs.Asteroid.from_catalogue("Bennu").with_physical(write(tmp_path / "c.json", card))
    assert a.body.density.value == pytest.approx(1204.673, rel=1e-4)
    assert "mass" in a.sources["density"]


def test_physical_parameters_of_an_answer_of_sbdb(tmp_path):
    a = fs.Asteroid.from_catalogue("Bennu").with_physical(write(tmp_path / "p.json", ANSWER))
    np.testing.assert_allclose(a.semi_axes.value, [252.35, 245.9, 228.35])
    assert (a.row["density_kg_m3"], a.row["spin_period_h"]) == ("1194", "4.296061")
    assert (a.row["density_sigma_kg_m3"], a.row["spin_period_sigma_h"]) == ("3", "2e-06")
    right_ascension, declination = np.radians([85.4522, -60.3678])
    across = np.cos(declination)
    pole = [across * np.cos(right_ascension), across * np.sin(right_ascension), np.sin(declination)]
    np.testing.assert_allclose(a.pole, pole, atol=1e-5)
    for key in ("density", "diameter", "semi_axes", "spin", "pole"):
        assert a.sources[key].startswith("JPL SBDB: "), key


def test_gm_and_extent_give_the_density(tmp_path):
    answer = ANSWER | {"phys_par": [p for p in ANSWER["phys_par"] if p["name"] != "density"]}
    a = fs.Asteroid.from_catalogue("Bennu").with_physical(write(tmp_path / "p.json", answer))
    gm = a.body.density.value * 4.0 / 3.0 * np.pi * np.prod(a.semi_axes.value) * 6.6743e-11
    assert gm == pytest.approx(4.8904, rel=1e-5)
    assert a.sources["density"].endswith("with extent")


def test_spin_files_of_damit_are_alternatives(tmp_path):
    itokawa = fs.Asteroid.from_catalogue("Itokawa")
    one = itokawa.with_physical(write(tmp_path / "spin.txt", SPIN))
    assert one.quantity("spin_period_h").value == 12.13237
    assert (one.row["pole_ecl_lon_deg"], one.row["pole_ecl_lat_deg"]) == ("252.0", "-63.0")
    assert one.sources["spin"] == "DAMIT (spin.txt)"
    assert one.semi_axes.value == pytest.approx(itokawa.semi_axes.value)
    two = itokawa.with_physical(tmp_path / "spin.txt", write(tmp_path / "mirror.txt", MIRROR))
    assert [s.pole for s in two.spin_solutions] == [(252.0, -63.0), (72.5, -50.1)]
    assert any("one of 2 alternative spin solutions (weight 50%)" in x for x in two.assumptions)


def test_rows_of_the_lcdb(tmp_path):
    path = write(tmp_path / "lcdb.csv", LCDB)
    eros = fs.Asteroid.from_catalogue("Eros")
    a = eros.with_physical(path)
    assert a.quantity("diameter_m").value == 23930.0
    np.testing.assert_allclose(
        a.semi_axes.value / eros.semi_axes.value, 23930.0 / eros.quantity("diameter_m").value, rtol=1e-6
    )
    assert (a.quantity("spin_period_h").value, a.row["amplitude_mag"]) == (5.27, "1.40")
    assert a.sources["spin"] == "LCDB, U = 3 (lcdb.csv)"
    body = next(b for b in read_physical(path) if "Alinda" in b.names)
    assert [s.period for s in body.spins] == [28.41, 73.97]  # those of the best quality
    tumbler = fs.Asteroid.from_catalogue("Apophis").with_physical(path)
    assert not tumbler.tumbles
    assert "tumbling replaced by principal-axis spin" in tumbler.assumptions
    with pytest.raises(InvalidInput, match=r"data of \(101955\) Bennu; it has: 433, 887, 99942"):
        fs.Asteroid.from_catalogue("Bennu").with_physical(path)


def test_a_screening_draws_alternative_solutions_by_their_weights(tmp_path):
    a = fs.Asteroid.from_catalogue("Itokawa").with_physical(write(tmp_path / "solutions.csv", SOLUTIONS))
    assert (a.quantity("spin_period_h").value, a.sources["spin"]) == (5.2, "A")
    sample = draws(a, 5000, seed=4)
    hours = sample.period / 3600.0
    for k, (period, share) in enumerate(((5.2, 0.6), (7.8, 0.2), (10.4, 0.2))):
        mine = hours[sample.solution == k]
        assert len(mine) / 5000 == pytest.approx(share, abs=4 * np.sqrt(share * (1 - share) / 5000))
        assert mine.mean() == pytest.approx(period, rel=1e-3)
    assert np.ptp(hours[sample.solution == 1]) == 0.0
    assert hours[sample.solution == 2].std() == pytest.approx(0.1, rel=0.1)
    poles = Attitudes.at(a, sample, 4, "earth").poles
    by_solution = [poles[sample.solution == k][:50] for k in range(3)]
    assert np.ptp(by_solution[0], axis=0).max() == np.ptp(by_solution[1], axis=0).max() == 0.0
    assert by_solution[0][0] @ by_solution[1][0] == pytest.approx(-1.0)
    assert np.ptp(by_solution[2], axis=0).max() > 1.0  # no pole: isotropic
    # A sample does not depend on the number of samples.
    assert np.array_equal(draws(a, 100, seed=4).period, sample.period[:100])


def test_without_alternatives_the_draws_are_those_of_the_catalogue():
    a = fs.Asteroid.from_catalogue("Itokawa")
    assert (draws(a, 10, seed=1).solution == -1).all()


def test_solutions_survive_their_column():
    solutions = (SpinSolution(5.0, 0.1, (10.0, -20.0), 2.0, "x"), SpinSolution(7.0, source="x"))
    assert solutions_of(solution_columns(solutions)) == solutions
    assert solution_columns(solutions[:1])["spin_solutions"] == ""
    assert list(chosen(solutions, np.array([0.0, 0.66, 0.67, 0.999999]))) == [0, 0, 1, 1]
    for bad in ({"period": 0.0}, {"period": 1.0, "weight": 0.0}, {"period": 1.0, "pole": (0.0, 91.0)}):
        with pytest.raises(InvalidInput, match="spin solution"):
            SpinSolution(**bad)


def test_formats_do_not_overlap_and_are_gzipped_or_named_as_they_like(tmp_path):

    texts = [json.dumps(CARD), SPIN, MIRROR, LCDB, SOLUTIONS, json.dumps(ANSWER)]
    for text in texts:
        assert sum(r.identify(text.replace("\r\n", "\n")) for r in PHYSICAL_READERS) == 1
        windows = text.replace("\r\n", "\n").replace("\n", "\r\n")
        (tmp_path / "x").write_bytes(gzip.compress(b"\xef\xbb\xbf" + windows.encode()))
        assert read_physical(tmp_path / "x")


@pytest.mark.parametrize("text", ["", "hello", "{}", "1 2 3\n4 5\n", '{"ssocard": 1, "physical": 2}', "\x00"])
def test_other_files_are_refused(tmp_path, text):
    (tmp_path / "x").write_text(text)
    with pytest.raises(InvalidInput, match=r"physical parameters|ssoCard"):
        fs.Asteroid.from_catalogue("Bennu").with_physical(tmp_path / "x")


def test_the_option_of_the_shell(tmp_path, capsys):
    path = write(tmp_path / "solutions.csv", SOLUTIONS)
    assert main(["stability", "Itokawa", "--phys", str(path)]) == 0
    first = capsys.readouterr().out
    assert main(["stability", "Itokawa", "--phys", str(path), "--period", "12.1 h"]) == 0
    assert capsys.readouterr().out != first
    assert main(["stability", "Itokawa", "--phys", str(tmp_path / "none")]) == 1


@pytest.mark.parametrize(
    ("name", "value", "unit"),
    [
        ("diameter", "340", "m"),
        ("density", "2000", "kg/m^3"),
        ("rot_per", "1.27", "d"),
        ("GM", "4.89", "m^3/s^2"),
    ],
)
def test_other_units_of_jpl_are_refused(tmp_path, name, value, unit):
    item = {"name": name, "value": value, "sigma": None, "units": unit, "ref": "X"}
    answer = {"object": {"des": "99942"}, "phys_par": [item]}
    with pytest.raises(InvalidInput, match=f"unit of {name}"):
        read_physical(write(tmp_path / "x.json", answer))
