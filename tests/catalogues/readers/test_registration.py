"""A file format is one more module in the package of readers: nothing else is edited."""

import sys

from flybystab.catalogues import readers
from flybystab.catalogues.catalogue import catalogue

MODULE = """
from flybystab.catalogues.readers import reader


@reader("mine", lambda text: text.startswith("MINE "), ())
def read(text, file):
    return [({"name": word}, None) for word in text.split()[1:]]
"""


def test_a_module_is_found_by_its_place(tmp_path, monkeypatch):
    (tmp_path / "another_publisher.py").write_text(MODULE)
    file = tmp_path / "orbits.any"
    file.write_text("MINE Own Other")
    readers.reader_names()  # registers the modules of the package in its own table
    monkeypatch.setattr(readers, "READERS", dict(readers.READERS))
    monkeypatch.setattr(readers, "__path__", [*readers.__path__, str(tmp_path)])
    readers._load.cache_clear()
    try:
        assert [a.name for a in catalogue(file)] == ["Own", "Other"]
        assert "mine" in readers.reader_names()
    finally:
        sys.modules.pop("flybystab.catalogues.readers.another_publisher", None)
        readers._load.cache_clear()
