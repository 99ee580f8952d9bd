"""Short runs from the own start are the runs that are begun anew."""

import copy
import pickle
from dataclasses import replace

import numpy as np
import pytest
import sympy

from discmech.integrators import BadInput, Scene, Scheme, StepFailure, pair, rules
from tests.objects import SCENES


def same(one, other):
    return all(
        np.array_equal(getattr(one, name), getattr(other, name))
        for name in ("t", "x", "u", "mu", "iterations", "translates")
    ) and (one.newton_mean, one.newton_max, one.margin, one.solver, one.steps) == (
        other.newton_mean, other.newton_max, other.margin, other.solver, other.steps
    )  # fmt: skip


@pytest.mark.dear("heavy-top-gauss-2")
@pytest.mark.sampled
@pytest.mark.parametrize("rule", ["midpoint", "gauss-2", "suzuki:trapezoidal"])
@pytest.mark.parametrize("scene", ["kepler", "heavy-top", "rigid-body"])
def test_it_is_the_run_begun_anew(scene, rule):
    scheme = Scheme(SCENES[scene], rules.get(rule))
    flow, seen = scheme.flow("0.05"), []
    for steps, every in ((7, 2), (0, 1), (20, 20), (7, 2)):
        run = flow.trajectory(steps, every)
        anew = scheme.flow("0.05").trajectory(steps, every, progress=seen.append)
        assert same(run, anew)
    assert seen


def test_a_run_belongs_to_its_caller():
    flow = Scheme(SCENES["kepler"], rules.get("gauss-2")).flow("0.05")
    first = flow.trajectory(5)
    kept = first.x.copy()
    first.mu[:] = 0
    assert same(flow.trajectory(5), flow.trajectory(5))
    assert np.array_equal(first.x, kept) and flow.trajectory(5).mu.any()


def test_states_are_read_without_the_rest():
    """Its end is at hand in a microsecond or two; what is read twice is one array."""
    flow = Scheme(SCENES["kepler"], rules.get("gauss-3")).flow("0.05")
    read = flow.trajectory(5)
    run = flow.trajectory(5)
    for name in ("mu", "base", "x", "u"):
        assert np.array_equal(getattr(run, name), getattr(read, name))
    assert "newton_mean" not in vars(run) and run.x is run.x and np.shares_memory(run.x, run.base)
    run.x[:] = 7
    assert run.newton_mean == read.newton_mean and (run.x == 7).all()
    assert type(run) is type(read)


@pytest.mark.parametrize("rule", ["gauss-3", "midpoint"])
def test_another_start_goes_the_same_way(rule):
    scheme = Scheme(SCENES["heavy-top"], rules.get(rule))
    flow, rows = scheme.flow("0.05"), scheme.flow("0.05").trajectory(5)
    for row in (2, 4, 0):
        start = {"x0": rows.x[row], "mu0": rows.mu[row]}
        flow.trajectory(4, 2, **start)
        anew = scheme.flow("0.05").trajectory(4, 2, progress=lambda _: None, **start)
        assert same(flow.trajectory(4, 2, **start), anew)
    assert same(flow.trajectory(4, 2), scheme.flow("0.05").trajectory(4, 2))
    with pytest.raises(BadInput, match="truth value"):
        flow.trajectory(4, 2, x0=[True, 0, 0], mu0=rows.mu[0])
    with pytest.raises(BadInput, match="finite"):
        flow.trajectory(4, 2, x0=rows.x[0], mu0=np.inf * rows.mu[0])
    for more in ({"mu0": rows.mu[0]}, {}):
        flow.trajectory(4, 2, x0=rows.x[3], **more)  # |Γ|² is 1 to round-off
        with pytest.raises(BadInput, match="must be 1"):
            flow.trajectory(4, 2, x0=2 * rows.x[0], **more)


@pytest.mark.parametrize("ask", [lambda r: pickle.loads(pickle.dumps(r)), copy.deepcopy, replace])
def test_a_run_that_nobody_has_read_is_a_run(ask):
    flow = Scheme(SCENES["kepler"], rules.get("gauss-3")).flow("0.05")
    read = flow.trajectory(5)
    assert same(read, ask(flow.trajectory(5)))
    assert flow.trajectory(5).solver == "fixed point"
    assert repr(flow.trajectory(5)) == repr(read)
    with pytest.raises(AttributeError, match="nothing"):
        _ = flow.trajectory(5).nothing


def test_a_step_that_fails_is_told_as_ever():
    scene = Scene(
        "edge",
        pair(1),
        lambda x, v, p: v[0] ** 2 / 2 - sympy.sqrt(x[0]) ** 3,
        x0=[1],
        v0=[-9],
    )
    flow = Scheme(scene, rules.get("midpoint")).flow("0.1")
    for _ in range(2):
        with pytest.raises(StepFailure):
            flow.trajectory(50)
