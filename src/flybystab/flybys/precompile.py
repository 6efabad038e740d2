"""Compilation of the kernels of a flyby in a second process, while the first one searches for the encounter.

On a fresh machine the kernels of the orbit and those of the body take about as long to compile. numba compiles in only
one thread of a process; a second process writes its kernels to the disk, from which the first one loads them.
"""

from __future__ import annotations

import os
import subprocess
import sys
from typing import Any

from flybystab.core.dynamics import verdict_row
from flybystab.core.numerics.jit import CACHE

#: A flyby and a sample of attitudes without yield: the kernels of the first result.
_RIGID = """
import astropy.units as u
import flybystab as fs
body = fs.Body([3, 2, 1] * u.m, 2000 * u.kg / u.m**3, spin_period=9 * u.h)
far = fs.Encounter.hyperbolic("earth", 20 * fs.R_earth, 5 * u.km / u.s)
repr(fs.flyby(body, far)), fs.spin_sample(body, far, 2)
"""

_running: subprocess.Popen[bytes] | None = None


def on_disk(kernel: Any) -> bool:
    """Whether a kernel is stored on the disk and up to date; True if that cannot be determined."""
    try:
        return bool(kernel._cache._cache_file._load_index())
    except AttributeError:  # without a cache, or with another version of numba
        return True


def start() -> bool:
    """Start the compilation of kernels that are not cached; False if that would save no time."""
    global _running
    if _running is None and CACHE and (os.cpu_count() or 1) > 1 and not on_disk(verdict_row.rigid_rows):
        _running = subprocess.Popen(
            [sys.executable, "-c", _RIGID], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        return True
    return False


def wait() -> None:
    """Wait for the end of the process that :func:`start` began; return immediately without one.

    Kernels that it has not compiled are compiled in this process.
    """
    global _running
    if _running is not None:
        _running.wait()
        _running = None
