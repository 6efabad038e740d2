"""The code in the documentation runs, and the objects that it names exist."""

import re
from pathlib import Path

import pytest

import flybystab
from flybystab.cli.main import COMMANDS

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.md"))


@pytest.mark.parametrize("page", ["README.md", "docs/index.md", "docs/tutorial.md", "docs/howto.md"])
def test_python_blocks_run(page, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / page).read_text(), re.S)
    assert blocks
    space = {}
    for block in blocks:
        exec(compile(block, page, "exec"), space)


def test_the_page_on_grains_runs_with_few_grains(monkeypatch, tmp_path, capsys):
    monkeypatch.setenv("FLYBYSTAB_CACHE", str(tmp_path))
    text = (ROOT / "docs" / "grains.md").read_text()
    space = {}
    for block in re.findall(r"```python\n(.*?)```", text, re.S):
        few = re.sub(r"grains=\d+, seeds?=\d+", lambda m: re.sub(r"grains=\d+", "grains=100", m[0]), block)
        few = few.replace("seeds=8", "seeds=1").replace("fs.Pile(lobes, ", "fs.Pile(lobes, grains=100, ")
        exec(compile(few, "docs/grains.md", "exec"), space)
    assert space["result"].rung == "grains"
    assert len(space["result"].fragments) >= 1
    capsys.readouterr()


@pytest.mark.parametrize("page", NOTEBOOKS, ids=lambda p: p.stem)
def test_notebooks_run(page, monkeypatch, tmp_path, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    space = {}
    for cell in re.findall(r"```\{code-cell\}\n(.*?)```", page.read_text(), re.S):
        exec(compile(cell, str(page), "exec"), space)
    capsys.readouterr()


def test_the_scenario_of_the_howto_runs(tmp_path, monkeypatch, capsys):
    from flybystab.cli.main import main

    monkeypatch.chdir(tmp_path)
    text = re.search(r"```toml\n(.*?)```", (ROOT / "docs/howto.md").read_text(), re.S).group(1)
    (tmp_path / "scene.toml").write_text(text)
    assert main(["scenario", "scene.toml"]) == 0
    assert (tmp_path / "pile.png").exists()
    capsys.readouterr()


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_what_a_page_names_is_there(page):
    text = page.read_text()
    for path in re.findall(r"\]\(((?!http)[^)#]+)\)", text):
        assert (page.parent / path).exists(), path
    for path in re.findall(r"\b(?:tests|examples|benchmarks|docs|scripts)/[\w/]+\.(?:py|toml|md)\b", text):
        assert (ROOT / path).exists(), path
    for command in re.findall(r"`flybystab ([a-z]+)", text):
        assert command in COMMANDS, command
    for name in re.findall(r"\bfs\.(\w+)", text):
        assert name in flybystab.__all__, name


def test_the_gallery_lists_every_example():
    text = (ROOT / "docs/gallery.md").read_text()
    shown = (ROOT / "docs/scripts.md").read_text()
    for script in (ROOT / "examples").glob("*.py"):
        assert f"`{script.name}`" in text, script.name
        assert f"../examples/{script.name}\n" in shown, script.name


def test_every_public_name_is_documented():
    text = (ROOT / "docs/api.md").read_text()
    assert "automodule:: flybystab.errors" in text
    for name in set(flybystab.__all__) - {"__version__", "R_earth", "FlybystabError"}:
        assert re.search(rf"auto(function|class):: flybystab\.(\w+\.)*{name}\b", text), name


def test_modules_that_the_theory_links_are_on_the_page():
    named = set(re.findall(r"\{mod\}`([\w.]+)`", (ROOT / "docs/theory.md").read_text()))
    assert len(named) > 15
    assert named <= set(re.findall(r"automodule:: ([\w.]+)", (ROOT / "docs/api.md").read_text()))


def test_the_example_of_the_package():
    import doctest

    result = doctest.testmod(flybystab)
    assert result.attempted >= 4
    assert result.failed == 0
