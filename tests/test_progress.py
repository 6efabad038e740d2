"""Bars of long calculations: one keyword, one implementation, none without a terminal unless asked for."""

import inspect
import io
import sys

import astropy.units as u
import numpy as np
import pytest
from astropy.time import Time

import flybystab as fs
from flybystab import progress
from flybystab.body.recovery import recovery
from flybystab.core.numerics import compile_notice
from flybystab.errors import InvalidInput
from flybystab.plots.grains import grains_animation
from flybystab.plots.scene import animation
from flybystab.progress import Bar, progress_bar

BODY = fs.Body([1400, 850, 750] * u.m, 2000 * u.kg / u.m**3, 6 * u.h)
ROUGH = fs.Shape.perturbed([1400, 850, 750] * u.m, amplitude=0.05, seed=2, facets=320)
APRIL = Time("2029-04-13", scale="tdb")


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.fixture(autouse=True)
def without_the_notice_of_compilation(monkeypatch):
    """Kernels that are compiled during a test write a notice into the same stream as the bars."""
    compile_notice.uninstall()
    monkeypatch.setattr(compile_notice, "install", lambda: None)


@pytest.fixture
def terminal(monkeypatch):
    def replace():  # in the test itself: pytest replaces the stream between set-up and call
        stream = Terminal()
        monkeypatch.setattr(sys, "stderr", stream)
        return stream

    return replace


def far(radii=3.0):
    return fs.Encounter.hyperbolic("earth", radii * fs.R_earth, 5 * u.km / u.s)


def apophis():
    return fs.Asteroid.from_catalogue("Apophis").orbit


