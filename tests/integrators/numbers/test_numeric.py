"""Functions made of expressions: they give what sympy's own evaluation gives, in any arithmetic."""

import itertools

import mpmath
import numpy as np
import pytest
import sympy
from sympy import Abs, I, Matrix, Rational, Symbol, pi, sqrt

from discmech.integrators import BadInput, exponential, se, so, su
from discmech.integrators.numbers import (
    arithmetic,
    as_one_number,
    evaluate,
    evaluate_matrix,
    newton,
    numeric,
    numeric_function,
    numeric_text,
    random_point,
)
from discmech.integrators.retractions.stumpff import stumpff

X = sympy.symbols("x_0:3", real=True)
H = Symbol("lambda", real=True)  # a word of Python
EXPRESSIONS = [
    X[0] * X[1] - Rational(1, 3) * X[2] ** 7,
    sqrt(X[0] + 2) * sympy.sin(X[1]) / (X[0] + 2) ** Rational(3, 2) + X[1] ** 20,
    sympy.exp(-X[2]) * sympy.atan2(X[0], X[1]) + pi * H,
    X[0] ** X[1] + (X[0] + X[1]) ** Rational(1, 3) + sympy.E,
    Abs(X[0] - 2) + sympy.log(X[2]) + sympy.tanh(X[0] * X[1]),
    as_one_number(sqrt(2) * X[0]) * as_one_number(X[1] + X[2]) * X[0] - H**2,
    Rational(10**40 + 1, 10**39 + 7) * X[0] / H,
    sympy.GoldenRatio * X[0] - sympy.EulerGamma * sympy.Catalan,
]
POINTS = [random_point([*X, H], seed=seed) for seed in range(3)]
WITH_TABLES = [stumpff(2, X[0]) * stumpff(5, X[0]), stumpff(0, -4 * X[1])]


def wanted(expression, point):
    return expression.xreplace(point).evalf(60)


def gap(value, exact):
    return abs(mpmath.mpf(str(value)) / mpmath.mpf(str(exact)) - 1)


@pytest.fixture(autouse=True)
def enough_digits():
    with mpmath.workdps(70):
        yield


@pytest.mark.parametrize("digits", [16, 50])
@pytest.mark.parametrize("point", POINTS, ids=["0", "1", "2"])
def test_values_are_those_of_sympy(point, digits):
    numbers, expressions = arithmetic(digits), EXPRESSIONS + WITH_TABLES
    f = numeric({"x": X, "h": H}, [expressions, expressions[0]], numbers)
    with numbers.working():
        values, first = f([numbers.number(point[s]) for s in X], numbers.number(point[H]))
        assert values[0] == first
        values = numbers.public(values)
    for value, expression in zip(values, expressions, strict=True):
        assert gap(value, wanted(expression, point)) < 10.0 ** (2 - digits)


def test_columns_of_numbers():
    numbers = arithmetic(16)
    f = numeric({"x": X, "h": H}, [EXPRESSIONS, [H, 3], X[0]], numbers, columns=True)
    columns = np.array([[float(p[s]) for p in POINTS] for s in X])
    values, constant, scalar = f(columns, 0.25)
    assert values.shape == (len(EXPRESSIONS), 3) and np.array_equal(scalar, columns[0])
    assert np.array_equal(constant, [0.25, 3])
    for row, expression in zip(values, EXPRESSIONS, strict=True):
        for value, point in zip(row, POINTS, strict=True):
            assert gap(value, wanted(expression, {**point, H: Rational(1, 4)})) < 1e-13


def test_shapes_are_those_of_the_results():
    numbers = arithmetic(16)
    x = list(X)
    results = [x[0], x, Matrix(1, 3, x), Matrix(3, 1, x), [Matrix(2, 1, x[:2])] * 4, [],
               sympy.zeros(0, 2), [[x[0], 0], [1, x[2]]]]  # fmt: skip
    shapes = [np.shape(part) for part in numeric({"x": X}, results, numbers)([1.0, 2.0, 3.0])]
    assert shapes == [(), (3,), (1, 3), (3, 1), (4, 2, 1), (0,), (0, 2), (2, 2)]
    assert np.array_equal(numeric({"x": x}, [Matrix(1, 3, x)], numbers)([1, 2, 3]), [[1, 2, 3]])


def test_one_text_serves_every_arithmetic():
    text = numeric_text({"x": X}, [X[0] / 3])
    short, long = (numeric_function(text, arithmetic(digits)) for digits in (16, 40))
    assert short([1.0, 0, 0]) == 1 / 3
    with arithmetic(40).working():
        third = long([arithmetic(40).number(1), 0, 0])
        assert abs(3 * third - 1) < 1e-40 and abs(third - 1 / 3) > 1e-20


