"""A step by the Legendre maps, against the kernels' own formulas of what it adds to (x, μ)."""

import numpy as np
import pytest

from discmech.integrators import Scheme, rules, scenes
from discmech.integrators.geometry import StepMap


def gaps(scene, rule, altered=False):
    """The largest gaps of x′, μ′ and the derivative of a step, relative to their sizes."""
    flow = Scheme(scenes.get(scene), rules.get(rule)).flow("0.05", digits=40)
    context, run = flow.context, flow.trajectory(2)
    equations, geometry = context.equations, context.geometry
    assert equations.arrows is not None and equations.free is None
    if altered:
        equations = equations.altered("doubled", gain=2 * equations.arrows.gain)
    with context.numbers.working():
        (x, mu), near = context.vectors(run.base[1], run.mu[1]), run.u[1]
        start = geometry.start(x, mu, context.vector(near, len(near)))
        *after, slope = geometry.step(x, mu, start)
        w = geometry.unknowns(x, mu, start)
        u = w[: len(mu)]
        here = geometry.at(x, u)
        grown = StepMap(equations, context.numbers, context.q).growth(x, mu, w)
        one = np.concatenate(after)
        pairs = [
            (one, np.concatenate([x, mu]) + grown),
            (slope.value, geometry.dual_step(here, context.h)),
        ]
        return [np.max(abs(a - b), initial=0) / (1 + np.max(abs(b), initial=0)) for a, b in pairs]


@pytest.mark.dear(but=("trapezoidal",))
@pytest.mark.sampled
@pytest.mark.parametrize("rule", ["trapezoidal", "gauss-2"])
@pytest.mark.parametrize("scene", ["pendulum", "heavy-top", "driven-heavy-top", "rotor-body"])
def test_maps_and_gain_give_one_step_and_arrows_its_derivative(scene, rule):
    assert max(gaps(scene, rule)) < 1e-36


def test_a_wrong_gain_is_seen():
    assert gaps("pendulum", "trapezoidal", altered=True)[0] > 1e-6
