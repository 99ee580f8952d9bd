"""Constants and remainders of series: enclosed, and by bounds that follow their derivation."""

import math
from dataclasses import replace
from fractions import Fraction

import gmpy2
import mpmath
import pytest
import sympy
from flint import arb, ctx

from discmech.reference.enclosure import enclose, remainders
from discmech.reference.enclosure.majorants import majorant, upward
from discmech.reference.failures import Unproven
from discmech.reference.taylor import TaylorSettings, compile_series
from discmech.reference.taylor.balls import enclosed, exact, working
from tests.reference.elementary import X, one_equation


def test_the_precision_of_others_is_left_alone():
    before = ctx.prec
    enclose(one_equation(X), compile_series(one_equation(X)), [Fraction(1)], TaylorSettings(20))
    assert ctx.prec == before


@pytest.mark.parametrize("number", ["0", "-1.5", "2.5e-40", "-3e200"])
def test_numbers_enter_exactly(number):
    """mpf, mpfr and arb numbers are the same binary fraction, sign and all."""
    for value in (mpmath.mpf(number), gmpy2.mpfr(number)):
        found = exact(value)
        numerator, denominator = map(int, gmpy2.mpq(gmpy2.mpfr(number)).as_integer_ratio())
        with working(2000):
            assert found.is_exact() and found * denominator == numerator
    for nothing in (mpmath.inf, mpmath.nan, gmpy2.mpfr("-inf"), gmpy2.mpfr("nan")):
        assert not exact(nothing).is_finite()


CONSTANTS = ("sqrt(2)", "-pi**2/3", "exp(1/3)", "2**Rational(1, 3)", "E + EulerGamma",
             "log(3)*sin(1)", "gamma(Rational(1, 3))", "1/sqrt(7)")  # fmt: skip


@pytest.mark.parametrize("text", CONSTANTS)
def test_constants_are_enclosed(text):
    number = sympy.sympify(text)
    with working(120):
        found = enclosed(number)
        assert found.overlaps(arb(str(number.evalf(50)) + " +/- 1e-45")) and found.rad() < 1e-30
    for unknown in (sympy.Function("mid")(1), sympy.besselj(0, 1), sympy.I):
        with pytest.raises(Unproven, match="cannot be enclosed"):
            enclosed(unknown)


def by_hand(terms, error, size=1):
    """A majorant and its terms as fractions; all exact in 53 bits."""
    made = majorant([gmpy2.mpfr(t) for t in terms], [gmpy2.mpfr(abs(t)) for t in terms], size)
    return replace(made, error=gmpy2.mpfr(error)), [Fraction(t) for t in terms], Fraction(error)


@pytest.fixture
def remainders_by_hand():
    """Those of a step of order 2 with nodes a and b, u = 2^-20."""
    found = object.__new__(remainders.Remainders)
    found.order, found.unit = 2, gmpy2.mpfr(2) ** -20
    return found


def cut_off(a, b):
    """What products leave out: sum over i + j >= N of |a_i||b_j|."""
    return sum(x * y for i, x in enumerate(a) for j, y in enumerate(b) if i + j >= 2)


def residual(a, b):
    """And what their products are rounded by."""
    return Fraction(8, 2**20) * sum(a) * sum(b) + cut_off(a, b)


def times_h_derivative(a):
    return [k * x for k, x in enumerate(a)]


def test_bounds_of_arithmetic_are_those_of_their_derivation(remainders_by_hand):
    """n b = a up to the residual, and what the errors of the arguments add, in fractions."""
    r, u = remainders_by_hand, Fraction(1, 2**20)
    with upward():
        (n, N, _), (a, A, e), (b, B, f) = (
            by_hand((1.5, 0.25, 0.125), 0), by_hand((2, 0.5, 0.25), 0.125),
            by_hand((4, 0.25, 0.5), 0.0625),
        )  # fmt: skip
        least_a, least_b = 2 - Fraction(3, 4) - e, 4 - Fraction(3, 4) - f

        wanted = {
            r._times(n, a, b): residual(A, B) + sum(A) * f + sum(B) * e + e * f,
            r._square(n, a): residual(A, A) + 2 * sum(A) * e + e * e,
            r._over(n, a, b): (residual(N, B) + 8 * u * sum(A) + A[2] + sum(N) * f + e) / least_b,
            r._inverse(n, a): (residual(N, A) + 8 * u + sum(N) * e) / least_a,
            r._sqrt(n, a): (residual(N, N) + 8 * u * sum(A) + A[2] + e) / Fraction(9, 8),
            r._abs(n, a): e + A[2],
        }  # fmt: skip
        for found, exactly in wanted.items():
            assert 1 <= Fraction(*found.as_integer_ratio()) / exactly < 1 + Fraction(1, 2**50)
        assert r._sign(n, a) == 0
        zero = by_hand((0, 1, 0), 0)[0]
        for method in (r._abs, r._sign, r._sqrt, r._inverse):
            with pytest.raises(Unproven, match="comes near zero"):
                method(n, zero)


