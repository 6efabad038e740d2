"""Page "Figures": every result with a figure is on it with its image, and the others are named."""

import re
import runpy
from importlib import import_module
from pathlib import Path

import flybystab as fs
from flybystab.plots.results import _plot
from flybystab.tabular import Results

DOCS = Path(__file__).resolve().parents[2] / "docs"
SCRIPT = runpy.run_path(str(DOCS / "figures.py"), run_name="figures")


def kinds(base):
    return {c.__name__ for c in base.__subclasses__()}.union(*(kinds(c) for c in base.__subclasses__()))


def test_every_result_is_shown_or_named():
    for package in ("body", "encounter", "flybys", "orbit", "population", "screening"):
        for module in (Path(fs.__file__).parent / package).glob("[a-z]*.py"):
            import_module(f"flybystab.{package}.{module.stem}")
    text = " ".join(text for items in SCRIPT["SECTIONS"].values() for _, text, _ in items)
    shown = set(re.findall(r"`([A-Z]\w+)`", text))
    without = {name for names in SCRIPT["WITHOUT"].values() for name in names}
    assert shown == {kind.__name__ for kind in _plot.registry} - {"object", "ResultTable"}
    assert shown.isdisjoint(without)
    assert shown | without == kinds(Results) - {"Record", "Tabular", "Collection"}


def test_the_page_is_that_of_the_script_and_has_its_images():
    assert (DOCS / "figures.md").read_text(encoding="utf-8") == SCRIPT["page"]()
    names = [name for items in SCRIPT["SECTIONS"].values() for name, _, _ in items]
    assert len(set(names)) == len(names) > 45
    kept = {path.stem for path in (DOCS / "images" / "figures").glob("*.png")}
    assert kept == set(names)


def test_the_code_of_each_figure_is_valid():
    compile(SCRIPT["SETUP"], "set-up", "exec")
    for items in SCRIPT["SECTIONS"].values():
        for name, _, code in items:
            compile(code, name, "eval")
