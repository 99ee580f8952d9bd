"""Contact: what has no answer is said in a sentence."""

import numpy as np
import pytest
import sympy
from sympy import Rational

from discmech import BadInput, LocalGroupoid, Scheme, StepFailure, midpoint, pair
from discmech.integrators import scenes
from discmech.integrators.errors import CannotMeasure
from discmech.integrators.rules import get
from tests.integrators.extensions.contact.motions import SPRING, ball, scheme

PLANE = {"groupoid": pair(2), "x0": [0, 1], "v0": [1, 0], "friction": 1, "parameters": {"g": 1}}


@pytest.mark.parametrize(("given", "words"), [
    ({"x0": ["-0.25"]}, "inside the obstacle: gap 0 is -0.25; begin outside, such as"),
    ({"contact": lambda x, p: [x[0] - 1, -x[0]], "x0": ["0.5"]}, "contradict each other: no"),
    ({"contact": lambda x, p: [x[0], -x[0]], "x0": [0]}, "0, 1 contradict each other"),
    ({"restitution": "1.5"}, "restitution from 0 to 1"),
    ({"restitution": -1}, "restitution from 0 to 1"),
    ({"restitution": ["0.5"]}, "restitution from 0 to 1"),
    ({"friction": -1}, "friction is negative"),
    ({"friction": "0.5"}, "no plane of contact"),
    ({"friction": [0, 1]}, "one for each gap, 1"),
    ({**PLANE, "contact": lambda x, p: [(x[1], [x[0], x[0] + x[1]])]}, "along its plane"),
    ({**PLANE, "contact": lambda x, p: [(x[1], [p.g])]}, "along its plane"),
    ({"contact": lambda x, p: []}, "must give a list of gaps"),
    ({"contact": lambda x, p: x[0]}, "must give a list of gaps"),
    ({"contact": lambda x, p: np.array(x[0])}, "must give a list of gaps"),
    ({"contact": lambda x, p: {x[0]: 0}}, "must give a list of gaps"),
    ({"contact": lambda x, p: [(x[0], [])]}, "give φ, or"),
    ({"contact": lambda x, p: [sympy.Symbol("z")]}, "unknown symbol z"),
    ({"contact": lambda x, p: [p.depth]}, "depth"),
    ({"contact": lambda x, p: [1]}, "no motion changes"),
    ({"contact": lambda x, p: [x[0] ** 2], "x0": [0]}, "no slope there"),
    ({"contact": lambda x, p: [sympy.log(x[0] - 2)]}, "no real value"),
    ({"contact": 3}, "give a function of"),
    ({"impacts": "never"}, "stepped"),
    ({"contact": None, "friction": -3}, "friction=-3 needs contact="),
    ({"contact": None, "restitution": "0.5"}, "restitution='0.5' needs contact="),
    ({"contact": None, "impacts": "foo"}, "impacts='foo' needs contact="),
    ({"holonomic": lambda x, p: [x[0] - 1]}, "no step takes together"),
    ({"groupoid": LocalGroupoid(0, 1, target=lambda x, u, h: [],
                                product=lambda x, u, v, h: [u[0] + v[0]]), "x0": []},
     "must have one"),
])  # fmt: skip
def test_what_cannot_be_used_is_said_in_a_sentence(given, words):
    with pytest.raises(BadInput, match=words.replace("(", "\\(")) as refused:
        ball(**given)
    assert str(refused.value).endswith(".") and "\n" not in str(refused.value)


def test_a_tolerance_needs_located_impacts():
    """Stepped, runs of an elastic ball agree at the times that are compared, and are wrong."""
    with pytest.raises(BadInput, match="say impacts="):
        scheme("bouncing-ball").flow(tolerance="1e-3", impacts="stepped")
    made = Scheme(SPRING.with_values(duration=4), get("gauss-2"))
    flow = made.flow(tolerance="1e-4")
    assert flow.choice.order == 2 and flow.choice.error <= 1e-4
    end = flow.trajectory(flow.choice.steps).x[-1, 0]  # reflected at −1/2, at t = 2π/3
    assert abs(end - np.cos(4 - 2 * np.pi / 3 + 4 * np.pi / 3)) < 1e-4


