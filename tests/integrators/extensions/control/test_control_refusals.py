"""Problems of control that have no answer, and questions that are none: a sentence each."""

import numpy as np
import pytest
import sympy

from discmech import BadInput, Control, discretisation, midpoint, one_step, scenes
from discmech.integrators.errors import CannotMeasure
from discmech.integrators.extensions.control.stages import places_of
from discmech.integrators.rules import compose, gauss
from tests.integrators.extensions.control.test_control import effort, mass, plane, problem


def test_one_step_has_too_few_controls():
    with pytest.raises(BadInput, match=r"2 conditions, but .* 1 values .* take more steps"):
        Control(mass(), effort, ([1], [0])).solve(1)
    assert abs(Control(mass(), effort, ([1], [0])).solve(1, gauss(2)).cost - 6) < 1e-12


def negative_middle(L, G, x, u, h):
    """Consistent and symmetric, with the weight −1/4 at the middle."""
    ends = L(x, u) + L(G.target(x, u, h), u)
    return h * (5 * ends / 8 - L(G.target(x, u, h / 2), u) / 4)


def test_a_negative_weight_has_no_minimum():
    """The cost falls without a bound where the middle's control grows and the ends' balance it."""
    with pytest.raises(BadInput, match=r"no minimum .* without negative weights"):
        Control(mass(), effort, ([1], [0])).solve(10, discretisation(order=2)(negative_middle))


@pytest.mark.parametrize("near", [20, lambda: Control(plane(), effort, ([1, 0], [0, 0])).solve(9)])
def test_a_start_near_another_problem_is_refused(near):
    near = near() if callable(near) else near
    with pytest.raises(BadInput, match=r"near= is no solution of mass: "):
        Control(mass(), effort, ([1], [0])).solve(10, near=near)


REST = scenes.get("rigid-body").with_values(v0=[0, 0, 0], symmetries=())
HALF_TURN = [-1, 0, 0, 0, -1, 0, 0, 0, 1]


@pytest.mark.dear("given9", "given8")
@pytest.mark.parametrize(("given", "said"), [
    ((plane(), effort, ([1, 1], [0, 0]), lambda x, v, f, p: [f[0], 0], 1),
     r"cannot be reached: the inputs do not steer x\[1\]"),
    ((plane(), effort, ([1, 0], [0, 0]), lambda x, v, f, p: [f[0], 0], 1),
     r"tried the inputs do not steer (x|mu)\[1\] .* not determined"),
    ((plane(), effort, ([1, 1], [0, 0]), lambda x, v, f, p: [f[0], f[0]], 1), "do not steer"),
    ((scenes.get("spherical-pendulum"), effort, ([0, 0, 2], [0, 0, 0])),
     r"cannot be reached: \|x\|² is 1 at x0 and 4 at x1"),
    ((mass(), lambda x, v, f, p: f[0], ([1], [0])), "does not bind every control"),
    ((mass(), lambda x, v, f, p: x[0] ** 2, ([1], [0])), "does not bind every control"),
    ((mass(), lambda x, v, f, p: -f[0] ** 2, ([1], [0])), "no minimum"),
    ((mass(duration=10), lambda x, v, f, p: f[0] ** 2 - 10 * x[0] ** 2, ([1], [0])), "no minimum"),
    ((mass(), lambda x, v, f, p: f[0] ** 2 - sympy.log(9 - f[0] ** 2), ([1], [0])), "not finite"),
    ((REST.with_attitude(), effort, (HALF_TURN, [0, 0, 0])), "edge of its chart, as a half turn"),
    ((mass(), lambda x, v, f, p: f[0] ** 2 + p.k, ([1], [0])), "its cost asks for what is not"),
    ((mass(), lambda x, v, f, p: [f, f], ([1], [0])), "its cost is"),
    ((mass(), effort, ([1], [0]), lambda x, v, f, p: [f[0], 0], 1), "must give a list of 1"),
    ((mass(), effort, ([1], [0]), lambda x, v, f, p: np.array(f[0]), 1), "must give a list of 1"),
    ((mass(), effort, ([1, 2], [0])), "x1 has 2 entries"),
    ((mass(), effort, 3), "give \\(x1, v1\\)"),
    ((mass(), effort, ([1], [0]), None, 2), "give their number"),
    ((mass(), effort, ([1], [0]), lambda x, v, f, p: [f[0]], 1000), "from 1 to 64"),
    ((mass(), effort, ([1], [0]), lambda x, v, f, p: [f[0]], 2**63), "from 1 to 64"),
    ((mass(), lambda f: f, ([1], [0])), "cost= is a function"),
    ((scenes.get("suslov"), effort, ([], [0, 0, 0])), "without constraints"),
])  # fmt: skip
def test_a_problem_without_an_answer_says_why(given, said):
    with pytest.raises(BadInput, match=said) as raised:
        Control(*given).solve(10)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(("path", "said"), [
    (lambda t: 3, "could not be evaluated"), (lambda t: [1 / t], "could not be evaluated"),
    (lambda t: [1, 2], "give 1 finite"), (lambda t: [float("nan")], "give 1 finite"),
])  # fmt: skip
def test_a_path_that_is_none_is_refused(path, said):
    with pytest.raises(BadInput, match=said):
        problem("double-integrator").with_values(path=path).solve(4)


def test_fields_that_are_none_are_refused():
    with pytest.raises(BadInput, match="a Control has no 'goal'"):
        problem("double-integrator").with_values(goal=3)


@one_step(order=1)
def euler(s, z, h):
    return z + h * s.f(z)


@pytest.mark.parametrize(("steps", "rule", "said"), [
    (0, midpoint, "whole number"), (2.5, midpoint, "whole number"), (5, "midpoint", "no rule"),
    (5, compose(midpoint, "triple-jump"), "weighted sum"), (5, euler, "weighted sum"),
])  # fmt: skip
def test_steps_and_rules_that_do_not_fit_are_refused(steps, rule, said):
    with pytest.raises(BadInput, match=said):
        problem("double-integrator").solve(steps, rule)


def test_fractions_of_a_step_that_depend_on_the_motion_are_told():
    @discretisation(order=2)
    def local(L, G, x, u, h):
        return h * L(G.target(x, u, h * (1 + sympy.exp(-(x[0] ** 2)) / 10) / 2), u)

    with pytest.raises(CannotMeasure, match="fractions of a step that depend on the motion"):
        places_of(scenes.get("pendulum"), local)
