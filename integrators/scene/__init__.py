"""A mechanical system as data, and what it declares of itself."""

from .quantities import Conserved, OnGroup, arguments_of, on_group, takes_fourth
from .reads import Opaque, reads, remembered
from .scene import Scene

__all__ = [
    "Conserved", "OnGroup", "Opaque", "Scene", "arguments_of", "on_group", "reads", "remembered",
    "takes_fourth",
]  # fmt: skip
