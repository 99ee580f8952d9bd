"""A scheme shows its equations in a notebook."""

import pytest
from matplotlib.mathtext import MathTextParser

from discmech import Scene, Scheme, midpoint, pair, scenes
from discmech.integrators import rules
from discmech.integrators.flows.latex import letter


def test_equations_are_those_of_the_scheme():
    shown = Scheme(scenes.get("pendulum"), rules.get("trapezoidal"))._repr_latex_()
    assert shown.startswith("$$") and shown.count("&=") == 4 and r"\mathrm{length}" in shown
    assert r"\mu_{1} &=" in shown and "x_{0}" not in shown


@pytest.mark.parametrize(("scene", "rule"), [
    ("heavy-top", "midpoint"), ("pendulum", "gauss-2"), ("pendulum", "implicit-midpoint"),
    ("cartesian-pendulum", "midpoint"), ("rigid-body", "triple-jump:midpoint"),
])  # fmt: skip
def test_what_is_long_or_has_no_arrows_is_left_out(scene, rule):
    shown = Scheme(scenes.get(scene), rules.get(rule))._repr_latex_()
    assert "l(x, u) &=" in shown and len(shown) < 6000


def test_the_time_is_t():
    shown = Scheme(scenes.get("kapitza-pendulum"), midpoint)._repr_latex_()
    assert r"\mathrm{frequency}\,t" in shown


@pytest.mark.parametrize(("name", "shown"), [
    ("x_1", "x_{1}"), ("omega_0", r"\omega_{0}"), ("ω0", r"\omega_{0}"), ("Λ", r"\Lambda"),
    ("μ′_1", r"\mu'_{1}"), ("a_1_2", "a_{1,2}"), ("f_3[μ_1]", r"f_{3}[\mu_{1}]"),
    ("Delta_max", r"\Delta_{\mathrm{max}}"), ("spring", r"\mathrm{spring}"),
])  # fmt: skip
def test_a_name_is_a_symbol_of_latex(name, shown):
    assert letter(name) == shown


def test_a_parameter_keeps_its_own_number_and_formulas_compile():
    """A number named omega_0 stays so, the entries of a list count from 1; all are typeset."""
    scene = Scene(
        name="named", groupoid=pair(2), x0=[1, 1], v0=[0, 0],
        parameters={"omega_0": 2, "theta": 1, "stiffness": [1, 2], "m2": 1, "mu_1": 3, "c": [[4]]},
        lagrangian=lambda x, v, p: (
            p.theta * v[0] ** 2 + p.m2 * v[1] ** 2 - p.c[0, 0] * p.omega_0**2 * x[0] ** 2
        ) / 2 - p.stiffness[1] * x[1] ** 4 - p.mu_1 * x[0] * x[1],
    )  # fmt: skip
    shown = Scheme(scene, midpoint)._repr_latex_()
    assert r"\omega_{0}^{2}" in shown and r"\mathrm{stiffness}_{2}" in shown and "c_{1,1}" in shown
    assert r"\mathrm{p.mu}_{1}" in shown and r"\mu_{2} &=" in shown and r"\theta\,u" in shown
    lines = shown.splitlines()[1:-1]
    assert len(lines) == 6
    for line in lines:
        MathTextParser("path").parse(f"${line.replace('&', '').removesuffix(chr(92) * 2)}$")
