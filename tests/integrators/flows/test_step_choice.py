"""A step is chosen for a tolerance by a pilot, and what it cannot reach is refused."""

import re

import mpmath
import pytest

from discmech import pair
from discmech.integrators import BadInput, Scene, Scheme, rules, scenes
from discmech.reference import solution
from tests.objects import SCENES


@pytest.mark.sampled
@pytest.mark.parametrize("tolerance", ["1e-4", "1e-8", "1e-12"])
@pytest.mark.parametrize(("scene", "rule"), [("kepler", "gauss-3"), ("rigid-body", "gauss-3"),
                                             ("pendulum", "kahan-li-8:trapezoidal")])  # fmt: skip
def test_the_error_is_what_was_asked_for(scene, rule, tolerance):
    flow = Scheme(SCENES[scene], rules.get(rule)).flow(tolerance=tolerance)
    duration, choice = SCENES[scene].duration, flow.choice
    assert flow.step == choice.step == duration / choice.steps
    run, true = flow.trajectory(choice.steps), solution(scene, duration, digits=20)
    rows = [(run.x, true.x), (run.mu, true.mu)]
    error = max(
        abs(float(run_[-1, i] - e)) / abs(run_[:, i]).max()
        for run_, ends in rows for i, e in enumerate(ends)
    )  # fmt: skip
    assert error < 1.1 * float(tolerance)
    assert choice.error <= choice.tolerance == float(tolerance)
    assert choice.constant * float(choice.step) ** choice.order == pytest.approx(choice.error)


def test_another_half_of_the_tolerance_costs_what_the_order_says():
    scheme = Scheme(SCENES["kepler"], rules.get("trapezoidal"))
    steps = [scheme.flow(tolerance=tolerance).choice.steps for tolerance in ("1e-4", "1e-6")]
    assert steps[1] / steps[0] == pytest.approx(10, rel=0.5)


@pytest.mark.slow
def test_with_more_digits_the_step_is_chosen_as_well():
    flow = Scheme(SCENES["pendulum"], rules.get("gauss-8")).flow(tolerance="1e-22", digits=30)
    assert flow.choice.error < 1e-22 and flow.choice.steps < 128


def test_a_step_whose_stages_do_not_contract_is_not_chosen(monkeypatch):
    """Eight steps keep a loose tolerance, all of them by Newton, and take five times as long; nor
    is anything compiled for them."""
    monkeypatch.setattr("discmech.integrators.flows.scene_runs.compile", None)
    flow = Scheme(SCENES["heavy-top"], rules.get("gauss-4")).flow(tolerance="1e-2")
    run = flow.trajectory(flow.choice.steps)
    assert run.solver == "fixed point" and flow.choice.error < 1e-2


@pytest.mark.dear(but=("pendulum",))
@pytest.mark.parametrize("name", ["heavy-top", "rigid-body", "pendulum"])
def test_half_as_many_steps_again_need_no_fewer_sweeps_in_all(name):
    """But for a tenth. On the heavy top 12 steps take fewer than 8, and than 16."""
    scene = scenes.get(name)
    scheme = Scheme(scene, rules.get("gauss-8"))
    steps = scheme.flow(tolerance="1e-12").choice.steps

    def sweeps(steps):
        run = scheme.flow(scene.duration / steps).trajectory(steps, steps)
        return run.newton_mean * (steps + 1)

    assert sweeps(steps * 3 // 2) >= 0.9 * sweeps(steps)
    if name == "heavy-top":
        assert sweeps(steps) < 0.9 * sweeps(steps * 2 // 3)
        assert sweeps(steps) < sweeps(steps * 4 // 3)


@pytest.mark.parametrize(("asked", "digits"), [("stages", 31), ("by_newton", 32), ("machine", 33)])
def test_who_asks_for_the_solver_first_does_not_change_its_digits(asked, digits):
    """Its tables are made at the flow's precision; nothing else was made at this one before."""
    scheme, ends = Scheme(SCENES["pendulum"], rules.get("gauss-2")), []
    for flow, first in ((scheme.flow("1/10", digits), asked), (scheme.flow("1/10", 40), "step")):
        getattr(flow, first)
        ends.append(flow.trajectory(2, 2).x[-1, 0])
    with mpmath.workdps(40):
        assert abs(ends[0] - ends[1]) < 1e-29


@pytest.mark.parametrize(("rule", "tolerance"), [("trapezoidal", 1e-13), ("gauss-4", 1e-17)])
def test_what_is_out_of_reach_is_refused_with_what_is_not(rule, tolerance):
    scheme = Scheme(SCENES["pendulum"], rules.get(rule))
    with pytest.raises(BadInput, match="below round-off, or takes more than") as refusal:
        scheme.flow(tolerance=tolerance)
    least = float(re.search(r"is reached: ([\d.e-]+)", str(refusal.value))[1])
    assert scheme.flow(tolerance=least).choice.error <= least


def test_the_number_of_steps_in_a_refusal_is_the_largest_that_was_tried():
    """The rectangle rule is of order one: its error halves down to the last step of the pilot."""
    scheme = Scheme(SCENES["kepler"], rules.get("rectangle"))
    with pytest.raises(BadInput) as refusal:
        scheme.flow(tolerance=1e-6)
    said = re.search(r"more than (\d+) steps.* with (\d+) steps", str(refusal.value))
    assert int(said[1]) == int(said[2])


@pytest.mark.parametrize("start", ["1/100000", 1])
def test_what_is_not_resolved_is_told_no_tolerance(start):
    """A stiff spring beside a soft one: errors of steps longer than its period say nothing."""
    stiff = Scene(
        name="stiff", groupoid=pair(2), x0=[1, start], v0=[0, 0], duration=10, step="1/100",
        lagrangian=lambda x, v, p: (v.dot(v) - x[0] ** 2 - 10**9 * x[1] ** 2) / 2,
    )  # fmt: skip
    for digits in (16, 20):
        with pytest.raises(BadInput, match=r"rate 3\.16e\+04.*A step of 3\.2e-05") as refusal:
            Scheme(stiff, rules.get("midpoint")).flow(tolerance=1e-3, digits=digits)
        assert "smallest" not in str(refusal.value)


@pytest.mark.parametrize("given", [{}, {"step": 1, "tolerance": 1e-6}])
def test_a_step_or_a_tolerance(given):
    with pytest.raises(BadInput, match="give a step, or a tolerance"):
        Scheme(SCENES["pendulum"], rules.get("midpoint")).flow(**given)


@pytest.mark.parametrize("tolerance", [0, -1e-3, 1, "x", float("nan")])
def test_no_tolerance_at_all(tolerance):
    with pytest.raises(BadInput, match="tolerance"):
        Scheme(SCENES["pendulum"], rules.get("midpoint")).flow(tolerance=tolerance)
