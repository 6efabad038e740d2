"""The table of formats in docs/inputs.md against the registry."""

import re
from pathlib import Path

import pytest

from flybystab.catalogues.readers import reader_names
from flybystab.catalogues.readers.format_tables import FORMATS
from flybystab.catalogues.readers.parameters import MODELLED, NOT_MODELLED

DOCS = Path(__file__).parents[3] / "docs" / "inputs.md"
pytestmark = pytest.mark.skipif(not DOCS.is_file(), reason="installed without the documentation")


def table():
    """First cells of the rows, without what stands in brackets after the name of a format."""
    rows = [line.split("|")[1:-1] for line in DOCS.read_text().splitlines() if line.startswith("|")][2:]
    return {row[0].strip(): [cell.strip() for cell in row[1:]] for row in rows}


def test_every_reader_has_its_row():
    rows = table()
    for name in reader_names():
        found = [
            cell for cell in rows if cell == name or cell.startswith(f"{name} (") or name in cell.split(", ")
        ]
        found = [cell for cell in found if cell != f"{name} (JSON)" and not cell.startswith(f"{name} (JSON)")]
        assert len(found) == 1, (name, found)
    assert all(len(cells) == 4 and all(cells) for cells in rows.values())


def test_every_format_and_parameter_is_named():
    text = DOCS.read_text()
    assert all(re.search(rf"\b{kind}\b", text) for kind in FORMATS)
    assert all(name in text for name in NOT_MODELLED["JPL"])
    modelled = next(cells[2] for cell, cells in table().items() if cell.startswith("OEF2.0"))
    assert set(modelled.split(", ")) == MODELLED["OrbFit"]
