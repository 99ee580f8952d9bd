"""The study of lattices whose bonds have constraints: linkages, and faults that it has to see."""

from dataclasses import replace

import numpy as np
import pytest
import sympy

from discmech import Lattice, Scheme, pair, trapezoidal
from discmech.integrators.extensions.lattices import LatticeRun, RestrictedStep, poisson_defect
from discmech.integrators.extensions.lattices import scenes as systems
from discmech.integrators.rules import get
from discmech.studies import get as get_study
from discmech.studies.core.case import Case, Choice
from discmech.studies.core.result import result_of
from discmech.studies.lattices import STUDY, measuring
from discmech.studies.symplecticity.limits import LIMITS
from discmech.studies.systems import reference, residual
from discmech.studies.systems.joints import Joints
from discmech.studies.systems.residual import step_defects
from tests.studies.as_json import run_case

EPS = 2.0**-53
RODS = Scheme(systems.get("rods"), trapezoidal)


def a_row(scheme, steps=40):
    """(flow, x, μ) of a row of a run."""
    flow = scheme.flow("1/50")
    run = flow.trajectory(steps, steps)
    return flow, run.x[-1], run.mu[-1]


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    ["rods", *(pytest.param(e, marks=pytest.mark.slow)
               for e in ("links-spherical", "links-revolute"))],
)  # fmt: skip
def test_a_linkage_passes(name):
    measured = {}
    for study in ("order", "energy", "momentum", "symplecticity"):
        steps = None if study == "order" else 400
        case = Case(study, systems.get(name), trapezoidal, 16, steps)
        if study == "momentum" and not get_study(study).cases(Choice(scenes=(case.scene,))):
            continue
        found = run_case(get_study(study), case)
        assert found["verdict"] == "pass", found["reason"]
        measured |= found["measured"]
    assert measured["held_against"] == "equations of motion" and abs(measured["order"] - 2) < 0.05
    assert measured["poisson"] < 1e-15
    assert max(measured[key] for key in ("residual", "constraint", "hidden")) < EPS
    assert ("vertical angular momentum" in (measured["drift"] if "rate" in measured else ())) == (
        name != "links-revolute"
    )


def test_the_derivative_is_that_of_the_step():
    flow, x, mu = a_row(RODS)
    step, delta = RestrictedStep(flow, x, mu), 1e-5
    b, dmu = step.tangent(np.random.default_rng(2))
    ends = []
    for sign in (delta, -delta):
        run = LatticeRun(flow, x + sign * b, mu + sign * dmu)
        run.advance(1)
        run.checked(run.show())
        ends.append((run.x.copy(), run.mu.copy()))
    for found, one, other in zip(step.applied((b, dmu)), *ends, strict=True):
        assert abs((one - other) / (2 * delta) - found).max() < 1e-7


def test_a_wrong_derivative_is_seen():
    """A control on pairs: the arrow is a millionth too long."""
    step = RestrictedStep(*a_row(RODS))
    assert poisson_defect(step, 2, 0) < 1e-15
    step.h *= 1 + 1e-6
    assert poisson_defect(step, 2, 0) > 1e-10


@pytest.mark.slow
def test_a_flipped_bracket_is_seen():
    flow, x, mu = a_row(Scheme(systems.get("links-spherical"), trapezoidal))
    assert flow.poisson_defect(x, mu, bracket_sign=-1) > 1e-4


@pytest.mark.slow
def test_a_solver_that_ends_early_is_seen(monkeypatch):
    listed = replace(systems.get("rods"), bonds=systems.get("rods").pairs)
    at = a_row(Scheme(listed, trapezoidal))
    assert max(step_defects(*at).values()) < EPS
    monkeypatch.setattr(
        "discmech.integrators.extensions.lattices.sparse_steps.SparseSteps.eps", 1e-2
    )
    # momenta are linear in (u, λ), so one correction solves for them
    assert step_defects(*at)["constraint"] > 1e3 * LIMITS["step"] * EPS


@pytest.mark.dear("[100]")
@pytest.mark.parametrize("power", [-12, 100])
def test_what_is_off_by_a_millionth_is_seen_in_any_unit_of_action(monkeypatch, power):
    rods, unit = systems.get("rods"), sympy.Integer(10) ** power
    at = a_row(Scheme(replace(rods, on_site=lambda *at: unit * rods.on_site(*at)), trapezoidal))
    assert max(step_defects(*at).values()) < LIMITS["step"] * EPS
    summed, projected = residual._summed, LatticeRun.projected

    def off(run):
        v, impulses = projected.fget(run)
        return v + 1e-6 * abs(v).max() * np.random.default_rng(1).normal(size=v.shape), impulses

    with monkeypatch.context() as m:
        m.setattr(residual, "_summed", lambda f, x, w, *rest: summed(f, x, w * (1 + 1e-6), *rest))
        assert step_defects(*at)["residual"] > 1e3 * LIMITS["step"] * EPS
    monkeypatch.setattr(LatticeRun, "projected", property(off))
    assert step_defects(*at)["hidden"] > 1e3 * LIMITS["step"] * EPS


def test_rods_of_another_length_and_other_velocities_are_seen():
    _, x, _ = a_row(RODS)
    v = np.random.default_rng(1).normal(size=x.shape)
    stretched, across = Joints(RODS, RODS.lattice.free).missed((x * (1 + 1e-9), abs(x)), v, 1.0)
    assert min(stretched, across) > 1e3 * LIMITS["step"] * EPS


def test_what_errors_are_held_against_is_said(monkeypatch):
    """Where the equations of motion are not followed, a method is held against itself."""
    monkeypatch.setattr(reference, "MOST", 10)
    order = get_study("order")
    found = run_case(order, Case("order", systems.get("rotors"), trapezoidal, 16))
    assert found["measured"]["held_against"] == "its own runs"
    assert "not followed" in found["measured"]["why_not"]
    assert "(against its own runs)" in dict(order.view.columns)["Order"](result_of("order", found))


def test_what_begins_at_rest_at_the_origin_is_held_against_its_equations():
    """Such a start has no size of its own: two sites that fall side by side, x = -t²/2."""
    falling = Lattice(
        name="falling",
        site=pair(1),
        sites=2,
        on_site=lambda x, v, p: v[0] ** 2 / 2 - x[0],
        on_bond=lambda x, y, p: -((y[0] - x[0]) ** 2) / 2,
        x0=np.zeros((2, 1)),
        v0=np.zeros((2, 1)),
    )
    x, mu, known = reference.solution(Scheme(falling, trapezoidal), 2.0)
    assert np.allclose(x, -2, rtol=2 * known) and np.allclose(mu, -2, rtol=2 * known)


def test_rules_that_constraints_do_not_take_are_left_out_with_a_note():
    mine = replace(systems.get("rods"), name="mine")
    rules = [case.rule.name for case in measuring.cases(Choice(scenes=(mine,)))]
    assert rules == ["trapezoidal", "midpoint"]
    (said,) = STUDY.notes(Choice(scenes=(mine,)))
    assert "mine has constraints" in said and "gauss-2 is left out" in said
    assert not STUDY.notes(Choice(scenes=(mine,), rules=(get("gauss-2"),)))
    assert not STUDY.notes(Choice(scenes=(systems.get("rods"),)))
