"""The embedded catalogue: completeness, honesty about what was measured, and lookup."""

import csv
import io
import itertools
import os
import subprocess
import sys
from importlib import resources
from pathlib import Path

import astropy.units as u
import numpy as np
import pytest

from flybystab.body.body import Material
from flybystab.catalogues.catalogue import UNITS, Asteroid, catalogue, catalogue_table, key_of
from flybystab.constants import G
from flybystab.errors import InvalidInput, UnknownName

REPO = Path(__file__).resolve().parents[2]
SHARED = Path(os.environ.get("FLYBYSTAB_SHARED", REPO.parent / "shared"))
ALL = catalogue()

FAMOUS = [
    "Apophis",
    "Toutatis",
    "Bennu",
    "Itokawa",
    "Eros",
    "Geographos",
    "Golevka",
    "Castalia",
    "Didymos",
    "Anteros",
    "Apollo",
    "Betulia",
    "Ra-Shalom",
    "Sisyphus",
    "Nereus",
    "Phaethon",
    "YORP",
    "Mithra",
    "Duende",
    "Ryugu",
    "Icarus",
    "Toro",
    "Cerberus",
    "Moshup",
    "Florence",
    "Bacchus",
    "1950 DA",
    "1999 KW4",
    "2000 ET70",
    "2008 EV5",
    "1996 FG3",
    "1992 SK",
    "2012 TC4",
    "2005 YU55",
    "2012 DA14",
]


@pytest.mark.parametrize("name", FAMOUS)
def test_famous_asteroids_have_a_body_and_elements(name):
    a = Asteroid.from_catalogue(name)
    assert np.all(a.body.axes > 0)
    assert a.knows("epoch_jd_tdb", "a_au", "e", "i_deg", "node_deg", "peri_deg", "M_deg")


def test_every_row_makes_a_valid_body_with_uncertainties_and_sources():
    assert len(ALL) >= 60
    for a in ALL:
        axes = a.body.axes
        assert axes[0] >= axes[1] >= axes[2] > 0
        assert 500 < a.body.rho < 5000
        r = a.record
        assert all(r[f"semi_axis_{x}_sigma_m"] > 0 * u.m for x in "abc")
        assert r["density_sigma_kg_m3"] > 0 * u.kg / u.m**3
        assert r["spin_period_sigma_h"] > 0 * u.h
        assert {"semi_axes", "diameter", "spin", "density", "orbit"} <= set(a.sources)
        # Semi-axes and equivalent diameter are the same volume.
        assert 2 * a.body.mean_radius.value == pytest.approx(r["diameter_m"].value, rel=2e-5)
        assert 0 < r["e"] < 1
        assert 0.3 < r["a_au"].value < 5


def test_unnumbered_bodies_with_trusted_lightcurves_are_in():
    """The LCDB marks them all with the number -9."""
    for name in ("1998 KY26", "2010 FC81", "2012 LZ1", "2016 PN"):
        a = Asteroid.from_catalogue(name)
        assert a.number is None
        assert a.sources["spin"].startswith("LCDB 2021")
        assert a.knows("amplitude_mag")


def test_names_are_unique():
    keys = [key_of(n) for a in ALL for n in a.names]
    assert len(keys) == len(set(keys))


def test_assumed_values_never_look_measured():
    for a in ALL:
        assert set(a.assumed) <= set(UNITS) | {"spin_state"}
        assert not set(a.assumed) & set(a.measured)
        assert ("density_kg_m3" in a.assumed) == (a.row["density_assumed"] == "true")
        assert (a.sources["density"].startswith("assumed")) == (a.row["density_assumed"] == "true")
        if a.row["shape_kind"] == "size+elongation":
            assert "semi_axis_b_m" in a.assumed
            assert any("shape" in x for x in a.assumptions)
        else:
            assert a.row["shape_kind"] == "measured"
            assert "semi_axis_a_m" not in a.assumed
        if a.row["density_assumed"] == "true":
            assert "density" in a.assumptions


@pytest.mark.parametrize(
    "name",
    [
        "Apophis",
        "apophis",
        " APOPHIS ",
        "99942",
        99942,
        "2004 MN4",
        "2004mn4",
        "(99942) Apophis",
        "99942 2004 MN4",
    ],
)
def test_apophis_by_any_name(name):
    a = Asteroid.from_catalogue(name)
    assert (a.name, a.number, a.designation) == ("Apophis", 99942, "2004 MN4")


