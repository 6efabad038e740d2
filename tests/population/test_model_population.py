"""Populations from files: layouts, laws, and refusals that name what is missing."""

import gzip

import astropy.units as u
import numpy as np
import pytest
from astropy.table import QTable

import flybystab as fs
from flybystab.errors import InvalidInput, UnknownName
from flybystab.population.model_population import read_population

# three rows as in Granvik+_2018_Icarus.dat: a, e, i, node, argument of perihelion, mean anomaly, H
GRANVIK = (
    "1.5 0.40 10.0 30.0 40.0 50.0 18.1\n2.1 0.55 5.0 130.0 140.0 150.0 19.2\n0.9 0.20 20.0 1.0 2.0 3.0 24.9\n"
)


def test_granvik_realisation_is_read_with_and_without_gzip(tmp_path):
    plain, packed = tmp_path / "granvik.dat", tmp_path / "granvik.dat.gz"
    plain.write_text(GRANVIK)
    packed.write_bytes(gzip.compress(GRANVIK.encode()))
    for path in (plain, packed):
        table = fs.read_population(path)
        assert table["a"].to_value(u.au).tolist() == [1.5, 2.1, 0.9]
        assert np.asarray(table["e"]).tolist() == [0.40, 0.55, 0.20]
        assert table["i"].to_value(u.deg).tolist() == [10.0, 5.0, 20.0]
        assert np.asarray(table["H"]).tolist() == [18.1, 19.2, 24.9]


def test_columns_without_a_header_are_named_by_the_caller_never_guessed(tmp_path):
    path = tmp_path / "neomod.txt"
    path.write_text("18.1 1.5 0.4 10.0\n19.2 2.1 0.55 5.0\n")
    with pytest.raises(InvalidInput, match="names of its 4 columns"):
        read_population(path)
    table = read_population(path, columns=["H", "a", "e", "i"])
    assert table["a"].to_value(u.au).tolist() == [1.5, 2.1]
    assert np.asarray(table["H"]).tolist() == [18.1, 19.2]
    with pytest.raises(InvalidInput, match="4 names"):
        read_population(path, columns=["a", "e", "i"])
    with pytest.raises(InvalidInput, match="one column i"):
        read_population(path, columns=["H", "a", "e", "x"])


@pytest.mark.parametrize(
    "text",
    [
        "a,e,i,H\n1.5,0.4,10,18\n",
        "Inclination,Semimajor_axis,ecc,absmag,name\n10,1.5,0.4,18,x\n",
        "# a comment\na e i H_mag\n1.5 0.4 10 18\n",
    ],
)
def test_headers_name_the_columns_in_any_order(tmp_path, text):
    path = tmp_path / "table.csv"
    path.write_text(text)
    table = read_population(path)
    row = [table["a"][0].to_value(u.au), table["e"][0], table["i"][0].to_value(u.deg), table["H"][0]]
    assert row == [1.5, 0.4, 10.0, 18.0]


def test_units_of_an_ecsv_table_are_converted(tmp_path):
    path = tmp_path / "table.ecsv"
    QTable({"a": [u.au.to(u.km)] * u.km, "e": [0.3], "i": [0.1] * u.rad}).write(path)
    table = read_population(path)
    assert table["a"][0].to_value(u.au) == pytest.approx(1.0, rel=1e-14)
    assert table["i"][0].to_value(u.deg) == pytest.approx(np.degrees(0.1), rel=1e-14)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("a,e\n1,0.1\n", "a column i"),
        ("a,a_au,e,i\n1,1,0.1,1\n", "one column a"),
        ("a,e,i\n1,high,1\n", "numbers in column e"),
        ("1 2 3\n1 2\n", "a table of numbers"),
        ("", "at least one row"),
    ],
)
def test_what_is_wrong_with_a_table_is_said(tmp_path, text, expected):
    path = tmp_path / "table.csv"
    path.write_text(text)
    with pytest.raises(InvalidInput, match=expected):
        read_population(path)


