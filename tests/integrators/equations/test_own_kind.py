"""A further kind of constraint is one object: here one that a motor holds by forces of its own.

Servo constraints (Béghin 1922; Marle, Rep. Math. Phys. 42, 1998): A ξ = a, with the force Bᵀλ along
rows B that are not A. So the multipliers do work.
"""

from dataclasses import replace

import mpmath
import numpy as np
import pytest
import sympy

from discmech.integrators import BadInput, Scene, Scheme, mean_multipliers, pair, rules
from discmech.integrators.errors import CannotMeasure
from discmech.integrators.scene import ConstraintKind, ConstraintParts, velocity_rows
from discmech.reference import multipliers, solution
from discmech.studies import check


def _parts(given, m):
    """A, a and B of a function that gives (A, a, B)."""
    if not isinstance(given, tuple) or len(given) != 3:
        raise BadInput("a servo constraint gives three lists: rows, right sides and reactions.")
    return replace(velocity_rows(given[:2], m), reactions=given[2])


SERVO = ConstraintKind(
    "servo", _parts, no_form="servo: a motor keeps no form", no_energy="servo: its motor does work"
)


def follower(name, *constraints, **more):
    """x = (slide, pendulum): the slide has to move as the constraint says."""
    return Scene(
        name, pair(2), lambda x, v, p: v.dot(v) / 2 + sympy.cos(x[1]) - x[0] * x[1] / 4,
        constraints=constraints, x0=[0, "0.3"], v0=[0, 0], duration=2, step="1/20", **more,
    )  # fmt: skip


def rows(x, t):
    return [[1, sympy.cos(x[1])]], [sympy.sin(t) / 2]


def held():
    """A motor that pushes the slide alone."""
    return follower("servo", SERVO(lambda x, p, t: (*rows(x, t), [[1, 0]])))


@pytest.mark.slow
def test_rows_starts_and_references_follow_from_it():
    """Of order 2, place and multiplier; another force would hold it along another way."""
    scene = held()
    exact, errors = solution(scene, 1, 25, proof=False), []
    for steps in (20, 40):
        made = Scheme(scene, rules.get("midpoint")).flow(sympy.Rational(1, steps), 30)
        run = made.trajectory(steps, every=steps)
        means = [*run.x[-1], *run.mu[-1], *mean_multipliers(made, run)[-1]]
        wanted = [*exact.x, *exact.mu, *multipliers(scene, exact)]
        errors.append([abs(a - b) for a, b in zip(means, wanted, strict=True)])
    orders = [float(mpmath.log(a / b, 2)) for a, b in zip(*errors, strict=True)]
    assert np.abs(np.array(orders) - 2).max() < 0.1
    ideal = follower("ideal", nonholonomic=lambda x, p, t: rows(x, t))
    assert abs(solution(ideal, 1, 25, proof=False).x[0] - exact.x[0]) > 1e-3


def test_a_proof_covers_it():
    assert "enclosed" in solution(held(), "1/2", 20).evidence


@pytest.mark.dear("symplecticity")
@pytest.mark.parametrize("study", ["symplecticity", "energy"])
def test_studies_judge_it_by_what_it_says(study):
    (case,) = check(study, [held()], ["midpoint"], [16], steps=32)["cases"]
    assert case["verdict"] == "pass", case["reason"]
    if study == "energy":
        assert case["measured"]["balance_order"] > 1.95
    else:
        assert case["expected"]["not_demanded"] == SERVO.no_form
        assert case["measured"]["constraint"] < 1e-15


@pytest.mark.parametrize(("given", "said"), [
    (([[1, 0]], [0]), "three lists"),
    (([[1, 0]], [0], [[1]]), "its servo constraint needs 1 reactions, rows of 2 entries"),
    (([[1, 0]], [0], [[1, 0], [0, 1]]), "its servo constraint needs 1 reactions"),
    (([[0, 1]], [0], [[1, 0]]), "A M⁻¹Bᵀ is singular"),
])  # fmt: skip
def test_wrong_parts_are_said_in_a_sentence(given, said):
    with pytest.raises(BadInput, match=said):
        Scheme(follower("wrong", SERVO(lambda x, p: given)), rules.get("midpoint"))


@pytest.mark.parametrize(("parts", "said"), [
    (lambda given, m: None, "gives None"), (lambda given, m: 1 / 0, "raises ZeroDivisionError"),
    (lambda given: given, "raises TypeError"), (3, "raises TypeError"),
    (lambda given, m: ConstraintParts(rows=[[1, 2, 3]], shift=[0]), "gives 1 rows and 1 right s"),
    (lambda given, m: ConstraintParts(rows=[[1, 0]]), "gives 1 rows and 0 right sides; give rows"),
])  # fmt: skip
def test_a_wrong_function_of_a_kind_is_said_in_a_sentence(parts, said):
    wrong = replace(SERVO, parts=parts)
    with pytest.raises(BadInput, match=f"follower: parts= of its servo constraint {said}"):
        Scheme(follower("follower", wrong(lambda x, p: [[1, 0]])), rules.get("midpoint"))


@pytest.mark.parametrize("parts", [
    {"rows": sympy.Matrix([[1, 0]]), "shift": sympy.Matrix([0])},
    {"rows": np.array([[1.0, 0.0]]), "shift": 0}, {"rows": ([1, 0],), "shift": [0]},
])  # fmt: skip
def test_parts_are_lists_arrays_matrices_and_single_expressions(parts):
    kind = replace(SERVO, parts=lambda given, m: ConstraintParts(**parts))
    scheme = Scheme(follower("follower", kind(lambda x, p: 0)), rules.get("midpoint"))
    assert scheme.flow("1/20").trajectory(2).x[-1, 0] == pytest.approx(0, abs=1e-15)


def test_parts_that_are_none_are_said_in_a_sentence():
    for parts in ({"positions": None}, {"rows": [[1, 0]], "shift": None}):
        kind = replace(SERVO, parts=lambda given, m, parts=parts: ConstraintParts(**parts))
        with pytest.raises(BadInput, match="its constraint is None, not an expression"):
            Scheme(follower("follower", kind(lambda x, p: 0)), rules.get("midpoint"))


def test_it_is_asked_for_as_constraint_only():
    with pytest.raises(CannotMeasure, match="without stages"):
        Scheme(held(), rules.get("gauss-2"))
    with pytest.raises(BadInput, match=r"constraints= is .* but is a list of Constraint"):
        follower("wrong", lambda x, p: [x[0]])
