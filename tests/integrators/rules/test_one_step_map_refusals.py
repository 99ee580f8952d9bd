"""What has no meaning for a one-step map, and wrong maps: a sentence each."""

import numpy as np
import pytest
import sympy

from discmech import (
    BadInput,
    Scheme,
    StepFailure,
    action,
    discretisation,
    exponential,
    one_step,
    scenes,
    so,
)
from discmech.integrators.errors import CannotMeasure
from discmech.integrators.rules import compose, dual_gauss, get, newmark


def test_no_omega_without_a_discrete_lagrangian():
    s = Scheme(scenes.get("pendulum"), get("runge-kutta-4"))
    flow = s.flow("0.1")
    asked = (flow.evolve, flow.devolve, flow.pullback_defect, flow.tangent, flow.inverse_legendre)
    for ask in asked:
        with pytest.raises(
            CannotMeasure, match=r"runge-kutta-4 .* no discrete Lagrangian, so no Ω"
        ):
            ask([1.0], [0.0])
    with pytest.raises(CannotMeasure, match="no FL"):
        _ = s.FL


def test_where_a_map_does_not_exist():
    with pytest.raises(BadInput, match="stoermer-verlet exists on pair groupoids only"):
        Scheme(scenes.get("rigid-body"), get("stoermer-verlet"))
    with pytest.raises(BadInput, match="rkmk-4 exists on Lie groups and action groupoids only"):
        Scheme(scenes.get("pendulum"), get("rkmk-4"))


def test_a_rule_that_exists_on_some_groupoids_only():
    @discretisation(order=2, groupoids=["pair", "product"])
    def mine(L, G, x, u, h):
        return h * (L(x, u) + L(x + h * u, u)) / 2

    assert mine.applies(scenes.get("kepler")) and not mine.applies(scenes.get("heavy-top"))
    with pytest.raises(CannotMeasure, match="mine exists on pair groupoids and products"):
        Scheme(scenes.get("heavy-top"), mine)
    composed = compose(mine, "triple-jump")
    assert composed.applies(scenes.get("kepler")) and composed.refusal(scenes.get("sl2"))


@pytest.mark.parametrize("where", ["lie_group", "group", "action"])
def test_a_body_with_its_attitude_is_still_on_its_group(where):
    """A study takes `with_attitude()` of a scene; an action that depends on x is no group."""
    body = scenes.get("rigid-body")

    @discretisation(order=2, groupoids=where)
    def plain(L, G, x, u, h):
        return h * L(x, u)

    for whole in (body.with_attitude(), body.with_attitude().with_retraction(exponential)):
        assert plain.applies(whole) and not get("stoermer-verlet").applies(whole)
    assert plain.applies(body) == (where != "action")
    hung = body.with_attitude().with_values(groupoid=action(so(3), rows=3))
    assert plain.applies(hung) == (where == "action")


@pytest.mark.parametrize(("make", "said"), [
    (lambda: one_step(order=0), "order"),
    (lambda: one_step(lambda s, z, h: z), "brackets"),
    (lambda: one_step(stages=-1), "stages"),
    (lambda: one_step(implicit=True, stages=1), "leave implicit out"),
    (lambda: one_step()(lambda s, z: z), r"takes 2 arguments.*\(s, z, h\)"),
    (lambda: one_step()(None), "a one-step map is a function"),
    (lambda: one_step(groupoids="pairs"), "no groupoid .pairs.: did you mean pair?"),
    (lambda: discretisation(groupoids=["groups"]), "no groupoid .groups."),
    (lambda: one_step(implicit=True)(lambda s, z, h: z), r"\(s, z, Z, h\)"),
    (lambda: one_step(name="a b")(lambda s, z, h: z), "name"),
    (lambda: dual_gauss(0), "from 1 to 20"),
    (lambda: newmark("a"), "newmark: γ"),
])  # fmt: skip
def test_a_map_that_is_none_is_refused(make, said):
    with pytest.raises(BadInput, match=said):
        make()


def wrong(formula, **how):
    rule = one_step(name="mine", **how)(formula)
    return Scheme(scenes.get("kepler"), rule)


@pytest.mark.parametrize(("formula", "how", "said"), [
    (lambda s, z, h: z[:3, :], {}, "gives Z of shape 3×1; a state .* has 4 entries"),
    (lambda s, z, h: None, {}, "gives Z None"),
    (lambda s, z, h: [z] * 4, {}, "gives Z as a list of columns"),
    (lambda s, z, h: z / sympy.Integer(0), {}, "map mine: Z is not finite"),
    (lambda s, z, Z, h: Z * sympy.nan, {"implicit": True}, "its residual is not finite"),
    (lambda s, z, h: z + h * s.f(z[:2, :]), {}, "asks at a 2×1 matrix"),
    (lambda s, z, h: 1 / 0, {}, "could not be evaluated with symbols .ZeroDivision"),
    (lambda s, z, h: z + h * s.g(z), {}, "asks for what is not there"),
    (lambda s, z, h: z + sympy.Symbol("q") * s.f(z), {}, "the unknown symbol q"),
    (lambda s, z, Z, h: z - h * s.f(z), {"implicit": True}, "does not determine the new Z"),
    (lambda s, z, h, K: z, {"stages": 1}, r"return Z, \[1 residuals\]"),
    (lambda s, z, h, K: (z, [z]), {"stages": 1}, "does not determine its stages"),
    (lambda s, z, h: ["a"] * 4, {}, "is the text 'a'"),
    (lambda s, z, h: z + h * s.f(z).jacobian(z) * s.f(z), {}, "s.df is the derivative of s.f"),
    (lambda s, z, h: z + h * s.f(z).subs(z[0], 1), {}, "ask s again, at the other state"),
])  # fmt: skip
def test_wrong_maps_say_so_in_one_sentence(formula, how, said):
    with pytest.raises(BadInput, match=said) as caught:
        wrong(formula, **how)
    text = str(caught.value)
    assert "\n" not in text and "test_one_step_map_refusals.py, line" in text


def test_what_does_not_converge_keeps_its_rows():
    """μ² = x, which sinks below 0 after ten steps."""

    def shrinking(s, z, Z, h):
        moved = Z[:2, :] - z[:2, :] + h * sympy.ones(2, 1)
        return sympy.Matrix([*moved, Z[2] ** 2 - z[0], Z[3] - z[3]])

    s = wrong(shrinking, implicit=True)
    with pytest.raises(StepFailure) as caught:
        s.flow("0.1").trajectory(200, x0=[1, 1], mu0=[1, 0])
    failure = caught.value
    assert failure.rule == "mine" and 5 <= failure.step_index <= 12
    assert len(failure.trajectory.t) == failure.step_index
    assert "u" not in failure.state


def test_an_explicit_map_that_blows_up_keeps_its_rows():
    s = Scheme(scenes.get("henon-heiles"), get("explicit-euler"))
    with pytest.raises(StepFailure, match="no longer finite") as caught:
        s.flow("1").trajectory(200, x0=[1, 1])
    rows = caught.value.trajectory
    assert len(rows.t) > 2 and np.isfinite(rows.mu[:-1]).all()
