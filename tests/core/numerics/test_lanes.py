"""Operations on four numbers at a time against numpy's, compiled and not."""

import subprocess
import sys

import numpy as np
import pytest

from flybystab.core.numerics.jit import kernel
from flybystab.core.numerics.lanes import (
    any_less,
    inverse_root,
    inverse_root_24,
    lane,
    lanes_at,
    put_lanes,
    spread,
    total,
    zero_where_less,
)

A = np.array([1.5, -2.0, 7.25, 1e10])
B = np.array([-0.5, 3.0, 7.25, 1e-3])


@kernel
def arithmetic(a, b, out):
    x, y = lanes_at(a, 0), lanes_at(b, 0)
    put_lanes(out, 0, x + y)
    put_lanes(out, 4, x - y)
    put_lanes(out, 8, x * y)
    put_lanes(out, 12, x / y)
    put_lanes(out, 16, 2.0 - x)
    put_lanes(out, 20, x / 4.0)
    z = spread(1.0)
    z += x
    z *= y
    z -= 3.0
    put_lanes(out, 24, z)


@kernel
def reductions(a, b):
    x, y = lanes_at(a, 0), lanes_at(b, 0)
    return total(x), lane(x, 2), any_less(x, y), any_less(y, spread(-1.0)), total(zero_where_less(x, x, y))


@kernel
def roots(values, exact, rough):
    for i in range(0, values.size, 4):
        put_lanes(exact, i, inverse_root(lanes_at(values, i)))
        put_lanes(rough, i, inverse_root_24(lanes_at(values, i)))


@kernel
def row(table, i):
    return total(lanes_at(table, table.shape[1] * i + 2))


def test_arithmetic():
    out = np.empty((7, 4))
    arithmetic(A, B, out)
    truth = [A + B, A - B, A * B, A / B, 2.0 - A, A / 4.0, (1.0 + A) * B - 3.0]
    np.testing.assert_array_equal(out, truth)


@kernel
def products(a, b, c, out):
    for i in range(0, a.size, 4):
        x, y, z = lanes_at(a, i), lanes_at(b, i), lanes_at(c, i)
        put_lanes(out, i, ((x * y + z) + x) + y)


def test_products_are_rounded_and_sums_are_in_order():
    """Fused or reordered, the results would depend on the processor and on how a kernel was compiled."""
    a, b, c = np.random.default_rng(2).normal(size=(3, 400))
    out = np.empty(400)
    products(a, b, c, out)
    np.testing.assert_array_equal(out, ((a * b + c) + a) + b)


def test_sums_and_comparisons():
    assert reductions(A, B) == (pytest.approx(A.sum()), 7.25, True, False, pytest.approx(A[[0, 2, 3]].sum()))


def test_inverse_roots_have_their_precision():
    values = 10.0 ** np.random.default_rng(1).uniform(-30.0, 30.0, 4000)
    exact, rough = np.empty(4000), np.empty(4000)
    roots(values, exact, rough)
    assert np.abs(exact * np.sqrt(values) - 1.0).max() < 5e-16
    assert 1e-8 < np.abs(rough * np.sqrt(values) - 1.0).max() < 1.3e-7


def test_places_count_in_the_order_of_memory():
    table = np.arange(18.0 * 6).reshape(18, 6)
    assert row(table, 3) == table[3, 2:].sum()


def test_uncompiled_kernels_give_the_same():
    code = (
        "import numpy as np, test_lanes as t\n"
        "t.test_arithmetic(); t.test_products_are_rounded_and_sums_are_in_order()\n"
        "t.test_sums_and_comparisons(); t.test_places_count_in_the_order_of_memory()\n"
        "t.test_inverse_roots_have_their_precision()\n"
        "assert not hasattr(t.row, 'py_func')"
    )
    env = {"NUMBA_DISABLE_JIT": "1", "PYTHONPATH": __file__.rsplit("/", 1)[0]}
    done = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
