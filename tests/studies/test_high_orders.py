"""Galerkin rules of Gauss and Lobatto and compositions have their orders."""

from __future__ import annotations

import pytest

from discmech.studies.user.assertions import assert_order

ORDERS = {
    "gauss-1": 2, "gauss-2": 4, "gauss-3": 6, "gauss-4": 8,
    "lobatto-2": 2, "lobatto-3": 4, "lobatto-4": 6, "lobatto-5": 8,
    "kahan-li-8:midpoint": 8, "sofroniou-spaletta-10:trapezoidal": 10,
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("scene", ["pendulum", "rigid-body", "heavy-top"])
@pytest.mark.parametrize(("rule", "order"), ORDERS.items())
def test_orders_2_to_10_on_a_pair_groupoid_a_group_and_an_action(scene, rule, order):
    found = assert_order(rule, scene, digits=50, steps=32)
    assert found["expected"]["order"] == order
    assert found["measured"]["order"] == pytest.approx(order, abs=0.05)
