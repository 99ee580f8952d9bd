"""The groupoids of the paper's section 3.6, each in its own file."""

from __future__ import annotations

from ..numbers.types import Function
from .action import ActionGroupoid, Attitude, RowAction, action
from .axioms import check_axioms
from .chart_margin import margin_of
from .clocked import Clocked, clock
from .connection import ConnectionGroupoid
from .groupoid import Groupoid, Motion
from .lie_group import LieGroup, RetractionGroupoid, lie_group
from .local import LocalGroupoid
from .pair import PairGroupoid, pair
from .product import ProductGroupoid
from .translates import GroupChart

__all__ = [
    "ActionGroupoid", "Attitude", "Clocked", "ConnectionGroupoid", "GroupChart", "Groupoid",
    "LieGroup", "LocalGroupoid", "Motion", "PairGroupoid", "ProductGroupoid", "RetractionGroupoid",
    "RowAction", "action", "check_axioms", "clock",
    "lie_group", "margin_of", "pair", "product",
]  # fmt: skip


def product(
    first: Groupoid, second: Groupoid, *, connection: Function | None = None
) -> ProductGroupoid:
    """Return the product of two groupoids; product(pair(n), lie_group(g)) carries L on TM × g.

    `connection` (for pair × group only) takes the column x and returns the k×n matrix A(x) of a
    principal connection, k = dim g. The fibre coordinates are then (ẋ, η) with η = ξ + A(x)ẋ, the
    vertical part of the velocity, in which the Lagrange–Poincaré equations are written: see
    `ConnectionGroupoid`. Raises `BadInput` for anything else.
    """
    if connection is None:
        return ProductGroupoid(first, second)
    return ConnectionGroupoid(first, second, connection)
