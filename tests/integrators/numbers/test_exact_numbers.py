"""Exact numbers: what is taken as it is, what a float means, what is refused."""

from decimal import Decimal
from fractions import Fraction

import gmpy2
import mpmath
import numpy as np
import pytest
import sympy
from sympy import Rational

from discmech.integrators import BadInput, Scene, Scheme, pair, trapezoidal
from discmech.integrators.numbers import exact, exact_nested, exact_vector, flatten

TENTH = Fraction(3602879701896397, 2**55)  # the double nearest to 0.1
THIRD = np.longdouble(1) / 3


@pytest.mark.parametrize(
    ("given", "wanted"),
    [
        (0.1, TENTH),
        ("0.1", Fraction(1, 10)),
        (" 1/3 ", Fraction(1, 3)),
        ("-2.5e-3", Fraction(-1, 400)),
        (3, 3),
        (Fraction(2, 7), Fraction(2, 7)),
        (np.float64(0.1), TENTH),
        (np.float32(0.1), Fraction(13421773, 2**27)),
        (np.int64(-4), -4),
        (mpmath.mpf(0.1), TENTH),
        (mpmath.mpf("-0.375"), Fraction(-3, 8)),
        (mpmath.mpf(0), 0),
        (gmpy2.mpfr("0.5"), Fraction(1, 2)),
        (gmpy2.mpq(1, 3), Fraction(1, 3)),
        (Rational(5, 9), Fraction(5, 9)),
        (sympy.Integer(2), 2),
        (-0.0, 0),
        (5e-324, Fraction(1, 2**1074)),
        (np.float64(1.7e308), Fraction(1.7e308)),
        (Decimal("0.1"), Fraction(1, 10)),
        (THIRD, Fraction(*THIRD.as_integer_ratio())),
    ],
    ids=repr,
)
def test_numbers_are_exact(given, wanted):
    assert exact(given, "it") == wanted
    assert isinstance(exact(given, "it"), Fraction)


def test_more_digits_than_a_double_are_kept():
    with mpmath.workdps(60):
        assert float(abs(exact(mpmath.pi, "pi") - exact(+mpmath.pi, "pi"))) < 1e-15
        assert exact(+mpmath.pi, "pi") != Fraction(float(mpmath.pi))
    assert exact("0." + "1" * 60, "ones") == Fraction(int("1" * 60), 10**60)


def test_exact_expressions_stay_exact():
    root = sympy.sqrt(2) / 2
    assert exact(root, "root") is root
    scene = Scene("root", pair(1), lambda x, v, p: v[0] ** 2 / 2 - x[0] ** 2 / 2, x0=[root], v0=[0])
    run = Scheme(scene, trapezoidal).flow("1/8", 50).trajectory(0)
    with mpmath.workdps(50):
        assert abs(run.x[0, 0] - mpmath.sqrt(2) / 2) < mpmath.mpf(10) ** -49
    assert Scheme(scene, trapezoidal).flow("1/8").trajectory(0).x[0, 0] == np.sqrt(0.5)


def test_a_third_is_a_third_at_50_digits():
    """A scene's "1/3" is the fraction; 1/3 written as a float is its nearest double."""

    def start(value):
        scene = Scene("third", pair(1), lambda x, v, p: v[0] ** 2 / 2, x0=[value], v0=[0])
        return Scheme(scene, trapezoidal).flow(1, 50).trajectory(0).x[0, 0]

    with mpmath.workdps(50):
        assert abs(start("1/3") - mpmath.mpf(1) / 3) < mpmath.mpf(10) ** -50
        assert start(1 / 3) == mpmath.mpf(1 / 3)


def test_vectors_and_nested():
    assert exact_vector(np.array([0.5, 2]), 2, "it") == (Fraction(1, 2), 2)
    assert exact_nested([["1/2", 1], [0.25, "3"]], "it") == (
        (Fraction(1, 2), 1),
        (Fraction(1, 4), 3),
    )
    assert flatten(((1, 2), (3, (4,)))) == [1, 2, 3, 4]


@pytest.mark.parametrize(("said", "values"), [
    (".*give a", [float("nan"), float("inf"), -np.inf, mpmath.mpf("nan"), mpmath.mpf("inf"),
                  gmpy2.mpfr("nan"), sympy.oo, sympy.zoo, sympy.nan, np.float32("inf"),
                  None, [1], 1j, {}, sympy.I, sympy.Symbol("q")]),
    ('".*", which is no number: write a decimal',
     ["one", "", "1/0", "0x10", "1,5", "__import__('os')"]),
    (".*: choose units that fit the motion",
     ["1e-999999999", "1E+99999", "-2.5e00012345", "1e5_0_0_0_0", "1e٩٩٩٩٩٩٩٩٩", " 1e-999999999 "]),
    ('".*", which is no number', ["9" * 10**6, "1e" + "9" * 10**6, "1e_9", "1e999999999/3"]),
    (".*not a truth value", [True, False, np.bool_(True)]),
    ("", [np.array([0.5, 1.0]), np.complex128(1j)]),
])  # fmt: skip
def test_what_is_no_finite_number_is_refused(said, values):
    for value in values:
        with pytest.raises(BadInput, match="the length is " + said):
            exact(value, "the length")


@pytest.mark.parametrize(("text", "value"), [
    ("sqrt(3)/6", sympy.sqrt(3) / 6),
    ("-(1 + sqrt(5))/2", -(1 + sympy.sqrt(5)) / 2),
    ("0.1*sqrt(2) - 1/3", sympy.sqrt(2) / 10 - sympy.Rational(1, 3)),
    ("sqrt(4)", Fraction(2)),
])  # fmt: skip
def test_a_text_with_roots_is_exact(text, value):
    assert exact(text, "w") == value


@pytest.mark.parametrize(
    "text",
    ["sqrt(-1)", "sqrt(x)", "sqrt(2)**9**9**9", "sqrt(2, 3)", "__import__('os').sqrt(2)", "sqrt",
     "sqrt(2)+" * 100 + "1", "sqrt(1/0)", "sqrt(1e999999999)"],
)  # fmt: skip
def test_a_text_that_is_no_number_with_roots_is_refused(text):
    with pytest.raises(BadInput, match="w is"):
        exact(text, "w")
