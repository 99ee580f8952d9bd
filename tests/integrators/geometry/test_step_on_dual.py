"""A rule's step as a map of (x, μ), which all equations have, against that along its arrows."""

import numpy as np
import pytest

from discmech.integrators import Scheme, rules, scenes
from discmech.integrators.flows import arrow_from, step_along
from discmech.integrators.geometry import OneStepGeometry


def gaps(scene, rule, altered=False):
    """The largest gaps of x′, μ′ and the derivative of a step, relative to their sizes."""
    flow = Scheme(scenes.get(scene), rules.get(rule)).flow("0.05", digits=40)
    context, run = flow.context, flow.trajectory(2)
    equations = context.equations
    assert equations.arrows is not None and equations.free is None
    if altered:
        equations = equations.altered("doubled", gain=2 * equations.arrows.gain)
    with context.numbers.working():
        (x, mu), near = context.vectors(run.base[1], run.mu[1]), run.u[1]
        u = arrow_from(context, x, mu, context.vector(near, len(near)))
        wanted = step_along(context, context.maps_at(x, u))
        rows = OneStepGeometry(equations, context.numbers, context.q)
        start = np.concatenate([u, context.geometry.stages(x, u)])
        *found, slope = rows.step(x, mu, start)
        pairs = zip([*found, slope.value], wanted, strict=True)
        return [np.max(abs(a - b), initial=0) / (1 + np.max(abs(b), initial=0)) for a, b in pairs]


@pytest.mark.dear(but=("trapezoidal",))
@pytest.mark.sampled
@pytest.mark.parametrize("rule", ["trapezoidal", "gauss-2"])
@pytest.mark.parametrize("scene", ["pendulum", "heavy-top", "driven-heavy-top", "rotor-body"])
def test_rows_and_arrows_give_one_step_and_one_derivative(scene, rule):
    assert max(gaps(scene, rule)) < 1e-36


def test_a_wrong_gain_is_seen():
    assert min(gaps("pendulum", "trapezoidal", altered=True)[1:]) > 1e-6