def test_unknown_name_offers_near_ones():
    with pytest.raises(UnknownName, match="Apophis") as error:
        Asteroid.from_catalogue("Apohpis")
    assert error.value.suggestions[0] == "Apophis"
    with pytest.raises(UnknownName):
        Asteroid.from_catalogue("")


def test_apophis_record_is_jpl_220_and_its_shape_has_the_inertia_of_lee_2022():
    a = Asteroid.from_catalogue("Apophis")
    row = a.row
    assert (row["a_au"], row["e"], row["M_deg"]) == (
        ".9223803173917017",
        ".1911663355386932",
        "312.8054663584516",
    )
    assert (row["epoch_jd_tdb"], row["orbit_solution"]) == ("2461000.5", "JPL 220")
    assert float(row["A2_au_d2"]) == -2.901766637153165e-14
    assert (a.epoch.scale, a.epoch.jd) == ("tdb", 2461000.5)
    inertia = a.body.inertia
    assert (inertia / inertia[2]).value == pytest.approx([0.64, 0.97, 1.0], abs=1e-5)
    assert 2 * a.body.mean_radius.to_value(u.m) == pytest.approx(340, abs=0.01)
    assert row["density_assumed"] == "true"
    assert a.tumbles
    # The pole is that of the angular momentum: ecliptic (275, -85) deg.
    q = a.attitude(40 * u.deg, phase=0.3)
    momentum = q @ (a.body_with(phase=0.3).omega * inertia.value)
    assert momentum / np.linalg.norm(momentum) == pytest.approx(a.pole, abs=1e-12)


def test_toutatis_long_axis_is_fifty_degrees_from_its_angular_momentum():
    # Hudson & Ostro 1995; the periods of precession and rotation in the table are independent of that angle.
    a = Asteroid.from_catalogue("Toutatis")
    for phase in (0.0, 0.1, 0.25):
        b = a.body_with(phase=phase)
        h = b.omega * b.inertia.value
        assert np.degrees(np.arccos(h[0] / np.linalg.norm(h))) == pytest.approx(50, abs=2)


def test_kw4_density_and_size_give_its_measured_mass():
    # Ostro et al. 2006: 2.353e12 kg, from the orbit of the moon.
    assert Asteroid.from_catalogue("1999 KW4").body.mass.value == pytest.approx(2.353e12, rel=0.01)


def test_ryugu_mass_is_that_of_its_gm():
    assert G * Asteroid.from_catalogue("Ryugu").body.mass.value == pytest.approx(
        30.0, rel=0.02
    )  # 3.00e-8 km3/s2


def test_poles_of_bennu_and_ryugu_agree_with_published_ecliptic_ones():
    # Bennu: obliquity of the pole near 178 deg; Ryugu: (179.3, -87.44) deg (Watanabe et al. 2019).
    assert float(Asteroid.from_catalogue("Ryugu").row["pole_ecl_lat_deg"]) == pytest.approx(-87.44, abs=0.02)
    assert float(Asteroid.from_catalogue("Ryugu").row["pole_ecl_lon_deg"]) == pytest.approx(179.3, abs=0.1)
    assert float(Asteroid.from_catalogue("Bennu").row["pole_ecl_lat_deg"]) < -80


def test_material_is_passed_on():
    m = Material(friction_angle=20 * u.deg)
    a = Asteroid.from_catalogue("Anteros", material=m)
    assert a.body.material is m
    assert a.body_with(Material(friction_angle=30 * u.deg)).material.friction_angle == 30 * u.deg
    with pytest.raises(InvalidInput, match="pole"):
        a.attitude(0 * u.deg)


def test_table_has_units_and_says_what_it_is():
    t = catalogue_table()
    assert len(t) == len(ALL)
    assert t["semi_axis_a_m"].unit == u.m
    assert t["A2_au_d2"].unit == u.au / u.d**2
    assert t.meta["time_scale"] == "TDB"
    assert np.isnan(t["A2_au_d2"]).any()
    assert np.isfinite(t["semi_axis_a_m"]).all()


def test_own_file_with_few_columns(tmp_path):
    path = tmp_path / "mine.csv"
    path.write_text(
        "name,semi_axis_a_m,semi_axis_b_m,semi_axis_c_m,density_kg_m3,spin_period_h\n"
        "Rock,100,90,80,2000,5\nSand,1,1,x,2000,\n"
    )
    rock = Asteroid.from_file(path, "rock")
    assert rock.body.axes == pytest.approx([100, 90, 80])
    assert rock.pole is None
    assert rock.record["a_au"] is None
    with pytest.raises(InvalidInput, match="epoch_jd_tdb"):
        _ = rock.orbit
    sand = catalogue(path)[1]
    with pytest.raises(InvalidInput, match="semi_axis_c_m = x"):
        _ = sand.semi_axes
    with pytest.raises(InvalidInput, match="spin_period_h"):
        sand.quantity("spin_period_h")


