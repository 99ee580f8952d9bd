"""Orders declared wrongly and references that are wrong: the study of orders must say no."""

import math

import pytest
import sympy

from discmech.integrators import (
    Scene,
    discretisation,
    lie_group,
    mean_multipliers,
    pair,
    scenes,
    so,
)
from discmech.integrators.rules import midpoint, rectangle, trapezoidal
from tests.studies.cached_results import measured, result


def declared(order, rule):
    return discretisation(order, name=f"so-called-{rule.name}")(rule.formula)


@discretisation()
def radau(L, G, x, u, h):
    """Radau's two points: of second order with a straight path, and not its own adjoint."""
    return h * L(x, u) / 4 + 3 * h * L(G.target(x, u, sympy.Rational(2, 3) * h), u) / 4


@pytest.mark.dear("kepler", "below")
@pytest.mark.sampled
@pytest.mark.parametrize("digits", [16, 50])
@pytest.mark.parametrize(("scene", "rule", "side"), [
    ("pendulum", declared(2, rectangle), "below"),
    ("pendulum", declared(1, radau), "above"),
    ("kepler", declared(1, radau), "above"),
    ("heavy-top", declared(2, rectangle), "below"),
    ("rigid-body", declared(4, midpoint), "below"),
    ("kepler", declared(4, trapezoidal), "below"),
])  # fmt: skip
def test_a_wrongly_declared_order_is_caught_from_both_sides(scene, rule, side, digits):
    found = result("order", scene, rule, digits)
    assert found["verdict"] == "fail"
    assert f"is {side} the expected {rule.order}" in found["reason"]


def inconsistent(size):
    """The midpoint rule with a potential that is too large by the fraction size·h."""

    def formula(L, G, x, u, h):
        middle = G.target(x, u, h / 2)
        rest = L(middle, 0 * u)
        return h * L(middle, u) + size * h**2 * rest

    return discretisation(2, name=f"drifting-by-{float(size):g}")(formula)


def perturbed(monkeypatch, size):
    """Make the order study compare with the solution for another gravity."""
    import discmech.reference as reference

    def other(scene, *arguments, **more):
        gravity = 1 + sympy.Rational(size)
        return reference_solution(scene.with_values(parameters={"gravity": gravity}),
                                  *arguments, **more)  # fmt: skip

    reference_solution = reference.solution
    monkeypatch.setattr(reference, "solution", other)
    return measured("order", scenes.get("pendulum").with_values(), trapezoidal, 16)


@pytest.mark.parametrize(
    "size",
    ["1/1000000000", *(pytest.param(s, marks=pytest.mark.slow) for s in ("1/100", "1/10000000"))],
)
def test_a_wrong_reference_is_no_pass(monkeypatch, size):
    assert perturbed(monkeypatch, size)["verdict"] == "fail"


def free_motion(monkeypatch):
    """A motion that every rule gives exactly: the ladder is on the floor from its first rung on."""
    monkeypatch.setattr("discmech.studies.order.measuring.RUNGS", {True: 4, False: 4})
    monkeypatch.setattr("discmech.studies.order.measuring.MOST_RUNGS", {True: 6, False: 6})
    easy = scenes.get("harmonic").with_values(parameters={"stiffness": 0}, v0=[1])
    return measured("order", easy, midpoint, 16, 4)


def test_a_method_without_any_error_passes_and_says_so(monkeypatch):
    found = free_motion(monkeypatch)
    assert found["verdict"] == "pass" and "exact on this scene" in found["reason"]
    assert len(found["rows"]) <= 6  # a ladder of round-off alone ends
    assert found["measured"] == {"order": None, "interval": None, "points": 0}
    assert all(row["why_not"] == "round-off" for row in found["rows"][:-1])


@pytest.mark.parametrize(
    "name", ["damped-pendulum", pytest.param("driven-heavy-top", marks=pytest.mark.slow)]
)
def test_a_flipped_force_does_not_converge(name, monkeypatch):
    scene = scenes.get(name).with_values(duration=2)
    # a drag that drives makes 1e56 of the errors by t = 10, where no run is resolved: inconclusive
    force = (
        (lambda x, v, p, t: [-e for e in scene.force(x, v, p, t)])
        if scene.timed
        else (lambda x, v, p: [-e for e in scene.force(x, v, p)])
    )
    flipped = scene.with_values(force=force)
    monkeypatch.setattr("discmech.reference.solution", reference_of(scene))
    found = measured("order", flipped, "midpoint", steps=100)
    assert found["verdict"] == "fail"


def reference_of(scene):
    """The reference of this scene, whichever is asked for."""
    from discmech.reference import solution

    return lambda other, t, digits=50: solution(scene, t, digits)


