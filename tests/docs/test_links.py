"""Links of the documentation, the README and the changelog: files and headings that they name exist."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGES = [*sorted((ROOT / "docs").rglob("*.md")), *sorted(ROOT.glob("*.md")), ROOT / "data" / "README.md"]
LINK = re.compile(r"\]\(([^)\s]+)\)|```\{(?:image|literalinclude)\} (\S+)|<img[^>]* src=\"([^\"]+)\"")


def anchors(page):
    """Headings of a page as they are linked to: lower case, hyphens, no punctuation."""
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.S)
    titles = re.findall(r"^#+ (.+)$", text, re.M)
    return {re.sub(r"[^\w\- ]", "", t.strip().lower()).replace(" ", "-") for t in titles}


@pytest.mark.parametrize("page", PAGES, ids=[str(p.relative_to(ROOT)) for p in PAGES])
def test_links_lead_somewhere(page):
    broken = []
    for groups in LINK.findall(page.read_text(encoding="utf-8")):
        target = next(filter(None, groups))
        if re.match(r"[a-z]+:", target):
            continue
        name, _, anchor = target.partition("#")
        file = (page.parent / name) if name else page
        if not file.exists() or (anchor and file.suffix == ".md" and anchor not in anchors(file)):
            broken.append(target)
    assert not broken


def test_every_page_is_in_the_table_of_contents():
    docs = ROOT / "docs"
    parts = (docs / "index.md").read_text().split("{toctree}")[1:]
    names = [name for part in parts for name in re.findall(r"^([\w/]+)$", part.partition("```")[0], re.M)]
    assert len(names) == len(set(names))
    listed = set(names)
    pages = {p.relative_to(docs).with_suffix("").as_posix() for p in docs.rglob("*.md")}
    assert pages - {"index"} == listed


def test_every_image_is_shown():
    text = "".join(p.read_text(encoding="utf-8") for p in PAGES)
    unused = [p.name for p in (ROOT / "docs" / "images").iterdir() if f"images/{p.name}" not in text]
    assert not unused
