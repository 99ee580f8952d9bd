"""Symmetries of lattices: the natural velocities with which they move a site, one row each."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...errors import BadInput
from ...scene import Scalar, entries_of
from .lattice import Lattice

if TYPE_CHECKING:
    from ...equations import SceneSymbols

Rows = list[list[Scalar]]


def rows_of(answer: object) -> Rows:
    """Return the natural velocities that a symmetry's function gives, one row each."""
    entries = entries_of(answer)
    in_rows = (isinstance(e, list | tuple) or getattr(e, "shape", ()) for e in entries)
    return list(map(entries_of, entries)) if entries and all(in_rows) else [entries]


def check_symmetries(s: SceneSymbols, lattice: Lattice) -> None:
    """Raise `BadInput` unless each symmetry gives natural velocities of a site, one or several."""
    for name, xi in lattice.symmetries.items():
        what = f"the symmetry {name}"
        answer = s.evaluated(xi, what, lattice.shaped(s.x), s.parameters)
        for row in rows_of(answer):
            rates = s.scalars(row, what, xi)
            s.refuse_unknown(rates, {*s.x}, what, xi, "x and p")
            if len(rates) != len(s.mu):
                raise BadInput(f"{lattice.name}: {what} gives {len(rates)} entries; give a list of "
                               f"{len(s.mu)}, a natural velocity, or several.")  # fmt: skip
