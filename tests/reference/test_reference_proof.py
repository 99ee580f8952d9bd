"""Each ingredient of a proof where it is used and nearly attained; a bound never says too little.

`test_reference_weakened` weakens each of them in turn and sees one of these tests fail.
"""

import math
from contextlib import nullcontext
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import product
from types import SimpleNamespace
from unittest.mock import Mock, patch

import gmpy2
import mpmath
import numpy as np
import pytest
import sympy
from flint import arb, arb_mat, arb_poly, ctx, fmpq
from mpmath import mpf

from discmech.integrators import scenes
from discmech.reference.answer import bounded, certify, states
from discmech.reference.closed_forms import registry
from discmech.reference.enclosure import enclose, majorants, propagation, remainders, tube
from discmech.reference.enclosure.majorants import majorant, upward
from discmech.reference.failures import MotionEnds, Unproven
from discmech.reference.taylor import SeriesProgram, Step, TaylorSettings, compile_series, integrate
from discmech.reference.taylor.balls import (
    BallRates,
    around_zero,
    enclosed,
    exact,
    largest,
    rounded,
    upper,
    working,
)
from tests.reference.elementary import FUNCTIONS, X, Y, one_equation, system


def fraction(number):
    """An arb number without a radius, exactly."""
    mantissa, exponent = map(int, number.man_exp())
    return Fraction(mantissa) * Fraction(2) ** exponent


def test_numbers_enter_exactly():
    """mpf, mpfr and arb numbers are the same binary fraction, sign and all."""
    for number in ("0", "-1.5", "2.5e-40", "-3e200"):
        wanted = Fraction(*map(int, gmpy2.mpfr(number).as_integer_ratio()))
        for value in (mpmath.mpf(number), gmpy2.mpfr(number)):
            assert exact(value).is_exact() and fraction(exact(value)) == wanted
    for nothing in (mpmath.inf, mpmath.nan, gmpy2.mpfr("-inf"), gmpy2.mpfr("nan")):
        assert not exact(nothing).is_finite()


CONSTANTS = ("sqrt(2)", "-pi**2/3", "exp(1/3)", "2**Rational(1, 3)", "E + EulerGamma",
             "log(3)*sin(1)", "gamma(Rational(1, 3))", "1/sqrt(7)", "2/3")  # fmt: skip


def test_constants_are_enclosed():
    for number in map(sympy.sympify, CONSTANTS):
        with working(120):
            found = enclosed(number)
        with working(400):
            assert found.contains(arb(f"{number.evalf(60)} +/- 1e-55")) and found.rad() < 1e-30
    for unknown in (sympy.Function("mid")(1), sympy.besselj(0, 1), sympy.I):
        with pytest.raises(Unproven, match="cannot be enclosed"):
            enclosed(unknown)
    third = sympy.Rational(1, 3)
    (power,) = BallRates(compile_series(one_equation(X**third))).operations
    ((_, factor),) = BallRates(compile_series(one_equation(third * X))).rates[0]
    assert power[2].contains(fmpq(1, 3)) and factor.contains(fmpq(1, 3))


def test_the_ends_of_balls_are_rounded_outwards():
    ball = arb(-1, 0.5)
    assert 1.5 <= upper(ball) < 1.5001 and 1.5 <= largest([arb(1), ball]) < 1.5001
    assert not largest([arb("nan"), ball]).is_finite() and upper(arb("nan")) == mpmath.inf
    assert around_zero(arb(2, 1)).contains(arb(0, 3))
    third = Fraction(2**70, 3)
    with upward():
        assert Fraction(*rounded(arb(int(third) + 1)).as_integer_ratio()) >= third
    digits = {"9.99e-31": 30, "1.01e-30": 29, "0.5": 0, "2": 0}
    assert {e: bounded.whole_digits(arb(e)) for e in digits} == digits


def test_derivatives_over_boxes_hold_those_at_points():
    """Of each operation, at both ends of the box too."""
    for rate in FUNCTIONS:
        contains_derivatives(one_equation(rate), np.array([0.75]))
    contains_derivatives(system(X / (2 + Y), X - Y**2), np.array([0.75, 0.5]), 0.2)
    with working():
        for function, at_two in ((sympy.sign(X), 0), (sympy.Abs(X), 1)):
            rates = BallRates(compile_series(one_equation(function)))
            assert rates([arb(2, 0.25)])[1][0, 0] == at_two
            slope = rates([arb(0, 0.25)])[1][0, 0]  # of a kink there is none
            assert not slope.is_finite() or (slope.contains(1) and slope.contains(-1))