@pytest.mark.parametrize("algebra", [so(3), se(2), su(2), su(3)], ids=lambda a: a.name)
def test_evaluation_agrees_with_numeric(algebra):
    """Both ways to a value, on complex matrices and on functions with several outputs too."""
    xi = Matrix([Rational(k + 2, 7) for k in range(algebra.dim)])
    letters = sympy.symbols(f"y_0:{algebra.dim}", real=True)
    matrix = exponential.displacement(algebra, Matrix(letters))
    parts = [[e.xreplace({I: 0}) for e in matrix], [e.coeff(I) for e in matrix.expand()]]
    numbers = arithmetic(40)
    with numbers.working():
        real, imaginary = numeric({"y": letters}, parts, numbers)([numbers.number(e) for e in xi])
        values = [evaluate(e, 40) for e in matrix.xreplace(dict(zip(letters, xi, strict=True)))]
        for value, a, b in zip(values, real, imaginary, strict=True):
            assert abs(value.real - a) < 1e-38 and abs(value.imag - b) < 1e-38


def test_a_complex_matrix_as_floats():
    matrix = Matrix([[1 + I * sqrt(2), pi], [I, Rational(1, 3)]])
    gaps = evaluate_matrix(matrix, 40) - matrix.evalf(40)
    assert max(abs(e) for e in gaps) < Rational(1, 10**38)


def test_functions_that_no_arithmetic_has_are_refused():
    with pytest.raises(BadInput, match="the function gamma cannot be put into a kernel; there are"):
        numeric({"x": X}, [sympy.gamma(X[0])], arithmetic(16))
    with pytest.raises(BadInput, match="the derivative of Abs"):
        numeric({"x": X}, [Abs(X[0]).diff(X[0])], arithmetic(16))


@pytest.mark.parametrize("digits", [16, 50])
@pytest.mark.parametrize("size", [0, 1, 2, 5])
def test_determinant_solution_and_identity(size, digits):
    numbers, generator = arithmetic(digits), np.random.default_rng(size)
    entries = generator.integers(-9, 9, (size, size))
    exact = Matrix(size, size, [int(e) for e in entries.ravel()])
    with numbers.working():
        a = numbers.array([numbers.number(int(e)) for e in entries.ravel()], size, size)
        one = numbers.identity(size)
        assert float(abs(numbers.det(a) - numbers.number(exact.det()))) < 1e-8 * 10 ** (16 - digits)
        assert (abs(a @ numbers.solve(a, one) - one) < 1e-12 * 10.0 ** (16 - digits)).all()
        assert numbers.det(a @ (0 * one)) == (size == 0)


@pytest.mark.parametrize("digits", [16, 50])
def test_a_singular_matrix_is_named(digits):
    numbers = arithmetic(digits)
    with numbers.working(), pytest.raises(ZeroDivisionError, match="singular matrix"):
        numbers.solve(0 * numbers.identity(2), numbers.zeros(2))


@pytest.mark.parametrize("digits", [16, 50])
def test_newton_ends_at_round_off_or_says_none(digits):
    numbers = arithmetic(digits)
    with numbers.working():
        start = numbers.identity(1)[0]
        root = newton(lambda z: (2 - z * z) / (2 * z), start, 0, numbers.eps)
        assert abs(root[0] ** 2 - 2) < 16 * numbers.eps
        assert newton(lambda z: (2 + z * z) / (2 * z), start, 0, numbers.eps) is None
        assert newton(lambda z: z / 0, start, 0, numbers.eps) is None
        # held against its own size, an entry that is put right to exactly 0 is no infinity
        assert newton(lambda z: -z, start, 0 * start, numbers.eps) == [0]


@pytest.mark.parametrize("digits", [16, 50])
def test_newton_ends_where_an_entry_is_a_product_of_round_offs(digits):
    """It wanders about 0 for ever, by as much as it has; the other one is found as before."""
    numbers = arithmetic(digits)
    wandering = itertools.cycle([1, -2, 3, -1])

    def change(z):
        return numbers.array([(2 - z[0] * z[0]) / (2 * z[0]), next(wandering) * numbers.eps**2], 2)

    with numbers.working():
        root = newton(change, numbers.identity(2)[0], numbers.zeros(2), numbers.eps)
        assert abs(root[0] ** 2 - 2) < 16 * numbers.eps
        assert abs(root[1]) < 16 * numbers.eps**2
