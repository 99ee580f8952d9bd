"""A mechanical system as data, and what it declares of itself."""

from ..errors import BadInput
from ..numbers import refuse_unwritten, short_numbers
from .pickled import Again, again, flow_of
from .quantities import Conserved, OnGroup, arguments_of, on_group, takes_fourth
from .reads import Opaque, reads, remembered
from .scene import Scene

#: the references take from here alone, and share no formula: also how sizes of numbers are refused
__all__ = [
    "Again", "BadInput", "Conserved", "OnGroup", "Opaque", "Scene", "again", "arguments_of",
    "flow_of", "on_group", "reads", "refuse_unwritten", "remembered", "short_numbers",
    "takes_fourth",
]  # fmt: skip
