"""Files of figures: fonts embedded as TrueType, legends for every shading."""

import re

import astropy.units as u
import matplotlib
import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

import flybystab as fs
from flybystab.cli.main import main
from flybystab.errors import UnknownName
from flybystab.plots.flyby import flyby_figure, flyby_panels
from flybystab.plots.style import SCALES, figure_style, save


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


def test_styles_change_the_size_of_text_and_figure_and_end_with_their_context(result):
    import matplotlib.pyplot as plt

    before = dict(matplotlib.rcParams)
    sizes = {}
    for name in SCALES:
        with figure_style(name):
            axes = result.plot()
            texts = {t.get_fontsize() for a in axes for t in (a.xaxis.label, a.yaxis.label)}
            sizes[name] = (*texts, *axes[0].figure.get_size_inches())
            axes = result.history.plot()
            assert axes.get_legend().get_texts()[0].get_fontsize() < axes.yaxis.label.get_fontsize()
    plt.close("all")
    assert sizes["paper"][0] < sizes["default"][0] < sizes["talk"][0]
    assert sizes["paper"][1] < sizes["default"][1]
    assert dict(matplotlib.rcParams) == before


def test_a_style_of_the_shell(tmp_path):
    sizes = []
    for name in ("default", "paper", "talk"):
        path = tmp_path / f"{name}.pdf"
        words = ["figure", "barrier", "--style", name, "--output", str(path)]
        assert main(words) == 0
        assert b"/Type3" not in path.read_bytes()
        sizes.append(
            [
                float(x)
                for x in re.search(rb"/MediaBox \[ ?0 0 ([0-9.]+) ([0-9.]+)", path.read_bytes()).groups()
            ]
        )
    assert sizes[1][0] < 7.2 * 72 < sizes[0][0] < sizes[2][0]  # two columns of a journal
    assert main(["figure", "barrier", "--style", "poster"]) == 2


def test_an_unknown_style_is_refused():
    with pytest.raises(UnknownName, match="paper"), figure_style("poster"):
        pass


def test_the_colour_cycle_can_be_told_apart_in_grey():
    with figure_style():
        colours = [to_rgb(x["color"]) for x in matplotlib.rcParams["axes.prop_cycle"]]
    grey = np.array(colours) @ [0.2126, 0.7152, 0.0722]
    assert np.abs(np.diff(grey)).min() > 0.09  # neighbours in the cycle