def test_a_gap_that_no_motion_on_the_groupoid_changes():
    """The length of a point on a sphere has a slope, but not along the sphere."""
    top = scenes.get("spherical-pendulum")
    with pytest.raises(BadInput, match="closed at x0 and no motion on"):
        Scheme(top.with_values(contact=lambda x, p: [x.dot(x) - 1]), midpoint)


@pytest.mark.slow
def test_friction_in_a_plane_that_no_motions_span():
    """x itself has two directions across φ′ there, and a sphere one: no paradox of friction."""
    bare = scenes.get("spherical-pendulum").with_values(
        contact=lambda x, p: [x[2] + Rational(7, 10)], friction="0.2", restitution="0.5"
    )
    with pytest.raises(BadInput, match=r"do not span the plane of gap 0.*give coordinates"):
        Scheme(bare, midpoint).flow("0.02")
    given = bare.with_values(
        contact=lambda x, p: [(x[2] + Rational(7, 10), [sympy.atan2(x[1], x[0])])]
    )
    found = Scheme(given, midpoint).flow("0.02").trajectory(200)
    assert len(found.impacts.t) and found.gaps.min() > -1e-13


def test_a_column_of_gaps_is_a_list():
    columns = ball(contact=lambda x, p: sympy.Matrix([x[0], x[0] + 1])).trajectory(3)
    assert columns.gaps.shape == (4, 2)
    slipping = ball(**PLANE, contact=lambda x, p: [(x[1], sympy.Matrix([x[0]]))])
    assert slipping.trajectory(3).impulses.shape == (4, 1, 2)


def test_what_a_flow_with_contact_has_not():
    flow = ball()
    made = flow.scheme
    for asked in (lambda: flow.evolve([1], [1]), lambda: flow.pullback_defect([1], [1]),
                  lambda: flow.poisson_defect([1], [1])):  # fmt: skip
        with pytest.raises(CannotMeasure, match="contact"):
            asked()
    for asked in (lambda: made.flow("-0.1"), lambda: made.flow("0.1", on_edge="shrink"),
                  lambda: flow.trajectory(3, x0=[-1], mu0=[0]),
                  lambda: flow.trajectory(3, element0=[[1]]),
                  lambda: made.flow("0.1", impacts="never"),
                  lambda: Scheme(scenes.get("harmonic"), midpoint).flow("0.1", impacts="located"),
                  lambda: made.at(contact=lambda x, p: [x[0] + 1])):  # fmt: skip
        with pytest.raises(BadInput):
            asked()


@pytest.mark.parametrize("digits", [16, 30])
@pytest.mark.parametrize("impacts", ["located", "stepped"])
def test_a_gap_without_a_value_is_not_open(impacts, digits):
    """A cube root is not real below 0: the ball was let through the ground without an impact."""
    falling = ball(contact=lambda x, p: [sympy.cbrt(x[0]) - Rational(1, 10)], impacts=impacts)
    with pytest.raises(StepFailure, match="a gap has no real value there") as failed:
        falling.scheme.flow("0.1", digits).trajectory(400)
    assert float(failed.value.trajectory.x.min()) > 0


def test_a_failure_keeps_its_rows():
    """A potential that ends: the ball reaches log(0) before the ground."""

    def lagrangian(x, v, p):
        return v.dot(v) / 2 - 9 * x[0] + sympy.log(x[0] - Rational(1, 2))

    with pytest.raises(StepFailure) as failed:
        ball(lagrangian=lagrangian, x0=["0.6"], v0=[-3]).trajectory(400)
    rows = failed.value.trajectory
    assert len(rows.x) == failed.value.step_index >= 1 and rows.gaps.min() > 0
