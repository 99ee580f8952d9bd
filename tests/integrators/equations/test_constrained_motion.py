"""Constraints: RATTLE comes out, closed forms, what is kept, and what must not be demanded."""

from __future__ import annotations

import math

import numpy as np
import pytest
import sympy

from discmech.integrators import BadInput, Scene, Scheme, lie_group, pair, rules, scenes, so
from discmech.integrators.errors import CannotMeasure
from discmech.integrators.flows import restricted_form_defect
from discmech.integrators.rules import compose
from tests.objects import SCENES, flow, scheme

HOLONOMIC = ("cartesian-pendulum", "double-spherical-pendulum")
NONHOLONOMIC = ("suslov", "chaplygin-sleigh", "rolling-disc", "contact-oscillator")
PLAIN = ("rectangle", "midpoint", "trapezoidal")


def cone():
    """A heavy top whose axis keeps its angle to the vertical: base and group together."""
    top = scenes.get("heavy-top")
    return Scene(
        "cone", top.groupoid, top.lagrangian, top.parameters, x0=["2/7", "3/7", "6/7"],
        v0=["0.2", "0.3", "0.8"], step="0.05",
        holonomic=lambda x, p: [x[2] - sympy.Rational(6, 7)],
    )  # fmt: skip


# -- holonomic ------------------------------------------------------------------------------------


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