@pytest.mark.slow
@pytest.mark.parametrize("digits", [16, 50])
@pytest.mark.parametrize("size", ["1e-4", "1e-8", "1e-12"])
def test_an_inconsistent_rule_cannot_buy_its_order_by_a_small_error(size, digits):
    """In the runs nothing of it is seen above the error of second order, or above round-off."""
    found = result("order", "pendulum", inconsistent(sympy.Rational(size)), digits)
    assert found["verdict"] == "fail"
    assert "order 1.00" in found["reason"] or size == "1e-4"  # which shows in the runs


def test_errors_beside_a_huge_momentum_are_not_called_exact(monkeypatch):
    """A free and heavy body carries the norm; the pendulum beside it is integrated as ever."""
    monkeypatch.setattr("discmech.studies.order.measuring.RUNGS", {True: 4, False: 4})
    monkeypatch.setattr("discmech.studies.order.measuring.MOST_RUNGS", {True: 5, False: 5})
    scene = Scene(
        "beside", pair(2),
        lambda x, v, p: 10**18 * v[0] ** 2 / 2 + v[1] ** 2 / 2 + sympy.cos(x[1]),
        x0=[0, 1], v0=[1, 0], step="0.1", duration=5,
    )  # fmt: skip
    found = measured("order", scene, midpoint, 16, 50)
    assert found["verdict"] == "pass" and "exact" not in found["reason"]
    assert "single steps, also beside the motion, are of order 2.00" in found["reason"]
    wrong = measured("order", scene, inconsistent(sympy.Rational("1e-2")), 16, 50)
    assert wrong["verdict"] == "fail"


@pytest.mark.slow
def test_multipliers_of_a_lower_order_fail_though_the_motion_converges(monkeypatch):
    """Those that leave a row, without those that arrive there, are of first order."""
    at = "discmech.studies.order.multipliers.mean_multipliers"
    monkeypatch.setattr(at, lambda flow, run: run.multipliers)
    found = measured("order", "suslov", midpoint, 50)
    assert (
        found["verdict"] == "fail"
        and "the multipliers of the constraints are of" in found["reason"]
    )


@pytest.mark.slow
def test_multipliers_on_no_line_are_no_pass(monkeypatch):
    """Those that do not sink fail; those that sink beside every line are not told."""
    at = "discmech.studies.order.multipliers.mean_multipliers"
    monkeypatch.setattr("discmech.studies.order.measuring.MOST_RUNGS", {True: 16, False: 4})
    for sinking, verdict in ((0, "fail"), (2, "inconclusive")):

        def uneven(flow, run, sinking=sinking):
            rough = math.sin(1 / flow.step) * (128 * flow.step) ** sinking
            return mean_multipliers(flow, run) * (1 + sympy.Rational(3, 10) * rough)

        monkeypatch.setattr(at, uneven)
        found = measured("order", "suslov", midpoint, 50)
        assert found["verdict"] == verdict and math.isnan(found["measured"]["multipliers"])
        assert "multipliers of the constraints" in found["reason"]


@pytest.mark.slow
def test_a_step_back_that_fails_takes_nothing_from_the_motion(monkeypatch):
    def failing(flow, run):
        raise flow.context.failure("no step back", {})

    monkeypatch.setattr("discmech.studies.order.multipliers.mean_multipliers", failing)
    monkeypatch.setattr("discmech.studies.order.measuring.MOST_RUNGS", {True: 16, False: 4})
    found = measured("order", "suslov", midpoint, 50)
    assert found["verdict"] == "inconclusive" and found["measured"]["order"] is not None
    assert all(math.isnan(row["multipliers"]) for row in found["rows"])


@pytest.mark.slow
@pytest.mark.parametrize(("start", "verdict"), [(1, "pass"), (2, "fail")])
def test_a_rule_whose_adjoint_meets_no_constraints_is_judged_by_its_motion(start, verdict):
    """Forces inside a step of a group: the adjoint asks for L off the straight step."""

    @discretisation(2, name=f"ends-{start}")
    def ends(L, G, x, u, h):
        middle, end = L(G.target(x, u, h / 2), u), L(G.target(x, u, h), u)
        return h * (start * L(x, u) + 4 * middle + end) / (start + 5)

    driven = Scene(
        "driven-suslov", lie_group(so(3)),
        lambda x, v, p: v[0] ** 2 + v[1] ** 2 * 3 / 2 + v[2] ** 2 / 2 + v[0] * v[2] / 3,
        nonholonomic=lambda x, p: [[0, 0, 1]], force=lambda x, v, p, t: [sympy.sin(t), -v[1], 0],
        v0=[1, "0.5", 0], duration=2, step="0.05",
    )  # fmt: skip
    found = measured("order", driven, ends, 50)
    assert found["verdict"] == verdict, found["reason"]
    assert not any("multipliers" in row for row in found["rows"])
