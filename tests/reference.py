"""Where the reference data are, and ephemerides that a test cannot do without."""

import os
from pathlib import Path

import pytest

from flybystab.errors import MissingExtra
from flybystab.orbit.ephemeris import ephemeris

SHARED = Path(os.environ.get("FLYBYSTAB_SHARED", Path(__file__).resolve().parents[2] / "shared"))


def need_ephemeris(name):
    """The ephemeris of that name; the test is skipped where it is not installed."""
    try:
        return ephemeris(name)
    except MissingExtra as error:
        pytest.skip(str(error))