def contains_derivatives(equations, centre, size=0.01):
    """Exact derivatives are those along imaginary steps, where nothing is lost by cancellation."""
    functions = [{"Abs": lambda z: z * np.sign(z.real)}, "numpy"]  # |z| is not analytic
    rates = sympy.lambdify(
        equations.states, equations.rates, functions, cse=lambda e: (equations.assignments, e)
    )
    n, radius = len(centre), size * (1 + abs(centre))
    random = np.random.default_rng(7)
    corners = list(product((-1, 1), repeat=n)) if n < 3 else []
    points = centre + radius * np.array([*random.uniform(-1, 1, (20, n)), *corners])
    along = points[:, None] + 1e-30j * np.eye(n)  # point, direction, coordinate
    values = np.array([rate + 0 * along[..., 0] for rate in rates(*np.moveaxis(along, -1, 0))])
    derivatives = np.moveaxis(values.imag / 1e-30, 0, 1)
    with working():
        box = [arb(z, r) for z, r in zip(centre, radius, strict=True)]
        value, over = BallRates(compile_series(equations))(box)
        for ball, entries in zip(value, values.real, strict=True):
            assert all(ball.overlaps(arb(float(e), 1e-14 * (1 + abs(e)))) for e in entries.ravel())
        for jacobian in derivatives:
            for at, ball in zip(jacobian.ravel(), over.entries(), strict=True):
                assert ball.overlaps(arb(float(at), 1e-14 * (1 + abs(float(at)))))
        most = max(float(e.mid().abs_upper()) for e in over.entries())
        assert all(e.rad() < 1 + 2 * most for e in over.entries())


def by_hand(terms, error, size=1):
    """A majorant and its terms as fractions; all exact in 53 bits."""
    made = majorant([gmpy2.mpfr(t) for t in terms], [gmpy2.mpfr(abs(t)) for t in terms], size)
    return replace(made, error=gmpy2.mpfr(error)), [Fraction(t) for t in terms], Fraction(error)


def test_norms_are_rounded_up():
    with majorants.upward():
        terms = [gmpy2.mpfr(1), gmpy2.mpfr(2) ** -60]
        assert gmpy2.mpq(majorant([], terms).norm) >= sum(map(gmpy2.mpq, terms))


def test_the_least_value_of_a_node():
    """By norms, of either sign; from an eighth of the first coefficient down by parts."""
    with upward():
        for first in (1, -1):
            found = majorant([gmpy2.mpfr(first)], [gmpy2.mpfr(1), gmpy2.mpfr("0.25")]).least()
            assert found == 0.75
        for tail, error, parts in ((0.5, 0.25, False), (0.75, 0.125, True), (0.8125, 0.0625, True)):
            found = Fraction(*by_hand((1, tail), error)[0].least().as_integer_ratio())
            plain, most = 1 - Fraction(tail) - Fraction(error), 1 - Fraction(error)
            # 1 + t tail on [0, 1] is 1 at least
            assert plain + Fraction(1, 2) < found <= most if parts else found == plain
        # |1 - t/2 + t^2/2| >= 7/8 on [0, 1], where the norms alone leave 0
        series = [gmpy2.mpfr(c) for c in (1, -0.5, 0.5)]
        assert 0.85 < majorant(series, list(map(abs, series)), gmpy2.mpfr(1)).least() <= 0.875
        for terms, error in (((1, -0.5), 1), ((0, 1, 0), 0)):
            with pytest.raises(Unproven, match="comes near zero"):
                by_hand(terms, error)[0].least()


def by_hand_remainders(*known):
    """The errors in a step of order 2 with these nodes, u = 2^-20."""
    found = object.__new__(remainders.Remainders)
    found.order, found.unit, found.known = 2, gmpy2.mpfr(2) ** -20, list(known)
    return found, Fraction(1, 2**20)


