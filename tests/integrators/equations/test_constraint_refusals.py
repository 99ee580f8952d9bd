"""Constraints that fit nothing: a sentence each."""

import pytest
import sympy

from discmech.integrators import BadInput, Scene, Scheme, pair, rules, scenes
from discmech.integrators.errors import CannotMeasure
from tests.objects import flow, scheme


def held(**more):
    return Scene(**{"name": "bad", "groupoid": pair(2), "x0": [1, 0], "v0": [0, 1],
                    "lagrangian": lambda x, v, p: v.dot(v) / 2, **more})  # fmt: skip


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"holonomic": lambda x, p: [x.dot(x) - 4]}, r"φ\(x0\) = 0 is off by 3; .* x0=\[2.0, 0"),
        ({"holonomic": lambda x, p: [x[1] - x[0] + 1]}, r"A\(x0\) v0 = 0 is off by 1"),
        ({"holonomic": lambda x, p: [x[0] - 1, 2 * x[0] - 2]}, "redundant"),
        ({"holonomic": lambda x, p: [(x[0] - 1) ** 2]}, "constraint 0 has the row A = 0 at x0"),
        ({"nonholonomic": lambda x, p: [[1, 0], [0, 0]]}, "constraint 1 has the row A = 0"),
        ({"nonholonomic": lambda x, p: [1, 0]}, "list of rows of 2 entries"),
        ({"nonholonomic": lambda x, p: [[1, 0, 0]]}, "list of rows of 2 entries"),
        ({"holonomic": lambda x, p: [[x[0]]]}, "list of expressions"),
        ({"holonomic": lambda x, p: [x[0] - sympy.Symbol("q")]}, "the unknown symbol q"),
        ({"nonholonomic": lambda x, p: [[sympy.I, 0]]}, "not finite and real"),
        ({"nonholonomic": lambda x, p: ([[1, 0]], [1, 2])}, r"1 row A .* right sides \[1, 2\]"),
        ({"nonholonomic": lambda x, p: ([[1, 0]], [[0]])}, r"the right sides \[\[0\]\]"),
        ({"nonholonomic": lambda x, p: ([[1, 0]], None)}, "the right sides None"),
        ({"nonholonomic": lambda x, p: ([[1, 0]], [0], 0)}, "list of rows of 2 entries"),
        ({"nonholonomic": lambda x, p: ([[1, 0]], [1])}, r"A\(x0\) v0 - a\(x0\) = 0 is off by 1"),
        ({"nonholonomic": lambda x, p, t: ([[t, 0]], [0])}, "constraint 0 has the row A = 0 at x0"),
        ({"nonholonomic": lambda x, p, t: ([[1, 0]], [1 / t])}, "is off by inf"),
        ({"holonomic": lambda x, p, t: [x[0] - 1 - t]}, r"dφ/dt at \(x0, v0\) = 0 is off by 1"),
        ({"holonomic": lambda x, p, t: [x[0] - 1 - sympy.Symbol("q")]}, "write it with x, p and t"),
        ({"holonomic": lambda x, p, t, h: [x[0]]}, r"write it with \(x, p\) or \(x, p, t\)"),
    ],
)  # fmt: skip
def test_constraints_that_fit_nothing_are_said_in_a_sentence(more, said):
    with pytest.raises(BadInput, match=said):
        Scheme(held(**more), rules.get("midpoint"))


def test_what_constraints_go_with():
    with pytest.raises(CannotMeasure, match="without stages"):
        Scheme(scenes.get("suslov"), rules.get("gauss-2"))
    light = rules.discretisation(name="light")(lambda L, G, x, u, h: h * L(x, u) / 3)
    with pytest.raises(BadInput, match="the weights of L have the sum h/3") as refused:
        Scheme(scenes.get("suslov"), light)
    assert not isinstance(refused.value, CannotMeasure)  # a wrong rule is no case to leave out
    with pytest.raises(
        CannotMeasure, match=r"suslov has constraints: a step is a map on \(x, mu\)"
    ):
        flow("suslov", "midpoint", "0.1").pullback_defect([], [1, 0, 0])
    with pytest.raises(CannotMeasure, match="has no legendre_minus"):
        scheme("suslov", "midpoint").legendre_minus  # noqa: B018
