"""Galerkin rules of Gauss and Lobatto and compositions have their orders."""

from __future__ import annotations

import pytest

from discmech.studies.evidence.order import NEAR
from discmech.studies.user.assertions import assert_order

ORDERS = {f"gauss-{s}": 2 * s for s in range(1, 9)} | {
    "lobatto-2": 2, "lobatto-3": 4, "lobatto-4": 6, "lobatto-5": 8,
    "kahan-li-8:midpoint": 8, "sofroniou-spaletta-10:trapezoidal": 10,
}  # fmt: skip
#: the more of them the finer the line is: at order 16 a halving of the step takes five
DIGITS = {f"gauss-{s}": 80 for s in range(5, 9)}


@pytest.mark.slow
@pytest.mark.parametrize("scene", ["pendulum", "rigid-body", "heavy-top", "rotor-body"])
@pytest.mark.parametrize(("rule", "order"), ORDERS.items())
def test_orders_2_to_16_on_a_pair_groupoid_a_group_an_action_and_a_product(scene, rule, order):
    found = assert_order(rule, scene, digits=DIGITS.get(rule, 50))
    assert found["expected"]["order"] == order
    # at a drawn place the constant of a component may be so small that the next power shows too
    assert found["expected"]["local_order"] == pytest.approx(order, abs=NEAR)
    assert found["measured"]["order"] == pytest.approx(order, abs=0.01)
