"""Rows of a step have the round-off of all their terms, and a step ends where only that is left."""

import numpy as np
import pytest
from sympy import Rational

from discmech.integrators import Scene, Scheme, StepFailure, pair, rules, scenes
from discmech.integrators.compiler.kernels import kernel_text, names_of
from discmech.integrators.compiler.module_text import CAREFUL
from discmech.integrators.numbers import arithmetic

ROWS = [
    ("cartesian-pendulum", "trapezoidal"), ("rolling-disc", "midpoint"), ("kepler", "midpoint"),
    ("moser-veselov", "midpoint"), ("heavy-top", "gauss-2"), ("pendulum", "gauss-2"),
    ("suslov", "midpoint"), ("wong", "trapezoidal"), ("rigid-body", "midpoint"),
]  # fmt: skip


@pytest.mark.dear("heavy-top", "wong")
@pytest.mark.parametrize(("scene", "rule"), ROWS)
def test_a_row_is_off_by_less_than_its_bound_and_not_by_much_less(scene, rule):
    scheme = Scheme(scenes.get(scene), rules.get(rule))
    flow, random = scheme.flow("0.01"), np.random.default_rng(5)
    q = [float(e) for e in flow.machine.qs[0]]
    text, parts = kernel_text(flow.system, frozenset({CAREFUL})), []
    for scale in np.geomspace(0.1, 100, 12):
        x = np.array(scheme.scene.x0, float) + scale * random.normal(size=len(flow.system.x))
        letters = (random.normal(size=len(e)) for e in (flow.system.w, flow.system.mu))
        places, values = [x, *letters], []
        for numbers in (arithmetic(16), arithmetic(40)):
            with numbers.working():
                names = names_of(text, numbers)
                at = [tuple(map(numbers.number, map(float, e))) for e in places]
                c = names["prepare"]([numbers.number(e) for e in q])
                values.append([np.array(e) for e in names["rounding"](*at, c)])
        (rows, bounds), (exact, _) = values
        assert (abs(exact - rows) <= 2.0**-53 * bounds).all()
        parts += list(abs(exact - rows)[bounds > 0] / (2.0**-53 * bounds[bounds > 0]))
    assert max(parts) > 0.001


def pendulum(away, expanded):
    """In Cartesian coordinates, `away` lengths from the origin."""

    def on_circle(x, p):
        square = x[0] ** 2 - 2 * away * x[0] + away**2
        return [(square if expanded else (x[0] - away) ** 2) + x[1] ** 2 - 1]

    return Scene(
        "far", pair(2), lambda x, v, p: (v[0] ** 2 + v[1] ** 2) / 2 - x[1], holonomic=on_circle,
        x0=[away + 1, 0], v0=[0, 0], duration=10,
    )  # fmt: skip


@pytest.mark.sampled
@pytest.mark.parametrize("digits", [16, 20])
@pytest.mark.parametrize(
    ("away", "expanded"), [(30_000, False), (3_000_000, False), (300, True), (30_000, True)]
)
def test_a_constraint_far_away_is_solved_to_its_own_round_off(away, expanded, digits):
    steps, size = (300, 10 ** (digits - 16) * away) if digits == 16 else (20, 1000 * away)
    exact, run = (
        Scheme(pendulum(n, expanded), rules.get("midpoint")).flow("0.01", digits).trajectory(steps)
        for n in (0, size)
    )
    # the round-off of a row, ε away or ε away², over its slope, as a walk of the steps that is
    # summed twice: 2 steps^1.5
    row = 10.0**-digits * size ** (2 if expanded else 1)
    off = np.abs(np.array(run.x - [size, 0] - exact.x, float)).max()
    assert off < 2 * steps**1.5 * row


@pytest.mark.slow
def test_no_step_of_a_long_run_is_lost_to_small_components_that_are_round_off():
    flow = Scheme(pendulum(30_000, True), rules.get("midpoint")).flow("0.0001")
    run = flow.trajectory(834_400, every=834_400)  # one of them did not end at the 834,317th
    assert abs(float(np.hypot(run.x[-1, 0] - 30_000, run.x[-1, 1])) - 1) < 1e-6


@pytest.mark.parametrize("away", [0, 30_000])
def test_a_step_without_a_solution_is_none_far_away(away):
    """In a step of 3 one falls below the circle, and the force at its start is level."""
    flow = Scheme(pendulum(away, False), rules.get("midpoint")).flow(3)
    with pytest.raises(StepFailure, match="did not converge at step 0"):
        flow.trajectory(3)


def test_a_step_of_a_chain_far_away_is_made_again_to_its_round_off():
    """Its rows are solved from unknowns of 0, where products with them hide their round-off."""
    far = 10**6
    chain = Scene(
        "chain", pair(4), lambda x, v, p: v.dot(v) / 2 - x[1] - x[3],
        holonomic=lambda x, p: [(x[0] - far) ** 2 + x[1] ** 2 - 1,
                                (x[2] - x[0]) ** 2 + (x[3] - x[1]) ** 2 - 1],
        x0=[far + Rational(3, 5), -Rational(4, 5), far + Rational(8, 5), -Rational(4, 5)],
        v0=[0, 0, 0, 0],
    )  # fmt: skip
    flow = Scheme(chain, rules.get("midpoint")).flow("0.005")
    run = flow.trajectory(40)
    for k in range(0, 40, 8):
        assert flow.poisson_defect(run.x[k], run.mu[k]) < 1e-30
