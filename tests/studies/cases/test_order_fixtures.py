"""The assertions of orders: an order that is asked for may only add a failure."""

from __future__ import annotations

import pytest

from discmech.integrators import scenes
from discmech.studies.user.assertions import Missed, assert_converges, assert_order
from tests.imports import ROOT

ATTACKS = str(ROOT / "docs/attacks/")


@pytest.mark.parametrize(
    ("rule", "scene", "digits"),
    [
        pytest.param("attacks.py:slightly_wrong", "pendulum", 50, marks=pytest.mark.slow),
        ("attacks.py:slightly_wrong", "pendulum", 16),
        pytest.param("attacks.py:wrong_in_one", "kepler", 50, marks=pytest.mark.slow),
        pytest.param("attacks.py:gauged", "attacks.py:whole_period", 50, marks=pytest.mark.slow),
    ],
)
def test_a_slope_that_fits_buys_no_order(rule, scene, digits):
    scene = f"{ATTACKS}/{scene}" if scene.endswith("whole_period") else scene
    with pytest.raises(Missed, match=r"one step is of order 1\.00 in"):
        assert_order(f"{ATTACKS}/{rule}", scene, 2, digits=digits)


def test_what_is_not_consistent_does_not_converge():
    with pytest.raises(Missed, match="not consistent"):
        assert_converges(f"{ATTACKS}/order.py:heavy", "pendulum", digits=16)


def test_the_order_that_a_sound_rule_has_is_no_failure():
    found = assert_order(f"{ATTACKS}/order.py:nested", "pendulum", 2)
    assert found["local"]["order"] == pytest.approx(2, abs=1e-3)
    with pytest.raises(Missed, match="the test asks for 4"):
        assert_order("midpoint", "pendulum", 4)
    assert assert_converges("midpoint", scenes.get("pendulum"))["verdict"] == "pass"
