"""The fixed point stops component by component: a motion keeps its digits beside a larger one."""

import numpy as np
import pytest
import sympy

from discmech.integrators import Scene, Scheme, pair, rules


def two_pendulums(size):
    """One of angle x₀, and one whose angle is x₁/size."""

    def lagrangian(x, v, p):
        kinetic = v[0] ** 2 + (v[1] / size) ** 2
        return kinetic / 2 + sympy.cos(x[0]) + 3 * sympy.cos(x[1] / size)

    return Scene("two-pendulums", pair(2), lagrangian, x0=[1, 2 * size], v0=[0, 0], duration=20)


@pytest.mark.slow
def test_a_motion_keeps_its_digits_beside_one_of_another_size():
    """1e12 apart, to the digits that it has beside one of its own size."""
    rule, step, steps = rules.get("gauss-4"), "0.2", 100
    own = Scheme(two_pendulums(1), rule)
    exact = np.array(own.flow(step, digits=25).trajectory(steps).x, float)
    errors = {}
    for size in (sympy.Integer(1), sympy.Rational(1, 2**40), sympy.Integer(2) ** 40):
        run = Scheme(two_pendulums(size), rule).flow(step).trajectory(steps)
        assert run.solver == "fixed point"
        errors[size] = np.abs(run.x / [1, float(size)] - exact).max(axis=0)
    assert all((error < 2 * errors[1] + 4e-15).all() for error in errors.values())


def test_what_is_round_off_of_others_is_not_waited_for():
    """The difference of two equal pendulums is the rounding of their sines, and does not shrink."""

    def lagrangian(x, v, p):
        return v[0] ** 2 + v[1] ** 2 + sympy.cos(x[0] + x[1]) + sympy.cos(x[0] - x[1])

    starts = [[1, "1e-17"], [1, "1/8"]]
    scenes = [Scene("alike", pair(2), lagrangian, x0=x, v0=[0, 0], duration=20) for x in starts]
    run, other = (
        Scheme(scene, rules.get("gauss-4")).flow("0.2").trajectory(400) for scene in scenes
    )
    assert run.solver == other.solver == "fixed point"
    assert run.newton_mean < other.newton_mean + 2 and run.newton_max < 2 * other.newton_max
