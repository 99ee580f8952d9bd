"""A mechanical system as data, and what it declares of itself."""

from .quantities import Conserved, OnGroup, arguments_of, on_group, takes_fourth
from .scene import Scene

__all__ = ["Conserved", "OnGroup", "Scene", "arguments_of", "on_group", "takes_fourth"]
