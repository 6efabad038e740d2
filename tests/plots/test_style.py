"""Files of figures: fonts embedded as TrueType, legends for every shading."""

import astropy.units as u
import numpy as np
import pytest
from matplotlib.figure import Figure

import flybystab as fs
from flybystab.plots.flyby import flyby_figure, flyby_panels
from flybystab.plots.style import save


@pytest.fixture(scope="module")
def result():
    body = fs.Body([1400, 850, 750] * u.m, 2000 * u.kg / u.m**3, 6 * u.h)
    return fs.flyby(body, fs.Encounter.hyperbolic("earth", 2.0 * fs.R_earth, 5 * u.km / u.s))


def test_fonts_in_pdf_are_truetype(result, tmp_path):
    written = flyby_figure(result, "2.0 Earth radii", tmp_path / "x.pdf").read_bytes()
    assert b"/FontFile2" in written  # an embedded TrueType font
    assert b"/Type3" not in written
    plain = Figure()
    plain.subplots().set_title("matplotlib's default")
    plain.savefig(tmp_path / "plain.pdf")
    assert b"/Type3" in (tmp_path / "plain.pdf").read_bytes()
    assert b"/Type3" not in save(plain, tmp_path / "plain.pdf").read_bytes()


def test_every_shading_is_in_the_legend(result):
    panels = Figure().subplots(4, 1)
    flyby_panels(panels, result)
    named = {t.get_text() for t in panels[0].get_legend().get_texts()}
    regimes = set(np.unique(result.history.regime))
    assert ("plastic flow" in named) == ("flowing" in regimes)
    assert ("dispersed" in named) == ("dispersed" in regimes)
    assert "plastic flow" in named
    assert len(panels[0].get_legend().get_texts()) == len(named)
