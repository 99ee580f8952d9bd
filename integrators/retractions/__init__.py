"""Retractions τ: g → G near the identity, with their trivialised tangents: one file each."""

from __future__ import annotations

from ..errors import unknown
from .cayley import Cayley, cayley
from .exponential import Exponential, exponential
from .implicit_product import AlgebraInNumbers
from .retraction import EquivariantRetraction, Retraction

__all__ = [
    "AlgebraInNumbers", "BUILT_IN", "Cayley", "EquivariantRetraction", "Exponential",
    "Retraction", "cayley", "exponential", "get",
]  # fmt: skip


BUILT_IN: dict[str, Retraction] = {r.name: r for r in (cayley, exponential)}


def get(name: str) -> Retraction:
    """The retraction of that name; raises `BadInput` naming the nearest ones."""
    if name in BUILT_IN:
        return BUILT_IN[name]
    raise unknown("retraction", name, BUILT_IN)
