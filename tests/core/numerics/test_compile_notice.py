"""The compilation notice in Python: once, for kernels of the package only, and never where nothing is compiled."""

import subprocess
import sys

from flybystab.core.numerics.compile_notice import WORDS

CODE = """
import astropy.units as u, numba, flybystab as fs
fs.Body
numba.njit(lambda x: x)(1)
print("own", flush=True)
def kernel(x):
    return 2 * x
kernel.__module__ = "flybystab.core.made_up"
for _ in range(2):
    assert numba.njit(kernel)(1.5) == 3.0
"""


def test_once_in_python_and_not_for_functions_of_others():
    done = subprocess.run([sys.executable, "-c", CODE], capture_output=True, text=True, check=True)
    assert done.stdout == "own\n"
    assert done.stderr == WORDS
    without = CODE.partition("def kernel")[0]
    assert (
        subprocess.run([sys.executable, "-c", without], capture_output=True, text=True, check=True).stderr
        == ""
    )
