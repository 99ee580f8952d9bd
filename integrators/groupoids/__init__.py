"""The groupoids of the paper's section 3.6, each in its own file."""

from .action import ActionGroupoid, action
from .lie_group import LieGroup, lie_group
from .pair import PairGroupoid, pair

__all__ = ["ActionGroupoid", "LieGroup", "PairGroupoid", "action", "lie_group", "pair"]