def test_bounds_of_functions_are_those_of_their_derivation(remainders_by_hand):
    r, u = remainders_by_hand, Fraction(1, 2**20)
    with upward():
        (n, N, _), (a, A, e), (m, M, _) = (
            by_hand((1.5, 0.25, 0.125), 0), by_hand((4, 0.5, 0.25), 0.125),
            by_hand((0.5, 0.75, 0.125), 0),
        )  # fmt: skip
        dA, dN = times_h_derivative(A), times_h_derivative(N)
        least, tail = Fraction(25, 8), Fraction(3, 4)

        drift = 8 * u * sum(N) + residual(dA, N)
        near = drift * math.exp(2 * tail)
        assert_above(r._exp(n, a), near + (sum(N) + near) * math.expm1(e))
        both = sum(N) + sum(M)
        drift = 8 * u * both + residual(dA, N) + residual(dA, M)
        for found, near in ((r._sin(n, a, m), drift), (r._cos(n, a, m), drift),
                            (r._sinh(n, a, m), drift * math.exp(2 * tail)),
                            (r._cosh(n, a, m), drift * math.exp(2 * tail))):  # fmt: skip
            assert_above(found, near + (both + near) * e * math.exp(e))
        p = Fraction(3, 2)
        drift = residual(dN, A) + p * residual(dA, N)
        start = 8 * u * sum(N) * (1 + p * math.log(4))
        near = (start + drift / least) * (sum(A) / least) ** p
        power = r._power(n, a, gmpy2.mpfr(1.5))
        assert_above(power, near + (sum(N) + near) * math.expm1(p * e / least))


def assert_above(found, wanted):
    """It is rounded up, and `wanted` to double precision."""
    assert float(wanted) * (1 - 1e-14) <= float(found) <= float(wanted) * (1 + 1e-14)


def test_the_bound_of_a_linear_form(remainders_by_hand):
    """Constants are rounded, nodes are cut off too; each further addition is one more rounding."""
    r, u = remainders_by_hand, Fraction(1, 2**20)
    with upward():
        (a, A, e), (b, B, f) = by_hand((2, 0.5, 0.25), 0.125), by_hand((4, 0.25, 0.5), 0.0625)
        r.known = [a, b]
        x, y, c = sympy.Rational(-3, 4), sympy.Integer(2), sympy.Rational(5, 8)
        one = Fraction(3, 4) * (e + 9 * u * sum(A) + A[2])
        assert_above(r.form({0: x}), one)
        both = Fraction(3, 4) * (e + 11 * u * sum(A) + A[2]) + 2 * (f + 11 * u * sum(B) + B[2])
        assert_above(r.form({0: x, 1: y, None: c}), both + 11 * u * Fraction(5, 8))
        r.known = [a] * 9
        each = e + 17 * u * sum(A) + A[2]
        assert_above(r.form(dict.fromkeys(range(9), sympy.Integer(1))), 9 * each)


def test_functions_and_their_mates_stand_side_by_side(remainders_by_hand):
    """sin before cos on the tape, sinh before cosh; each has the other's size in its bound."""
    r = remainders_by_hand
    with upward():
        a, s, c = (by_hand((size, 0.25, 0), 0.125)[0] for size in (1, 2, 4))
        for first, second in (("sin", "cos"), ("sinh", "cosh")):
            r.known = [a, s, c]
            found = r._error((first, 0), 1), r._error((second, 0), 2)
            assert found[0] == found[1] == getattr(r, f"_{first}")(s, a, c)
        with pytest.raises(Unproven, match="no remainder of whatever"):
            r._error(("unknown", "whatever"), 1)


def test_the_least_value_is_taken_from_the_parts_where_the_norms_leave_little():
    """From an eighth of the first coefficient on the norms do; below, the parts are asked."""
    with upward():
        for tail, error, parts in ((0.5, 0.25, False), (0.75, 0.125, True), (0.8125, 0.0625, True)):
            node = by_hand((1, tail), error)[0]
            plain = 1 - Fraction(tail) - Fraction(error)
            found = Fraction(*node.least().as_integer_ratio())
            # 1 + t tail on [0, 1] is 1 at least
            assert (found > plain + Fraction(1, 2)) if parts else (found == plain)
        with pytest.raises(Unproven, match="comes near zero"):
            by_hand((1, -0.5), 1)[0].least()
