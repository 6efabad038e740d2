"""The atlas of a screening: complete without scripts, searched and sorted in a browser, and safe with odd names."""

import csv
import json
import re
import shutil
import subprocess
from html.parser import HTMLParser

import astropy.units as u
import numpy as np
import pytest

import flybystab as fs
from flybystab.cli.main import main
from flybystab.errors import InvalidInput
from flybystab.io.atlas import atlas
from flybystab.screening.results import read_results

CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")


@pytest.fixture(scope="module")
def results():
    table = fs.screen(
        ["Apophis", "1997 XF11", "2001 WN5"], "2028-01-01", "2030-01-01", within=0.02 * u.au, samples=8
    )
    assert len(table) == 3
    return table[np.argsort(table["jd_tdb"])]


@pytest.fixture(scope="module")
def site(results, tmp_path_factory):
    folder = tmp_path_factory.mktemp("atlas") / "site"
    atlas(results, folder)
    return folder


class Links(HTMLParser):
    def __init__(self, text):
        super().__init__()
        self.links, self.scripts = [], []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        attributes = dict(attributes)
        self.links += [attributes[k] for k in ("href", "src") if k in attributes]


def test_every_link_of_every_page_is_a_file_of_the_site(site):
    pages = list(site.rglob("*.html"))
    assert len(pages) == 4
    for page in pages:
        for link in Links(page.read_text()).links:
            assert link.startswith("data:") or (page.parent / link).is_file(), (page, link)


def test_the_list_is_complete_without_scripts(site, results):
    text = (site / "index.html").read_text()
    for row in results:
        assert str(row["asteroid"]) in text
        assert f"{row['distance'].to_value(u.km):,.0f}" in text
    assert "http" not in text


def test_downloads_hold_the_table(site, results):
    rows = json.loads((site / "encounters.json").read_text())["rows"]
    assert [r["distance_km"] for r in rows] == results["distance"].to_value(u.km).tolist()
    with (site / "encounters.csv").open(newline="") as file:
        listed = list(csv.DictReader(file))
    assert [float(r["distance_km"]) for r in listed] == results["distance"].to_value(u.km).tolist()
    again = read_results(site / "encounters.ecsv")
    assert np.array_equal(again["jd_tdb"], results["jd_tdb"])
    (one,) = (site / "encounters").glob("*apophis*.json")
    assert json.loads(one.read_text())["rows"] == [r for r in rows if r["asteroid"] == "Apophis"]


def test_probability_comes_first_where_inputs_are_uncertain(site):
    text = next((site / "encounters").glob("*apophis*.html")).read_text()
    assert re.search(r"<strong>probability of yielding below [\d.]+</strong>", text)
    assert "Nominal verdict: INTACT" in text


def test_odd_names_and_failed_rows_stay_text(results, tmp_path):
    table = results.copy()
    table["asteroid"] = ["<script>alert(1)</script>", "=cmd|x", "../../x"]
    table["verdict"] = ["", "INTACT", "INTACT"]
    table["error"] = ["NotConverged: x < y", "", ""]
    table["margin"][1] = -np.inf * u.deg
    folder = tmp_path / "site"
    atlas(table, folder)
    for page in folder.rglob("*.html"):
        assert "<script>alert" not in page.read_text()
    names = sorted(p.name for p in (folder / "encounters").glob("*.html"))
    assert [n[:6] for n in names] == ["00000-", "00001-", "00002-"]
    assert '"=cmd|x"' in (folder / "encounters.csv").read_text()
    text = (folder / "index.html").read_text()
    assert "not computed" in text
    assert "none suffices" in text
    assert "NaN" not in (folder / "encounters.json").read_text()


def test_only_an_atlas_is_replaced_and_only_on_request(results, tmp_path):
    folder = tmp_path / "site"
    atlas(results, folder)
    (folder / "mine.txt").write_text("kept")
    with pytest.raises(InvalidInput, match="overwrite"):
        atlas(results, folder)
    atlas(results[:1], folder, overwrite=True)
    assert len(list((folder / "encounters").glob("*.html"))) == 1
    assert (folder / "mine.txt").read_text() == "kept"
    other = tmp_path / "other"
    other.mkdir()
    (other / "index.html").write_text("a page")
    with pytest.raises(InvalidInput, match="other files"):
        atlas(results, other, overwrite=True)
    with pytest.raises(InvalidInput, match="at least one row"):
        atlas(results[:0], tmp_path / "none")
    with pytest.raises(InvalidInput, match="table of encounters"):
        atlas(results["asteroid", "planet"], tmp_path / "none")


