"""A rule whose coefficients come from the scene's start: one order along its motion, one beside."""

import pytest
import sympy

from discmech import one_step, scenes
from tests.studies.cached_results import measured

START = scenes.get("pendulum")
ALONG = "is of order 4.00 along the motion of the scene and of order 2.00 beside it"


def classical(s, z, h):
    k1 = s.f(z)
    k2 = s.f(z + h * k1 / 2)
    k3 = s.f(z + h * k2 / 2)
    k4 = s.f(z + h * k3)
    return z + h * (k1 + 2 * k2 + 2 * k3 + k4) / 6


@one_step(order=4, groupoids="pair")
def of_the_start(s, z, h):
    """Its h³ vanishes at the energy of the start."""
    start = s.join(sympy.Matrix(START.x0), sympy.zeros(1, 1))
    return classical(s, z, h) + h**3 * (s.H(z) - s.H(start)) * s.f(z) / 8


@one_step(order=4, groupoids="pair")
def small(s, z, h):
    """Its h³ is everywhere, and too small for a run of 16 digits to show."""
    return classical(s, z, h) + h**3 * s.f(z) / 10**14


@pytest.mark.slow
@pytest.mark.parametrize(("rule", "told"), [(of_the_start, True), (small, False)])
def test_orders_along_the_motion_and_beside_it_are_both_told(rule, told):
    found = measured("order", START, rule, 16, 100)
    assert found["verdict"] == "fail" and "one step is of order 2.00" in found["reason"]
    assert found["measured"]["order"] == pytest.approx(4, abs=0.05)
    assert (ALONG in found["reason"]) == told
