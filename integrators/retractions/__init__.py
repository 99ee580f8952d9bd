"""Retractions τ: g → G near the identity, with their trivialised tangents: one file each."""

from __future__ import annotations

from difflib import get_close_matches

from ..errors import BadInput
from .cayley import Cayley, cayley
from .exponential import Exponential, exponential
from .retraction import Retraction

__all__ = ["BUILT_IN", "Cayley", "Exponential", "Retraction", "cayley", "exponential", "get"]

BUILT_IN: dict[str, Retraction] = {r.name: r for r in (cayley, exponential)}


def get(name: str) -> Retraction:
    """The retraction of that name; raises `BadInput` naming the nearest ones."""
    if name in BUILT_IN:
        return BUILT_IN[name]
    near = get_close_matches(name, BUILT_IN, 1)
    hint = f"did you mean {near[0]}?" if near else f"there are {', '.join(BUILT_IN)}."
    raise BadInput(f'there is no retraction "{name}": {hint}')