def test_the_command_screens_and_takes_a_finished_table(capsys, tmp_path):
    folder = tmp_path / "site"
    words = ["Apophis", "--from", "2029-01-01", "--to", "2030-01-01", "--output", str(folder)]
    assert main(["atlas", *words]) == 0
    assert (tmp_path / "site.ecsv").is_file()
    assert main(["atlas", *words]) == 1
    assert "overwrite" in capsys.readouterr().err
    assert main(["atlas", str(tmp_path / "site.ecsv"), "--output", str(tmp_path / "again"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["encounters"] == 1
    assert (tmp_path / "again" / "index.html").is_file()


def browse(site, script, *, size="1200,900", where=""):
    """What a script finds on the page of the list: it sets `document.body.dataset.probe`."""
    copy = site / "probe.html"
    probe = (
        "<script>addEventListener('error', (e) => { document.body.dataset.failure = e.message });"
        "addEventListener('load', () => setTimeout(() => { document.body.dataset.probe = JSON.stringify((() => {"
        + script
        + "})()) }, 50))</script></body>"
    )
    copy.write_text((site / "index.html").read_text().replace("</body>", probe))
    command = [
        CHROMIUM,
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--enable-logging=stderr",
        f"--window-size={size}",
    ]
    done = subprocess.run(
        [
            *command,
            f"--window-size={size}",
            "--virtual-time-budget=3000",
            "--dump-dom",
            copy.as_uri() + where,
        ],
        capture_output=True,
        text=True,
        timeout=600,
        check=True,
    )
    copy.unlink()
    assert "CONSOLE" not in done.stderr
    assert "data-failure" not in done.stdout
    from html import unescape

    return json.loads(unescape(re.search(r'data-probe="([^"]*)"', done.stdout).group(1)))


needs_browser = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium")
SHOWN = (
    "[...document.querySelectorAll('.list tbody tr')].filter(r => !r.hidden).map(r => r.cells[0].innerText)"
)


@needs_browser
def test_search_filters_and_reset_in_a_browser(site):
    found = browse(
        site,
        f"""const f = document.querySelector('form'), out = [];
        const set = (name, value) => {{
          f.elements[name].value = value; f.dispatchEvent(new Event('input')); out.push({SHOWN}); }};
        set('search', 'APOPH'); set('search', ''); set('distance', '100000'); set('distance', '');
        set('from', '2028-07-01'); set('to', '2028-12-31'); set('probability', '0.5');
        return [out, document.getElementById('count').textContent, location.hash];""",
    )
    every = ["2001 WN5", "1997 XF11", "Apophis"]
    assert found[0] == [["Apophis"], every, ["Apophis"], every, ["1997 XF11", "Apophis"], ["1997 XF11"], []]
    assert found[1] == "0 of 3 encounters"
    assert "from=2028-07-01" in found[2]


@needs_browser
def test_sorting_by_header_with_the_keyboard(site):
    found = browse(
        site,
        f"""const b = document.querySelectorAll('.list thead button'), out = [{SHOWN}];
        b[3].focus(); b[3].click(); out.push({SHOWN}); b[3].click(); out.push({SHOWN});
        document.activeElement.blur();
        document.dispatchEvent(new KeyboardEvent('keydown', {{key: '/', cancelable: true}}));
        return [out, document.activeElement.name, document.querySelectorAll('[aria-sort]').length];""",
    )
    by_date = ["2001 WN5", "1997 XF11", "Apophis"]
    assert found[0] == [by_date, ["Apophis", "2001 WN5", "1997 XF11"], ["1997 XF11", "2001 WN5", "Apophis"]]
    assert found[1:] == ["search", 1]


@needs_browser
def test_a_shared_address_restores_search_and_order(site):
    assert browse(site, f"return {SHOWN};", where="#search=xf11&sort=-3") == ["1997 XF11"]


@needs_browser
def test_phone_width_needs_no_sideways_scrolling(site):
    width, window = browse(site, "return [document.documentElement.scrollWidth, innerWidth];", size="500,900")
    assert width <= window
