"""Damaged orbit files: every reader answers with an error of the package or with an orbit."""

import random
from contextlib import suppress
from pathlib import Path

import pytest

from flybystab.catalogues.catalogue import catalogue
from flybystab.errors import FlybystabError

FILES = sorted((Path(__file__).parents[2] / "cases" / "files").iterdir())
PIECES = ["nan", "inf", "-1", "null", "[]", "{}", '""', "\x00", "é", "1e999", "x", ",", "\n", "true", " "]


def damaged(text, rng):
    """The text cut, shortened, with foreign pieces, with lines in another order, or without a line."""
    at = rng.randrange(len(text))
    lines = text.split("\n")
    choice = rng.randrange(5)
    if choice == 0:
        return text[:at]
    if choice == 1:
        return text[:at] + text[at + rng.randint(1, 30) :]
    if choice == 2:
        return text[:at] + rng.choice(PIECES) + text[at + rng.randint(0, 3) :]
    if choice == 3:
        rng.shuffle(lines)
    else:
        del lines[rng.randrange(len(lines))]
    return "\n".join(lines)


@pytest.mark.parametrize("file", FILES, ids=lambda p: p.name)
def test_a_damaged_file_gives_an_error_of_the_package(tmp_path, file):
    rng = random.Random(file.name)
    text = file.read_text()
    path = tmp_path / "x"
    for _ in range(40):
        path.write_text(damaged(text, rng))
        with suppress(FlybystabError):  # anything else is a failure
            for a in catalogue(path):
                assert a.orbit.position.shape == (3,)
