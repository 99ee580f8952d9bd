"""A run at rest stays at rest wherever its place is: its corrections are round-off of x."""

import types
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


def resting(turns, name="swing", potential=lambda x: -sympy.cos(x), **more):
    """A swing that hangs at the double nearest to this many turns."""
    of = {"parameters": {"mass": 1}, "x0": [2 * pi * turns], "v0": [0], "duration": 10}
    return Scene(name, pair(1), lambda x, v, p: p.mass * (v[0] ** 2 / 2 - potential(x[0])),
                 **of | more)  # fmt: skip


@pytest.mark.parametrize("step", ["1e-4", "0.01", "0.6", "1.5"])
@pytest.mark.parametrize("turns", [0, 1, 160, 159155])
@pytest.mark.parametrize("rule", RULES)
def test_a_run_at_rest_stays_there(rule, turns, step):
    """x and μ stay within as many round-offs of x as there are steps, 300."""
    run = Scheme(resting(turns), rules.get(rule)).flow(step).trajectory(STEPS)
    unit = STEPS * np.spacing(2 * pi * turns) if turns else 0
    assert abs(run.x - run.x[0]).max() <= unit and abs(run.mu).max() <= unit


def test_the_unit_of_mass_does_not_tell_rest():
    """Slopes of μ and multipliers have its unit, and move x as little as before."""
    for mass in ("1e-6", "1e6"):
        scene = resting(159155, "heavy", parameters={"mass": mass})
        run = Scheme(scene, rules.get("implicit-midpoint")).flow("0.6").trajectory(STEPS)
        assert abs(run.x - run.x[0]).max() <= STEPS * np.spacing(run.x[0, 0])


@pytest.mark.parametrize("mass", [1, 10**6])
@pytest.mark.parametrize("far", [1000, 10**6])
def test_a_weightless_rod_stays_at_rest(far, mass):
    """Corrections of its multiplier are round-off of x times the mass, and do not move x."""
    scene = Scene("rod", pair(2), lambda x, v, p: mass * (v[0] ** 2 + v[1] ** 2) / 2,
                  holonomic=lambda x, p: [(x[0] - far) ** 2 + x[1] ** 2 - 1],
                  x0=[far + Fraction(5, 13), Fraction(-12, 13)], v0=[0, 0],
                  duration=10)  # fmt: skip
    run = Scheme(scene, rules.get("midpoint")).flow("0.6").trajectory(STEPS)
    assert abs(run.x - run.x[0]).max() <= STEPS * np.spacing(1.0 * far)


@pytest.mark.parametrize("rule", ["midpoint", "gauss-2", "implicit-midpoint"])
@pytest.mark.parametrize("step", ["1e-4", "0.1"])
def test_a_slow_swing_far_from_0_is_not_taken_for_rest(rule, step):
    """It moves by less than Newton's corrections at rest, in a step, and still by the right sum."""
    scene = resting(159155, x0=[2 * pi * 159155 + 1e-3], v0=["1e-6"])
    scheme = Scheme(scene, rules.get(rule))
    near, exact = (scheme.flow(step, digits=d).trajectory(STEPS) for d in (16, 40))
    unit = STEPS * np.spacing(1e6)
    assert abs(near.x - exact.x.astype(float)).max() <= unit
    assert abs(near.mu - exact.mu.astype(float)).max() <= unit


@pytest.mark.parametrize("rule", ["midpoint", "gauss-2", "implicit-midpoint"])
def test_an_exported_file_stays_at_rest_too(rule):
    """Its own text of Newton's method and of the sweeps has the same law."""
    file = types.ModuleType("exported")
    exec(Scheme(resting(1), rules.get(rule)).export("numpy"), vars(file))
    xs, mus = file.run(file.begin(), 0.6, STEPS)
    unit = STEPS * np.spacing(2 * pi)
    assert abs(xs - xs[0]).max() <= unit and abs(mus).max() <= unit


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