@pytest.mark.parametrize("rule", PLAIN)
@pytest.mark.parametrize("name", HOLONOMIC)
def test_neither_constraint_drifts(name, rule, steps=20000):
    scene, run = SCENES[name], flow(name, rule, SCENES[name].step).trajectory(steps)
    assert run.multipliers.shape == (steps + 1, 2 if "double" in name else 1)
    masses = [1, 1, 1, 2, 2, 2] if "double" in name else [1, 1]
    phi = np.array([[float(e) for e in scene.holonomic(sympy.Matrix(x), _Exact(scene))]
                    for x in run.x[:: steps // 10]])  # fmt: skip
    assert np.abs(phi).max() < 1e-13
    v = run.mu / masses
    rods = [(run.x, v)]
    if "double" in name:
        rods = [(run.x[:, :3], v[:, :3]), (run.x[:, 3:] - run.x[:, :3], v[:, 3:] - v[:, :3])]
    for r, w in rods:
        assert np.abs((r * w).sum(axis=1)).max() < 1e-13
        assert np.abs((r * r).sum(axis=1) - 1).max() < 1e-13


@pytest.mark.slow
@pytest.mark.parametrize("name", HOLONOMIC)
def test_neither_constraint_drifts_over_a_million_steps(name):
    test_neither_constraint_drifts(name, "trapezoidal", 10**6)


class _Exact:
    """A scene's parameters as sympy numbers."""

    def __init__(self, scene):
        for name, value in scene.parameters.items():
            many = isinstance(value, tuple)
            exact = [sympy.Rational(v) for v in value] if many else sympy.Rational(value)
            setattr(self, name, sympy.Matrix(exact) if many else exact)


def test_the_pendulum_by_its_angle_is_the_same():
    run = flow("cartesian-pendulum", "midpoint", "0.002").trajectory(1000)
    angle = math.atan2(0.96, -0.28)
    own = scenes.get("pendulum").with_values(x0=[angle], v0=[0])
    by_angle = Scheme(own, rules.get("gauss-2")).flow("0.01").trajectory(200)
    found = np.arctan2(run.x[-1, 0], -run.x[-1, 1])
    assert found == pytest.approx(by_angle.x[-1, 0], abs=1e-5)


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
        # the whole form is not kept, nor another bracket where there is one
        assert made.poisson_defect(*at[:2], u0=at[2]) > 1e3 * limit
        if scene.name == "cone":
            assert restricted_form_defect(made, *at, bracket_sign=-1) > 1e3 * limit


@pytest.mark.parametrize("name", NONHOLONOMIC)
def test_no_form_is_kept_where_constraints_are_not_holonomic(name):
    made = flow(name, "midpoint", SCENES[name].step)
    run = made.trajectory(3)
    defect = restricted_form_defect(made, run.base[1], run.mu[1], run.u[1])
    assert defect > 1e-6 or name == "rolling-disc"


def test_a_composition_is_of_its_own_order():
    scene = scenes.get("cartesian-pendulum")
    one = Scheme(scene, compose(rules.get("midpoint"), "triple-jump"))
    ends = [one.flow(f"1/{n}").trajectory(n, every=n).x[-1] for n in (20, 40, 320)]
    gaps = [np.abs(e - ends[-1]).max() for e in ends[:2]]
    assert math.log2(gaps[0] / gaps[1]) == pytest.approx(4, abs=0.2)


# -- nonholonomic ---------------------------------------------------------------------------------


def test_suslov_against_its_closed_form():
    """θ′ = k cos(θ − δ) on the ellipse of constant energy: sin(θ − δ) = tanh(kt + c)."""
    run = flow("suslov", "midpoint", "0.00005").trajectory(200000, every=20000)
    i1, i2, c1, c2, w1, w2 = 1.0, 2.0, 0.5, 0.3, 0.4, -0.9
    energy = i1 * w1**2 + i2 * w2**2
    a, b = math.sqrt(energy / i1), math.sqrt(energy / i2)
    delta, size = math.atan2(c2 * b, c1 * a), math.hypot(c1 * a, c2 * b)
    psi = math.atan2(w2 / b, w1 / a) - delta
    u = np.tanh(size / math.sqrt(i1 * i2) * run.t + math.atanh(math.sin(psi)))
    theta = np.arctan2(u, math.copysign(1, math.cos(psi)) * np.sqrt(1 - u * u)) + delta
    wanted = np.stack([i1 * a * np.cos(theta), i2 * b * np.sin(theta)], axis=1)
    assert np.abs(run.mu[:, :2] - wanted).max() < 1e-8
    spin = run.mu[:, 2] - c1 * a * np.cos(theta) - c2 * b * np.sin(theta)
    assert np.abs(spin).max() < 1e-8  # μ₃ of a motion with Ω₃ = 0


def test_the_sleigh_against_its_closed_form():
    """v = V tanh(κt + c), J ω² + m v² constant: it ends going straight, blade behind."""
    run = flow("chaplygin-sleigh", "midpoint", "0.00005").trajectory(200000, every=20000)
    a, inertia, w0, v0 = 0.5, 1.25, 1.5, -0.4
    top = math.sqrt(inertia * w0**2 + v0**2)
    sign = math.copysign(1, run.mu[-1, 1])
    v = sign * top * np.tanh(a * top / inertia * run.t + math.atanh(sign * v0 / top))
    assert np.abs(run.mu[:, 1] - v).max() < 1e-8
    assert np.abs(run.mu[:, 0] - inertia * np.sqrt((top**2 - v**2) / inertia)).max() < 1e-8


def test_the_disc_rolls_round_a_circle():
    """Both spins constant; the multipliers are the forces that turn its velocity."""
    errors = []
    for steps in (1000, 2000):
        run = flow("rolling-disc", "midpoint", f"{10 / steps}").trajectory(steps, every=steps // 10)
        t, radius = run.t, 0.8 / 0.6
        place = np.stack([radius * np.sin(0.6 * t), radius * (1 - np.cos(0.6 * t))], axis=1)
        force = 0.48 * np.stack([-np.sin(0.6 * t), np.cos(0.6 * t)], axis=1)
        assert np.abs(run.mu[:, 2:] - [0.4, 0.15]).max() < 1e-13
        errors.append((np.abs(run.x[:, :2] - place).max(), np.abs(run.multipliers - force).max()))
    (x1, l1), (x2, l2) = errors
    assert math.log2(x1 / x2) == pytest.approx(2, abs=0.05)
    assert math.log2(l1 / l2) == pytest.approx(1, abs=0.1)


@pytest.mark.parametrize("name", NONHOLONOMIC)
def test_the_constraint_is_exact_where_the_rule_asks_for_l(name):
    run = flow(name, "midpoint", SCENES[name].step).trajectory(200)
    scene, middle = SCENES[name], run.x[:-1]
    if middle.shape[1]:
        middle = middle + float(scene.step) * run.u[:-1] / 2
    for x, u in list(zip(middle, run.u[:-1], strict=True))[::20]:
        A = sympy.Matrix(scene.nonholonomic(sympy.Matrix(len(x), 1, list(x)), _Exact(scene)))
        assert max(abs(float(e)) for e in A * sympy.Matrix(list(u))) < 1e-13


def test_self_adjointness_asks_for_the_constraint_too():
    """The disc's L_d is the same by every rule, but a constraint at the start alone is not."""
    assert not scheme("rolling-disc", "rectangle").self_adjoint
    assert scheme("rolling-disc", "rectangle").order == 1
    assert scheme("suslov", "rectangle").self_adjoint
    assert scheme("contact-oscillator", "trapezoidal").self_adjoint


# -- bad input ------------------------------------------------------------------------------------


def held(**more):
    return Scene(**{"name": "bad", "groupoid": pair(2), "x0": [1, 0], "v0": [0, 1],
                    "lagrangian": lambda x, v, p: v.dot(v) / 2, **more})  # fmt: skip


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"holonomic": lambda x, p: [x.dot(x) - 4]}, r"φ\(x0\) = 0 is off by 3; .* \(2.5, 0\)"),
        ({"holonomic": lambda x, p: [x[1] - x[0] + 1]}, r"A\(x0\) v0 = 0 is off by 1"),
        ({"holonomic": lambda x, p: [x[0] - 1, 2 * x[0] - 2]}, "redundant"),
        ({"holonomic": lambda x, p: [(x[0] - 1) ** 2]}, "constraint 0 has the row A = 0 at x0"),
        ({"nonholonomic": lambda x, p: [[1, 0], [0, 0]]}, "constraint 1 has the row A = 0"),
        ({"nonholonomic": lambda x, p: [1, 0]}, "list of rows of 2 entries"),
        ({"nonholonomic": lambda x, p: [[1, 0, 0]]}, "list of rows of 2 entries"),
        ({"holonomic": lambda x, p: [[x[0]]]}, "list of expressions"),
        ({"holonomic": lambda x, p: x[0] - 1}, "list of expressions"),
    ],
)  # fmt: skip
def test_constraints_that_fit_nothing_are_said_in_a_sentence(more, said):
    with pytest.raises(BadInput, match=said):
        Scheme(held(**more), rules.get("midpoint"))


def test_what_constraints_go_with():
    with pytest.raises(BadInput, match="either holonomic="):
        held(holonomic=lambda x, p: [x[0] - 1], nonholonomic=lambda x, p: [[1, 0]])
    with pytest.raises(BadInput, match="has no base"):
        Scene("bad", lie_group(so(3)), lambda x, v, p: v.dot(v) / 2, v0=[1, 0, 0],
              holonomic=lambda x, p: [0])  # fmt: skip
    with pytest.raises(CannotMeasure, match="without stages"):
        Scheme(scenes.get("suslov"), rules.get("gauss-2"))
    with pytest.raises(
        CannotMeasure, match=r"suslov has constraints: a step is a map on \(x, mu\)"
    ):
        flow("suslov", "midpoint", "0.1").pullback_defect([], [1, 0, 0])
    with pytest.raises(CannotMeasure, match="has no legendre_minus"):
        scheme("suslov", "midpoint").legendre_minus  # noqa: B018
