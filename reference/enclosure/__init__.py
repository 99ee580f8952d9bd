"""The proof: a rigorous bound of the error that a Taylor integration makes."""

from __future__ import annotations

from .tube import Enclosed, enclose

__all__ = ["Enclosed", "enclose"]