def residual(a, b):
    """What a product leaves out, sum over i + j >= N of |a_i||b_j|, and is rounded by."""
    cut_off = sum(x * y for i, x in enumerate(a) for j, y in enumerate(b) if i + j >= 2)
    return Fraction(8, 2**20) * sum(a) * sum(b) + cut_off


def times_h_derivative(a):
    return [k * x for k, x in enumerate(a)]


def assert_above(found, wanted):
    """It is rounded up, and `wanted` to double precision."""
    assert float(wanted) * (1 - 1e-14) <= float(found) <= float(wanted) * (1 + 1e-14)


def test_bounds_of_arithmetic_are_those_of_their_derivation():
    """n b = a up to the residual, and what the errors of the arguments add, in fractions."""
    with upward():
        r, u = by_hand_remainders()
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


def test_bounds_of_functions_are_those_of_their_derivation():
    with upward():
        r, u = by_hand_remainders()
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


def test_the_bound_of_a_linear_form():
    """Constants are rounded, nodes are cut off too; each further addition is one more rounding."""
    with upward():
        (a, A, e), (b, B, f) = by_hand((2, 0.5, 0.25), 0.125), by_hand((4, 0.25, 0.5), 0.0625)
        r, u = by_hand_remainders(a, b)
        x, y, c = sympy.Rational(-3, 4), sympy.Integer(2), sympy.Rational(5, 8)
        one = Fraction(3, 4) * (e + 9 * u * sum(A) + A[2])
        assert_above(r.form({0: x}), one)
        both = Fraction(3, 4) * (e + 11 * u * sum(A) + A[2]) + 2 * (f + 11 * u * sum(B) + B[2])
        assert_above(r.form({0: x, 1: y, None: c}), both + 11 * u * Fraction(5, 8))
        r.known = [a] * 9
        each = e + 17 * u * sum(A) + A[2]
        assert_above(r.form(dict.fromkeys(range(9), sympy.Integer(1))), 9 * each)
        root = sympy.sqrt(1 + sympy.Rational(1, 2**80))  # which 64 bits do not tell from 1
        assert remainders.size_of(-root) > 1


def test_functions_and_their_mates_stand_side_by_side():
    """sin before cos on the tape, sinh before cosh; each has the other's size in its bound."""
    with upward():
        a, s, c = (by_hand((size, 0.25, 0), 0.125)[0] for size in (1, 2, 4))
        for first, second in (("sin", "cos"), ("sinh", "cosh")):
            r, _ = by_hand_remainders(a, s, c)
            found = r._error((first, 0), 1), r._error((second, 0), 2)
            assert found[0] == found[1] == getattr(r, f"_{first}")(s, a, c)
        with pytest.raises(Unproven, match="no remainder of whatever"):
            r._error(("unknown", "whatever"), 1)


def error_of_inverse(first=1):
    """The true error of the polynomial of 1/(1 - 9t/10) at t = 1, over its bound."""
    order, program = 8, compile_series(one_equation(1 / X))
    with gmpy2.context(gmpy2.get_context(), precision=100):
        slope = gmpy2.mpfr(9) / 10
        nodes = [[gmpy2.mpfr(first), -slope], [slope**k for k in range(order)]]
        wrong = 1 / (nodes[0][0] + nodes[0][1]) - sum(nodes[1])
    with upward():
        found = remainders.Remainders(program, Step(nodes, gmpy2.mpfr(1), []), order, 100)
    return abs(wrong) / found.known[1].error


def test_the_bound_of_an_inverse_is_attained_within_a_factor_of_two():
    assert 0.5 < error_of_inverse() <= 1


def test_series_that_are_not_finite_prove_nothing():
    for first in ("nan", "inf"):
        with pytest.raises(Unproven, match="not finite"):
            error_of_inverse(first)
    program = compile_series(one_equation(X**2))
    nodes = [[gmpy2.mpfr(1)], [gmpy2.mpfr("inf")]]
    with upward(), pytest.raises(Unproven, match="not finite"):
        remainders.Remainders(program, Step(nodes, gmpy2.mpfr(1), []), 2, 100)


