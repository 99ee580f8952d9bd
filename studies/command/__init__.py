"""The command `discmech`."""

from .entry import main

__all__ = ["main"]
