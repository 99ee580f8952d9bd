"""The proof: a rigorous bound of the error that a Taylor integration makes."""

from .tube import Enclosed, enclose

__all__ = ["Enclosed", "enclose"]