@pytest.mark.parametrize(
    ("text", "error", "match"),
    [
        ("name,semi_axis_a_km\nx,1\n", UnknownName, "semi_axis_a_m"),
        ("a_au\n1\n", InvalidInput, "at least one of"),
        ("name,a_au\nx,1,2\n", InvalidInput, "line 2"),
        ("name,a_au\nx\n", InvalidInput, "line 2"),
        ("", InvalidInput, "at least one of"),
    ],
)
def test_bad_files_are_named(tmp_path, text, error, match):
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with pytest.raises(error, match=match):
        catalogue(path)


def test_missing_file():
    with pytest.raises(InvalidInput, match="nowhere"):
        catalogue("/nowhere/at/all.csv")


def test_readme_explains_every_column():
    text = (REPO / "data" / "README.md").read_text()
    header = next(
        csv.reader(io.StringIO(resources.files("flybystab.data").joinpath("asteroids.csv").read_text()))
    )
    for c in header:
        stem = c
        for x in "abc":
            stem = stem.replace(f"semi_axis_{x}_", "semi_axis_{a,b,c}_")
        assert stem in text or c.startswith("sigma_"), c


@pytest.mark.skipif(not (SHARED / "data").is_dir(), reason="the source tables are not here")
def test_the_script_rebuilds_the_embedded_file(tmp_path):
    out = tmp_path / "asteroids.csv"
    subprocess.run(
        [
            sys.executable,
            REPO / "scripts" / "build_catalogue.py",
            "--source",
            SHARED / "data",
            "--output",
            out,
        ],
        check=True,
        capture_output=True,
    )
    # The last digits of computed elements depend on the processor and its mathematical library.
    built, kept = (list(csv.reader(p.open(encoding="utf-8"))) for p in (out, REPO / "data" / "asteroids.csv"))
    assert [len(row) for row in built] == [len(row) for row in kept]
    for new, old in zip(itertools.chain(*built), itertools.chain(*kept), strict=True):
        if new != old:
            assert float(new) == pytest.approx(float(old), rel=1e-12)


@pytest.mark.parametrize(
    ("column", "value", "expected"),
    [
        ("density_kg_m3", "-2600", "in [50, 25000]"),
        ("density_kg_m3", "2.6", "in [50, 25000]"),  # g/cm3
        ("semi_axis_a_m", "0", "in [0.05, 5e+06]"),
        ("spin_period_h", "-30", "in [0.0001, 100000]"),
        ("e", "-0.1", "of at least 0"),
        ("sigma_a_au", "-1e-9", "of at least 0"),
        ("a_au", "nan", "a finite number"),
    ],
)
def test_a_value_that_cannot_be_is_refused_with_its_row(column, value, expected):
    apophis = Asteroid.from_catalogue("Apophis")
    bad = Asteroid(dict(apophis.row) | {column: value}, file="mine.csv")
    with pytest.raises(InvalidInput, match=column) as error:
        bad.quantity(column)
    assert expected in str(error.value)
    assert "(99942) Apophis in mine.csv" in str(error.value)


def test_every_embedded_value_is_within_its_limits():
    for a in catalogue():
        for column in UNITS:
            if a.row.get(column):
                a.quantity(column)


def test_other_separators_are_named(tmp_path):
    file = tmp_path / "semi.csv"
    file.write_text("name;a_au\nX;1.2\n")
    with pytest.raises(InvalidInput, match="commas between the columns"):
        catalogue(file)


@pytest.mark.parametrize(
    ("cells", "match"),
    [
        ("80,90,100,", "a >= b >= c for Rock in mine.csv"),
        ("0.1,0.09,0.08,180", "sphere of diameter_m = 180"),  # km
    ],
)
def test_semi_axes_in_another_order_or_unit_are_refused(tmp_path, monkeypatch, cells, match):
    monkeypatch.chdir(tmp_path)
    Path("mine.csv").write_text(
        "name,semi_axis_a_m,semi_axis_b_m,semi_axis_c_m,diameter_m,density_kg_m3,spin_period_h\n"
        f"Rock,{cells},2000,5\n"
    )
    with pytest.raises(InvalidInput, match=match):
        _ = Asteroid.from_file("mine.csv", "Rock").body
