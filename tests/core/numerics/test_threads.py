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


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on this system")
def test_a_fork_while_threads_compute_is_warned_of():
    """The child of such a fork may hang: tested in a separate process with a time limit."""
    import subprocess
    import sys

    script = """
import os, threading, warnings
from flybystab.core.numerics.threads import in_order
begun, go = threading.Event(), threading.Event()
def wait(_):
    begun.set(); go.wait()
def compute():
    list(in_order(wait, [1, 2], 2))
thread = threading.Thread(target=compute); thread.start(); begun.wait()
with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("always")
    child = os.fork()
    if child == 0:
        os._exit(0)
    os.waitpid(child, 0)
go.set(); thread.join()
with warnings.catch_warnings(record=True) as quiet:
    warnings.simplefilter("always")
    child = os.fork()
    if child == 0:
        os._exit(0)
    os.waitpid(child, 0)
print(sum("may hang" in str(w.message) for w in caught), sum("may hang" in str(w.message) for w in quiet))
"""
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, timeout=600, check=True
    )
    assert done.stdout.split() == ["1", "0"]
