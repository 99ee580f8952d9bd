"""Constraints: RATTLE comes out, closed forms, what is kept, and what must not be demanded."""

import math

import mpmath
import numpy as np
import pytest
import sympy

from discmech.integrators import Scene, Scheme, midpoint, pair, rules, scenes
from discmech.integrators.errors import CannotMeasure
from discmech.integrators.flows import restricted_form_defect
from discmech.integrators.rules import compose
from discmech.reference import solution
from tests.objects import SCENES, exact_parameters, flow

HOLONOMIC = ("cartesian-pendulum", "double-spherical-pendulum")
PLAIN = ("rectangle", "midpoint", "trapezoidal")


def cone():
    """A heavy top whose axis keeps its angle to the vertical: base and group together."""
    top = scenes.get("heavy-top")
    return Scene(
        "cone", top.groupoid, top.lagrangian, top.parameters, x0=["2/7", "3/7", "6/7"],
        v0=["0.2", "0.3", "0.8"], step="0.05",
        holonomic=lambda x, p: [x[2] - sympy.Rational(6, 7)],
    )  # fmt: skip


def rattle(x, p, h, steps):
    """The textbook's: Hairer, Lubich, Wanner, VII.1.4, for |x| = 1 under gravity (0, −1)."""
    down = np.array([0.0, -1.0])
    for _ in range(steps):
        a, b, c = x @ x, 2 * (x @ (x + h * p + h * h * down / 2)), 0.0
        free = x + h * p + h * h * down / 2
        c = free @ free - 1
        size = (b - math.sqrt(b * b - 4 * a * c)) / (2 * a)  # |free − size x| = 1
        y = free - size * x
        half = p + h * down / 2 - size * x / h
        p = half + h * down / 2
        p = p - (y @ p) / (y @ y) * y
        x = y
    return x, p


def test_rattle_comes_out_of_the_trapezoidal_rule():
    run = flow("cartesian-pendulum", "trapezoidal", "0.05").trajectory(200)
    x, p = rattle(run.x[0], run.mu[0], 0.05, 200)
    assert np.abs(run.x[-1] - x).max() < 1e-12 and np.abs(run.mu[-1] - p).max() < 1e-12


