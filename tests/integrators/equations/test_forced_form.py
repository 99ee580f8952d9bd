"""What a step under a force does to the symplectic form and to phase volume."""

import numpy as np
import pytest
import sympy

from discmech.integrators import Scheme, rules, scenes
from discmech.integrators.flows import form_change_defects, restricted_form_defect
from discmech.studies import check
from tests.integrators.equations.forced_scenes import forced, with_force
from tests.objects import with_wrong_force

DIGITS = 50
SLOW = pytest.mark.slow
#: an entry that vanishes is judged over √ε of its round-off (`FormChange.defect`), and at twice the
#: digits of double precision √ε is 7.5e-23
ROUND_OFF = 1e-22

#: cheap ones of each kind of groupoid, one with the time; with stages, and with substeps by turns
CHANGED = [
    ("spring-pendulum", "rectangle"), ("heavy-top", "rectangle"),
    ("rigid-body", "triple-jump:rectangle"), ("duffing", "gauss-2"),
    *(pytest.param(*e, marks=SLOW) for e in [
        ("spring-pendulum", "lobatto-3"), ("rigid-body", "trapezoidal"),
        ("driven-heavy-top", "rectangle"),
        ("heavy-top", "midpoint"), ("heavy-top", "gauss-2"), ("rigid-body", "lobatto-3"),
        ("rotor-body", "trapezoidal"), ("wong", "rectangle"), ("kirchhoff", "trapezoidal"),
        ("driven-heavy-top", "gauss-2"), ("heavy-top", "kahan-li-6:rectangle")]),
]  # fmt: skip


def changed(one):
    """What `form_change_defects` says after a step of 0.1, in double precision's run."""
    made = one.flow("0.1")
    run = made.trajectory(2)
    return form_change_defects(made, run.base[1], run.mu[1], run.u[1])


@pytest.mark.parametrize("rule", ["rectangle", "midpoint", "trapezoidal"])
@pytest.mark.parametrize("name", ["pendulum", "henon-heiles"])
def test_the_form_changes_by_the_differential_of_the_forces_one_form(name, rule):
    """With f = −γv the discrete force is −γ(y − x)·((1 − θ)dx + θdy): its differential is
    γ dx∧dy, whatever θ, and that is what a step adds to dμ∧dx (at 50 digits). With it det M, the
    contraction of phase volume, is below 1."""
    gamma = sympy.Rational(1, 5)
    rubbed_scene = with_force(name, lambda x, v, p: [-gamma * e for e in v])
    made = Scheme(rubbed_scene, rules.get(rule)).flow("0.1", DIGITS)
    n, run = len(rubbed_scene.x0), made.trajectory(2)
    with made.numbers.working():
        here = made.context.maps_at(*made.context.vectors(run.x[1], run.u[1]))
        M = made.geometry.dual_step(here, made.context.h)
        M = np.asarray(getattr(M, "value", M))
        one, zero = made.numbers.identity(n), made.numbers.zeros(n, n)
        J = np.block([[zero, -one], [one, zero]])  # dμ∧dx
        start, end = np.hstack([one, zero]), M[:n]
        added = made.numbers.number(gamma) * (start.T @ end - end.T @ start)
        change = M.T @ J @ M - J
        assert abs(change - added).max() < 1e-45
        assert abs(change + added).max() > 1e-3  # another sign is seen
        assert 1 - 2 * n * 0.02 < float(made.numbers.det(M)) < 1


@pytest.mark.dear(but=("2]",))
@pytest.mark.sampled
@pytest.mark.parametrize(("name", "rule"), CHANGED)
def test_the_form_changes_by_the_work_on_every_groupoid(name, rule):
    """And with a wrong discrete force otherwise: flipped, doubled at one end, left out."""
    own = scenes.get(name)
    one = forced(name, rule) if own.force is None else Scheme(own, rules.get(rule))
    form, volume, grown = changed(one)
    assert form < ROUND_OFF and volume < ROUND_OFF
    assert 0.5 < grown < 1
    if ":" in rule or len(one.s.stages):
        return
    for ends in ((-1, -1), (2, 0), (0, 0)) if name == "spring-pendulum" else ((2, 0),):
        assert changed(with_wrong_force(one, *ends))[0] > 1e-4


@pytest.mark.parametrize("rule", ["trapezoidal", pytest.param("rectangle", marks=SLOW)])
def test_under_a_constraint_the_form_that_is_left_changes_by_the_work(rule):
    made = forced("cartesian-pendulum", rule).flow("0.1")
    run = made.trajectory(2)
    at = run.base[1], run.mu[1], run.u[1]
    assert restricted_form_defect(made, *at, forced=True) < ROUND_OFF
    assert restricted_form_defect(made, *at) > 1e-4


def test_phase_volume_shrinks_at_the_rate_of_the_friction():
    """θ̈ = −sin θ − γθ̇ with a kinetic energy θ̇²/2 shrinks areas by e^{−γt}: to O(h²) a step does."""
    rubbed_one = with_force("pendulum", lambda x, v, p: [-v[0] / 5])
    (case,) = check("symplecticity", [rubbed_one], [rules.get("midpoint")], [16])["cases"]
    assert case["verdict"] == "pass" and case["measured"]["volume"] < ROUND_OFF
    own = [r["contraction"] for r in case["rows"] if r["step"] == float(rubbed_one.step)]
    assert case["measured"]["contraction"] == pytest.approx(0.2, rel=0.02)
    assert case["measured"]["contraction"] == pytest.approx(sum(own) / len(own))
