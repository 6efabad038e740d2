"""Number of threads: one keyword, the old one with a warning, anything else refused by name."""

import os

import numpy as np
import pytest

from flybystab.core.numerics.threads import worker_count
from flybystab.errors import InvalidInput


def test_the_number_of_threads():
    assert worker_count(None) == os.cpu_count()
    assert worker_count(3) == worker_count(np.int64(3)) == 3


@pytest.mark.parametrize("value", [0, -1, 1.5, True, "x", [2]])
def test_anything_else_is_refused(value):
    with pytest.raises(InvalidInput, match="workers"):
        worker_count(value)


def test_the_old_keyword_warns():
    with pytest.warns(DeprecationWarning, match="use workers"):
        assert worker_count(None, threads=2) == 2


def test_searches_take_workers_and_the_old_keyword():
    import astropy.units as u
    from astropy.time import Time

    import flybystab as fs

    apophis = fs.Asteroid.from_catalogue("Apophis")
    span = Time("2029-04-01", scale="tdb"), Time("2029-05-01", scale="tdb")
    new = fs.find_encounters(apophis, *span, workers=1)
    with pytest.warns(DeprecationWarning, match="threads"):
        old = fs.find_encounters(apophis, *span, threads=1)
    assert new["distance"][0] == old["distance"][0]
    with pytest.raises(InvalidInput, match="workers"):
        fs.find_encounters(apophis, *span, workers="x")
    with pytest.raises(InvalidInput, match="forces"):
        fs.find_encounters(apophis, *span, forces=3)
    with pytest.raises(InvalidInput, match="periapsis"):
        fs.Encounter.hyperbolic("earth", 1e-300 * u.km, 6 * u.km / u.s)
