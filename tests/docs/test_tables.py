"""Tables of the documentation: kept with their command, shown by a page, and quoted as they are."""

import re
import runpy
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
TABLES = runpy.run_path(str(ROOT / "docs" / "tables.py"))["TABLES"]
PAGES = {
    p.name: p.read_text() for p in (ROOT / "README.md", ROOT / "CHANGELOG.md", *(ROOT / "docs").glob("*.md"))
}

NUMBER = r"\d[\d,]*(?:\.\d+)?(?:e[-+]?\d+)?"
#: Sentences with figures out of a table: page, table, and the words around each figure (N stands for one).
QUOTED = [
    ("README.md", "sky", "JPL's N close approaches of early 2020 to N km (median; N km at"),
    ("README.md", "completeness", "takes N s on two cores"),
    ("CHANGELOG.md", "margin", "On N encounters it is wrong in N % (N too optimistic, N too pessimistic)"),
    ("screening.md", "throughput", "are split over both workers: N times the rate of one worker"),
    ("screening.md", "throughput", "with an overhead of about N ms each"),
]


def numbers(name):
    """All numbers in a table."""
    text = (ROOT / "docs" / "tables" / f"{name}.txt").read_text()
    return [float(n.replace(",", "")) for n in re.findall(rf"(?<![\w.]){NUMBER}", text)]


def there(quoted, found):
    """Whether a number as it is quoted is one of those found, rounded to as many digits."""
    mantissa, _, power = quoted.replace(",", "").partition("e")
    last = 10.0 ** (int(power or 0) - len(mantissa.partition(".")[2]))
    value = float(quoted.replace(",", ""))
    return any(abs(value - n) <= 0.5001 * last for n in found)


@pytest.mark.parametrize(("page", "table", "words"), QUOTED, ids=[f"{p}-{t}" for p, t, _ in QUOTED])
def test_quoted_figures_are_those_of_the_table(page, table, words):
    pattern = r"\s+".join(re.sub(r"\bN\b", lambda _: f"({NUMBER})", re.escape(w)) for w in words.split())
    match = re.search(pattern, PAGES[page])
    assert match, f"{page} does not say: {words}"
    for figure in match.groups():
        assert there(figure, numbers(table)), f"{figure} is not in docs/tables/{table}.txt"


def test_the_speeds_of_the_readme_are_those_of_the_table():
    section = PAGES["README.md"].partition("## Speed and accuracy")[2].partition("\n## ")[0]
    rows = [line.strip("|").split("|") for line in section.splitlines() if line.startswith("|")][2:]
    found = numbers("flyby")
    assert len(rows) >= 6
    for _, _, *cells in rows:
        for figure in re.findall(NUMBER, " ".join(cells)):
            assert there(figure, found), figure


def test_there_tells_a_stale_figure():
    assert there("4.3", [4.31])
    assert there("2,587", [2587.0])
    assert there("9.9e-11", [9.94e-11])
    assert not there("3.9", [4.3, 39.0])
    assert not there("9.7e-7", [9.4e-7])


def test_every_table_has_its_command_and_a_page():
    shown = "".join(PAGES.values())
    kept = {p.stem for p in (ROOT / "docs" / "tables").glob("*.txt")}
    assert kept == set(TABLES)
    for name, command in TABLES.items():
        text = (ROOT / "docs" / "tables" / f"{name}.txt").read_text()
        assert text.startswith(f"$ {command}\n"), name
        assert re.search(rf"```{{(literal)?include}} tables/{name}\.txt\n", shown), name


def test_no_output_is_typed_into_a_page():
    """Fenced blocks are code that is run or directives; what commands print is included from its file."""
    for name, text in PAGES.items():
        opening = re.findall(r"^ *```(.*)$", text, re.M)[::2]
        for language in opening:
            assert re.match(r"(python|sh|toml|bibtex)$|\{", language), (
                f"{name}: a block of {language or 'text'}"
            )