def test_what_is_kept_of_a_step_bounds_it():
    """Defect, jump and what is cut off, against fractions: rounded up, and hardly larger."""
    program = compile_series(one_equation(X**2 / 3))
    settings = SimpleNamespace(order=3, precision=100, digits=0)
    with gmpy2.context(gmpy2.get_context(), precision=100):
        z = [gmpy2.mpfr(1) / k for k in (3, 7, 9, 11)]
        square = [gmpy2.mpfr(2) / k for k in (19, 23, 29)]
        size = -gmpy2.mpfr(1) / 3
        half = gmpy2.mpq(size) / 2
    witness = tube._Witness(program, settings)
    with gmpy2.context(precision=20):  # the arithmetic of bounds is not that of who integrates
        assert witness.allowed([z, square], size) == size
        witness(Step([z, square], size, [(Fraction(-1, 7), half)]))
    (piece,) = witness.pieces
    H, u = abs(Fraction(*size.as_integer_ratio())), Fraction(1, 2**99)
    a, b = ([abs(Fraction(*c.as_integer_ratio())) * H**k for k, c in enumerate(series)]
            for series in (z, square))  # fmt: skip
    left_out = sum(x * y for i, x in enumerate(a) for j, y in enumerate(a) if i + j >= 3)
    defect = H / 3 * (8 * u * sum(a) ** 2 + left_out + 9 * u * sum(b))
    jump = (sum(a) + sum(times_h_derivative(a))) * (2 * 3 + 8) * u
    for (found,), wanted in ((piece.defect, defect), (piece.jump, jump), (piece.tails, a[3])):
        assert 1 <= fraction(found) / wanted < 1 + Fraction(1, 2**46)
    assert [fraction(c) for c in piece.paths[0]] == [Fraction(*c.as_integer_ratio()) for c in z[:3]]
    assert fraction(piece.size) == -H and piece.times == [(Fraction(-1, 7), Fraction(1, 2))]


def piece(*paths, size=1, defect=0, jump=0, tail=0, times=((1, Fraction(1)),)):
    """A step along these paths, lists of coefficients."""
    n, paths = len(paths), [arb_poly(path) for path in paths]
    same = ([arb(e)] * n for e in (tail, defect, jump))
    slopes = [path.derivative() for path in paths]
    return tube._Piece(arb(size), paths, slopes, *same, list(times))


def test_the_tube_holds_the_path_and_the_room_around_it():
    """t^2 from 0 to 1 in four parts; with what was cut off, and an error, 1/1000 each."""
    with working():
        step = piece([0, 0, 1], tail=arb("0.001"))
        for i in range(4):
            (box,) = step.box(Fraction(2 * i + 1, 8), Fraction(1, 4), [arb("0.001")])
            for t in (arb(i) / 4, arb(i + 1) / 4):
                assert all(box.contains(t**2 + e) for e in (arb("0.0019"), arb("-0.0019")))
        (box,) = piece([0, 1], tail=arb("0.001")).box(Fraction(1, 2), Fraction(1), [arb("0.001")])
        assert box.contains(arb("-0.0019")) and box.contains(arb("1.0019"))


def test_the_boxes_of_a_step_cover_it_without_a_gap():
    shares, box = [], tube._Piece.box

    def seen(self, *at):
        shares.append(at[:2])
        return box(self, *at)

    program = compile_series(one_equation(sympy.Integer(1)))
    for count in (1, 4):
        shares.clear()
        with (working(), patch.object(tube, "_balanced", lambda *_: ([arb(1)], 0.0)),
              patch.object(tube, "_stretches", Mock(return_value=count)),
              patch.object(tube._Piece, "box", seen)):  # fmt: skip
            assert list(tube._carry(program, [piece([1, 1])], [arb(0)], [arb(1)], True))
        ends = [(middle - width / 2, middle + width / 2) for middle, width in shares]
        assert [a for a, _ in ends] + [1] == [0] + [b for _, b in ends] and len(ends) == count


ROOM = Fraction(tube.ROOM)


def carried(rates, pieces, start, scale=1, proving=True):
    """{time: (bounds of the errors over `start`, whether they are proven)} along these steps."""
    with working():
        n = len(rates)
        first = [arb(0)] * (n - 1) + [enclosed(sympy.Rational(start)).abs_upper()]
        program = compile_series(system(*rates))
        told = tube._carry(program, pieces, first, [arb(scale)] * n, proving)
        unit = first[-1] if start else arb(1)
        return {t: ([float(e / unit) for e in errors], safe) for t, errors, safe in told}