@pytest.mark.sampled
@pytest.mark.parametrize("rule", PLAIN)
@pytest.mark.parametrize("name", HOLONOMIC)
def test_neither_constraint_drifts(name, rule):
    steps = 20_000
    scene, run = SCENES[name], flow(name, rule, SCENES[name].step).trajectory(steps)
    assert run.multipliers.shape == (steps + 1, 2 if "double" in name else 1)
    masses = [1, 1, 1, 2, 2, 2] if "double" in name else [1, 1]
    phi = np.array([[float(e) for e in scene.holonomic(sympy.Matrix(x), exact_parameters(scene))]
                    for x in run.x[:: steps // 10]])  # fmt: skip
    assert np.abs(phi).max() < 1e-13
    v = run.mu / masses
    rods = [(run.x, v)]
    if "double" in name:
        rods = [(run.x[:, :3], v[:, :3]), (run.x[:, 3:] - run.x[:, :3], v[:, 3:] - v[:, :3])]
    for r, w in rods:
        assert np.abs((r * w).sum(axis=1)).max() < 1e-13
        assert np.abs((r * r).sum(axis=1) - 1).max() < 1e-13


@pytest.mark.sampled
@pytest.mark.parametrize("rule", PLAIN)
@pytest.mark.parametrize("digits", [16, 50])
@pytest.mark.parametrize("scene", [*map(scenes.get, HOLONOMIC), cone()], ids=lambda s: s.name)
def test_the_form_is_kept_on_the_arrows_that_are_left(scene, rule, digits):
    made = Scheme(scene, rules.get(rule)).flow(scene.step, digits)
    run = made.trajectory(4)
    limit = 1e-13 if digits == 16 else 1e-45
    for k in (0, 3):
        at = run.base[k], run.mu[k], run.u[k]
        assert restricted_form_defect(made, *at) < limit
        assert made.poisson_defect(*at[:2], u0=at[2]) == restricted_form_defect(made, *at)
        # another bracket is not kept where there is one
        if scene.name == "cone":
            assert restricted_form_defect(made, *at, bracket_sign=-1) > 1e3 * limit


@pytest.mark.slow
def test_the_pivoted_body_moves_as_the_heavy_top_does():
    """Its centre of mass and attitude under constraints, and Γ alone in the reduced equations."""
    body = SCENES["pivoted-body"]
    top = scenes.get("heavy-top").with_values(
        parameters={"inertia": ["0.86", "1.06", "0.4"], "weight": "0.6", "center": [0, 0, 1]},
        x0=body.x0[9:], v0=body.v0[3:],
    )  # fmt: skip
    held, free = solution(body, 3), solution(top, 3)
    assert max(abs(a - b) for a, b in zip(held.x[9:], free.x, strict=True)) < 1e-45
    runs = [Scheme(s, rules.get("midpoint")).flow("0.01").trajectory(300) for s in (body, top)]
    assert np.abs(runs[0].x[:, 9:] - runs[1].x).max() < 1e-3


@pytest.mark.slow
def test_the_pivot_stays_where_it_is():
    """r = A χ and ṙ = A (Ω × χ), of the pivoted body, over a million steps."""
    run = flow("pivoted-body", "midpoint", "0.03").trajectory(10**6, every=1000)
    attitude, arm = run.x[:, 3:].reshape(-1, 3, 3), np.array([0, 0, 0.6])
    turning = np.cross(run.mu[:, 3:] / [0.5, 0.7, 0.4], arm)
    assert np.abs(run.x[:, :3] - attitude @ arm).max() < 1e-13
    assert np.abs(run.mu[:, :3] - np.einsum("kij,kj->ki", attitude, turning)).max() < 1e-13


@pytest.mark.parametrize("rule", ["midpoint", "trapezoidal"])
def test_a_composition_is_of_its_own_order(rule):
    scene = scenes.get("cartesian-pendulum")
    one = Scheme(scene, compose(rules.get(rule), "triple-jump"))
    ends = [one.flow(f"1/{n}").trajectory(n, every=n).x[-1] for n in (20, 40, 320)]
    gaps = [np.abs(e - ends[-1]).max() for e in ends[:2]]
    assert math.log2(gaps[0] / gaps[1]) == pytest.approx(4, abs=0.2)


@pytest.mark.slow
def test_pendulums_move_as_they_do_in_coordinates_without_constraints():
    """To 28 digits: the sphere by S² × so(3), two bobs in the plane by their angles."""
    reduced = scenes.get("spherical-pendulum")
    x, omega = (sympy.Matrix(e) for e in (reduced.x0, reduced.v0))
    ball = Scene(
        "ball-on-a-sphere", pair(3), lagrangian=lambda x, v, p: v.dot(v) / 2 - x[2],
        holonomic=lambda x, p: [x.dot(x) - 1], x0=list(x), v0=list(x.cross(omega)), duration=10,
    )  # fmt: skip
    here, there = solution(ball, 3, 30), solution(reduced, 3, 30)
    assert min(here.certain_digits, there.certain_digits) == 30
    assert max(abs(a - b) for a, b in zip(here.x, there.x, strict=True)) < 1e-28

    angles = scenes.get("double-pendulum")
    inner, outer = ([sympy.sin(a), -sympy.cos(a)] for a in angles.x0)
    bobs = Scene(
        "two-bobs", pair(4), lagrangian=lambda x, v, p: v.dot(v) / 2 - x[1] - x[3],
        holonomic=lambda x, p: [x[0] ** 2 + x[1] ** 2 - 1,
                                (x[2] - x[0]) ** 2 + (x[3] - x[1]) ** 2 - 1],
        x0=[*inner, inner[0] + outer[0], inner[1] + outer[1]], v0=[0, 0, 0, 0], duration=5,
    )  # fmt: skip
    here, there = solution(bobs, 2, 30), solution(angles, 2, 30)
    assert min(here.certain_digits, there.certain_digits) == 30
    with mpmath.workdps(40):
        first, second = there.x
        wanted = [mpmath.sin(first), -mpmath.cos(first)]
        wanted += [wanted[0] + mpmath.sin(second), wanted[1] - mpmath.cos(second)]
        assert max(abs(a - b) for a, b in zip(here.x, wanted, strict=True)) < 1e-28


def test_one_constraint_needs_no_list():
    of_one, of_a_list = (
        Scene(
            "circle",
            pair(2),
            lambda x, v, p: v.dot(v) / 2 - x[1],
            x0=["3/5", "-4/5"],
            v0=[0, 0],
            holonomic=constraint,
        )
        for constraint in (lambda x, p: x.dot(x) - 1, lambda x, p: [x.dot(x) - 1])
    )
    one, other = (Scheme(s, rules.get("trapezoidal")).flow("0.1").trajectory(5)
                  for s in (of_one, of_a_list))  # fmt: skip
    assert np.array_equal(one.x, other.x) and np.ptp(one.x) > 0


def test_a_flow_has_no_form_where_constraints_leave_none():
    """Over substeps the form is that of the base rule's steps."""
    pendulum = SCENES["cartesian-pendulum"]
    made = Scheme(pendulum, compose(midpoint, "suzuki")).flow(pendulum.step)
    with pytest.raises(CannotMeasure, match="the rule several substeps: ask for the form of a st"):
        made.poisson_defect(pendulum.x0, [0, 0])
    made = flow("ball-on-turntable", "midpoint", "1/20")
    with pytest.raises(CannotMeasure, match="ball-on-turntable has no form that a step keep"):
        made.poisson_defect([1, 0, 0], [0, 0, 4, 0, 0])
