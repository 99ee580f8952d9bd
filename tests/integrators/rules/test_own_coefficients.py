"""Compositions and splittings with coefficients of one's own: order, digits, refusals."""

from fractions import Fraction

import mpmath
import numpy as np
import pytest
import sympy

from discmech import BadInput, Scheme, midpoint, rectangle, scenes, trapezoidal
from discmech.integrators.rules import METHODS, compose, gauss, splitting
from discmech.integrators.rules.order_conditions import conditions

CUBE = 1 / (2 - 2 ** (1 / 3))
EXACT = 1 / (2 - sympy.cbrt(2))
RUTH = [Fraction(7, 24), Fraction(2, 3), Fraction(3, 4), Fraction(-2, 3), Fraction(-1, 24), 1]


@pytest.mark.parametrize("name", METHODS)
def test_a_published_method_in_floats_is_the_method(name):
    """Its order is found, and its numbers are those of the table, to 60 digits in between."""
    method = METHODS[name]
    floats = [float(e) for e in method.coefficients(30)]
    rule = compose(rectangle, floats[1::2], adjoint=floats[::2]) if method.in_turn else (
        compose(trapezoidal, floats))  # fmt: skip
    assert rule.order == method.order and rule.method.symmetric
    with mpmath.workdps(70):
        pairs = zip(rule.method.coefficients(60), method.coefficients(60), strict=True)
        assert max(abs(a - b) for a, b in pairs) < 1e-15
        assert abs(sum(rule.method.coefficients(60)) - 1) < mpmath.mpf(10) ** -60
    assert METHODS[name].defect(60) < 1e-50  # the same palindrome is judged as before


def test_exact_numbers_stay_as_they_are():
    rule = compose(midpoint, [EXACT, 1 - 2 * EXACT, EXACT], order=4)
    with mpmath.workdps(70):
        first = 1 / (2 - mpmath.cbrt(2))
        assert abs(rule.method.coefficients(65)[0] - first) < mpmath.mpf(10) ** -65
    rule = compose(midpoint, ["0.25", Fraction(1, 2), 1 - Fraction(3, 4)])
    assert rule.method.coefficients(30)[0] == 0.25


@pytest.mark.dear("6]", "4]")
@pytest.mark.parametrize(
    ("rule", "order"),
    [
        (compose(midpoint, [1]), 2),
        (compose(midpoint, [0.3, 0.3, 0.4]), 2),
        (compose(gauss(2), [1 / (2 - 2**0.2), 1 - 2 / (2 - 2**0.2), 1 / (2 - 2**0.2)]), 6),
        (compose(gauss(2), [CUBE, 1 - 2 * CUBE, CUBE]), 4),
        (splitting([1, 1]), 1),
        (splitting(["1/2", 1, "1/2"]), 2),
        (splitting([1, Fraction(1, 2), 0, Fraction(1, 2)], first="potential"), 1),
        (splitting(RUTH), 3),
    ],
    ids=lambda e: getattr(e, "name", e),
)
def test_the_order_is_that_of_runs(rule, order):
    """From both sides, on a motion that no symmetry helps."""
    assert rule.order == order
    of = Scheme(scenes.get("henon-heiles"), rule)
    assert of.order == order and of.self_adjoint == rule.method.symmetric
    ends = [of.flow(Fraction(1, n), 40).trajectory(n, n) for n in (40, 80, 1280)]
    gaps = [max(abs(e.x[-1] - ends[-1].x[-1]).max(), abs(e.mu[-1] - ends[-1].mu[-1]).max())
            for e in ends[:2]]  # fmt: skip
    assert float(mpmath.log(gaps[0] / gaps[1], 2)) == pytest.approx(order, abs=0.15)


def test_a_splitting_is_drifts_and_kicks():
    """Ruth's method of order 3 on the pendulum, written by hand."""
    run = Scheme(scenes.get("pendulum"), splitting(RUTH)).flow("1/10").trajectory(1)
    (x,), (p,) = run.x[0], run.mu[0]
    for i, share in enumerate(map(float, RUTH)):
        if i % 2:
            p -= share / 10 * np.sin(x)
        else:
            x += share / 10 * p
    assert run.x[1, 0] == pytest.approx(x, abs=1e-15)
    assert run.mu[1, 0] == pytest.approx(p, abs=1e-15)


def kinetic(x, mu, p):
    return mu.dot(mu) / 2


def second(x, mu, p):
    return p.coupling * x[0] ** 2 * x[1]


def third(x, mu, p):
    return x.dot(x) / 2 - p.coupling * x[1] ** 3 / 3


def both(x, mu, p):
    return second(x, mu, p) + third(x, mu, p)


FOREST_RUTH = [CUBE / 2, CUBE, (1 - CUBE) / 2, 1 - 2 * CUBE, (1 - CUBE) / 2, CUBE, CUBE / 2]


