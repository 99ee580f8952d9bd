"""A scheme shows its equations in a notebook."""

import pytest

from discmech import Scheme, midpoint, scenes
from discmech.integrators import rules


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
