"""Four numbers at a time in kernels: explicit vector instructions for short sums.

The compiler unrolls loops of four or eight passes before it vectorises loops, and so leaves their square roots and
divisions scalar. Values of the type here are four floats in one register (two where registers are shorter), with
``+``, ``-``, ``*``, ``/`` among themselves and with floats. The operations are those of single numbers, in the order
written, with the same results on any processor. Uncompiled kernels use arrays of shape (4,) instead.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import config, types
from numba.core import cgutils
from numba.core.imputils import lower_builtin
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, models, register_model
from numba.np.arrayobj import make_array

from flybystab.core.numerics.jit import inlined

#: Numbers in a value.
N_LANES = 4
_DOUBLES = ir.VectorType(ir.DoubleType(), N_LANES)
_SINGLES = ir.VectorType(ir.FloatType(), N_LANES)


class LanesType(types.Type):
    """Four floats."""

    def __init__(self) -> None:
        super().__init__(name="lanes4")


_lanes = LanesType()


@register_model(LanesType)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _DOUBLES)


def _broadcast(builder: Any, value: Any) -> Any:
    """All lanes equal to one float."""
    one = builder.insert_element(ir.Constant(_DOUBLES, ir.Undefined), value, ir.Constant(ir.IntType(32), 0))
    return builder.shuffle_vector(
        one, one, ir.Constant(ir.VectorType(ir.IntType(32), N_LANES), [0] * N_LANES)
    )


def _define(operations: tuple[Any, ...], instruction: str) -> None:
    """Typing and code of an operator, for two values or a value and a float."""

    class Operation(AbstractTemplate):
        def generic(self, args: Any, kws: Any) -> Any:
            if (
                len(args) == 2
                and _lanes in args
                and all(a == _lanes or isinstance(a, types.Number) for a in args)
            ):
                return signature(_lanes, *(a if a == _lanes else types.float64 for a in args))
            return None

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        both = [a if t == _lanes else _broadcast(builder, a) for a, t in zip(args, sig.args, strict=True)]
        return getattr(builder, instruction)(*both)

    for operation in operations:
        infer_global(operation)(Operation)
        for pair in ((_lanes, _lanes), (_lanes, types.float64), (types.float64, _lanes)):
            lower_builtin(operation, *pair)(generate)


_define((operator.add, operator.iadd), "fadd")
_define((operator.sub, operator.isub), "fsub")
_define((operator.mul, operator.imul), "fmul")
_define((operator.truediv, operator.itruediv), "fdiv")


def _function(fallback: Callable[..., Any]) -> Callable[[Callable[..., Any]], Any]:
    """An intrinsic, or `fallback` in uncompiled kernels."""

    def choose(typed: Callable[..., Any]) -> Any:
        return fallback if getattr(config, "DISABLE_JIT", 0) else intrinsic(typed)

    return choose


def _address(context: Any, builder: Any, kind: Any, array: Any, place: Any) -> Any:
    """Pointer to four consecutive numbers of an array, counted in the order of its memory."""
    data = make_array(kind)(context, builder, array).data
    return builder.bitcast(builder.gep(data, [place]), _DOUBLES.as_pointer())


def _put_in_python(array: Any, place: int, value: Any) -> None:
    array.reshape(-1)[place : place + N_LANES] = value


@_function(lambda array, place: array.reshape(-1)[place : place + N_LANES].copy())
def lanes_at(typing: Any, array: Any, place: Any) -> Any:
    """Four consecutive numbers of a C-contiguous array, from place `place` in the order of its memory."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.load(_address(context, builder, sig.args[0], *args), align=8)

    return _lanes(array, types.intp), generate


@_function(_put_in_python)
def put_lanes(typing: Any, array: Any, place: Any, value: Any) -> Any:
    """Write four consecutive numbers of a C-contiguous array."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        builder.store(args[2], _address(context, builder, sig.args[0], args[0], args[1]), align=8)
        return context.get_dummy_value()

    return types.none(array, types.intp, _lanes), generate


@_function(lambda value: np.full(N_LANES, value))
def spread(typing: Any, value: Any) -> Any:
    """All lanes equal to one float."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return _broadcast(builder, args[0])

    return _lanes(types.float64), generate


@_function(lambda value, i: value[i])
def lane(typing: Any, value: Any, i: Any) -> Any:
    """Number `i` of a value."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.extract_element(args[0], args[1])

    return types.float64(_lanes, types.intp), generate


@_function(lambda value: value.sum())
def total(typing: Any, value: Any) -> Any:
    """Sum of the lanes."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        (a,) = args
        for swap in ([2, 3, 0, 1], [1, 0, 3, 2]):
            mask = ir.Constant(ir.VectorType(ir.IntType(32), N_LANES), swap)
            a = builder.fadd(a, builder.shuffle_vector(a, a, mask))
        return builder.extract_element(a, ir.Constant(ir.IntType(32), 0))

    return types.float64(_lanes), generate


@_function(lambda value: (np.float32(1.0) / np.sqrt(value.astype(np.float32))).astype(float))
def inverse_root_24(typing: Any, value: Any) -> Any:
    """Inverse square root in single precision (24 bits), for numbers in its range, 1e-38 to 3e38."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        single = builder.fptrunc(args[0], _SINGLES)
        root = cgutils.get_or_insert_function(
            builder.module, ir.FunctionType(_SINGLES, [_SINGLES]), f"llvm.sqrt.v{N_LANES}f32"
        )
        ones = ir.Constant(_SINGLES, [1.0] * N_LANES)
        return builder.fpext(builder.fdiv(ones, builder.call(root, [single])), _DOUBLES)

    return _lanes(_lanes), generate


@_function(lambda value, a, b: np.where(a < b, 0.0, value))
def zero_where_less(typing: Any, value: Any, a: Any, b: Any) -> Any:
    """The value, with zeros where ``a < b``."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        less = builder.fcmp_ordered("<", args[1], args[2])
        return builder.select(less, ir.Constant(_DOUBLES, [0.0] * N_LANES), args[0])

    return _lanes(_lanes, _lanes, _lanes), generate


@_function(lambda a, b: bool((a < b).any()))
def any_less(typing: Any, a: Any, b: Any) -> Any:
    """True if ``a < b`` in any lane."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        bits = builder.bitcast(builder.fcmp_ordered("<", *args), ir.IntType(N_LANES))
        return builder.icmp_unsigned("!=", bits, ir.Constant(ir.IntType(N_LANES), 0))

    return types.boolean(_lanes, _lanes), generate


@inlined
def inverse_root(value: Any) -> Any:
    """Inverse square root: that of single precision after one step of Halley's method, of third order."""
    q = inverse_root_24(value)
    e = 1.0 - (value * q) * q
    return q + (q * e) * (0.5 + 0.375 * e)


__all__ = [
    "N_LANES",
    "any_less",
    "inverse_root",
    "inverse_root_24",
    "lane",
    "lanes_at",
    "put_lanes",
    "spread",
    "total",
    "zero_where_less",
]
