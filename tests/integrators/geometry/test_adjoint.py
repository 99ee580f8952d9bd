"""Whether a rule is its own adjoint is known where Newton finds no stages at a random arrow."""

import pytest

from discmech import Scheme, scenes
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
