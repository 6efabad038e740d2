"""Write the tables of formats in ``docs/inputs.md`` from the registries of readers: ``python docs/formats.py``."""

from pathlib import Path

from flybystab.catalogues.physical import PHYSICAL_READERS
from flybystab.catalogues.readers import READERS

PAGE = Path(__file__).with_name("inputs.md")
OWN = (
    "columns of the embedded catalogue (CSV)",
    "a or q, e, i, node, peri, M or Tp",
    "1-sigmas of the elements",
    "A1, A2, A3, law, DT, AMRAT",
    "all columns",
)


def orbits() -> str:
    """The table of orbit formats."""
    lines = [
        "| Format | Elements | Covariance | Non-gravitational | Physical |",
        "|---|---|---|---|---|",
        row(*OWN),
    ]
    for name in sorted(READERS.names, key=str.lower):
        c = READERS[name].contents
        label = f"{name}: {c.files}" if c.files else name
        lines.append(row(label, c.elements, c.covariance, c.nongravitational, c.physical))
    return "\n".join(lines)


def physical() -> str:
    """The table of formats of physical parameters."""
    lines = ["| Format | Physical | Spin |", "|---|---|---|"]
    for name in sorted(PHYSICAL_READERS.names, key=str.lower):
        found = PHYSICAL_READERS[name]
        lines.append(row(name, found.physical, found.spin))
    return "\n".join(lines)


def row(*cells: str) -> str:
    """A row of a table."""
    return f"| {' | '.join(cells)} |"


def page(text: str) -> str:
    """The page with the tables between their marks."""
    for mark, table in (("orbits", orbits()), ("physical", physical())):
        start, stop = f"<!-- {mark} -->\n", f"\n<!-- end of {mark} -->"
        before, _, rest = text.partition(start)
        _, _, after = rest.partition(stop)
        text = before + start + table + stop + after
    return text


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