@pytest.mark.dear("[16")
@pytest.mark.parametrize("digits", [16, 40])
def test_a_splitting_by_parts_of_h_is_that_of_the_lagrangian(digits):
    """One explicit map, of exact flows; potentials commute, so three parts are two."""
    scene = scenes.get("henon-heiles")
    rules = [splitting(FOREST_RUTH, **more) for more in
             ({}, {"parts": [kinetic, both]}, {"parts": [second, kinetic, third]})]  # fmt: skip
    ends = []
    for rule in rules:
        of = Scheme(scene, rule)
        assert of.order == 4 and of.self_adjoint
        run = of.flow("1/50", digits).trajectory(20)
        ends.append(np.concatenate([run.x[-1], run.mu[-1]]))
    unit = 1e-15 if digits == 16 else mpmath.mpf(10) ** (3 - digits)
    assert abs(ends[1] - ends[0]).max() <= unit
    gap = abs(ends[2] - ends[0]).max()  # another method of the order
    assert 1e-14 < gap < 1e-6


@pytest.mark.parametrize(("parts", "words"), [
    ([kinetic, third], "do not add up to H of henon-heiles: what is left is coupling.*x_1.* which"),
    ([lambda x, mu, p: kinetic(x, mu, p) + both(x, mu, p), lambda x, mu, p: 0],
     "henon-heiles: the flow of the part .* is no polynomial"),
])  # fmt: skip
def test_parts_that_are_no_splitting(parts, words):
    with pytest.raises(BadInput, match=words):
        Scheme(scenes.get("henon-heiles"), splitting([1, 1], parts=parts))


def test_lyndon_words_are_as_many_as_necklaces_say():
    """1, 1, 2, 3, 6, 9, 18 by weight (Hairer, Lubich, Wanner, III.3), fewer of odd ones."""
    for over, odd, wanted in ((1, False, [1, 1, 2, 3, 6, 9, 18]), (2, True, [1, 0, 1, 1, 2, 2, 4])):
        of = [len(conditions(p, over, odd)) for p in range(8)]
        assert np.diff(of).tolist() == wanted


@pytest.mark.parametrize(("make", "words"), [
    (lambda: compose(midpoint, [CUBE, 1.001 - 2 * CUBE, CUBE]), "add up to 1.001, .* 0.001 more"),
    (lambda: compose(midpoint, ["1/3", "1/3"]),
     ": the coefficients add up to 0.666.* 0.333333 less"),
    (lambda: compose(midpoint, [sympy.sqrt(2), 1 - sympy.sqrt(3)]), "0.317837 less than 1"),
    (lambda: compose(midpoint, [0.5, 0.5], order=4), "order 3, Σ γᵢ³ = 0, is missed by 0.25, so"),
    (lambda: compose(midpoint, [CUBE + 1e-6, 1 - 2 * CUBE, CUBE - 1e-6], order=4),
     "8.11e-12"),
    (lambda: compose(rectangle, [1], adjoint=[0], order=2), "Σ .αᵢ² − βᵢ².* = 0, is missed by 1,"),
    (lambda: compose(midpoint, [0.5 + 0.1j, 0.5 - 0.1j]), "a complex number: .* real coefficients"),
    (lambda: compose(midpoint, [sympy.I, 1 - sympy.I]), "a complex number"),
    (lambda: compose(midpoint, [0.5, float("nan"), 0.5]), "coefficient 2 is nan: give a finite"),
    (lambda: compose(midpoint, [1, 0]), "coefficient 2 is 0; leave it out"),
    (lambda: compose(midpoint, []), "no coefficient is given"),
    (lambda: compose(midpoint, 3), "give a list of coefficients"),
    (lambda: compose(midpoint, [1], adjoint=[0, 0]), "as many"),
    (lambda: compose(midpoint, [1], order=11), "from 1 to 10"),
    (lambda: compose(midpoint, [1], name="a b"), "use letters"),
    (lambda: compose(midpoint, "suzuki", order=4), "a published method: leave"),
    (lambda: splitting(["1/2", 1, "1/3"]), "kinetic part .* add up to 0.8333.*0.166667 less"),
    (lambda: splitting(["1/2", 2, "1/2"]), "potential part .* add up to 2, which is 1 more"),
    (lambda: splitting([1]), "at least two"),
    (lambda: splitting([1, 1], parts=[kinetic]), "a list of two or more functions"),
    (lambda: splitting([1, 1], parts=[kinetic, lambda x: x]), "part 2 is a function of .x.; write"),
    (lambda: splitting([1, "1/2"], parts=[kinetic, both]), "of the second part .* 0.5 less than 1"),
    (lambda: splitting([1, 1], first="drift"), 'say "kinetic" or "potential"'),
])  # fmt: skip
def test_bad_input_says_which_and_by_how_much(make, words):
    with pytest.raises(BadInput, match=words) as caught:
        make()
    assert "\n" not in str(caught.value)
