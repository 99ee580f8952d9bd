"""Where the mass matrix or FL is singular the direction is named; a lost step is our error."""

import numpy as np
import pytest

from discmech.integrators import (
    BadInput,
    DiscmechError,
    Scene,
    Scheme,
    StepFailure,
    midpoint,
    pair,
    rectangle,
    trapezoidal,
)
from discmech.integrators.rules import get as rule_called
from tests.objects import SCENES, flow


def plain(**changes):
    return Scene(**{"name": "bad", "groupoid": pair(1), "lagrangian": None,
                    "x0": [1], "v0": [0], **changes})  # fmt: skip


def plane(**changes):
    return plain(groupoid=pair(2), x0=[0, 0], v0=[0, 0], **changes)


@pytest.mark.parametrize("digits", [16, 30])
@pytest.mark.parametrize(
    "rule", [rectangle, midpoint, trapezoidal, rule_called("gauss-3")], ids=lambda r: r.name
)
def test_a_coordinate_without_kinetic_energy(rule, digits):
    scene = plane(lagrangian=lambda x, v, p: v[0] ** 2 / 2 - x[0] ** 2)
    with pytest.raises(DiscmechError, match="singular") as caught:
        Scheme(scene, rule).flow("1/10", digits).trajectory(3)
    assert "bad with " + rule.name in str(caught.value)


@pytest.mark.parametrize("rule", ["midpoint", "lobatto-2", "gauss-2"])
def test_a_velocity_without_kinetic_energy_that_a_potential_hides(rule):
    """FL is regular there by terms O(h²) of the potential, and no motion is approximated."""
    scene = plane(lagrangian=lambda x, v, p: (v[0] + v[1]) ** 2 / 2 - x[0] ** 2)
    with pytest.raises(
        BadInput, match=r"bad with .* singular everywhere, in the direction \(-1, 1"
    ):
        Scheme(scene, rule_called(rule))


def test_a_discrete_lagrangian_alone_is_asked_for_nothing_continuous():
    def of_points(x, u, h, p):
        return h * (u[0] + u[1]) ** 2 / 2 - h * (x[0] + h * u[0] / 2) ** 2

    scene = plane(lagrangian=None, discrete_lagrangian=of_points)
    run = Scheme(scene, midpoint).flow("1/10", 30).trajectory(3, mu0=[1, 1])
    assert run.steps == 3


@pytest.mark.parametrize("digits", [16, 30])
def test_a_mass_of_zero(digits):
    scene = SCENES["harmonic"].with_values(parameters={"mass": 0})
    with pytest.raises(DiscmechError, match=r"harmonic with trapezoidal: .*singular"):
        Scheme(scene, trapezoidal).flow("1/10", digits).trajectory(3)


def test_a_failure_is_both_ours_and_a_runtime_error():
    with pytest.raises(StepFailure) as caught:
        flow("pendulum", "midpoint", 3).trajectory(10)
    assert isinstance(caught.value, DiscmechError)
    assert isinstance(caught.value, RuntimeError)
    assert "take a smaller step" in str(caught.value)
    assert "direction" not in str(caught.value)  # FL is regular there


@pytest.mark.parametrize(
    ("lagrangian", "x0", "v0", "direction"),
    [
        (lambda x, v, p: x[0] * v[0] ** 2 / 2, [0], [1], r"\(1\) of ξ"),
        (lambda x, v, p: v[0] ** 4, [1], [0], r"\(1\) of ξ"),
        (lambda x, v, p: v.dot(v) / 2 + x[0] * v[0] * v[1], [1, 0], [1, 0], r"\(-1, 1\) of ξ"),
    ],
    ids=["x v²", "v⁴", "two"],
)
@pytest.mark.parametrize("rule", ["trapezoidal", "triple-jump:trapezoidal"])
def test_where_it_is_singular_the_direction_is_named(rule, lagrangian, x0, v0, direction):
    scene = plain(groupoid=pair(len(x0)), lagrangian=lagrangian, x0=x0, v0=v0)
    with pytest.raises(StepFailure, match=rf"∂²l/∂ξ² is singular .* {direction}") as caught:
        Scheme(scene, rule_called(rule)).flow("1/10", 30).trajectory(3)
    assert "smaller step helps, begin elsewhere" in str(caught.value)
    assert "take a smaller" not in str(caught.value)


@pytest.mark.parametrize("given", ["lagrangian", "discrete_lagrangian"])
def test_where_fl_alone_is_singular_another_step_is_advised(given):
    """FL = 1 − h²/4 at x = u = 0: the mass matrix is regular, and only h = 2 is not."""

    def lagrangian(x, v, p):
        return v[0] ** 2 / 2 + x[0] ** 2 / 2 + x[0] ** 4

    def discrete(x, u, h, p):
        return h * lagrangian(x + h * u / 2, u, p)

    formula = lagrangian if given == "lagrangian" else discrete
    made = Scheme(plain(x0=[0], v0=[0], **{"lagrangian": None, given: formula}), midpoint)
    with pytest.raises(StepFailure, match=r"FL is singular in the direction \(1\) of u") as caught:
        made.flow(2, 30).trajectory(1, mu0=["1/10"])
    assert "take another step, or begin elsewhere, or look" in str(caught.value)
    assert made.flow(1, 30).trajectory(1, mu0=["1/10"]).steps == 1


def test_an_inverse_step_that_is_not_there():
    f = flow("pendulum", "midpoint", 3)
    with pytest.raises(StepFailure, match="pendulum with midpoint: the inverse step was not found"):
        for start in np.linspace(0.3, 3, 40):
            f.devolve([start], [7 * start])
