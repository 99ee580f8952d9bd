"""Bounds that are carried from step to step, and the attempts to have one."""

import math
from fractions import Fraction
from types import SimpleNamespace

import mpmath
import numpy as np
import pytest
import sympy
from flint import arb, arb_mat, arb_poly

from discmech.reference.answer import bounded
from discmech.reference.enclosure import propagation, tube
from discmech.reference.failures import Unproven
from discmech.reference.taylor import TaylorSettings, compile_series
from discmech.reference.taylor.balls import BallRates, working
from tests.reference.elementary import X, one_equation


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


@pytest.mark.parametrize("source", (0.0, 1.0))
@pytest.mark.parametrize("steps", (1, 3, 4, 12))
def test_what_is_carried_holds_the_error_and_little_more(steps, source):
    """Through the frames too: an orthogonal one costs a factor of two at most here."""
    found, true = grown(steps, source)
    for f, t in zip(found, true, strict=True):
        assert t * (1 - 1e-9) <= f <= 2.5 * t


def test_a_frame_is_taken_every_third_stretch(monkeypatch):
    calls, right = [], propagation.Carried._new_frame

    def counted(self, weights):
        calls.append(self.age)
        right(self, weights)

    monkeypatch.setattr(propagation.Carried, "_new_frame", counted)
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


def test_the_rest_of_the_exponential_is_its_ninth_term_at_most():
    with working():
        for norm in (0.1, 0.375, 2.0):
            found = float(propagation.cut_off(arb(norm)))
            with mpmath.workdps(40):
                terms = [mpmath.mpf(norm) ** k / math.factorial(k) for k in range(10)]
                rest, bound = mpmath.exp(norm) - mpmath.fsum(terms[:9]), terms[9] * mpmath.exp(norm)
            assert rest <= found == pytest.approx(float(bound), rel=1e-12, abs=0)


def test_a_sign_has_no_slope_where_it_may_change():
    """And 0 elsewhere; that of |x| is the sign."""
    for function, at_two in ((sympy.sign(X), 0), (sympy.Abs(X), 1)):
        with working():
            rates = BallRates(compile_series(one_equation(function)))
            assert rates([arb(2, 0.25)])[1][0, 0] == at_two
            slope = rates([arb(0, 0.25)])[1][0, 0]
        assert not slope.is_finite() or (slope.contains(arb(1)) and slope.contains(arb(-1)))


def attempts(monkeypatch, certain, lost=2.5, held=lambda digits: True, unproven=0.0):
    """(digits, proving) of all runs for 30 digits, and what the last one was, by faked bounds.

    certain: digits had of digits run with; lost, unproven: what the two pilots lose.
    """
    runs = []

    def enclose(equations, program, times, settings, proving):
        runs.append((settings.digits, proving))
        both = {0, 1} if held(settings.digits) else {0}
        return SimpleNamespace(held=both, sweep=len(runs), proving=proving)

    def findings(equations, bounds, found, settings):
        bound = mpmath.mpf(10) ** ((lost if found.proving else unproven) - settings.digits)
        one = SimpleNamespace(certain=certain(settings.digits), bound=bound)
        return {0: SimpleNamespace(certain=99, bound=mpmath.mpf(0)), 1: one}

    for name, fake in (("enclose", enclose), ("_findings", findings), ("BlockBounds", str)):
        monkeypatch.setattr(bounded, name, fake)
    found, sweep, settings = bounded.bounded_integration(None, None, [1], 30)
    assert sweep == len(runs) and settings.digits == runs[-1][0] and set(found) == {0, 1}
    return runs


