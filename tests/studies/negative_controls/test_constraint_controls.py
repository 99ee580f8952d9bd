"""Steps that do not meet a scene's constraints fail, whatever the rows say that made them."""

import pytest
import sympy

from discmech.integrators import scenes
from discmech.integrators.equations import constrained_equations
from tests.studies.cached_results import measured


def found_with(name, monkeypatch, wrong, digits=16):
    """symplecticity of a fresh copy of the scene, whose rows are made with a wrong function."""
    for part, more in wrong.items():
        right = getattr(constrained_equations, part)
        monkeypatch.setattr(
            constrained_equations, part, lambda s, x, right=right, more=more: more(s, right(s, x))
        )
    scene = scenes.get(name).with_values(name=f"{name}-{len(wrong)}")
    return measured("symplecticity", scene, "midpoint", digits, 8)


@pytest.mark.parametrize("name", ["cartesian-pendulum", "suslov", "knife-edge"])
@pytest.mark.parametrize("digits", [16, 50])
@pytest.mark.sampled
def test_constraints_are_met_to_round_off(name, digits, monkeypatch):
    found = found_with(name, monkeypatch, {}, digits)
    assert found["verdict"] == "pass"
    assert 0 <= found["measured"]["constraint"] < 10.0 ** (-15 if digits == 16 else -60)


@pytest.mark.parametrize(
    ("name", "wrong"),
    [
        ("cartesian-pendulum", {"constraint": lambda s, value: value.applyfunc(
            lambda e: e + s.h**3 / 1000)}),  # the base beside the constraint
        ("suslov", {"constraint_matrix": lambda s, value: value.applyfunc(
            lambda e: e + sympy.Rational(1, 1000))}),  # another direction is forbidden
        ("knife-edge", {"constraint_matrix": lambda s, value: value.applyfunc(
            lambda e: e + sympy.Rational(1, 1000))}),
    ],
)  # fmt: skip
def test_rows_beside_the_constraint_are_caught(name, wrong, monkeypatch):
    found = found_with(name, monkeypatch, wrong)
    assert found["verdict"] == "fail"
    assert found["measured"]["constraint"] > 1e3 * found["expected"]["residual"]
