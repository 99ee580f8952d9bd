"""A step is chosen for a tolerance by a pilot, and what it cannot reach is refused."""

import re

import pytest

from discmech.integrators import BadInput, Scheme, rules
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


def test_with_more_digits_the_step_is_chosen_as_well():
    flow = Scheme(SCENES["pendulum"], rules.get("gauss-8")).flow(tolerance="1e-22", digits=30)
    assert flow.choice.error < 1e-22 and flow.choice.steps < 128


@pytest.mark.parametrize(("rule", "tolerance"), [("trapezoidal", 1e-13), ("gauss-4", 1e-17)])
def test_what_is_out_of_reach_is_refused_with_what_is_not(rule, tolerance):
    scheme = Scheme(SCENES["pendulum"], rules.get(rule))
    with pytest.raises(BadInput, match="below round-off, or takes more than") as refusal:
        scheme.flow(tolerance=tolerance)
    least = float(re.search(r"is reached: ([\d.e-]+)", str(refusal.value))[1])
    assert scheme.flow(tolerance=least).choice.error <= least


@pytest.mark.parametrize("given", [{}, {"step": 1, "tolerance": 1e-6}])
def test_a_step_or_a_tolerance(given):
    with pytest.raises(BadInput, match="give a step, or a tolerance"):
        Scheme(SCENES["pendulum"], rules.get("midpoint")).flow(**given)


@pytest.mark.parametrize("tolerance", [0, -1e-3, 1, "x", float("nan")])
def test_no_tolerance_at_all(tolerance):
    with pytest.raises(BadInput, match="tolerance"):
        Scheme(SCENES["pendulum"], rules.get("midpoint")).flow(tolerance=tolerance)
