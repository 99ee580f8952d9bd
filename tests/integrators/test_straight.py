"""Straight-line functions as machine code: the numbers that Python makes of the same text."""

import math
import random
from math import atan2, cos, sin, sqrt

import numpy as np
import pytest
from numba import njit

from integrators.straight import straight

R = float
FAST = "contract", "arcp", "nsz", "reassoc"


def arithmetic(x, w, k):
    a = x[0] * w[1] - (R(1) / 3) * x[1] / w[0] + 2
    b, c = sin(a) + atan2(a, w[1]), sqrt(abs(-a * a + 7))
    return (a, b * 1, 0), c**2.5 - 3 * k + x[2][0] ** 2, ()


def doubled(a, b):
    return (2 * a + b, cos(a))


def filled(a, row, v):
    a[row, 0] = v[0]
    a[row, 1] = 1 / v[1]


def counted(a):
    return int(a[2]), a[0] + a[1], (a[3],)


plain = {f.__name__: f for f in (arithmetic, doubled, filled, counted)}
shared_pair = straight(shared=True)(doubled)


def twice(x):
    a, b = shared_pair(x[0], x[1])
    c, d = shared_pair(a, b)
    return (a + c, b + d)


@njit
def halved(a, count):
    for i in range(count):
        a[i] /= 2


@straight()
def worked(x):
    rows = workspace(3)  # noqa: F821
    rows[0] = x[0]
    rows[2] = x[1]
    halved(rows, 3)
    s0 = rows[0]
    s1 = rows[1]
    return (s0, s1, rows[2])


@pytest.mark.parametrize("flags", [(), FAST], ids=["exact", "fast"])
def test_arithmetic_is_python_s(flags):
    made = straight(*flags)(arithmetic)
    run = njit(lambda x, w, k: made(x, w, k))
    at = random.Random(3)
    for _ in range(50):
        x = (at.uniform(1, 2), at.uniform(-2, 2), (at.uniform(-1, 1),))
        w, k = (at.uniform(1, 2), at.uniform(1, 2)), at.uniform(-1, 1)
        (found, number, nothing), (wanted, other, _) = run(x, w, k), arithmetic(x, w, k)
        assert nothing == ()
        assert np.allclose([*found, number], [*wanted, other], rtol=1e-14, atol=1e-14)


def test_operations_are_those_of_the_text_without_flags():
    """A compensated sum loses nothing; with reassociation it is the plain sum."""

    def compensated(a, d):
        s = a + d
        return (s, (s - a) - d)

    for flags, lost in (((), True), (FAST, False)):
        made = straight(*flags)(compensated)
        run = njit(lambda a, d: made(a, d))  # noqa: B023
        assert (run(1.0, 1e-17)[1] != 0) is lost


def test_arrays_and_whole_numbers():
    fill, count = straight()(filled), straight()(counted)
    run = njit(lambda a, row, v: fill(a, row, v))
    a = np.zeros((3, 2))
    run(a, 2, (5.0, 4.0))
    assert a.tolist() == [[0, 0], [0, 0], [5, 0.25]]
    assert njit(lambda a: count(a))(np.array([1.5, 2.0, 7.0, 9.0])) == (7, 3.5, (9.0,))


def test_shared_functions_are_written_once():
    made = straight()(twice)
    run = njit(lambda x: made(x))
    x = (0.3, -1.25)
    a, b = doubled(*x)
    c, d = doubled(a, b)
    assert run(x) == pytest.approx((a + c, b + d), rel=1e-15)
    text = next(iter(run.inspect_llvm().values()))
    assert text.count("define internal") <= 1


def test_a_workspace_is_zero_and_loops_of_numba_may_be_called():
    worked.straight_text.function.__globals__["workspace"] = None
    run = njit(lambda x: worked(x))
    assert run((3.0, 8.0)) == (1.5, 0.0, 4.0)


def test_division_by_zero_is_a_number():
    made = straight()(filled)
    a = np.zeros((1, 2))
    njit(lambda a, row, v: made(a, row, v), error_model="numpy")(a, 0, (1.0, 0.0))
    assert math.isinf(a[0, 1])
