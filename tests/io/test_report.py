"""The report page: complete, self-contained, readable on a phone and in print."""

import base64
import io
import re
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path

import astropy.units as u
import numpy as np
import pytest
from PIL import Image

import flybystab as fs
from flybystab.cli.main import main

CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")
VOID = {"meta", "link", "img", "br", "source"}


class Page(HTMLParser):
    def __init__(self, text):
        super().__init__()
        self.open, self.links, self.images, self.words = [], [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        found = dict(attributes)
        self.links += [v for k, v in found.items() if k in ("src", "href", "srcset", "data")]
        if tag == "img":
            self.images.append(found)
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.words.append(data)


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    path = tmp_path_factory.mktemp("report") / "apophis <b> & report.html"
    words = ["report", "Apophis", "--date", "2029-04-13", "--attitudes", "8", "--samples", "40"]
    assert main([*words, "--output", str(path)]) == 0
    return path


def test_everything_is_in_it(page):
    text = page.read_text()
    parsed = Page(text)
    assert parsed.open == []
    said = " ".join(parsed.words)
    for needed in (
        "INTACT",
        "2029-04-13 21:46:12 TDB",
        "38,011.",
        "JPL 220",
        "assumed",
        "8 of 8 sampled attitudes",
        "95 % interval",
        "Earth J2",
        "excludes the orbit uncertainty",
        "hyperbolic excess speed",
        "orbit quality",
        "over the sampled attitudes",
        "flybystab report Apophis --date 2029-04-13",
        "rebound ",
    ):
        assert needed in said, needed


def test_values_are_escaped(page):
    """The command under Provenance holds the name of the file."""
    text = page.read_text()
    assert "apophis &lt;b&gt; &amp; report.html" in text
    assert "<b>" not in text


def test_nothing_is_loaded_from_elsewhere(page):
    parsed = Page(page.read_text())
    assert len(parsed.images) == 3
    assert all(image["alt"] for image in parsed.images)
    assert all(link.startswith("data:") for link in parsed.links)
    assert "url(" not in re.search("<style>.*</style>", page.read_text(), re.S).group()


def test_figures_are_drawn_anew_for_a_phone(page):
    text = page.read_text()
    narrow = re.findall(r'<source media="\(max-width: 640px\)" srcset="data:([^"]+)"', text)
    wide = re.findall(r'<img src="data:([^"]+)"', text)
    assert len(narrow) == len(wide) == 3
    assert not set(narrow) & set(wide)
    svg = base64.b64decode(narrow[0].split(",")[1]).decode()
    assert float(re.search(r'width="([0-9.]+)pt"', svg)[1]) == pytest.approx(4.0 * 72, rel=0.01)


def chromium(*arguments):
    command = [CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--enable-logging=stderr", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=600, check=True)


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium")
def test_in_a_browser(page, tmp_path):
    # what the page measures of itself at phone width, written where --dump-dom shows it
    probe = (
        "<script>addEventListener('load', () => { document.body.dataset.probe = "
        "[document.documentElement.scrollWidth, innerWidth, "
        "[...document.images].filter(i => !i.naturalWidth).length].join(' ') })</script></body>"
    )
    copy = tmp_path / "probe.html"
    copy.write_text(page.read_text().replace("</body>", probe))
    done = chromium("--window-size=500,900", "--dump-dom", copy.as_uri())
    assert "CONSOLE" not in done.stderr
    width, window, broken = map(int, re.search(r'data-probe="(\d+) (\d+) (\d+)"', done.stdout).groups())
    assert width <= window
    assert broken == 0
    pdf = tmp_path / "report.pdf"
    chromium(f"--print-to-pdf={pdf}", page.as_uri())
    assert Path(pdf).read_bytes().startswith(b"%PDF")


def test_the_place_is_checked_first(capsys):
    assert main(["report", "Apophis", "--output", "report.doc"]) == 2
    assert "ends in .html" in capsys.readouterr().err


def test_grains_have_a_section(tmp_path, monkeypatch):
    from astropy.time import Time

    from flybystab.catalogues.asteroid import Asteroid
    from flybystab.encounter.encounter import Encounter
    from flybystab.flybys.flyby import flyby
    from flybystab.flybys.spin_sample import spin_sample
    from flybystab.io.report import report

    monkeypatch.setenv("FLYBYSTAB_CACHE", str(tmp_path))
    apophis = Asteroid.from_catalogue("Apophis")
    encounter = Encounter.from_orbit(apophis.orbit, "earth", Time("2029-04-13", scale="tdb"))
    result = flyby(apophis.body, encounter, grains=100, seeds=1, model="grains")
    sample = spin_sample(apophis, encounter, n=2)
    size = np.asarray(apophis.body.axes) * u.m
    shape = fs.Shape.perturbed(size, amplitude=0.05, seed=2, facets=320)
    solid = fs.Body.from_shape(shape, density=2000 * u.kg / u.m**3, spin_period=30 * u.h)
    surface = fs.surface_history(solid, encounter, shape=shape, instants=5)
    said = {}
    for name, r in (("with", result), ("without", flyby(apophis.body, encounter))):
        page = report(apophis, r, sample, tmp_path / f"{name}.html", surface=surface if r is result else None)
        parsed = Page(page.read_text())
        assert parsed.open == []
        said[name] = " ".join(parsed.words), len(parsed.images)
    assert "1 pile: INTACT 100%" in said["with"][0]
    assert "Grains" not in said["without"][0]
    assert said["with"][1] == said["without"][1] + 3  # slopes, piles, path
    text = (tmp_path / "with.html").read_text()
    narrow = re.findall(r'<source media="\(max-width: 640px\)" srcset="data:image/([^"]+)"', text)
    assert len(narrow) == said["with"][1]
    bitmaps = [Image.open(io.BytesIO(base64.b64decode(n.split(",")[1]))) for n in narrow if n[:3] == "png"]
    assert len(bitmaps) == 4
    assert all(picture.width == pytest.approx(4.0 * 130, abs=2) for picture in bitmaps)
