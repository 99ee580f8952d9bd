"""Each ingredient of a proof, where it is nearly attained: the check sees when it is weakened."""

from fractions import Fraction
from types import SimpleNamespace

import gmpy2
import pytest
import sympy
from flint import arb, arb_mat, arb_poly

from discmech.reference.enclosure import enclose, majorants, propagation, remainders, tube
from discmech.reference.enclosure.majorants import Majorant, abs_exact, majorant, upward
from discmech.reference.failures import Unproven
from discmech.reference.taylor import Step, TaylorSettings, compile_series
from discmech.reference.taylor.balls import BallRates, working
from tests.reference.elementary import X, one_equation


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


def test_the_bound_of_an_inverse(monkeypatch):
    assert 0.5 < error_of_inverse() <= 1
    monkeypatch.setattr(
        Majorant, "least", lambda self: abs_exact(self.series[0]) + self.tails[1] + self.error
    )
    assert error_of_inverse() > 2


def test_the_least_value_on_parts(monkeypatch):
    """|1 - t/2 + t^2/2| >= 7/8 on [0, 1], where the norms alone leave 0."""

    def least():
        with upward():
            series = [gmpy2.mpfr(c) for c in (1, -0.5, 0.5)]
            return majorant(series, list(map(abs, series)), gmpy2.mpfr(1)).least()

    assert 0.85 < least() <= 0.875
    monkeypatch.setattr(majorants, "around_zero", lambda size: arb(0))
    assert least() > 0.875


@pytest.mark.parametrize("first", [1, -1])
def test_the_least_value_by_norms_is_of_either_sign(first):
    with upward():
        assert majorant([gmpy2.mpfr(first)], [gmpy2.mpfr(1), gmpy2.mpfr("0.25")]).least() == 0.75


def test_norms_are_rounded_up(monkeypatch):
    def sum_is_above():
        with majorants.upward():
            terms = [gmpy2.mpfr(1), gmpy2.mpfr(2) ** -60]
            return gmpy2.mpq(majorant([], terms).norm) >= sum(map(gmpy2.mpq, terms))

    assert sum_is_above()
    monkeypatch.setattr(majorants, "upward", lambda: gmpy2.context(precision=53))
    assert not sum_is_above()


@pytest.mark.parametrize("first", ["nan", "inf"])
def test_series_that_are_not_finite_prove_nothing(monkeypatch, first):
    with pytest.raises(Unproven, match="not finite"):
        error_of_inverse(first)
    monkeypatch.setattr(remainders, "finite", lambda value: True)
    monkeypatch.setattr(Majorant, "least", lambda self: gmpy2.mpfr(1))
    assert not error_of_inverse(first) > 1


def carried_over(steps=1):
    """A unit error over e' = 3e/2 for a time 1: what must hold exp(3/2)."""
    with working():
        carried = propagation.Carried([arb(1)])
        for _ in range(steps):
            carried.move(arb_mat(1, 1, [arb(3) / (2 * steps)]), [arb(0)], [arb(1)])
        return carried.error()[0, 0].abs_upper()


def test_what_the_exponential_leaves_out(monkeypatch):
    wanted = arb("1.5").exp()
    assert wanted <= carried_over() < 1.001 * wanted
    assert wanted <= carried_over(12) < 1.001 * wanted
    monkeypatch.setattr(propagation, "cut_off", lambda norm: arb(0))
    assert carried_over() < wanted


def jacobian_spreads():
    """d(x^2)/dx over 1 +- 1/4 holds 3/2 and 5/2."""
    with working():
        slope = BallRates(compile_series(one_equation(X**2)))([arb(1, 0.25)])[1][0, 0]
        return slope.contains(arb("1.5")) and slope.contains(arb("2.5"))


def test_jacobians_hold_the_whole_box(monkeypatch):
    assert jacobian_spreads()
    right = BallRates.__call__
    monkeypatch.setattr(BallRates, "__call__", lambda self, box: (0, right(self, box)[1].mid()))
    assert not jacobian_spreads()


def box_holds_the_path():
    """t^2 from 0 to 1 in four parts; and what was cut off, 1/1000."""
    path = arb_poly([0, 0, 1])
    piece = tube._Piece(arb(1), [path], [path.derivative()], [arb("0.001")], [arb(0)], [arb(0)], [])
    with working():
        for i in range(4):
            (box,) = piece.box(Fraction(2 * i + 1, 8), Fraction(1, 4), [arb(0)])
            for t in (arb(i) / 4, arb(i + 1) / 4):
                if not all(box.contains(t**2 + cut) for cut in (arb("0.0009"), arb("-0.0009"))):
                    return False
    return True


def test_the_tube_holds_the_path(monkeypatch):
    assert box_holds_the_path()
    right = tube.around_zero
    for weak in (lambda size: arb(0), lambda size: right(size) / 2):
        monkeypatch.setattr(tube, "around_zero", weak)
        assert not box_holds_the_path()


def test_constants_are_as_near_as_the_bounds_take_them_to_be():
    program, settings = compile_series(one_equation(sympy.sqrt(2) * X)), TaylorSettings(18)
    with working(settings.precision + 32):
        tube._check_constants(program, settings)

    def off(digits):
        return [c * (1 + gmpy2.mpfr(4) / 2**settings.precision)
                for c in program.constants_at(digits)]  # fmt: skip

    wrong = SimpleNamespace(constants=program.constants, constants_at=off)
    with pytest.raises(Unproven, match="known well enough"), working(settings.precision + 32):
        tube._check_constants(wrong, settings)


def test_a_bound_wider_than_the_tube_is_no_proof(monkeypatch):
    """Six digits leave the tube of 1e-9; over a tube of any width they would be proven."""
    equations, t = one_equation(X**2), Fraction(1, 4)
    program, settings = compile_series(equations), TaylorSettings(6)
    assert enclose(equations, program, [t], settings).held == {0}
    monkeypatch.setattr(tube, "ROOM", 1e-3)
    assert enclose(equations, program, [t], settings).held == {0, t}
