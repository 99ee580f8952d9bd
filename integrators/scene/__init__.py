"""A mechanical system as data, and what it declares of itself."""

from .pickled import Again, again, flow_of
from .quantities import Conserved, OnGroup, arguments_of, on_group, takes_fourth
from .reads import Opaque, reads, remembered
from .scene import Scene

__all__ = [
    "Again", "Conserved", "OnGroup", "Opaque", "Scene", "again", "arguments_of", "flow_of",
    "on_group", "reads", "remembered", "takes_fourth",
]  # fmt: skip
