"""The claims of a method's author beside its order, which a verdict may contradict."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import BadInput, shown


@dataclass(frozen=True)
class Claims:
    """Claims of a method: symplectic, reversible, and the names of conserved quantities.

    None and () claim nothing: the property is then measured and not judged. keeps: "energy",
    "volume", names of the scene's quantities.
    """

    symplectic: bool | None = None
    reversible: bool | None = None
    keeps: tuple[str, ...] = ()

    @classmethod
    def of(cls, who: str, symplectic: bool | None, reversible: bool | None,
           keeps: str | Sequence[str]) -> Claims:  # fmt: skip
        """Return the claims given to a decorator; raises `BadInput` for those of another kind."""
        for word, claim in (("symplectic", symplectic), ("reversible", reversible)):
            fit = claim is None or (isinstance(claim, int | np.bool_) and claim in (True, False))
            if not fit:  # an array has no truth value that could be compared
                raise BadInput(f"{who}({word}=...): {word} is True or False, not {shown(claim)}.")
        names = (keeps,) if isinstance(keeps, str) else keeps
        if not isinstance(names, list | tuple) or not all(isinstance(e, str) for e in names):
            raise BadInput(
                f"{who}(keeps={shown(keeps)}): give names such as "
                'keeps=("energy", "angular momentum").'
            )
        return cls(symplectic, reversible, tuple(names))
