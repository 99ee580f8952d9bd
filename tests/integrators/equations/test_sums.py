"""Python's sum over expressions, while a function of the user's is evaluated with symbols."""

import builtins

import pytest
import sympy

from discmech.integrators import BadInput, Scene, Scheme, midpoint, pair
from discmech.integrators.equations.sums import at_once, sums_at_once

x, y = sympy.symbols("x y", real=True)


@pytest.mark.parametrize("terms", [
    [], [1, 2], [x, y, x, -x / 2], [x, 1], [x, 0.5], [1, x], ["a"], [sympy.eye(2), sympy.eye(2)],
])  # fmt: skip
@pytest.mark.parametrize("start", [0, x, sympy.zeros(2, 2)])
def test_a_sum_is_what_python_makes_of_it(terms, start):
    def made(add):
        try:
            return add(iter(terms), start)
        except Exception as error:
            return type(error)

    assert made(at_once) == made(sum)


def test_python_s_sum_is_there_again_whatever_happens():
    before = builtins.sum
    with pytest.raises(ZeroDivisionError), sums_at_once():
        assert sum is at_once and sum([x, y]) == x + y
        1 / 0  # noqa: B018
    assert builtins.sum is before


def test_a_scene_is_evaluated_with_it():
    seen = []

    def lagrangian(x, v, p):
        seen.append(builtins.sum)
        return sum(e**2 for e in v) / 2 - sum(x[i] * x[i + 1] for i in range(2))

    scene = Scene(name="row", groupoid=pair(3), lagrangian=lagrangian, x0=[1, 0, 0], v0=[0] * 3)
    assert Scheme(scene, midpoint).s.lagrangian.as_coefficients_dict()
    assert set(seen) == {at_once} and builtins.sum is not at_once
    scene = scene.with_values(lagrangian=lambda x, v, p: sum(v) / missing)  # noqa: F821
    with pytest.raises(BadInput, match="missing"):
        Scheme(scene, midpoint)
    assert builtins.sum is not at_once
