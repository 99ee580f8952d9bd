"""Constraints: RATTLE comes out, closed forms, what is kept, and what must not be demanded."""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest
import sympy

from discmech.integrators import BadInput, Scene, Scheme, lie_group, pair, rules, scenes, so
from discmech.integrators.errors import CannotMeasure
from discmech.integrators.flows import restricted_form_defect
from discmech.integrators.rules import compose
from discmech.reference import solution
from discmech.studies import check
from tests.objects import SCENES, flow, scheme

HOLONOMIC = ("cartesian-pendulum", "double-spherical-pendulum")
NONHOLONOMIC = ("suslov", "chaplygin-sleigh", "rolling-disc", "knife-edge", "contact-oscillator")
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


@pytest.mark.sampled
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


@pytest.mark.parametrize("steps", [1000, pytest.param(10**6, marks=pytest.mark.slow)])
def test_the_pivot_stays_where_it_is(steps):
    """r = A χ and ṙ = A (Ω × χ), of the pivoted body."""
    run = flow("pivoted-body", "midpoint", "0.03").trajectory(steps, every=steps // 1000)
    attitude, arm = run.x[:, 3:].reshape(-1, 3, 3), np.array([0, 0, 0.6])
    turning = np.cross(run.mu[:, 3:] / [0.5, 0.7, 0.4], arm)
    assert np.abs(run.x[:, :3] - attitude @ arm).max() < 1e-13
    assert np.abs(run.mu[:, :3] - np.einsum("kij,kj->ki", attitude, turning)).max() < 1e-13


def test_a_composition_is_of_its_own_order():
    scene = scenes.get("cartesian-pendulum")
    one = Scheme(scene, compose(rules.get("midpoint"), "triple-jump"))
    ends = [one.flow(f"1/{n}").trajectory(n, every=n).x[-1] for n in (20, 40, 320)]
    gaps = [np.abs(e - ends[-1]).max() for e in ends[:2]]
    assert math.log2(gaps[0] / gaps[1]) == pytest.approx(4, abs=0.2)


# -- nonholonomic ---------------------------------------------------------------------------------


def suslov(t):
    """θ′ = k cos(θ − δ) on the ellipse of constant energy: sin(θ − δ) = tanh(kt + c)."""
    i1, i2, c1, c2, w1, w2 = 1.0, 2.0, 0.5, 0.3, 0.4, -0.9
    energy = i1 * w1**2 + i2 * w2**2
    a, b = math.sqrt(energy / i1), math.sqrt(energy / i2)
    delta, size = math.atan2(c2 * b, c1 * a), math.hypot(c1 * a, c2 * b)
    psi, k = math.atan2(w2 / b, w1 / a) - delta, size / math.sqrt(i1 * i2)
    sine = np.tanh(k * t + math.atanh(math.sin(psi)))
    cosine = math.copysign(1, math.cos(psi)) * np.sqrt(1 - sine**2)
    theta = np.arctan2(sine, cosine) + delta
    o1, o2 = a * np.cos(theta), b * np.sin(theta)
    turned = k * cosine * (-c1 * a * np.sin(theta) + c2 * b * np.cos(theta))  # dμ₃/dt
    mu = np.stack([i1 * o1, i2 * o2, c1 * o1 + c2 * o2], axis=1)
    return None, mu, (turned - (i1 - i2) * o1 * o2)[:, None]


def chaplygin_sleigh(t):
    """v = V tanh(κt + c), J ω² + m v² constant: it ends going straight, blade behind."""
    a, inertia, w0, v0 = 0.5, 1.25, 1.5, -0.4
    top = math.sqrt(inertia * w0**2 + v0**2)
    v = top * np.tanh(a * top / inertia * t + math.atanh(v0 / top))
    w = np.sqrt((top**2 - v**2) / inertia)
    push = w * v - a**2 * w * v / inertia  # m(ωv + aω′) across the blade
    return None, np.stack([inertia * w, v, a * w], axis=1), push[:, None]


def rolling_disc(t):
    """Both spins constant: round a circle; the multipliers turn its velocity."""
    turned, radius, one = 0.6 * t, 0.8 / 0.6, np.ones_like(t)
    x = [radius * np.sin(turned), radius * (1 - np.cos(turned)), 0.8 * t, turned]
    mu = [0.8 * np.cos(turned), 0.8 * np.sin(turned), 0.4 * one, 0.15 * one]
    push = [-0.48 * np.sin(turned), 0.48 * np.cos(turned)]
    return (np.stack(e, axis=1) for e in (x, mu, push))


def knife_edge(t):
    """θ = ωt and dv/dt = g cos θ along the blade: it drifts across the slope, and never down."""
    v0, w, g = 0.3, 0.8, 0.7
    turned = w * t
    v = v0 + g / w * np.sin(turned)
    x = [v0 / w * np.sin(turned) + g / (2 * w**2) * np.sin(turned) ** 2,
         v0 / w * (1 - np.cos(turned)) + g / (2 * w**2) * (turned - np.sin(2 * turned) / 2),
         turned]  # fmt: skip
    mu = [v * np.cos(turned), v * np.sin(turned), 0.5 * w * np.ones_like(t)]
    return np.stack(x, axis=1), np.stack(mu, axis=1), -(v * w + g * np.sin(turned))[:, None]


def both_multipliers(name, rule, step, steps, every):
    """A run and the mean of the multipliers that leave a row and that arrive there, which are
    those of a step −h: of second order, each alone of first."""
    there, back = flow(name, rule, step), scheme(name, rule).flow(f"-{step}")
    run = there.trajectory(steps, every=every)
    arriving = [back.trajectory(0, x0=x, mu0=mu, u0=u).multipliers[0]
                for x, mu, u in zip(run.x, run.mu, run.u, strict=True)]  # fmt: skip
    return run, (run.multipliers + np.array(arriving)) / 2


@pytest.mark.parametrize("rule", ["midpoint", "trapezoidal"])
@pytest.mark.parametrize(
    "closed_form", [suslov, chaplygin_sleigh, rolling_disc, knife_edge], ids=lambda f: f.__name__
)
def test_closed_forms_to_eight_digits(closed_form, rule):
    """Place, momentum and the force of the constraint."""
    name = closed_form.__name__.replace("_", "-")
    run, multipliers = both_multipliers(name, rule, "0.00005", 200000, 20000)
    x, mu, push = closed_form(run.t)
    assert x is None or np.abs(run.x - x).max() < 1e-8
    assert np.abs(run.mu - mu).max() < 1e-8
    assert np.abs(multipliers - push).max() < 1e-8
    assert np.abs(multipliers + push).max() > 1e-2  # the sign is seen


def test_multipliers_are_of_first_order_and_their_mean_of_second():
    """Of a holonomic constraint: λ = m(g x₂ − |v|²)/ℓ² of the Cartesian pendulum."""
    alone, mean = [], []
    for steps in (500, 1000):
        run, found = both_multipliers(
            "cartesian-pendulum", "midpoint", f"{5 / steps}", steps, steps // 10
        )
        wanted = run.x[:, 1] - (run.mu**2).sum(axis=1)
        alone.append(np.abs(run.multipliers[:, 0] - wanted).max())
        mean.append(np.abs(found[:, 0] - wanted).max())
    assert math.log2(alone[0] / alone[1]) == pytest.approx(1, abs=0.05)
    assert math.log2(mean[0] / mean[1]) == pytest.approx(2, abs=0.05)


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
        ({"holonomic": lambda x, p: [x.dot(x) - 4]}, r"φ\(x0\) = 0 is off by 3; .* x0=\[2.0, 0"),
        ({"holonomic": lambda x, p: [x[1] - x[0] + 1]}, r"A\(x0\) v0 = 0 is off by 1"),
        ({"holonomic": lambda x, p: [x[0] - 1, 2 * x[0] - 2]}, "redundant"),
        ({"holonomic": lambda x, p: [(x[0] - 1) ** 2]}, "constraint 0 has the row A = 0 at x0"),
        ({"nonholonomic": lambda x, p: [[1, 0], [0, 0]]}, "constraint 1 has the row A = 0"),
        ({"nonholonomic": lambda x, p: [1, 0]}, "list of rows of 2 entries"),
        ({"nonholonomic": lambda x, p: [[1, 0, 0]]}, "list of rows of 2 entries"),
        ({"holonomic": lambda x, p: [[x[0]]]}, "list of expressions"),
        ({"holonomic": lambda x, p: x[0] - 1}, "list of expressions"),
        ({"holonomic": lambda x, p: [x[0] - sympy.Symbol("q")]}, "the unknown symbol q"),
        ({"nonholonomic": lambda x, p: [[sympy.I, 0]]}, "not finite and real"),
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


@pytest.mark.slow
@pytest.mark.parametrize(("rule", "order"), [("rectangle", 1), ("midpoint", 2), ("trapezoidal", 2)])
def test_a_nonholonomic_motion_that_no_reversibility_helps(rule, order):
    """Standard tests flatter (Modin, Verdier 2020): the oscillator with its coupling and cube."""
    scene = scenes.get("contact-oscillator").with_values(
        name="coupled-oscillator", parameters={"coupling": "0.3", "cubic": "0.5"}
    )
    (case,) = check("order", [scene], [rule], [50])["cases"]
    assert case["verdict"] == "pass"
    assert case["measured"]["order"] == pytest.approx(order, abs=0.01)