#: Every function that may take longer than two seconds, at a small size.
CALLS = {
    "flyby_many": lambda p: fs.flyby_many([BODY] * 40, far(), workers=2, progress=p),
    "flyby (grains)": lambda p: fs.flyby(BODY, far(1.3), grains=100, seeds=1, model="grains", progress=p),
    "outcome_map": lambda p: fs.outcome_map(
        BODY, [2, 3] * fs.R_earth, [1, 9] * u.km / u.s, workers=2, progress=p
    ),
    "target_map": lambda p: fs.target_map(BODY, 5 * u.km / u.s, [2, 3] * fs.R_earth, 4, workers=2, progress=p),
    "critical": lambda p: fs.critical(BODY, far(), "friction_angle", phases=2, tolerance=0.1, progress=p),
    "spin_sample": lambda p: fs.spin_sample(BODY, far(), n=8, workers=2, progress=p),
    "spin_forecast": lambda p: fs.spin_forecast(BODY, far(), n=3, progress=p),
    "find_encounters": lambda p: fs.find_encounters(
        [apophis()] * 2, APRIL - 1 * u.d, APRIL + 1 * u.d, progress=lambda done, total, _: p(done, total)
    ),
    "encounter_distribution": lambda p: fs.encounter_distribution(
        apophis(), "earth", APRIL, n=4, progress=p
    ),
    "virtual_impactors": lambda p: fs.virtual_impactors(
        apophis(), APRIL - 1 * u.d, APRIL + 1 * u.d, n=5, progress=p
    ),
    "infer": lambda p: fs.infer(BODY, [far()], attitudes=2, progress=p),
    "refresh_distance": lambda p: fs.refresh_distance(
        fs.Body.from_shape(ROUGH, density=2000 * u.kg / u.m**3, spin_period=6 * u.h), ROUGH, attitudes=1, progress=p
    ),
    "recovery": lambda p: recovery(
        BODY, directions=2, refinements=1, searches=2, precision=0.5, progress=p
    ),
    "disruption_rates": lambda p: fs.disruption_rates([apophis()], ["earth"], samples=16, progress=p),
    "screen": lambda p: fs.screen(
        ["Apophis", "YORP"], APRIL - 1 * u.d, APRIL + 1 * u.d, progress=lambda s: p(s.done, s.total)
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", CALLS)
def test_a_function_is_called_with_finished_and_total_parts(name, terminal):
    terminal = terminal()
    seen = []
    CALLS[name](lambda done, total: seen.append((done, total)))
    assert terminal.getvalue() == ""
    assert seen
    done, totals = np.array(seen).T
    assert len(set(totals)) == 1
    assert np.all(np.diff(done) >= 0)
    assert done[0] >= 0
    assert done[-1] <= totals[0]
    if name not in ("critical", "refresh_distance"):  # they may end early
        assert done[-1] == totals[0]


@pytest.mark.parametrize("kind", ["ellipsoid", pytest.param("grains", marks=pytest.mark.slow)])
def test_animations_count_their_pictures(kind, tmp_path):
    seen = []
    if kind == "grains":
        result = fs.flyby(BODY, far(1.3), grains=100, seeds=1, model="grains")
        grains_animation(result, tmp_path / "x.gif", progress=lambda *x: seen.append(x))
    else:
        animation(fs.flyby(BODY, far()), tmp_path / "x.gif", frames=3, progress=lambda *x: seen.append(x))
        assert seen == [(1, 3), (2, 3), (3, 3)]
    assert seen[-1][0] == seen[-1][1]


def test_every_call_of_this_list_has_the_keyword():
    named = {name.split()[0] for name in CALLS}
    public = {n for n in fs.__all__ if inspect.isfunction(getattr(fs, n))}
    having = {n for n in public if "progress" in inspect.signature(getattr(fs, n)).parameters}
    assert having - {"survival", "atlas"} == named & public


def test_no_bar_without_a_terminal_unless_asked_for(capfd, monkeypatch):
    monkeypatch.setattr(progress, "DELAY", 0.0)
    CALLS["spin_forecast"](None)
    assert capfd.readouterr() == ("", "")
    CALLS["spin_forecast"](True)
    out, error = capfd.readouterr()
    assert out == ""
    assert error.startswith("spin forecast 3/3 phases")
    CALLS["spin_forecast"](False)
    assert capfd.readouterr() == ("", "")


def test_a_bar_on_a_terminal_after_a_delay(terminal, monkeypatch):
    terminal = terminal()
    fs.spin_forecast(BODY, far(), n=3)
    assert terminal.getvalue() == ""
    monkeypatch.setattr(progress, "DELAY", 0.0)
    fs.spin_forecast(BODY, far(), n=3)
    assert "spin forecast [" in terminal.getvalue()
    assert "phases" in terminal.getvalue()
    assert terminal.getvalue().rstrip(" ").endswith("\r")  # erased at the end
    fs.spin_forecast(BODY, far(), n=3, progress=True)
    assert "[####################] 3/3 phases" in terminal.getvalue()
    assert terminal.getvalue().endswith("\n")  # kept


def test_a_calculation_inside_another_shows_no_bar(terminal):
    terminal = terminal()
    with progress_bar(True, 2, "steps", "outer") as tick:
        tick(1)
        fs.spin_forecast(BODY, far(), n=3, progress=True)
        tick(2)
    assert "outer [" in terminal.getvalue()
    assert "phases" not in terminal.getvalue()
    with progress_bar(True, 1, "steps", "next") as tick:
        tick(1)
    assert "next [" in terminal.getvalue()


def test_an_error_ends_the_bar(terminal):
    terminal = terminal()
    with pytest.raises(ZeroDivisionError), progress_bar(True, 2, "steps") as tick:
        tick(1 / 0)
    with progress_bar(True, 1, "steps", "later") as tick:
        tick(1)
    assert "later" in terminal.getvalue()


@pytest.mark.parametrize("wrong", [1, "yes", 2.5])
def test_wrong_values_are_refused(wrong):
    with pytest.raises(InvalidInput, match="progress"):
        fs.spin_forecast(BODY, far(), n=3, progress=wrong)


def test_a_log_gets_a_line_every_half_minute(monkeypatch):
    now = [0.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    out = io.StringIO()
    bar = Bar(100, "rows", "map", stream=out)
    for k in range(100):
        now[0] += 1.0
        bar(k + 1)
    bar.close()
    lines = out.getvalue().splitlines()
    assert [line.split()[1] for line in lines] == ["30/100", "60/100", "90/100", "100/100"]
    assert "1.00 rows/s, 01:10 left" in lines[0]


NOTEBOOK = [
    "import time, threading\nfrom flybystab.progress import progress_bar",
    """
def steps(asked, n):
    with progress_bar(asked, n, "steps", "test") as tick:
        for k in range(n):
            time.sleep(0.1)
            tick(k + 1)
steps(None, 32)
""",
    "steps(None, 3)",
    "steps(True, 10)",
    "thread = threading.Thread(target=steps, args=(None, 25)); thread.start(); thread.join()",
    "steps(False, 25)",
]


def test_bars_in_a_notebook():
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    book = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(c) for c in NOTEBOOK])
    nbclient.NotebookClient(book, timeout=120, kernel_name="python3").execute()
    texts = ["".join(o.text for o in cell.outputs) for cell in book.cells]
    assert all(o.output_type == "stream" and o.name == "stderr" for c in book.cells for o in c.outputs)
    _, long, short, asked, threaded, none = texts
    assert "test [" in long
    assert "/32 steps" in long
    assert 2 <= long.count("steps,") <= 4  # after two seconds, every half second
    assert not long.split("\r")[-1].strip()  # erased at the end
    assert asked.endswith("\n")
    assert "[####################] 10/10 steps" in asked.split("\r")[-1]
    assert short == threaded == none == ""
    assert "arning" not in "".join(texts)
