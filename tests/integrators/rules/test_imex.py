"""The fast potential of a scene, and the rule that treats it apart."""

import pytest

from discmech.integrators import Scene, Scheme, imex, midpoint, pair, scenes, trapezoidal
from discmech.integrators.errors import CannotMeasure
from discmech.integrators.numbers import first_violation
from discmech.studies.core.case import Choice


def two_springs(x, v, p):
    return v.dot(v) / 2 - p.k * x[0] ** 2 / 2 - x[1] ** 4 / 4 - x[0] * x[1]


def with_fast(fast):
    return Scene("two-springs", pair(2), two_springs, {"k": 7}, [1, "1/2"], [0, "1/3"], fast=fast)


def legendre(scene, rule):
    scheme = Scheme(scene, rule)
    return [*scheme.legendre_minus, *scheme.legendre_plus]


def same(one, other):
    return first_violation([a - b for a, b in zip(one, other, strict=True)]) is None


@pytest.mark.slow
def test_nothing_fast_is_the_trapezoidal_rule_and_everything_fast_is_midpoint():
    none = with_fast(lambda x, p: 0 * x[0])
    assert same(legendre(none, imex), legendre(none, trapezoidal))
    whole = with_fast(lambda x, p: p.k * x[0] ** 2 / 2 + x[1] ** 4 / 4 + x[0] * x[1])
    assert same(legendre(whole, imex), legendre(whole, midpoint))
    part = with_fast(lambda x, p: p.k * x[0] ** 2 / 2)
    assert not same(legendre(part, imex), legendre(part, midpoint))
    assert not same(legendre(part, imex), legendre(part, trapezoidal))


def test_a_quadratic_fast_part_needs_no_newton():
    scene = with_fast(lambda x, p: p.k * x[0] ** 2 / 2)
    most = [Scheme(scene, rule).flow("1/10").trajectory(10).newton_max for rule in (imex, midpoint)]
    assert most[0] == 1 < most[1]


def test_a_scene_without_a_fast_part_says_so():
    with pytest.raises(CannotMeasure, match=r"pendulum names no fast part .* Scene\(fast="):
        Scheme(scenes.get("pendulum"), imex)
    pairs = list(Choice(scenes=(scenes.get("pendulum"), scenes.get("fpu"))).pairs())
    assert [s.name for s, rule in pairs if rule is imex] == ["fpu"]
