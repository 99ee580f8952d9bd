"""Runs whose numbers end where no equation needs them: a failure that names step and component."""

import json
from itertools import pairwise

import numpy as np
import pytest
import sympy

from discmech import (
    Lattice,
    LocalGroupoid,
    Scene,
    Scheme,
    StepFailure,
    midpoint,
    one_step,
    pair,
    rectangle,
    trapezoidal,
)
from discmech.integrators import rules
from discmech.integrators.rules import gauss
from discmech.studies.command.output import strict_json
from tests.studies.cached_results import measured


@one_step(order=1, stages=1, name="root", groupoids="pair")
def root(s, z, h, K):
    """Explicit Euler and a root of x, which is no number once x < 0."""
    x, mu = s.split(z)
    new = s.join(x + h * K[0][:1, :] + h**4 * x.applyfunc(sympy.sqrt), mu + h * K[0][1:, :])
    return new, [K[0] - s.f(z)]


FREE = Scene("free", pair(1), lambda x, v, p: v[0] ** 2 / 2, x0=[1], v0=[-1], duration=4)
SCALING = Scene(
    "scaling", LocalGroupoid(
        1, 1, target=lambda x, u, h: [x[0] * sympy.exp(h * u[0])],
        product=lambda x, u, v, h: [u[0] + v[0]], inverse=lambda x, u, h: [-u[0]],
    ), lambda x, v, p: v[0] ** 2 / 2, x0=[1], v0=[50], duration=40,
)  # fmt: skip


@pytest.mark.parametrize("digits", [16, 30])
@pytest.mark.parametrize(("steps", "every"), [(40, 1), (40, 7), (40, 100), (3000, 1000)])
def test_a_map_that_leaves_the_numbers_says_where(steps, every, digits):
    flow = Scheme(FREE, root).flow("1/10", digits)
    for _ in range(2):  # the second time the run is prepared
        with pytest.raises(StepFailure, match=r"finite, first x\[0\] at step 1[012]") as e:
            flow.trajectory(steps, every)
    assert np.isfinite(e.value.trajectory.x.astype(float)).all()
    assert np.isfinite(np.array(e.value.state["x"], dtype=float)).all()


@pytest.mark.sampled
@pytest.mark.parametrize("rule", [midpoint, gauss(2), rules.get("triple-jump:midpoint")],
                         ids=lambda r: r.name)  # fmt: skip
@pytest.mark.parametrize("every", [1, 20, 1000])
def test_an_overflow_of_x_says_where(rule, every):
    flow = Scheme(SCALING, rule).flow("1/10")
    for _ in range(2):
        with pytest.raises(StepFailure, match=r"first x\[0\] at step 141") as failed:
            flow.trajectory(200, every)
        assert len(failed.value.trajectory.t) == 141 // every + 1


def test_a_member_of_an_ensemble_fails_by_itself():
    found = Scheme(FREE, root).flow("1/10").ensemble([[1], [100]], [[-1], [-1]], 40)
    assert list(found.failures) == [0]
    assert np.isfinite(found.x[1]).all()


@pytest.mark.sampled
@pytest.mark.parametrize("rule", [midpoint, trapezoidal, gauss(2)], ids=lambda r: r.name)
@pytest.mark.parametrize("every", [1, 5, 50])
def test_a_site_that_overflows_is_named(rule, every):
    x0, v0 = np.zeros((3, 1)), np.zeros((3, 1))
    x0[1], v0[1] = 1e308, 1e306
    L = Lattice("far", pair(1), 3, on_site=lambda x, v, p: v[0] ** 2 / 2,
                on_bond=lambda x, y, p: 0 * x[0], x0=x0, v0=v0)  # fmt: skip
    with pytest.raises(StepFailure, match=r"first x\[0\] at site 1 at step (79|80)"):
        Scheme(L, rule).flow(1).trajectory(120, every)
    with pytest.raises(StepFailure, match="at site 1"):
        for one, other in pairwise(Scheme(L, rule).flow(1).blocks(120, every, size=3)):
            assert one.t[0] < other.t[0]


def test_a_lattice_with_contact_that_overflows_names_the_site():
    x0, v0 = np.ones((3, 1)), np.zeros((3, 1))
    x0[1], v0[1] = 1e308, 1e306
    L = Lattice("far", pair(1), 3, on_site=lambda x, v, p: v[0] ** 2 / 2,
                on_bond=lambda x, y, p: 0 * x[0], contact=lambda x, p: [x[0]], x0=x0, v0=v0,
                )  # fmt: skip
    with np.errstate(all="ignore"), pytest.raises(StepFailure, match=r"first x\[0\] at site 1"):
        Scheme(L, midpoint).flow(1).trajectory(120, 7)


def test_no_study_passes_a_run_without_numbers():
    found = measured("energy", FREE, root, 16, 1000)
    assert found["verdict"] == "fail" and "no longer finite" in found["reason"]


def test_json_has_no_nan():
    found = json.loads(strict_json({"x": [[float("nan"), 1.0]], "t": float("inf")}),
                       parse_constant=pytest.fail)  # fmt: skip
    assert found == {"x": [[None, 1.0]], "t": None}


LATE = [
    lambda x, v, p: v[0] ** 2 / 2 + x[0] ** 6,
    lambda x, v, p, t: v[0] ** 2 / 2 - x[0] / (2 - t) ** 2,
]


@pytest.mark.parametrize("lagrangian", LATE)
def test_the_time_of_a_failure_begins_at_t0(lagrangian):
    scene = Scene("late", pair(1), lagrangian, x0=[1], v0=[1], duration=5)
    with pytest.raises(StepFailure) as caught:
        Scheme(scene, rectangle).flow("1/8").trajectory(99, t0=1)
    assert caught.value.time == 1 + caught.value.step_index / 8
