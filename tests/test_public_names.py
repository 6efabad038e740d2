"""The names of the API page."""

import re
from importlib import import_module
from pathlib import Path

import pytest

import flybystab as fs

PAGE = Path(__file__).resolve().parents[1] / "docs" / "api.md"
NAMES = re.findall(r"auto(?:class|function):: (flybystab\.\S+)", PAGE.read_text(encoding="utf-8"))


def test_the_page_lists_names():
    assert len(NAMES) > 60


@pytest.mark.parametrize("path", NAMES)
def test_a_name_of_the_page_is_importable_from_the_package(path):
    module, _, name = path.rpartition(".")
    assert getattr(fs, name) is getattr(import_module(module), name)
    assert name in fs.__all__
    assert name in dir(fs)
