"""Python's sum over expressions, while a function of the user's is evaluated with symbols."""

import numpy as np
import pytest
import sympy

from discmech.integrators import BadInput, Scene, Scheme, midpoint, pair
from discmech.integrators.equations import symbols
from discmech.integrators.equations.symbols import at_once, summing_at_once

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


def test_a_sum_may_begin_with_an_array():
    rows = [np.array([x, y]), np.array([y, 1])]
    assert list(at_once(rows, np.zeros(2))) == list(sum(rows, np.zeros(2)))
    assert list(at_once([x, y], np.zeros(2))) == list(sum([x, y], np.zeros(2)))


def test_a_function_has_another_sum_and_nothing_else():
    shift = 2

    def value(a, b=x, *, c=y):
        return sum([a, b]) + sum([c, shift])

    made = summing_at_once(value)
    assert made.__globals__["sum"] is at_once and "sum" not in value.__globals__
    assert made(x) == value(x) == 2 * x + y + shift and made(x, c=x) == value(x, c=x)
    assert summing_at_once(sum) is sum and summing_at_once(own) is own


asked = 0


def counted(terms):
    global asked
    asked += 1
    return sum(terms)


def counted_within(terms):
    def count():
        global asked
        asked += 1

    count()
    return sum(terms)


@pytest.mark.parametrize("function", [counted, counted_within])
def test_names_of_a_module_are_written_where_they_are(function):
    before = asked
    assert summing_at_once(function)([x, y]) == x + y and asked == before + 1


def own(terms):
    """It asks for no sum."""
    return max(terms)


def test_a_scene_is_evaluated_with_it(monkeypatch):
    seen = []
    monkeypatch.setattr(symbols, "at_once", lambda terms: seen.append(1) or at_once(terms))
    scene = Scene(
        "row", pair(3), lambda x, v, p: sum(e**2 for e in v) / 2 - sum(x), x0=[1, 0, 0], v0=[0] * 3
    )
    assert Scheme(scene, midpoint).s.lagrangian.as_coefficients_dict() and seen
    scene = scene.with_values(lagrangian=lambda x, v, p: sum(v) / missing)  # noqa: F821
    with pytest.raises(BadInput, match="missing"):
        Scheme(scene, midpoint)
