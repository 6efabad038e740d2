"""Kernels where their cache cannot be written, and as plain Python."""

import os
import subprocess
import sys

import numpy as np
import pytest

COMPILED = {key: value for key, value in os.environ.items() if key != "NUMBA_DISABLE_JIT"}

SCRIPT = """
import numba.core.caching as caching

def refuse(self):
    raise PermissionError("read-only")

caching._CacheLocator.ensure_cache_path = refuse  # neither the package's directory nor the user's can be written
import flybystab.flybys.flyby, flybystab.orbit.ias15, flybystab.core.ellipsoid.yield_bound
from flybystab.core.numerics import jit

@jit.kernel
def twice(x):
    return 2.0 * x

print(jit.CACHE, twice(21.0))
"""


def test_import_and_kernels_work_without_a_place_for_the_cache():
    done = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, env=COMPILED)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == ["False", "42.0"]


def test_kernels_are_cached_where_they_can_be():
    script = "from flybystab.core.numerics import jit, tensors; print(jit.CACHE)"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, env=COMPILED)
    assert done.stdout.split() == ["True"], done.stderr


FLOWN = """
import numpy as np
from flybystab.core.dynamics.run import LIMITS, body_state, integrate
from flybystab.bench.flyby import PHI, case

body, e = case()
state = body_state(body.axes, body.rho, body.omega, np.eye(3), PHI)
found = integrate(state, (e.t_start, e.t_stop), e.tide, limits=LIMITS._replace(tolerance=1e-3))
print(found.steps, *found.shape.ravel(), *found.velocity_gradient.ravel())
"""


def test_a_passage_with_flow_is_the_same_as_plain_python():
    said = [
        subprocess.run(
            [sys.executable, "-c", FLOWN], capture_output=True, text=True, env=env, check=True
        ).stdout.split()
        for env in (COMPILED, {**COMPILED, "NUMBA_DISABLE_JIT": "1"})
    ]
    assert said[0][0] == said[1][0]  # steps
    compiled, plain = (np.array(words[1:], dtype=float) for words in said)
    # compilers fuse products and sums
    assert plain[:9] == pytest.approx(compiled[:9], rel=1e-9, abs=1e-9 * compiled[:9].max())
    assert plain[9:] == pytest.approx(compiled[9:], abs=1e-9 * np.abs(compiled[9:]).max())