def test_the_jacobian_is_taken_over_all_of_the_tube():
    """e' = e^2/ROOM: on the path it is 0, within the tube 2e/ROOM, and the error does grow."""
    start = ROOM / 16
    ((bound,), safe) = carried([X**2 / ROOM], [piece([0])], start)[1]
    assert safe and 1 / (1 - 1 / 16) <= bound < math.exp(2.1)


def test_the_jacobian_is_taken_over_all_of_a_stretch():
    """e' = t^2 e, exp(1/3) in all: its values in the middle of each stretch leave less."""
    ((_, bound), _) = carried([sympy.S.One, X**2 * Y], [piece([0, 1], [0])], ROOM / 10**6)[1]
    assert math.exp(1 / 3) <= bound < 2 * math.exp(1 / 3)


def test_an_error_grows_by_its_equation():
    """e' = 2e: over one step, over two, and backwards."""
    for sign in (1, -1):
        for steps in (1, 2):
            one = piece([0], size=Fraction(sign, steps).numerator / steps)
            ((bound,), _) = carried([2 * sign * X], [one] * steps, ROOM / 10**6)[1]
            assert math.exp(2) <= bound < 1.2 * math.exp(2)


def test_a_time_within_a_stretch_has_the_largest_error_of_the_stretch():
    """e' = -e: at its beginning an error is larger than at its end."""
    share = Fraction(1, 64)
    ((bound,), _) = carried([-X], [piece([0], times=[(1, share)])], ROOM / 10**6)[1]
    assert math.exp(-share) <= bound < 1.3


def test_a_defect_is_carried_over_each_stretch():
    """e' = 2e + d, with |d| <= 1 (in units of ROOM/10^6)."""
    size = float(ROOM) / 10**6
    ((bound,), _) = carried([2 * X], [piece([0], defect=size)], Fraction(0))[1]
    assert (math.exp(2) - 1) / 2 * size <= bound < 1.5 * (math.exp(2) - 1) / 2 * size


def test_errors_of_steps_are_carried_in_units_of_their_scale():
    """Two steps of x' = 1, whose errors nothing makes grow: jumps and defects add up."""
    size = 2.0**-50
    steps = [piece([1, 1], defect=size, jump=4 * size, times=[(t, Fraction(1))]) for t in (1, 2)]
    found = carried([sympy.Integer(1)], steps, Fraction(2, 2**50), scale=4)
    # the start's 2, each step's own 1 and its jump of 4, which the next one has carried
    assert found == {1: ([pytest.approx(3.5)], True), 2: ([pytest.approx(6)], True)}


def test_what_leaves_the_tube_is_not_proven_even_where_it_has_come_back():
    """e' = 16 (1 - 2t) e grows to exp(4) at t = 1/2 and is what it was at t = 1."""
    still = [sympy.Integer(1)]
    for start, safe in ((ROOM * Fraction(99, 100), True), (ROOM * Fraction(101, 100), False)):
        assert carried(still, [piece([0, 1])], start)[1][1] == safe
    assert not carried(still, [piece([0, 1])], ROOM / 2, proving=False)[1][1]
    back = [sympy.S.One, 16 * (1 - 2 * X) * Y]
    ((_, bound), safe) = carried(back, [piece([0, 1], [0])], ROOM / 20)[1]
    assert bound < 20 and not safe


def grown(steps, source=0.0, skew=1.0):
    """The errors in e' = M e + d, M a rotation that grows: what was carried, and what is true.

    True for a unit error at the start in each direction, and d of either sign all the time.
    """
    M, tau = mpmath.matrix([[0.5, -skew], [skew, 0.5]]), mpmath.mpf(1) / 4
    with working():
        carried = propagation.Carried([arb(1), arb(1)])
        jacobian = arb_mat(2, 2, [arb(0.5) / 4, arb(-skew) / 4, arb(skew) / 4, arb(0.5) / 4])
        for _ in range(steps):
            along = carried.move(jacobian, [arb(source) / 4] * 2, [arb(1)] * 2)
        found = [float(e.abs_upper()) for e in carried.error().entries()]
        all_along = [float(e.abs_upper()) for e in along.entries()]
        assert all(a >= f * (1 - 1e-12) for a, f in zip(all_along, found, strict=True))
    once, true = mpmath.expm(M * tau), [0.0, 0.0]
    for k in range(steps):
        over = mpmath.expm(M * tau * (k + 1))
        part = (over - mpmath.expm(M * tau * k)) * M**-1 if source else 0 * once
        for i in range(2):
            true[i] += source * float(abs(part[i, 0]) + abs(part[i, 1]))
            true[i] += float(abs(over[i, 0]) + abs(over[i, 1])) if k == steps - 1 else 0
    return found, true


