"""Numbers that are given: exact, refused, rounded once."""

from decimal import Decimal
from fractions import Fraction

import gmpy2
import mpmath
import numpy as np
import pytest
import sympy

from discmech.reference import ReferenceFailure
from discmech.reference.equations import exact

TENTH = Fraction(1, 10)


@pytest.mark.parametrize(
    "given, wanted",
    [("0.1", TENTH), ("1/10", TENTH), (Decimal("0.1"), TENTH), (sympy.Rational(1, 10), TENTH),
     (gmpy2.mpq(1, 10), TENTH), (np.int64(3), Fraction(3)), (np.float32(0.5), Fraction(1, 2)),
     (gmpy2.mpfr(0.5), Fraction(1, 2)), (0.1, Fraction(0.1)), ("1e1000", Fraction(10**1000))],
    ids=repr,
)  # fmt: skip
def test_an_exact_number_is_what_it_says(given, wanted):
    found = exact.exact_time(given)
    assert found == wanted and type(found.numerator) is type(found.denominator) is int
    assert exact.exact_number(given, "k") == sympy.Rational(wanted.numerator, wanted.denominator)


@pytest.mark.parametrize("given", [
    None, "x", "1/0", "1e-1001", True, float("nan"), float("inf"), Decimal("NaN"), Decimal("inf"),
    np.float32("nan"), sympy.Symbol("x"), sympy.oo, sympy.I, 1j, [1],
], ids=repr)  # fmt: skip
def test_what_is_no_real_number_is_refused(given):
    for refused in (exact.exact_time, lambda value: exact.exact_number(value, "k")):
        with pytest.raises(ReferenceFailure):
            refused(given)


def test_complex_numbers_only_where_they_are_asked_for():
    assert exact.exact_number(0.5j, "k", real=False) == sympy.I / 2
    for value, kind in ((sympy.I, "finite real"), (sympy.oo, "finite real")):
        with pytest.raises(ReferenceFailure, match=f"k = .* is not a {kind} number"):
            exact.exact_number(value, "k")
    with pytest.raises(ReferenceFailure, match=r"k = .* is not a finite number"):
        exact.exact_number(sympy.zoo, "k", real=False)


def test_arrays_of_numbers_are_matrices():
    assert exact.exact_array("1/2", "k") == sympy.Rational(1, 2)
    assert exact.exact_array([1, "1/2"], "k") == sympy.Matrix([1, sympy.Rational(1, 2)])
    table = sympy.Matrix([[1, 2], [3, 4]])
    assert exact.exact_array(((1, 2), [3, 4]), "k") == exact.exact_array(table, "k") == table
    for bad in ([1, None], [[1, 2], [3, sympy.I]], sympy.Matrix([sympy.I])):
        with pytest.raises(ReferenceFailure, match=r"^k = "):
            exact.exact_array(bad, "k")


@pytest.mark.parametrize("number", [
    sympy.Rational(-1, 3), sympy.Integer(2**31), -sympy.Integer(2**70), sympy.sqrt(2), sympy.S.Zero,
], ids=str)  # fmt: skip
def test_numbers_are_rounded_once(number):
    """To the precision of whoever asks, and from there exactly."""
    with gmpy2.context(gmpy2.get_context(), precision=200), mpmath.workprec(200):
        one = gmpy2.mpfr(exact.number_to_mpfr(number, 60))
        two = exact.number_to_mpf(number)
        assert two == +mpmath.mpmathify(sympy.N(number, 80))
        with mpmath.workprec(20):
            assert exact.to_mpf(one)._mpf_ == two._mpf_