LAW = """
count = 4000
asteroids = 900
a = { kind = "uniform", low = 0.8, high = 3.0 }
e = { kind = "uniform", low = 0.1, high = 0.8 }
i = { kind = "normal", mean = 10.0, sd = 8.0, low = 0.0, high = 90.0 }
H = { slope = 0.35, low = 14.0, high = 17.75 }
perihelion = [0.3, 1.3]
"""


def test_a_law_gives_its_distribution_its_limits_and_its_number(tmp_path):
    path = tmp_path / "law.toml"
    path.write_text(LAW)
    table = read_population(path, seed=3)
    q = table["a"].to_value(u.au) * (1 - np.asarray(table["e"]))
    assert len(table) == 4000
    assert q.min() >= 0.3
    assert q.max() <= 1.3
    assert np.sum(table["weight"]) == pytest.approx(900.0)
    # log10 N(<H) grows by 0.35 per magnitude: N(<16.75)/N(<17.75) = 10^-0.35, less the part below 14
    h = np.asarray(table["H"])
    expected = (10 ** (0.35 * 2.75) - 1) / (10 ** (0.35 * 3.75) - 1)
    assert np.mean(h < 16.75) == pytest.approx(expected, abs=4 * np.sqrt(expected * (1 - expected) / 4000))
    assert np.array_equal(read_population(path, seed=3)["a"], table["a"])
    assert not np.array_equal(read_population(path, seed=4)["a"], table["a"])


@pytest.mark.parametrize(
    ("change", "error", "expected"),
    [
        (("count = 4000", "count = 0"), InvalidInput, "count"),
        (("asteroids = 900", "asteroids = -1"), InvalidInput, "asteroids"),
        (("slope = 0.35, ", ""), InvalidInput, "H"),
        (("perihelion = [0.3, 1.3]", "perihelion = [9, 10]"), InvalidInput, "limits that"),
        (("count", "cuont"), UnknownName, "cuont"),
        (
            ('i = { kind = "normal", mean = 10.0, sd = 8.0, low = 0.0, high = 90.0 }', ""),
            InvalidInput,
            "i = ",
        ),
    ],
)
def test_a_wrong_law_is_refused_by_name(tmp_path, change, error, expected):
    path = tmp_path / "law.toml"
    path.write_text(LAW.replace(*change))
    with pytest.raises(error, match=expected):
        read_population(path)


def test_weights_multiply_rates():
    table = QTable({"a": [1.3, 2.0] * u.au, "e": [0.4, 0.6], "i": [10.0, 3.0] * u.deg, "weight": [3.0, 0.5]})
    plain = fs.encounter_rates(table["a", "e", "i"], "earth")
    heavy = fs.encounter_rates(table, "earth")
    assert heavy.total.value == pytest.approx(
        3.0 * plain.rate[0].value + 0.5 * plain.rate[1].value, rel=1e-14
    )
    assert np.array_equal(heavy.rate, plain.rate)
    table["weight"] = [-1.0, 1.0]
    with pytest.raises(InvalidInput, match="zero or more"):
        fs.encounter_rates(table, "earth")


def test_the_known_asteroids_are_those_of_the_mpc(shared):
    """All of H < 17.75; impacts on the Earth one in 0.5 to 0.7 Myr (published), the known ones one in 0.79 Myr."""
    import csv

    known = fs.known_population()
    with gzip.open(shared / "nea_mpc_2026-02.csv.gz", "rt") as file:
        rows = [r for r in csv.DictReader(file) if r["H"] and float(r["H"]) < 17.75]
    assert len(known) == len(rows) == 875
    assert set(known["designation"]) == {r["number"] or r["principal_desig"] for r in rows}
    interval = 1e-6 / fs.encounter_rates(known, "earth").total.value
    assert interval == pytest.approx(0.785, abs=0.005)


def test_the_limit_of_the_known_asteroids_is_checked():
    assert len(fs.known_population(20)) == 4783
    with pytest.raises(InvalidInput, match="at most 20"):
        fs.known_population(22.0)
    with pytest.raises(InvalidInput, match="largest asteroid"):
        fs.known_population(5.0)