def test_what_is_carried_holds_the_error_and_little_more():
    """Through the frames too: an orthogonal one costs a factor of two at most here."""
    for steps in (1, 3, 4, 12):
        for source in (0.0, 1.0):
            for found, true in zip(*grown(steps, source), strict=True):
                assert true * (1 - 1e-9) <= found <= 2.5 * true


def test_what_the_exponential_leaves_out():
    """A unit error over e' = 3e/2 for a time 1, and over e_i' = 3/4 (e_1 + e_2), the same."""
    wanted = arb("1.5").exp()
    for size, steps in ((1, 1), (1, 12), (2, 1)):
        with working():
            one = propagation.Carried([arb(1)] * size)
            for _ in range(steps):
                entries = [arb(3) / (2 * size * steps)] * size**2
                along = one.move(arb_mat(size, size, entries), [arb(0)] * size, [arb(1)] * size)
            for error in (one.error()[0, 0].abs_upper(), along[0, 0].abs_upper()):
                assert wanted <= error < 1.001 * wanted


def test_a_frame_is_taken_every_third_stretch():
    calls, right = [], propagation.Carried._new_frame

    def counted(self, weights):
        calls.append(self.age)
        right(self, weights)

    with patch.object(propagation.Carried, "_new_frame", counted):
        grown(10)
    assert calls == [3, 3, 3]


@pytest.mark.parametrize("unit", [2.0**-20, 2.0**20])
def test_what_is_carried_is_hardly_more_in_other_units(unit):
    """An oscillator whose velocity is told in them, whose errors only turn."""

    def carried(unit):
        sizes, units = [[0, 0.3 / unit], [0.3 * unit, 0]], [arb(1), arb(unit)]
        jacobian = arb_mat(2, 2, [0, arb(0.3 / unit), arb(-0.3 * unit), 0])
        weights, norm = propagation.balance(np.array(sizes))
        assert norm == pytest.approx(0.6)
        assert float(propagation.row_norm(jacobian, weights)) <= norm * (1 + 1e-6)
        found = propagation.Carried(units)
        for _ in range(200):
            found.move(jacobian, [arb(0)] * 2, weights)
        return [float(e.abs_upper() / one) for e, one in zip(found.error(), units, strict=True)]

    with working():
        assert max(carried(unit)) <= 2 * max(carried(1.0)) < 3


@pytest.mark.parametrize("sizes", [
    np.zeros((3, 3)), [[0, 1e9, 3], [0, 0, 1e9], [0, 0, 0]], [[2, 1e-9], [1e12, 1]],
    [[5, 0, 0], [1e5, 5, 0], [0, 1, 5]], np.full((18, 18), 40),
], ids=["none", "nilpotent", "unlike", "triangular", "dense"])  # fmt: skip
def test_weights_are_positive_and_leave_twice_the_spectral_radius(sizes):
    """Or as much as one stretch takes; however the sizes are coupled."""
    sizes = np.array(sizes, dtype=float)
    least = max(abs(np.linalg.eigvals(sizes)))
    with working():
        weights, norm = propagation.balance(sizes)
        assert all(d >= 1 for d in weights)
        assert norm == pytest.approx(max(2 * least, propagation.STRETCH), rel=1e-12)
        matrix = arb_mat(*sizes.shape, sizes.ravel().tolist())
        assert float(propagation.row_norm(matrix, weights)) <= norm * (1 + 1e-6)
        weights, norm = propagation.balance(sizes + math.inf)
    assert norm == math.inf and set(map(float, weights)) == {1}


