"""Text of summaries: no nan or inf where a number is not defined, and no warning."""

import warnings

import astropy.units as u
import numpy as np
import pytest

import flybystab as fs
from flybystab.cli.main import main
from flybystab.io.text import extent, flyby_lines, sample_lines

GCC = u.g / u.cm**3
ENCOUNTER = fs.Encounter.hyperbolic("earth", 1.8 * fs.R_earth, 5 * u.km / u.s)
BODIES = {
    "without spin": fs.Body([1, 0.8, 0.7] * u.km, 2 * GCC),
    "spinning": fs.Body([1, 0.8, 0.7] * u.km, 2 * GCC, 6 * u.h),
    "not in equilibrium": fs.Body([1, 0.8, 0.7] * u.km, 2 * GCC, 2.05 * u.h),
}


@pytest.mark.parametrize("name", BODIES)
def test_undefined_values_are_named(name):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sample = fs.spin_sample(BODIES[name], ENCOUNTER, n=8)
        text = "\n".join(
            [*sample_lines(sample), *flyby_lines(fs.flyby(BODIES[name], ENCOUNTER)), repr(sample)]
        )
    words = text.replace(",", " ").split()
    assert "nan" not in words
    assert "inf" not in words
    expected = {
        "without spin": "none before, period",
        "spinning": "no friction angle suffices at 7 of 8",
        "not in equilibrium": "not in equilibrium; friction angle needed: no friction angle suffices",
    }
    assert expected[name] in text


def test_extent_counts_what_is_not_finite():
    values = np.array([1.0, np.inf, 3.0, np.nan])
    assert extent(values, 1, "deg", "none") == "1.0 to 3.0 deg (none at 2 of 4)"
    assert extent(values[[1, 3]], 1, "deg", "none") == "none"
    assert extent(values[[0, 2]], 1, "deg", "none") == "1.0 to 3.0 deg"


def test_command_and_report_of_a_fast_rotator(capsys, tmp_path):
    page = tmp_path / "fast.html"
    body = ["Apophis", "--date", "2029-04-13", "--period", "1.5 h", "--attitudes", "4"]
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        assert main(["flyby", *body]) == 0
        assert main(["report", *body, "--samples", "8", "--output", str(page)]) == 0
    out = capsys.readouterr().out
    assert "4 x NOT IN EQUILIBRIUM" in out
    assert "not in equilibrium; friction angle needed: no friction angle suffices" in out
    for text in (out, page.read_text().split("<h2>Provenance")[0]):
        assert " nan" not in text
        assert ">nan" not in text
