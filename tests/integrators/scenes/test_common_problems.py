"""The scenes that other codes are compared on: their data, motions and quantities."""

from types import SimpleNamespace

import numpy as np
import pytest
import sympy

from discmech import Scheme, scenes, solution
from discmech.integrators.rules import get
from discmech.integrators.scenes import COMMON
from discmech.integrators.scenes.abc_flow import field

SLOW = {"argon", "pleiades", "water"}  # whose references take seconds


@pytest.mark.dear(but=("mathews",))
@pytest.mark.parametrize("name", [
    pytest.param(n, marks=pytest.mark.slow if n in SLOW else ())
    for n in COMMON
    if n != "pythagorean"
])  # fmt: skip
def test_the_reference_and_a_run_agree(name):
    """By Gauss collocation with three nodes, in a tenth of the duration; momenta are kept.

    The Pythagorean problem has encounters that no equal steps resolve: see the tests of steps.
    """
    scene = scenes.get(name)
    rule = get("gauss-3" if scene.has_lagrangian else "dual-gauss-3")
    steps = scene.steps_for(scene.step) // 10
    scheme = Scheme(scene, rule)
    run = scheme.flow(scene.step).trajectory(steps, steps)
    wanted = solution(scene, steps * scene.step, digits=20, proof=False)
    for found, exact in ((run.x[-1], wanted.x), (run.mu[-1], wanted.mu)):
        exact = np.array(exact, float)
        assert np.abs(found - exact).max() < 1e-8 * np.abs(exact).max()
    for quantity in scene.symmetries:
        ends = [quantity.formula(*(sympy.Matrix(e[k]) for e in (run.x, run.mu)), None)
                for k in (0, -1)]  # fmt: skip
        ends = [np.array(sympy.Matrix([e]), float) for e in ends]
        assert np.abs(ends[1] - ends[0]).max() < 1e-12 * np.abs(run.mu).max()


def test_argon_has_the_published_energy():
    """H₀/k_B = −1260.2 K (Hairer, Lubich, Wanner, I.4.4)."""
    scene = scenes.get("argon")
    x, v = (sympy.Matrix(part) for part in (scene.x0, scene.v0))
    p = SimpleNamespace(**scene.parameters)
    assert float(p.mass * v.dot(v) - scene.lagrangian(x, v, p)) == pytest.approx(-1260.2, abs=0.05)
    assert sum(scene.v0[::2]) == sum(scene.v0[1::2]) == 0


def test_the_abc_flow_has_no_divergence():
    scene = scenes.get("abc-flow")
    x, p = sympy.Matrix(sympy.symbols("x:3")), SimpleNamespace(A=1, B=2, C=3)
    assert sum(e.diff(z) for e, z in zip(field(x, p), x, strict=True)) == 0
    assert not scene.has_lagrangian and scene.name not in scenes.names()


def test_arenstorf_in_the_turning_frame():
    """Its Lagrangian has the magnetic term of the frame and the centrifugal potential."""
    scene = scenes.get("arenstorf")
    x, v = (sympy.Matrix(sympy.symbols(f"{e}:2", real=True)) for e in "xv")
    m = sympy.Symbol("m")
    turned = x[0] * v[1] - x[1] * v[0]
    potential = (1 - m) / sympy.sqrt((x[0] + m) ** 2 + x[1] ** 2)
    potential += m / sympy.sqrt((x[0] - 1 + m) ** 2 + x[1] ** 2)
    wanted = (v.dot(v) + x.dot(x)) / 2 + turned + potential
    assert sympy.expand(scene.lagrangian(x, v, SimpleNamespace(moon=m)) - wanted) == 0
