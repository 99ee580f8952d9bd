"""The compiler's own small language: the numbers that Python makes of the same text."""

import math
import random
import textwrap

import numpy as np
import pytest

from discmech.integrators.compiler.llvm_values import Array
from discmech.integrators.compiler.machine_code import compiled
from discmech.integrators.numbers import Double, run_text

ARRAYS = {"a": Array("f"), "table": Array("f", columns=3), "whole": Array("i")}


def both(text, *arguments):
    """What a text's `advance` makes of copies of the arguments, as machine code and in Python."""
    text = textwrap.dedent(text)
    names = run_text(text, Double().namespace())
    found = []
    for advance in (compiled("test", text, names, ARRAYS), names["advance"]):
        given = [g.copy() if isinstance(g, np.ndarray) else g for g in arguments]
        found.append([advance(*given), *(g for g in given if isinstance(g, np.ndarray))])
    return found


def agree(text, *arguments, rtol=1e-14):
    machine, python = both(text, *arguments)
    assert machine[0] == python[0]
    for one, other in zip(machine[1:], python[1:], strict=True):
        assert np.allclose(one, other, rtol=rtol, atol=1e-14)
    return machine


@pytest.mark.parametrize("decorator", ["kernel", "node", "aside", "helper"])
def test_arithmetic_is_python_s(decorator):
    text = f"""
    @{decorator}
    def arithmetic(x, w, k):
        p = x[0] * w[1] - (R(1) / 3) * x[1] / w[0] + 2
        b, c = sin(p) + atan2(p, w[1]), sqrt(abs(-p * p + 7))
        return (p, b * 1, 0), c**2.5 - 3 * k + x[2][0] ** 2 + p**18 + w[0] ** -2 + k**0, tan(k)

    def advance(a):
        (b, c, d), e, f = arithmetic((a[0], a[1], (a[2],)), (a[3], a[4]), a[5])
        for i, value in enumerate((b, c, d, e, f)):
            a[i] = value
        return 0, 1
    """
    at = random.Random(3)
    for _ in range(20):
        agree(text, np.array([at.uniform(1, 2) for _ in range(6)]))


def test_a_loop_over_a_generator_ends_whole():
    """A break leaves all loops of the generator; one over known numbers is unrolled."""
    text = """
    def places(rows, stop):
        for r in range(rows):
            for k in range(stop):
                yield r, 3 * r + k

    def advance(a, whole, n):
        total = 0.0
        for r, at in places(3, n):
            total = total + a[at]
            whole[r] = whole[r] + at
            if total > 4:
                break
        for r, at in places(1, 2):
            a[at] = total + r
        return whole[1], whole[2]
    """
    a, whole = np.array([1.0, 0, 1, 1, 0, 0.5, 2, 9]), np.zeros(3, dtype=np.int64)
    assert agree(text, a, whole, 3)[0] == (12, 6)
    assert agree(text, a, whole, 2)[0] == (7, 13)


def test_branches_loops_and_whole_numbers():
    text = """
    def collatz(n, most):
        count = 0
        while n != 1:
            n = n // 2 if n % 2 == 0 else 3 * n + 1
            count += 1
            if count > most and not n < 10:
                return n, count
        return 0, count

    def advance(a, whole, n):
        best = 0
        for i in range(n):
            if a[i] > a[best] or i == 0:
                best = i
            elif a[i] < -100:
                break
        total = 0
        for j in range(3, -1, -1):
            total += whole[j] * j
        whole[0], whole[1] = collatz(n, total)
        return best, total
    """
    numbers, whole = np.array([1.0, 7, -3, 9, -200, 50]), np.array([4, 5, 6, 7])
    for n in range(1, 7):
        agree(text, numbers, whole, n)


def test_vectors_are_python_s_tuples():
    text = """
    LENGTH = 3

    def plus(a, b):
        return tuple([p + q for p, q in zip(a, b)])

    def advance(a, table, row):
        x = tuple([table[row, i] for i in range(LENGTH)])
        y = plus(x, x[1:] + (a[0],)) if LENGTH == 3 else ()
        for i, p in enumerate(y):
            table[row, i] = p
        return len(y), row
    """
    agree(text, np.array([2.5]), np.arange(6.0).reshape(2, 3), 1)


@pytest.mark.parametrize(("decorator", "lost"), [("helper", True), ("kernel", False)])
def test_operations_are_those_of_the_text_unless_it_is_a_kernel(decorator, lost):
    """A compensated sum loses nothing; with reassociation it is the plain sum."""
    text = f"""
    @{decorator}
    def compensated(a, d):
        s = a + d
        return s, (s - a) - d

    def advance(a):
        s, a[0] = compensated(a[0], a[1])
        return 0, 0
    """
    assert bool(both(text, np.array([1.0, 1e-17]))[0][1][0]) is lost


def test_division_by_zero_is_a_number():
    text = """
    def advance(a):
        a[0] = 1 / a[1]
        return 0, 0
    """
    names = run_text(textwrap.dedent(text), Double().namespace())
    a = np.array([2.0, 0.0])
    compiled("test", textwrap.dedent(text), names, ARRAYS)(a)
    assert math.isinf(a[0])


@pytest.mark.parametrize(
    "line", ["b = c = a[0]", "with a: pass", "a[0] = [1 for i in a if i]", "del a", "b: int = 1"]
)
def test_what_is_not_of_the_language_is_refused(line):
    text = f"def advance(a):\n    {line}\n    return 0, 0\n"
    with pytest.raises(AssertionError, match="not of the language"):
        compiled("test", text, run_text(text, {}), ARRAYS)
