"""Whether a rule is its own adjoint is known where Newton finds no stages at a random arrow."""

import pytest
import sympy

from discmech import Scene, Scheme, pair, scenes
from discmech.integrators import rules


@pytest.mark.parametrize(
    ("scene", "rule"),
    [
        ("vortex-pair", "lobatto-3"),  # L is linear in u: no stages at an arrow that no step is
        ("guiding-centre", "gauss-2"),
        pytest.param("argon", "gauss-3", marks=pytest.mark.slow),  # atoms all but at one place
    ],
)
def test_a_symmetric_rule_is_self_adjoint_where_random_arrows_have_no_stages(scene, rule):
    assert Scheme(scenes.get(scene), rules.get(rule)).self_adjoint


@pytest.mark.parametrize("length", [-30, -11, 0, 11, 30])
def test_a_rule_is_not_its_own_adjoint_at_some_length_alone(length):
    """At x = 1 a well of 10⁻¹¹ is flat, and L a free particle's."""
    scale = sympy.Integer(10) ** length
    well = Scene(
        "well", pair(1), lambda x, v, p: v[0] ** 2 / 2 + sympy.exp(-((x[0] / scale) ** 2)),
        x0=[scale], v0=[0],
    )  # fmt: skip
    assert not Scheme(well, rules.rectangle).self_adjoint
    assert Scheme(well, rules.rectangle).order == 1
    assert Scheme(well, rules.trapezoidal).self_adjoint