@pytest.mark.parametrize(("certain", "digits"), [
    (lambda d: d - 4, [34]),  # 30 and the 2.5 that the pilot lost, rounded up, and one
    (lambda d: d - 10, [34, 41]),  # 24 are had: seven more
    (lambda d: d - 5, [34, 36]),  # at least two
    (lambda d: {34: 21}.get(d, 40), [34, 44]),  # ten more than nine that lack
    (lambda d: {34: 24, 41: 26}.get(d, 30), [34, 41, 59]),  # of seven two were gained
    (lambda d: {34: 10, 55: 29}.get(d, 40), [34, 55, 58]),  # 19 of 21
    (lambda d: {34: 24}.get(d, 29), [34, 41, 44]),  # 5 of 7
    (lambda d: {34: 20, 45: 20}.get(d, 40), [34, 45, 56]),  # none
    (lambda d: {34: 20, 45: 18}.get(d, 40), [34, 45, 58]),  # two were lost
    (lambda d: {34: 24, 41: 40}.get(d, 0), [34, 41]),
    (lambda d: 0, [34, 65, 96]),  # three times and no more
])  # fmt: skip
def test_more_digits_are_taken_until_the_bound_is_small_enough(monkeypatch, certain, digits):
    assert attempts(monkeypatch, certain) == [(18, True), *((d, True) for d in digits)]


def test_what_the_tube_does_not_hold_is_tried_with_fifteen_digits_more(monkeypatch):
    runs = attempts(monkeypatch, lambda d: d, held=lambda d: d > 50)
    assert [d for d, _ in runs] == [18, 34, 49, 64]
    kept = attempts(monkeypatch, lambda d: d, held=lambda d: d > 40)
    assert [d for d, _ in kept] == [18, 34, 49]


def test_a_proof_may_cost_thirty_digits_more_than_its_estimate(monkeypatch):
    def runs(lost, unproven):
        return attempts(monkeypatch, lambda d: 99, lost=lost, unproven=unproven)

    assert runs(29.5, 0) == [(18, True), (61, True)]
    assert runs(39.5, 10) == [(18, True), (18, False), (71, True)]
    assert runs(40.5, 10) == [(18, True), (18, False), (41, False)]
    assert runs(149.5, 130) == [(18, True), (18, False), (181, True)]
    with pytest.raises(Unproven, match="it would cost 151 digits"):
        runs(151, 140)
    assert runs(-3, 0) == [(18, True), (31, True)]  # nothing is lost
    assert bounded._lost({0: SimpleNamespace(bound=0)}, TaylorSettings(18)) == 0


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


def test_errors_of_steps_are_carried_in_units_of_their_scale():
    """Two steps of x' = 1, whose errors nothing makes grow: jumps and defects add up."""
    path = arb_poly([1, 1])

    def piece(time):
        return tube._Piece(
            arb(1), [path], [path.derivative()], [arb(0)], [arb(2) ** -50], [arb(2) ** -48],
            [(time, Fraction(1))],
        )  # fmt: skip

    program = compile_series(one_equation(sympy.Integer(1)))
    with working():
        found = tube._carry(program, [piece(1), piece(2)], [arb(2) ** -49], [arb(4)], True)
        told = [(t, float(error) * 2**50, safe) for t, (error,), safe in found]
    # the start's 2, each step's own 1 and its jump of 4, which the next one has carried
    assert told == [(1, pytest.approx(7), True), (2, pytest.approx(12), True)]


@pytest.mark.parametrize("count", [1, 4])
def test_the_boxes_of_a_step_cover_it_without_a_gap(monkeypatch, count):
    path, shares, box = arb_poly([1, 1]), [], tube._Piece.box
    monkeypatch.setattr(tube, "_balanced", lambda *_: ([arb(1)], 0.0))
    monkeypatch.setattr(tube, "_stretches", lambda *_: count)
    monkeypatch.setattr(
        tube._Piece, "box", lambda self, *at: (shares.append(at[:2]), box(self, *at))[1]
    )
    piece = tube._Piece(
        arb(1), [path], [path.derivative()], [arb(0)], [arb(0)], [arb(0)], [(1, Fraction(1))]
    )
    program = compile_series(one_equation(sympy.Integer(1)))
    with working():
        assert list(tube._carry(program, [piece], [arb(0)], [arb(1)], True))
    ends = [(middle - width / 2, middle + width / 2) for middle, width in shares]
    assert [a for a, _ in ends] + [1] == [0] + [b for _, b in ends] and len(ends) == count
