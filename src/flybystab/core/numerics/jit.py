"""Decorators by which the package compiles its kernels.

``kernel`` is ``numba.njit`` with the on-disk cache, without the GIL and with IEEE division (a zero
divisor gives inf or nan, which the callers test for, instead of an exception inside a kernel).
``fastmath`` stays off: compensated sums and sign tests rely on the order of operations, and results would depend on
what the compiler makes of a kernel, which differs between the process that compiles it and those that load it.
``summing_kernel`` is for the few inner loops that are plain sums and are not merged with others: there the compiler may
reorder additions and fuse products, which lets it use vector instructions; infinities and nan are still handled.
``inlined`` is a kernel that becomes part of its callers. A kernel on disk is recompiled when any file from which it is
compiled has changed (:mod:`flybystab.core.numerics.kernel_cache`). If no folder for the cache is writable (read-only
package and home) each process compiles for itself.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import config, njit, types
from numba.core import cgutils
from numba.extending import intrinsic
from numba.np.arrayobj import make_array

from flybystab.core.numerics.kernel_cache import watch

watch()


def _cacheable() -> bool:
    """True if numba finds a folder for its cache; without one it refuses to define a cached kernel."""
    try:
        njit(cache=True)(lambda: 0)
    except RuntimeError:
        return False
    return True


#: True if compiled kernels are kept on disk.
CACHE = _cacheable()
kernel = njit(cache=CACHE, nogil=True, error_model="numpy")
#: For kernels that are made from others at run time, which numba cannot keep on disk; they become part of the cached
#: kernels that call them.
uncached_kernel = njit(nogil=True, error_model="numpy")
summing_kernel = njit(cache=CACHE, nogil=True, error_model="numpy", fastmath={"reassoc", "contract", "nsz"})
#: A kernel that becomes part of its callers: large kernels that it calls are not compiled once more for it, and a tuple
#: of arrays is not passed to it, which costs more than a few sums.
inlined = njit(cache=CACHE, nogil=True, error_model="numpy", inline="always")


def code(n: int) -> int:
    """An integer constant for kernels: numba compiles anew for each literal int, but not for numpy's."""
    return np.int64(n)  # type: ignore[return-value]


def _uncounted(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    """An array without its reference count, a tuple of such arrays, or any other value unchanged."""
    if isinstance(kind, types.Array):
        view = make_array(kind)(context, builder, value)
        view.meminfo = cgutils.get_null_value(view.meminfo.type)
        return view._getvalue()
    if isinstance(kind, types.BaseTuple):
        members: Any = kind
        parts = cgutils.unpack_tuple(builder, value, len(members))
        return context.make_tuple(
            builder, kind, [_uncounted(context, builder, members[i], part) for i, part in enumerate(parts)]
        )
    return value


def _borrowed(context, value):  # type: ignore[no-untyped-def]
    def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
        return _uncounted(context, builder, signature.return_type, args[0])

    return value(value), generate


#: Inside a kernel: the same array, or named tuple of arrays, without reference counting, which costs an atomic
#: instruction at each use and most of the time of a loop over bodies. Use it for arguments only, which the caller keeps
#: alive: a local array would be freed after its last counted use, and its memory reused.
borrowed: Any = (lambda value: value) if getattr(config, "DISABLE_JIT", 0) else intrinsic(_borrowed)
