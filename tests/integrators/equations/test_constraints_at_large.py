"""Constraints in other units, without mass, and under compositions of a rule and its adjoint."""

import mpmath
import pytest
import sympy

from discmech import BadInput, Scene, Scheme, check, midpoint, pair, scenes, solution
from discmech.integrators import rules
from discmech.integrators.flows import mean_multipliers
from discmech.reference import multipliers


def massless(**held):
    return Scene("held", pair(2), lambda x, v, p: v[0] ** 2 / 2 - x.dot(x) / 2,
                 x0=[1, 0], v0=[0, 0], duration=2, step="1/20", **held)  # fmt: skip


@pytest.mark.parametrize("held", [
    {}, {"holonomic": lambda x, p: [x[1]]}, {"nonholonomic": lambda x, p: [[x[0], 1]]},
], ids=["free", "holonomic", "nonholonomic"])  # fmt: skip
def test_a_velocity_without_mass_is_refused_in_one_sentence(held):
    with pytest.raises(BadInput, match=r"singular everywhere, in the direction \(0, 1\)") as said:
        Scheme(massless(**held), midpoint)
    assert "\n" not in str(said.value)


@pytest.mark.dear("blanes-moan")
@pytest.mark.parametrize(("name", "rule"), [
    ("cartesian-pendulum", "triple-jump:rectangle"), ("knife-edge", "blanes-moan-4:rectangle"),
    pytest.param("suslov", "triple-jump:rectangle", marks=pytest.mark.slow),
])  # fmt: skip
def test_a_composition_of_rectangle_and_its_adjoint_is_of_order_4(name, rule):
    """Hairer, Lubich, Wanner, VII.1.3: symplectic Euler under constraints, composed: RATTLE."""
    scene, errors, pulls = scenes.get(name), [], []
    exact = solution(scene, 1, digits=30, proof=False)
    force = multipliers(scene, exact)
    for steps in (20, 40):
        flow = Scheme(scene, rules.get(rule)).flow(sympy.Rational(1, steps), digits=30)
        run = flow.trajectory(steps, steps)
        ends = zip([*run.x[-1], *run.mu[-1]], [*exact.x, *exact.mu], strict=True)
        errors.append(max(abs(a - b) for a, b in ends))
        means = mean_multipliers(flow, run)[-1]
        pulls.append(max(abs(a - b) for a, b in zip(means, force, strict=True)))
    assert abs(mpmath.log(errors[0] / errors[1], 2) - 4) < 0.4
    assert mpmath.log(pulls[0] / pulls[1], 2) > 1.6  # even in h


def ten(power):
    return sympy.Integer(10) ** power


def swinging(length, time, action):
    """A pendulum on pairs, told in other units."""
    weight = action / time
    return Scene(
        "swinging", pair(2), holonomic=lambda x, p: [x.dot(x) - length**2],
        lagrangian=lambda x, v, p: weight * (v.dot(v) * (time / length) ** 2 / 2 - x[1] / length),
        x0=[length * sympy.Rational(3, 5), -length * sympy.Rational(4, 5)], v0=[0, 0],
        duration=4 * time, step=time / 20,
    )  # fmt: skip


def tied(a, d):
    """Two coordinates of units of their own, x/a = y/d + (y/d)²; its turn comes near a pole."""
    return Scene(
        "tied", pair(2), lambda x, v, p: ((v[0] / a) ** 2 + (v[1] / d) ** 2 - (x[0] / a) ** 2) / 2,
        holonomic=lambda x, p: [x[0] / a - x[1] / d - (x[1] / d) ** 2], x0=[0, 0], v0=[a, d],
        duration=4, step="1/20",
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("scene", [
    swinging(ten(12), ten(0), ten(0)), swinging(ten(-12), ten(3), ten(0)),
    swinging(ten(0), ten(0), ten(100)), swinging(ten(0), ten(0), ten(-100)),
    swinging(ten(-40), ten(0), ten(0)), tied(ten(25), ten(-25)), tied(ten(-12), ten(3)),
], ids=lambda s: s.name)  # fmt: skip
def test_verdicts_under_constraints_know_no_unit(scene):
    for study in ("order", "symplecticity"):
        (case,) = check(study, [scene], [midpoint], digits=[50])["cases"]
        assert case["verdict"] == "pass", (study, case["reason"])
