"""Compiled access to a simulation of rebound, for functions that rebound calls through C pointers.

The layout of ``reb_simulation`` differs between rebound 4 and 5: the offsets of its fields are read from rebound's own
ctypes classes. A simulation carries the address of a model (:func:`flybystab.orbit.forces.model`) in ``extras``.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import rebound
from llvmlite import ir
from numba import carray, types
from numba.core import cgutils
from numba.core.base import BaseContext
from numba.core.typing import Signature
from numba.core.typing.context import BaseContext as TypingContext
from numba.extending import intrinsic

from flybystab.core.numerics.jit import inlined
from flybystab.typing import Array

#: Signature of a callback.
CALLBACK = types.void(types.voidptr)

_Generator = Callable[[BaseContext, ir.IRBuilder, Signature, tuple[ir.Value, ...]], ir.Value]


class Layout(NamedTuple):
    """Offsets of fields: of a simulation in bytes, of a particle in numbers of 8 bytes, and the size of a particle."""

    time: int
    particles: int
    extras: int
    x: int
    v: int
    a: int
    words: int


@lru_cache(maxsize=1)
def layout() -> Layout:
    """The layout of the installed version of rebound."""
    sim, particle = rebound.Simulation, rebound.Particle
    return Layout(
        sim.t.offset,
        sim._particles.offset,
        sim.extras.offset,
        particle.x.offset // 8,
        particle.vx.offset // 8,
        particle.ax.offset // 8,
        ctypes.sizeof(particle) // 8,
    )


@intrinsic
def _pointer(typingctx: TypingContext, address: types.Type) -> tuple[Signature, _Generator]:
    """An address (integer) as a pointer."""

    def generate(
        context: BaseContext, builder: ir.IRBuilder, signature: Signature, args: tuple[ir.Value, ...]
    ) -> ir.Value:
        return builder.inttoptr(args[0], cgutils.voidptr_t)

    return types.voidptr(types.int64), generate


@intrinsic
def _address(typingctx: TypingContext, pointer: types.Type) -> tuple[Signature, _Generator]:
    """A pointer as an address (integer)."""

    def generate(
        context: BaseContext, builder: ir.IRBuilder, signature: Signature, args: tuple[ir.Value, ...]
    ) -> ir.Value:
        return builder.ptrtoint(args[0], cgutils.intp_t)

    return types.int64(types.voidptr), generate


@inlined
def numbers_at(address: int, size: int) -> Array:
    """The `size` numbers at an address, as an array."""
    return carray(_pointer(address), size, np.float64)  # type: ignore[call-arg,arg-type]


@inlined
def _integer_at(address: int) -> int:
    return carray(_pointer(address), 1, np.int64)[0]  # type: ignore[call-arg,arg-type]


@inlined
def under_way(sim: int, at: Layout, count: int) -> tuple[float, Array, Array, int]:
    """Time (s), particles ``[count, at.words]``, model of the forces, and the address after the model."""
    base: int = _address(sim)  # type: ignore[call-arg,arg-type]
    t = numbers_at(base + at.time, 1)[0]
    first = _integer_at(base + at.particles)
    particles = numbers_at(first, count * at.words).reshape((count, at.words))
    where = _integer_at(base + at.extras)
    size = int(numbers_at(where, 1)[0])
    return t, particles, numbers_at(where, size), where + 8 * size
