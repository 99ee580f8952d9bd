"""A run at rest stays at rest wherever its place is: its corrections are round-off of x."""

from fractions import Fraction
from math import pi

import numpy as np
import pytest
import sympy

from discmech.integrators import Scene, Scheme, StepFailure, pair, rules

STEPS = 300
#: explicit, implicit, by Newton's method, by a fixed point, composed, a one-step map
RULES = ("trapezoidal", "midpoint", "gauss-2", "gauss-4", "kahan-li-8:trapezoidal",
         "triple-jump:midpoint", "implicit-midpoint")  # fmt: skip


def resting(turns, name="swing", potential=lambda x: -sympy.cos(x)):
    """A swing that hangs at the double nearest to this many turns."""
    return Scene(name, pair(1), lambda x, v, p: v[0] ** 2 / 2 - potential(x[0]),
                 x0=[2 * pi * turns], v0=[0], duration=10)  # fmt: skip


@pytest.mark.parametrize("step", ["1e-4", "0.01", "0.6", "1.5"])
@pytest.mark.parametrize("turns", [0, 1, 160, 159155])
@pytest.mark.parametrize("rule", RULES)
def test_a_run_at_rest_stays_there(rule, turns, step):
    """x and μ stay within as many round-offs of x as there are steps, 300."""
    run = Scheme(resting(turns), rules.get(rule)).flow(step).trajectory(STEPS)
    unit = STEPS * np.spacing(2 * pi * turns) if turns else 0
    assert abs(run.x - run.x[0]).max() <= unit and abs(run.mu).max() <= unit


def test_a_run_at_rest_stays_there_to_thirty_digits():
    """The same with numbers of another round-off."""
    start = Fraction(str(sympy.N(2 * sympy.pi, 30)))
    scene = resting(1).with_values(name="exactly", x0=[start])
    run = Scheme(scene, rules.get("midpoint")).flow("0.6", digits=30).trajectory(60)
    assert max(abs(run.x[:, 0] - run.x[0, 0])) < 1e-27


def test_a_step_without_solution_still_fails():
    """Newton's corrections that are larger than round-off of x/h are no rest."""
    scene = resting(1, "cliff", lambda x: -(x**3) / 3)  # u − h/2 (x + hu/2)² has no zero
    with pytest.raises(StepFailure, match="did not converge"):
        Scheme(scene, rules.get("midpoint")).flow("1.5").trajectory(STEPS)
