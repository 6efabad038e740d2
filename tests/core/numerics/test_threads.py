"""Number of threads: one keyword, the old one with a warning, anything else refused by name."""

import os
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from flybystab.core.numerics.threads import in_order, interrupts_deferred, worker_count
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


def interrupted_block(seen):
    with interrupts_deferred() as interrupted:
        seen.append(interrupted())
        signal.raise_signal(signal.SIGINT)
        seen.append(interrupted())


@pytest.fixture
def usual_interrupts():
    """Python's handler: a shell that starts the tests in the background lets them ignore SIGINT."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_an_interrupt_waits_for_the_end_of_the_block(usual_interrupts):
    seen = []
    with pytest.raises(KeyboardInterrupt):
        interrupted_block(seen)
    assert seen == [False, True]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_other_threads_receive_no_interrupts():
    with ThreadPoolExecutor(1) as pool:
        assert pool.submit(lambda: list(in_order(abs, [-1, -2, -3], 2))).result() == [1, 2, 3]


def test_an_interrupt_inside_a_lock_of_the_futures_ends_the_run(tmp_path):
    """Without deferral the lock stays locked, and the threads that need it never end."""
    script = """
import signal, threading, time
from flybystab.core.numerics.threads import in_order
usual, left, main = threading.Condition.__enter__, [PLACE], threading.get_ident()
def enter(self):
    found = usual(self)
    if threading.get_ident() == main:
        left[0] -= 1
        if left[0] == 0:
            signal.raise_signal(signal.SIGINT)
    return found
signal.signal(signal.SIGINT, signal.default_int_handler)
threading.Condition.__enter__ = enter
done = []
def work(n):
    time.sleep(0.001)
    done.append(n)
try:
    for _ in in_order(work, range(2000), 2):
        pass
except KeyboardInterrupt:
    print("interrupted after", len(done))
"""
    for place in range(2049, 2053):
        program = script.replace("PLACE", str(place))
        run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120)
        assert run.stdout.startswith("interrupted after"), run.stderr
        assert int(run.stdout.split()[-1]) < 1500


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on this system")
def test_a_fork_while_threads_compute_is_warned_of():
    """The child of such a fork may hang: tested in a separate process with a time limit."""
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
