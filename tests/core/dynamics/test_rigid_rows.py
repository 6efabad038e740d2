"""Rows followed up to yield without the kernels of flow."""

import os
import subprocess
import sys

import astropy.units as u
import numpy as np
from scipy.spatial.transform import Rotation

from flybystab.bench.flyby import case
from flybystab.core.dynamics import verdict_row as kernels
from flybystab.core.dynamics.workspace import Limits
from flybystab.core.verdict_codes import FLOWED, INTACT, NOT_IN_EQUILIBRIUM
from flybystab.encounter.encounter import Encounter
from flybystab.flybys.batch import MAX_STEPS, output_buffers, records
from flybystab.units import R_earth


def test_outcomes_are_those_of_the_full_kernel_to_the_bit():
    body, _ = case()
    still, fast = body.with_(spin_period=None), body.with_(spin_period=1.5 * u.h)
    bodies = [body, still, fast] * 20
    e = [
        Encounter.hyperbolic("earth", q * R_earth, 5 * u.km / u.s)
        for q in np.repeat([2.0, 2.4, 3.0, 0.9], 15)
    ]
    rows, met = records(bodies, Rotation.random(60, random_state=3).as_matrix(), e)
    limits, every = Limits(1e-8, 6.0, MAX_STEPS), np.arange(60)
    full, rigid = output_buffers(60, 0), output_buffers(60, 0)
    kernels.verdict_rows(every, rows, met, limits, True, full)
    kernels.rigid_rows(every, rows, met, limits, rigid)
    verdicts = full.outcomes["verdict"]
    assert {INTACT, FLOWED, NOT_IN_EQUILIBRIUM} <= set(verdicts)
    yields = rigid.outcomes["verdict"] == kernels.YIELDS
    assert yields[verdicts == FLOWED].all()
    assert not yields[(verdicts == INTACT) | (verdicts == NOT_IN_EQUILIBRIUM)].any()
    for name in kernels.OUTCOME.names:
        np.testing.assert_array_equal(
            full.outcomes[name][~yields], rigid.outcomes[name][~yields], err_msg=name
        )


SCRIPT = """
import astropy.units as u, numpy as np
import flybystab as fs
from flybystab.bench.flyby import case
from flybystab.core.dynamics import verdict_row as kernels
body, near = case()
far = fs.Encounter.hyperbolic("earth", 4 * fs.R_earth, 5 * u.km / u.s)
full = kernels.verdict_rows
first = fs.flyby(body, far)
assert first.verdict == "INTACT" and not full.overloads
table = fs.flyby_many([body] * 3, [far, near, far])
assert list(table.verdict) == ["INTACT", "RESHAPED", "INTACT"] and len(full.overloads) == 1
again = fs.flyby(body, far)
for name in ("spin_ratio", "pole_change", "max_required_friction_angle", "end_time", "bound_fraction"):
    assert np.all(getattr(first, name) == getattr(again, name)), name
assert np.array_equal(first.history.shape.value, again.history.shape.value)
"""


def test_kernels_of_flow_are_loaded_when_a_body_yields():
    """Before and after, a body that does not yield has the same result to the bit."""
    environment = {key: value for key, value in os.environ.items() if key != "NUMBA_DISABLE_JIT"}
    done = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stderr
