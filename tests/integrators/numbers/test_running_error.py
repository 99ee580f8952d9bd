"""Bounds of round-off."""

import numpy as np
import pytest

from discmech.integrators.numbers import (
    arithmetic,
    inverse_sizes,
    numeric_function,
    numeric_text,
    rounded,
    solve,
    sympy,
    with_running_errors,
)
from discmech.integrators.numbers.running_error import product
from discmech.integrators.retractions import stumpff  # noqa: F401 - lets texts call its functions

x, y = sympy.symbols("x y", positive=True)
FORMULAS = [
    x + y - sympy.Rational(1, 3), x * y / (1 + x), x**3 - 1 / y**2, (x - y) ** 4 / (x + y),
    sympy.sin(x) * sympy.cos(y) - sympy.tan(x / 9), sympy.exp(-x) + sympy.log(y) * sympy.sqrt(x),
    sympy.atan2(x, y) + sympy.asin(x / 9) + sympy.acos(y / 9) + sympy.atan(x * y),
    sympy.sinh(x) * sympy.tanh(y) + sympy.cosh(x), x**sympy.Rational(3, 2) - 1 / sympy.cbrt(y),
    abs(1 - x) * sympy.pi + sympy.EulerGamma, 1 - sympy.cos(x / 10**6),
]  # fmt: skip


@pytest.mark.parametrize("digits", [16, 50])
@pytest.mark.parametrize("rows", [
    [], [[-4]], [[1, 2], [3, 4]], [[0, 1e-9], [2, 0]], [[1e-80, 1], [1, 3e90]],
    [[1 / (i + j + 1) for j in range(8)] for i in range(8)],  # of condition 10¹⁰: in all digits
])  # fmt: skip
def test_the_sizes_of_an_inverse_are_those_of_its_entries(rows, digits):
    numbers, k = arithmetic(digits), len(rows)
    with numbers.working():
        a = np.array([[numbers.number(e) for e in row] for row in rows], numbers.dtype)
        a = a.reshape(k, k)
        found, many = inverse_sizes(a), arithmetic(200)
        with many.working():
            exact = np.vectorize(many.number, otypes=[object])(a) if k else a
            wanted = abs(many.solve(exact, many.identity(k)))
        assert found.shape == (k, k)
        assert all(abs(f - w) <= 1e-6 * w for f, w in zip(found.flat, wanted.flat, strict=True))


@pytest.mark.parametrize("digits", [16, 50])
@pytest.mark.parametrize("rows", [[[0, 1], [0, 2]], [[1, 2], [0, 0]], [[1, 2], [2, 4]]])
def test_a_singular_matrix_has_none(rows, digits):
    numbers = arithmetic(digits)
    with numbers.working(), pytest.raises(ZeroDivisionError):
        inverse_sizes(np.array(rows, numbers.dtype) * numbers.number(1))


@pytest.mark.parametrize("digits", [16, 50])
@pytest.mark.parametrize("shape", [(3, 4), (4,), (0, 4)])
@pytest.mark.parametrize("columns", [0, 3])
def test_a_product_leaves_out_nothing_but_zeros(shape, columns, digits):
    numbers, random = arithmetic(digits), np.random.default_rng(7)
    a, b = (random.integers(-3, 4, size) for size in (shape, (4, columns)))
    b[:, :1] = 0  # a column that leaves nothing
    with numbers.working():
        found = product(*(numbers.zeros(*e.shape) + e for e in (a, b)))
        assert found.dtype == numbers.dtype and found.shape == (a @ b).shape
        assert np.all(found == a @ b)


@pytest.mark.parametrize("formula", FORMULAS, ids=str)
def test_a_bound_holds_and_is_near_what_is_lost(formula):
    """Doubles are off by at most their bound, which is some round-offs of what they can be."""
    text = numeric_text({"x": x, "y": y}, [[formula]])
    double, many = arithmetic(16), arithmetic(50)
    with many.working():
        exact, plain = numeric_function(text, many), numeric_function(text, double)
        for at in np.random.default_rng(3).uniform(0.5, 4, (20, 2)):
            bound = with_running_errors(text, double)(*rounded(at)).error[0] * double.eps
            wanted = exact(*map(many.number, at.tolist()))[0]
            moved = [exact(*(e * (1 + 2.0**-40 * (j == k)) for j, e in enumerate(at.tolist())))[0]
                     for k in range(2)]  # fmt: skip
            lost = sum(abs(e - wanted) * 2**40 for e in moved) + abs(wanted) + 1
            assert abs(plain(*at)[0] - wanted) <= bound <= 64 * double.eps * lost


@pytest.mark.parametrize("digits", [16, 50])
def test_a_bound_of_a_solution_has_what_elimination_fills(digits):
    """Of a zero that elimination fills and empties again, round-off remains in the solution."""
    numbers = arithmetic(digits)
    with numbers.working():
        a = np.array([[1, 0, 1], [1, 1, 1], [0, 1, 3]]) * numbers.number("0.1")
        found = solve(numbers, rounded(a), rounded(a[:, 0]))
        assert np.all(found.error[1:] > 0.5) and np.all(found.error < 200)
        singular = np.ones((2, 2)) * numbers.number("0.1")
        singular[1, 1] += 3 * numbers.eps
        assert np.all(solve(numbers, rounded(singular), rounded(singular[0])).error != 0)


@pytest.mark.parametrize("digits", [16, 50])
def test_an_error_of_a_zero_goes_through_a_product(digits):
    numbers = arithmetic(digits)
    with numbers.working():
        one = numbers.identity(2)
        zeros = rounded(numbers.zeros(2, 2), np.array([[0, 5], [7, 0]]))
        for found in (rounded(one) @ zeros, zeros @ rounded(one)):
            assert np.allclose(found.error.astype(float), [[0, 5], [7, 0]], rtol=1e-6)
