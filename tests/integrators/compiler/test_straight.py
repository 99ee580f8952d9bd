"""Straight-line functions as machine code: the numbers that Python makes of the same text."""

import math
import random
from math import atan2, cos, sin, sqrt

import numpy as np
import pytest
from numba import njit

from discmech.integrators.compiler.llvm_instructions import Writer
from discmech.integrators.compiler.straight_line import straight

R = float
FAST = "contract", "arcp", "nsz", "reassoc"


def arithmetic(x, w, k):
    a = x[0] * w[1] - (R(1) / 3) * x[1] / w[0] + 2
    b, c = sin(a) + atan2(a, w[1]), sqrt(abs(-a * a + 7))
    return (a, b * 1, 0), c**2.5 - 3 * k + x[2][0] ** 2, ()


def raised(x):
    return (x[0] ** 18 + x[1] ** 3, x[0] ** -2, x[1] ** 0, x[0] ** 1 * 1)


def doubled(a, b):
    return (2 * a + b, cos(a))


def filled(a, row, v):
    a[row, 0] = v[0]
    a[row, 1] = 1 / v[1]


def counted(a):
    return int(a[2]), a[0] + a[1], (a[3],)


shared_pair = straight(shared=True)(doubled)


def twice(x):
    a, b = shared_pair(x[0], x[1])
    c, d = shared_pair(a, b)
    return (a + c, b + d)


@njit
def halved(a, count):
    for i in range(count):
        a[i][2 * i] /= 2


@straight()
def worked(x):
    rows = workspace(2, 3)  # noqa: F821
    rows[0][0] = x[0]
    rows[1][2] = x[1]
    halved(rows, 2)
    s0 = rows[0][0]
    s1 = rows[0, 1]
    return (s0, s1, rows[1][2])


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


@pytest.mark.parametrize("shared", [True, False])
def test_how_often_a_function_is_written(shared, monkeypatch):
    """Once where it is shared, else once for each call."""
    written = []
    begin = Writer.call

    def counted_call(self, arguments):
        written.append(self.text.function.__name__)
        return begin(self, arguments)

    monkeypatch.setattr(Writer, "call", counted_call)
    monkeypatch.setitem(twice.__globals__, "shared_pair", straight(shared=shared)(doubled))
    made = straight()(twice)
    njit(lambda x: made(x))((0.3, -1.25))
    assert written.count("doubled") == (1 if shared else 2)


def raised_in_node(x):
    a, b, c, d = shared_raised(x[0], x[1])
    return (a + b + c + d,)


def raised_of(a, b):
    return (a**18, b**-3, a**0.5, b**20)


shared_raised = straight(shared=True)(raised_of)


def test_powers_in_shared_functions_too():
    made, inner = straight()(raised), straight()(raised_in_node)
    x = (1.1, -0.7)
    assert njit(lambda x: made(x))(x) == pytest.approx(raised(x), rel=1e-14)
    assert njit(lambda x: inner(x))(x)[0] == pytest.approx(sum(raised_of(*x)), rel=1e-14)


def test_what_is_no_straight_line_is_refused():
    def branched(a):
        if a > 0:
            a = -a
        return a

    def grown(a):
        a += 1
        return a

    def twofold(a):
        b = c = a
        return b + c

    def signed(a):
        return +a

    for function in (branched, grown, twofold, signed):
        made = straight()(function)
        with pytest.raises(Exception, match="no straight line"):
            njit(lambda a: made(a))(1.0)  # noqa: B023


def test_arrays_that_are_not_contiguous_are_refused():
    fill = straight()(filled)
    run = njit(lambda a, row, v: fill(a, row, v))
    with pytest.raises(Exception, match="no straight line"):
        run(np.zeros((3, 2)).T, 0, (1.0, 2.0))


def test_entries_of_a_table_are_read_by_row_and_column():
    def read(a, row):
        return (a[row, 1], a[0, 2])

    made = straight()(read)
    a = np.arange(6.0).reshape(2, 3)
    assert njit(lambda a, row: made(a, row))(a, 1) == (4.0, 2.0)


def test_a_workspace_is_zero_and_loops_of_numba_may_be_called():
    worked.straight_text.function.__globals__["workspace"] = None
    run = njit(lambda x: worked(x))
    assert run((3.0, 8.0)) == (1.5, 0.0, 4.0)


def test_division_by_zero_is_a_number():
    made = straight()(filled)
    a = np.zeros((1, 2))
    njit(lambda a, row, v: made(a, row, v), error_model="numpy")(a, 0, (1.0, 0.0))
    assert math.isinf(a[0, 1])
