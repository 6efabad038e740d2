"""The table of formats in docs/inputs.md against the registry."""

import importlib.util
import re
from pathlib import Path

import pytest

from flybystab.catalogues.physical import PHYSICAL_READERS
from flybystab.catalogues.readers import READERS
from flybystab.catalogues.readers.format_tables import FORMATS
from flybystab.catalogues.readers.parameters import MODELLED, NOT_MODELLED

DOCS = Path(__file__).parents[3] / "docs" / "inputs.md"
pytestmark = pytest.mark.skipif(not DOCS.is_file(), reason="installed without the documentation")


def test_the_tables_are_those_of_the_registries():
    """Made by ``python docs/formats.py``."""
    spec = importlib.util.spec_from_file_location("formats", DOCS.with_name("formats.py"))
    formats = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(formats)
    text = DOCS.read_text(encoding="utf-8")
    assert formats.page(text) == text
    assert all(f"| {name}" in text for name in (*READERS.names, *PHYSICAL_READERS.names))


def test_every_reader_says_what_it_reads():
    names = READERS.names
    assert all(
        all((c.elements, c.covariance, c.nongravitational, c.physical))
        for c in (READERS[n].contents for n in names)
    )
    stated = set(READERS["OEF2.0"].contents.nongravitational.split(", "))
    assert stated == MODELLED["OrbFit"]
    for name in ("JPL Horizons", "SBDB answer"):
        assert {"A1", "A2", "A3", "DT", "AMRAT"} <= MODELLED["JPL"]
        assert READERS[name].contents.nongravitational == "A1, A2, A3, their law, DT, AMRAT"


def test_every_format_and_parameter_is_named():
    text = DOCS.read_text()
    assert all(re.search(rf"\b{kind}\b", text) for kind in FORMATS)
    assert all(name in text for name in NOT_MODELLED["JPL"])
