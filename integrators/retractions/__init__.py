"""Retractions τ: g → G near the identity, with their trivialised tangents: one file each."""

from __future__ import annotations

from ..errors import unknown
from .algebra_in_numbers import AlgebraInNumbers
from .cayley import Cayley, cayley
from .exponential import Exponential, exponential
from .retraction import EquivariantRetraction, Extents, Retraction

__all__ = [
    "AlgebraInNumbers", "BUILT_IN", "Cayley", "EquivariantRetraction", "Exponential",
    "Extents", "Retraction", "cayley", "exponential", "get",
]  # fmt: skip


BUILT_IN: dict[str, Retraction] = {r.name: r for r in (cayley, exponential)}


def get(name: str) -> Retraction:
    """The retraction of that name; raises `BadInput` naming the nearest ones."""
    if name in BUILT_IN:
        return BUILT_IN[name]
    raise unknown("retraction", name, BUILT_IN)
