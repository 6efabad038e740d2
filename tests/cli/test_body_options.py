"""Options for a body of the user's own."""

import json
from argparse import ArgumentTypeError
from pathlib import Path

import pytest

from flybystab.cli.body_options import _axes, distance, measured
from flybystab.cli.main import main
from flybystab.errors import InvalidInput

FILES = Path(__file__).parents[1] / "cases" / "files"
BODY = [
    "--axes",
    "5x4.5x4+-0.5 m",
    "--density",
    "2+-0.3 g/cm3",
    "--period",
    "0.5+-0.1 h",
    "--pole",
    "120,-45",
]


@pytest.mark.parametrize(
    ("text", "unit", "value", "sigma"),
    [
        ("35", "deg", 35.0, 0.0),
        ("200+-20 m", "m", 200.0, 20.0),
        ("0.2 +/- 0.02 km", "m", 200.0, 20.0),
        ("2.1±0.3 g/cm3", "kg/m3", 2100.0, 300.0),
        ("1e2 Pa", "Pa", 100.0, 0.0),
    ],
)
def test_values_with_errors(text, unit, value, sigma):
    found = measured(text, unit, "x")
    assert (float(found), found.sigma) == pytest.approx((value, sigma))


@pytest.mark.parametrize(
    ("text", "axes", "errors"),
    [
        ("200x170x150+-10 m", [200, 170, 150], [10, 10, 10]),
        ("150 m x 0.2 km x 170 m", [200, 170, 150], [0, 0, 0]),
        ("200+-20x170+-5x150+-10 m", [200, 170, 150], [20, 5, 10]),
        ("0.2 km", [200, 200, 200], [0, 0, 0]),
    ],
)
def test_axes(text, axes, errors):
    assert _axes(text) == (pytest.approx(axes), pytest.approx(errors))


@pytest.mark.parametrize("text", ["200 kg", "m", "200+-", "1x2 m", ""])
def test_bad_axes(text):
    with pytest.raises(InvalidInput, match="--axes"):
        _axes(text)


@pytest.mark.parametrize(
    "words", [["--density", "2 m"], ["--pole", "1"], ["--period", "x"], ["--friction", "1 m"]]
)
def test_bad_options_are_wrong_usage(capsys, words):
    try:
        status = main(["stability", "Apophis", *words])
    except SystemExit as error:
        status = error.code
    assert status == 2
    assert words[0] in capsys.readouterr().err


def test_a_newly_found_object_from_its_file_to_a_verdict(capsys):
    words = ["flyby", str(FILES / "2023BU.ke1"), "--date", "2023-01-27", "--attitudes", "2", "--json"]
    assert main(words) == 1
    assert "--assume" in capsys.readouterr().err
    assert main([*words, *BODY, "--friction", "35+-5 deg", "--cohesion", "500 Pa"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["encounter"]["distance_km"] == pytest.approx(9967.0, abs=5.0)
    assert found["verdict"] == "INTACT"
    assert main([*words, "--assume", "--cohesion", "500"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert any("median of the population" in text for text in found["assumed"])


def test_a_report_samples_the_errors(capsys, tmp_path):
    path = tmp_path / "x.html"
    words = [
        "report",
        str(FILES / "2023BU.ke1"),
        "--date",
        "2023-01-27",
        "--attitudes",
        "2",
        "--samples",
        "8",
    ]
    assert main([*words, *BODY, "--cohesion", "500+-50 Pa", "--output", str(path)]) == 0
    assert "2023 BU" in path.read_text()


def test_stability_and_infer_take_a_body(capsys):
    file = str(FILES / "2023BU.ke1")
    assert main(["stability", file, *BODY, "--cohesion", "500", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["admissible"]
    assert main(["infer", file, *BODY, "--from", "2023-01-01", "--to", "2023-02-01", "--attitudes", "2"]) == 0
    assert "2000 kg/m3" in capsys.readouterr().out


def test_size_and_magnitude_of_an_object_without_either(tmp_path, capsys):
    """An orbit of the MPC without H: the size is given, or H with --assume."""
    (tmp_path / "x").write_text((FILES / "2020AB.json").read_text())
    words = ["stability", str(tmp_path / "x")]
    assert main([*words, "--assume"]) == 1
    assert "--diameter, --H" in capsys.readouterr().err
    assert main([*words, "--assume", "--H", "27.5"]) == 0
    by_magnitude = capsys.readouterr().out
    assert main([*words, "--assume", "--diameter", "12+-3 m"]) == 0
    by_size = capsys.readouterr().out
    assert by_magnitude != by_size
    assert main(["stability", "Bennu", "--diameter", "12 m", "--axes", "5 m"]) == 2
    assert "not both" in capsys.readouterr().err


def test_a_diameter_scales_the_known_shape():
    from argparse import Namespace

    from flybystab.catalogues.asteroid import Asteroid
    from flybystab.cli.body_options import with_body_options

    bennu = Asteroid.from_catalogue("Bennu")
    half = with_body_options(bennu, Namespace(diameter="0.25+-0.02 km"))
    ratio = half.semi_axes.value / bennu.semi_axes.value
    assert ratio == pytest.approx([ratio[0]] * 3)
    assert 2.0 * half.semi_axes.value.prod() ** (1 / 3) == pytest.approx(250.0)
    assert half.row["diameter_sigma_m"] == "20.0"


@pytest.mark.parametrize("text", ["200,150,140 m", "200x150xm"])
def test_bad_axes_are_described_by_axes(text):
    with pytest.raises(InvalidInput, match="200x170x150"):
        _axes(text)


def test_distances_have_units():
    assert distance("0.05") == 0.05
    assert distance("149597870.7 km") == pytest.approx(1.0)
    assert distance("2 R_earth") == pytest.approx(2 * 6378.1 / 149597870.7, rel=1e-4)
    for text in ("5 h", "near", "1+-0.1 au"):
        with pytest.raises(ArgumentTypeError, match="a distance such as"):
            distance(text)


def test_a_sphere_cannot_tumble(capsys):
    assert main(["stability", "Apophis", "--axes", "200 m"]) == 1
    error = capsys.readouterr().err
    assert "semi-axes a > b > c" in error
    assert "--period" in error
    assert main(["stability", "Apophis", "--axes", "200 m", "--period", "30 h"]) == 0
