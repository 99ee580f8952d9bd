"""The groupoids of the paper's section 3.6, each in its own file."""

from .action import ActionGroupoid, action
from .groupoid import Groupoid
from .lie_group import LieGroup, lie_group
from .local import LocalGroupoid
from .pair import PairGroupoid, pair
from .product import ProductGroupoid, product

__all__ = [
    "ActionGroupoid",
    "Groupoid",
    "LieGroup",
    "LocalGroupoid",
    "PairGroupoid",
    "ProductGroupoid",
    "action",
    "lie_group",
    "pair",
    "product",
]
