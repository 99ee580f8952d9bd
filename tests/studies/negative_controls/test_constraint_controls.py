"""Steps that do not meet a scene's constraints fail, whatever the rows say that made them."""

import pytest
import sympy

from discmech.integrators import Conserved, Scene, Scheme, pair, rules, scenes
from discmech.integrators.equations import constrained_equations
from discmech.studies.symplecticity.constraints import constraint_defect
from discmech.studies.symplecticity.limits import limits
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


@pytest.mark.slow
@pytest.mark.parametrize("name", ["cartesian-pendulum", "suslov", "knife-edge"])
@pytest.mark.parametrize("digits", [16, 50])
def test_constraints_are_met_to_round_off(name, digits, monkeypatch):
    found = found_with(name, monkeypatch, {}, digits)
    assert found["verdict"] == "pass"
    assert 0 <= found["measured"]["constraint"] < 10.0 ** (-15 if digits == 16 else -60)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "wrong"), [
    ("cartesian-pendulum", {"constraint": lambda s, value: value.applyfunc(
        lambda e: e + s.h**3 / 1000)}),  # the base beside the constraint
    ("suslov", {"constraint_matrix": lambda s, value: value.applyfunc(
        lambda e: e + sympy.Rational(1, 1000))}),  # another direction is forbidden
    ("knife-edge", {"constraint_matrix": lambda s, value: value.applyfunc(
        lambda e: e + sympy.Rational(1, 1000))}),
])  # fmt: skip
def test_rows_beside_the_constraint_are_caught(name, wrong, monkeypatch):
    found = found_with(name, monkeypatch, wrong)
    assert found["verdict"] == "fail"
    assert found["measured"]["constraint"] > 1e3 * found["expected"]["residual"]


def at_first_time(s, points):
    """The points with the time of the start, and L asked for where it was."""
    return [(w, x[:-1, :].col_join(sympy.Matrix([s.x[-1]]))) for w, x in points]


MOVED_OTHERWISE = {
    # ∂φ/∂t forgotten; a forgotten; A ξ = a at the time of the start of a step
    "bead-on-hoop": ("constraint_shift", lambda right: lambda s, x: 0 * right(s, x)),
    "ball-on-turntable": ("constraint_shift", lambda right: lambda s, x: 0 * right(s, x)),
    "ball-in-cylinder": (
        "met_by_velocity", lambda right: lambda s, points: right(s, at_first_time(s, points))
    ),
}  # fmt: skip


@pytest.fixture
def moved_otherwise(request, monkeypatch):
    """A fresh copy of a scene, with a constraint that steps take to move in a wrong way."""
    part, wrong = MOVED_OTHERWISE[request.param]
    right = getattr(constrained_equations, part)
    monkeypatch.setattr(constrained_equations, part, wrong(right))
    return scenes.get(request.param).with_values(name=f"{request.param}-{part}")


@pytest.mark.dear(but=("ball-on",))
@pytest.mark.parametrize("moved_otherwise", MOVED_OTHERWISE, indirect=True)
def test_what_moves_otherwise_than_the_constraint_is_caught(moved_otherwise):
    flow = Scheme(moved_otherwise, rules.get("midpoint")).flow(moved_otherwise.step)
    found = constraint_defect(flow, flow.trajectory(4), 2)
    assert found > 1e3 * limits(16)["constraint"]


@pytest.mark.slow
@pytest.mark.parametrize("moved_otherwise", MOVED_OTHERWISE, indirect=True)
def test_what_moves_otherwise_fails_in_two_studies(moved_otherwise):
    found = measured("symplecticity", moved_otherwise, "midpoint", 16, 8)
    assert found["verdict"] == "fail" and "constraint" in found["reason"]
    found = measured("order", moved_otherwise, "midpoint", 16)
    assert found["verdict"] == "fail" and found["expected"]["order"] == 2
    assert not found["measured"]["order"] or found["measured"]["order"] < 1.1


def test_velocities_without_a_closed_form_leave_the_defect_of_what_is_known():
    """Four coupled velocities are no expressions of μ, so A ξ − a at the end is not judged."""
    tied = Scene(
        "tied", pair(4), lambda x, v, p: v.dot(v) / 2 + (v[0] + v[2]) * (v[1] + v[3]) / 4,
        nonholonomic=lambda x, p: ([[1, x[0], 0, 2]], [1 + x[1]]), x0=[0, 0, 0, 0], v0=[1, 0, 0, 0],
        duration=1, step="1/20",
    )  # fmt: skip
    flow = Scheme(tied, rules.get("midpoint")).flow(tied.step)
    assert constraint_defect(flow, flow.trajectory(4), 2) < limits(16)["constraint"]


BLADE = Conserved(
    "along the blade", lambda x, mu, p: sympy.cos(x[2]) * mu[0] + sympy.sin(x[2]) * mu[1],
    kind="nonholonomic momentum",
)  # fmt: skip
SPIN = Conserved("spin", lambda x, mu, p: (1 + x[0] ** 2) * mu[2], kind="nonholonomic momentum")


def momentum(name, *quantities, rule="midpoint", **more):
    scene = scenes.get("knife-edge").with_values(name=name, symmetries=quantities, **more)
    return measured("momentum", scene, rule, 16, 200)


@pytest.mark.slow
@pytest.mark.parametrize("rule", ["midpoint", "rectangle", "trapezoidal"])
def test_a_nonholonomic_momentum_obeys_its_equation(rule):
    """Gravity moves it, so does the turning of its section, and a force its part."""

    def force(x, v, p):
        return [-v[0] * v[2], 0, -v[2] / 5]

    found = momentum(f"rubbed-{rule}", BLADE, SPIN, rule=rule, force=force)
    assert found["verdict"] == "pass", found["reason"]
    assert max(found["measured"]["drift"].values()) < 1e-15


@pytest.mark.slow
def test_a_wrong_reaction_breaks_the_momentum_equation(monkeypatch):
    right = constrained_equations.reaction_matrix

    def wrong(s, x):
        return right(s, x).applyfunc(lambda e: e + sympy.Rational(1, 1000))

    monkeypatch.setattr(constrained_equations, "reaction_matrix", wrong)
    found = momentum("wrong-row", BLADE)
    assert found["verdict"] == "fail"
    assert found["measured"]["drift"]["along the blade"] > 1e-9


@pytest.mark.dear(but=("not linear",))
@pytest.mark.parametrize(("formula", "said"), [
    (lambda x, mu, p: mu[0], "the constraints do not allow"),
    (lambda x, mu, p: mu[2] ** 2, "not linear"),
])  # fmt: skip
def test_what_is_no_nonholonomic_momentum_is_refused_in_a_sentence(formula, said):
    wrong = Conserved("wrong", formula, kind="nonholonomic momentum")
    found = momentum("refused", wrong)
    assert found["verdict"] == "inconclusive" and said in found["reason"]
