"""Proofs of order: for every Lagrangian of a class, not for a scene (docs/proofs.md)."""

from .proving import prove
from .result import Answer, Result

__all__ = ["Answer", "Result", "prove"]
