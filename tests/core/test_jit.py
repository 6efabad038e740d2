"""Kernels where their cache cannot be written."""

import subprocess
import sys

SCRIPT = """
import numba.core.caching as caching

def refuse(self):
    raise PermissionError("read-only")

caching._CacheLocator.ensure_cache_path = refuse  # neither the package's directory nor the user's can be written
import flybystab.flybys, flybystab.sky.reboundry, flybystab.core.quick
from flybystab.core import jit

@jit.kernel
def twice(x):
    return 2.0 * x

print(jit.CACHE, twice(21.0))
"""


def test_import_and_kernels_work_without_a_place_for_the_cache():
    done = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == ["False", "42.0"]


def test_kernels_are_cached_where_they_can_be():
    script = "from flybystab.core import jit, tensors; print(jit.CACHE)"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.stdout.split() == ["True"], done.stderr