def test_what_is_carried_beyond_all_numbers_bounds_nothing():
    with working():
        carried = propagation.Carried([arb(1), arb(1)])
        for _ in range(5):
            carried.move(arb_mat(2, 2, [arb("nan")] * 4), [arb(0)] * 2, [arb(1)] * 2)
        assert not any(e.is_finite() for e in carried.error().entries())


def test_the_precision_of_others_is_left_alone():
    before = ctx.prec
    enclose(one_equation(X), compile_series(one_equation(X)), [Fraction(1)], TaylorSettings(20))
    assert ctx.prec == before


def test_the_rounding_of_the_start_is_an_error():
    equations = system(sympy.S.Zero, start=(sympy.sqrt(2),))
    found = enclose(equations, compile_series(equations), [Fraction(1)], TaylorSettings(20))
    with working(400):
        off = abs(exact(found.sweep.states[Fraction(0)][0]) - arb(2).sqrt())
        assert off > 0 and all(off <= bound for (bound,) in found.bounds.values())
        assert found.bounds[Fraction(0)][0] < 1.01 * off


@dataclass(frozen=True)
class Rough(SeriesProgram):
    """Its constants are off by some units."""

    def constants_at(self, digits):
        return [c * (1 + gmpy2.mpfr(4) / 2 ** TaylorSettings(18).precision)
                for c in super().constants_at(digits)]  # fmt: skip


def test_constants_are_as_near_as_the_bounds_take_them_to_be():
    equations, times = one_equation(sympy.sqrt(2) * X), [Fraction(1, 9)]
    program = compile_series(equations)
    assert enclose(equations, program, times, TaylorSettings(18)).held == {0, *times}
    with pytest.raises(Unproven, match="known well enough"):
        enclose(equations, Rough(**vars(program)), times, TaylorSettings(18))


def test_a_bound_wider_than_the_tube_is_no_proof():
    """Six digits leave the tube of 1e-9; over a tube of any width they would be proven."""
    equations, t = one_equation(X**2), Fraction(1, 4)
    program = compile_series(equations)
    assert enclose(equations, program, [t], TaylorSettings(6)).held == {0}
    assert enclose(equations, program, [t], TaylorSettings(18)).held == {0, t}
    assert enclose(equations, program, [t], TaylorSettings(18), proving=False).held == {0}
    with patch.object(tube, "ROOM", 1e-3):
        assert enclose(equations, program, [t], TaylorSettings(6)).held == {0, t}


def test_where_a_bound_is_lost_there_is_none():
    equations, times = one_equation(X), [Fraction(1, 4), Fraction(-1, 4)]
    nothing = SimpleNamespace(entries=lambda: [arb("nan")])
    with patch.object(propagation.Carried, "move", lambda *_: nothing):
        found = enclose(equations, compile_series(equations), times, TaylorSettings(18))
    assert found.held == {0} and not any(found.bounds[t][0].is_finite() for t in times)


def test_a_path_near_a_pole_of_a_step_is_no_proof():
    """A step over which a denominator may vanish is refused, not bounded."""
    program = compile_series(one_equation(1 / X))
    with gmpy2.context(gmpy2.get_context(), precision=100):
        state, size = [gmpy2.mpfr(1)], gmpy2.mpfr(-3) / 4  # x^2 = 1 + 2t is zero at t = -1/2
        nodes = program.nodes(20, state, [])
    with upward(), pytest.raises(Unproven, match="near zero"):
        remainders.Remainders(program, Step(nodes, size, []), 20, 100)


def test_rows_of_constraints_are_independent_all_along_a_step():
    """One row, x - 2/5 on the way of x' = 1 from 0: it vanishes between the looks."""
    for rows, ends in ((X - sympy.Rational(2, 5), True), (X + sympy.Rational(2, 5), False)):
        equations = system(sympy.S.One, start=(0,), constraints=(rows,), dim_x=0, dim_u=1)
        program = compile_series(equations)
        if ends:
            with pytest.raises(MotionEnds, match=r"dependent at t = 0\.(4\b|399)"):
                integrate(equations, program, [Fraction(1)], TaylorSettings(20))
        else:
            assert integrate(equations, program, [Fraction(1)], TaylorSettings(20)).states


