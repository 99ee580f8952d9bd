"""Runs from the start that the last run had: nothing of one run is seen in another."""

import copy
import pickle
from dataclasses import fields, replace

import numpy as np
import pytest

from discmech.integrators import Scheme, rules
from tests.objects import SCENES

COLUMNS = ("t", "x", "u", "mu", "iterations", "translates")


def same(one, other):
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in COLUMNS) and (
        one.newton_mean, one.newton_max, one.margin, one.solver, one.steps
    ) == (other.newton_mean, other.newton_max, other.margin, other.solver, other.steps)  # fmt: skip


@pytest.mark.sampled
@pytest.mark.parametrize("rule", ["midpoint", "gauss-3", "suzuki:trapezoidal"])
@pytest.mark.parametrize("scene", ["kepler", "rigid-body"])
def test_it_is_the_run_begun_anew(scene, rule):
    scheme = Scheme(SCENES[scene], rules.get(rule))
    flow, rows = scheme.flow("0.05"), scheme.flow("0.05").trajectory(5)
    elsewhere = {"x0": rows.x[2], "mu0": rows.mu[2]}
    for steps, every, start in (
        (7, 2, {}), (0, 1, {}), (20, 20, elsewhere), (20, 20, {}), (7, 2, elsewhere), (7, 2, {})
    ):  # fmt: skip
        anew = scheme.flow("0.05").trajectory(steps, every, **start)
        assert same(flow.trajectory(steps, every, **start), anew)


def test_a_run_belongs_to_its_caller():
    flow = Scheme(SCENES["kepler"], rules.get("gauss-2")).flow("0.05")
    first = flow.trajectory(5)
    kept = first.x.copy()
    first.mu[:] = 0
    assert same(flow.trajectory(5), flow.trajectory(5))
    assert np.array_equal(first.x, kept) and flow.trajectory(5).mu.any()


def test_states_are_read_without_the_rest():
    flow = Scheme(SCENES["kepler"], rules.get("gauss-3")).flow("0.05")
    run = flow.trajectory(5)
    assert run.x is run.x and np.shares_memory(run.x, run.base)
    assert "newton_mean" not in vars(run)
    run.x[:] = 7
    assert run.newton_mean == flow.trajectory(5).newton_mean and (run.x == 7).all()
    with pytest.raises(AttributeError, match="nothing"):
        _ = run.nothing


@pytest.mark.parametrize("ask", [lambda r: pickle.loads(pickle.dumps(r)), copy.deepcopy, replace])
def test_a_run_that_nobody_has_read_is_a_run(ask):
    flow = Scheme(SCENES["kepler"], rules.get("gauss-3")).flow("0.05")
    made = ask(flow.trajectory(5))
    assert same(made, flow.trajectory(5)) and {f.name for f in fields(made)} <= {*vars(made)}
    assert repr(flow.trajectory(5)) == repr(flow.trajectory(5))
