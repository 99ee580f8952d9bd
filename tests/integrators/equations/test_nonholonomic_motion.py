"""Nonholonomic constraints: closed forms, multipliers, and what no reversibility helps."""

import math

import numpy as np
import pytest
import sympy

from discmech.integrators import BadInput, Scheme, mean_multipliers, scenes
from discmech.integrators.flows import restricted_form_defect
from discmech.integrators.rules import midpoint
from discmech.studies import check
from discmech.tests.bench.power.units import in_unit_of_action
from tests.objects import SCENES, exact_parameters, flow, scheme

NONHOLONOMIC = ("suslov", "chaplygin-sleigh", "rolling-disc", "knife-edge", "contact-oscillator")


@pytest.mark.dear(but=("edge", "sleigh"))
@pytest.mark.parametrize("name", NONHOLONOMIC)
def test_no_form_is_kept_where_constraints_are_not_holonomic(name):
    made = flow(name, "midpoint", SCENES[name].step)
    run = made.trajectory(3)
    defect = restricted_form_defect(made, run.base[1], run.mu[1], run.u[1])
    assert defect > 1e-3


@pytest.mark.dear("knife-edge")
@pytest.mark.parametrize("name", ["knife-edge", "cartesian-pendulum"])
def test_how_far_a_form_is_from_kept_has_no_unit(name):
    found = []
    for power in (0, 150, -150):
        scene = in_unit_of_action(SCENES[name], power)
        made = Scheme(scene, midpoint).flow(scene.step)
        run = made.trajectory(3)
        found.append(restricted_form_defect(made, run.base[1], run.mu[1], run.u[1]))
    assert found == pytest.approx([found[0]] * 3, rel=1e-9, abs=1e-40)
    assert found[0] < 1e-40 if name == "cartesian-pendulum" else found[0] > 0.1


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


def with_mean_multipliers(name, rule, step, steps, every):
    """A run and the mean of the multipliers that leave a row and that arrive there."""
    there = flow(name, rule, step)
    run = there.trajectory(steps, every=every)
    return run, mean_multipliers(there, run)


@pytest.mark.dear(but=("midpoint", "chaplygin_sleigh"))
@pytest.mark.parametrize("rule", ["midpoint", "trapezoidal"])
@pytest.mark.parametrize(
    "closed_form", [suslov, chaplygin_sleigh, rolling_disc, knife_edge], ids=lambda f: f.__name__
)
def test_closed_forms_to_eight_digits(closed_form, rule):
    """Place, momentum and the force of the constraint."""
    name = closed_form.__name__.replace("_", "-")
    run, multipliers = with_mean_multipliers(name, rule, "0.00005", 200000, 20000)
    x, mu, push = closed_form(run.t)
    assert x is None or np.abs(run.x - x).max() < 1e-8
    assert np.abs(run.mu - mu).max() < 1e-8
    assert np.abs(multipliers - push).max() < 1e-8
    assert np.abs(multipliers + push).max() > 1e-2  # the sign is seen


def test_multipliers_are_of_first_order_and_their_mean_of_second():
    """Of a holonomic constraint: λ = m(g x₂ − |v|²)/ℓ² of the Cartesian pendulum."""
    alone, mean = [], []
    for steps in (500, 1000):
        run, found = with_mean_multipliers(
            "cartesian-pendulum", "midpoint", f"{5 / steps}", steps, steps // 10
        )
        wanted = run.x[:, 1] - (run.mu**2).sum(axis=1)
        alone.append(np.abs(run.multipliers[:, 0] - wanted).max())
        mean.append(np.abs(found[:, 0] - wanted).max())
    assert math.log2(alone[0] / alone[1]) == pytest.approx(1, abs=0.05)
    assert math.log2(mean[0] / mean[1]) == pytest.approx(2, abs=0.05)


@pytest.mark.slow
def test_a_rule_that_forces_one_end_has_its_multipliers_in_the_mean():
    """Gravity is all at one end of a step: λ is answered there, and half of it is not the force."""
    from discmech.reference import multipliers, solution

    (exact,) = multipliers("knife-edge", solution("knife-edge", "1/4", 20))
    errors = []
    for steps in (50, 100):
        run, found = with_mean_multipliers(
            "knife-edge", "rectangle", f"1/{4 * steps}", steps, steps
        )
        errors.append(abs(found[-1, 0] - float(exact)))
        assert abs(run.multipliers[-1, 0] - float(exact)) > 0.1
    assert math.log2(errors[0] / errors[1]) == pytest.approx(1, abs=0.05)


def test_multipliers_are_asked_of_the_flow_that_made_the_run():
    made = flow("suslov", "midpoint", "0.1")
    with pytest.raises(BadInput, match="of another flow"):
        mean_multipliers(made, flow("suslov", "midpoint", "0.05").trajectory(1))
    free = flow("pendulum", "midpoint", "0.1")
    with pytest.raises(BadInput, match="pendulum has no constraints"):
        mean_multipliers(free, free.trajectory(1))


@pytest.mark.parametrize("name", NONHOLONOMIC)
def test_the_constraint_is_exact_where_the_rule_asks_for_l(name):
    run = flow(name, "midpoint", SCENES[name].step).trajectory(200)
    scene, middle = SCENES[name], run.x[:-1]
    if middle.shape[1]:
        middle = middle + float(scene.step) * run.u[:-1] / 2
    for x, u in list(zip(middle, run.u[:-1], strict=True))[::20]:
        A = sympy.Matrix(
            scene.nonholonomic(sympy.Matrix(len(x), 1, list(x)), exact_parameters(scene))
        )
        assert max(abs(float(e)) for e in A * sympy.Matrix(list(u))) < 1e-13


def test_self_adjointness_asks_for_the_constraint_too():
    """The disc's L_d is the same by every rule, but a constraint at the start alone is not."""
    assert not scheme("rolling-disc", "rectangle").self_adjoint
    assert scheme("rolling-disc", "rectangle").order == 1
    assert scheme("suslov", "rectangle").self_adjoint
    assert scheme("contact-oscillator", "trapezoidal").self_adjoint


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