def test_the_error_of_a_momentum_is_that_of_all_states_in_the_box():
    """mu = x^3 v at (2, 1): with errors of 1/8 and 1/4 it is off by 9.5 or less."""
    equations = system(X, Y, start=(2, 1), dim_x=1, dim_u=1, momentum=(X**3 * Y,))
    numbers = {"x": [mpmath.mpf(2)], "v": [mpmath.mpf(1)], "mu": [mpmath.mpf(8)]}
    with working():
        found = states.BlockBounds(equations).of([arb(0.125), arb(0.25)], numbers)
        assert [float(found[k]) for k in ("x", "v")] == [0.125, 0.25]
        assert 2.125**3 * 1.25 - 8 <= float(found["mu"]) < 4.5


def test_a_bound_is_relative_to_the_largest_component_here_or_at_the_start():
    with working():

        def worst(bounds, here, start):
            return bounded._relative(bounds, here, start)

        x = [mpmath.mpf(-4), mpmath.mpf(1)]
        assert worst({"x": arb(2)}, {"x": x}, {"x": [mpmath.mpf(1)]}) == arb("0.5")
        assert worst({"x": arb(2)}, {"x": x}, {"x": [mpmath.mpf(8)]}) == arb("0.25")
        assert worst({"x": arb(2)}, {"x": x}, {}) == arb("0.5")
        assert worst({"x": arb(2)}, {"x": [mpmath.mpf(0)]}, {}) == 2
        both = {"x": x, "mu": [mpmath.mpf(1)]}
        assert worst({"x": arb(2), "mu": arb("0.75")}, both, {}) == arb("0.75")


def test_an_answer_is_called_enclosed_where_the_tube_held_it():
    equations, t = system(X**2, momentum=(X,)), Fraction(1, 4)
    program, settings = compile_series(equations), TaylorSettings(6)
    bounds = states.BlockBounds(equations)
    found = enclose(equations, program, [t], settings)
    told = bounded._findings(equations, bounds, found, settings)
    assert [told[k].certainty for k in (0, t)] == ["enclosure", "defect bound"]
    assert told[t].bound > 0 and 10 ** -(told[t].certain + 1) < told[t].bound
    assert told[t].bound <= 10 ** -told[t].certain


T = Fraction(3)


def answered(patched="", by=None, **more):
    """The answer for the oscillator at t = 3 to 30 digits, with something in its place."""
    scene = scenes.get("harmonic")
    with patch.object(certify, patched, by) if patched else nullcontext():
        return certify.certified_integration(scene, [T], 30, False, **more)[T]


def told_late(method):
    """Its results at times that are 1e-20 too late, relatively."""

    def late(equations, times, *given, **more):
        exactly = {t * (1 + Fraction(1, 10**20)): t for t in times}
        found = method(equations, [*exactly], *given, **more)
        return replace(found, states={exactly[t]: z for t, z in found.states.items()})

    return late


def test_what_disagrees_takes_a_proof_away():
    """A closed form, the second method, or a quantity that the motion keeps."""
    form = registry()["harmonic"]
    late = replace(form, motion=lambda p, x, v, t: form.motion(p, x, v, t * (1 + mpf("1e-20"))))
    sound = answered(), answered(form=form), answered(proof=False)
    assert [found.certain_digits for found in sound] == [30] * 3
    assert [found.certainty for found in sound] == ["enclosure", "enclosure", "agreement"]
    kept = SimpleNamespace(digits=lambda *_: (19, "energy kept to 19 digits"))
    lost = (*certify.derived(scenes.get("harmonic"), False)[:2], kept)
    for found in (
        answered(form=late), answered("extrapolate", told_late(certify.extrapolate)),
        answered("derived", lambda *_: lost),
    ):  # fmt: skip
        assert 18 <= found.certain_digits <= 20, found.evidence
    assert found.certainty == "enclosure"  # a quantity may lose digits by itself
    for found in (answered(form=late), answered("extrapolate", told_late(certify.extrapolate))):
        assert found.certainty == "agreement" and found.bound is None


def test_two_settings_are_as_certain_as_they_agree():
    with patch.object(certify, "CHEAP", 0):  # with no second method beside them
        found = answered("agreement", lambda *_: 17, proof=False)
    assert found.certain_digits == 17 and "agree to 17 digits" in found.evidence
