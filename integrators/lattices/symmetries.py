"""Symmetries of lattices: the natural velocities with which they move a site, one row each."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..errors import BadInput
from ..numbers import sympy
from ..scene import Parameters, Point, Scalar, entries_of
from .lattice import Lattice

if TYPE_CHECKING:
    from ..equations import SceneSymbols

Rows = list[list[Scalar]]


def rows_of(given: object) -> Rows:
    """Return the natural velocities that a symmetry's function gives, one row each."""
    entries = entries_of(given)
    return entries if entries and isinstance(entries[0], list) else [entries]


def check_symmetries(s: SceneSymbols, lattice: Lattice) -> None:
    """Raise `BadInput` unless each symmetry gives natural velocities of a site, one or several."""
    for name, xi in lattice.symmetries.items():
        what = f"the symmetry {name}"
        given = s.evaluated(xi, what, lattice.shaped(s.x), s.parameters)
        for row in rows_of(given):
            found = s.scalars(row, what, xi)
            s.refuse_unknown(found, {*s.x}, what, xi, "x and p")
            if len(found) != len(s.mu):
                raise BadInput(f"{lattice.name}: {what} gives {len(found)} entries; give a list of "
                               f"{len(s.mu)}, a natural velocity, or several.")  # fmt: skip


def along(x: Point, p: Parameters) -> list[Scalar]:
    """Return the velocity of a shift, for points on a line."""
    return [sympy.Integer(1)]


def turns_of_attitude(g: Point, p: Parameters) -> Rows:
    """Return the velocities Rᵀe_k of the turns of space, for bodies on SO(3)."""
    return [list(g[k, :]) for k in range(3)]


def shifts(g: Point, p: Parameters) -> Rows:
    """Return the velocities (0, Rᵀe_k) of the shifts of space, for bodies on SE(3)."""
    return [[*[sympy.Integer(0)] * 3, *g[k, :3]] for k in range(3)]


def turns(g: Point, p: Parameters) -> Rows:
    """Return the velocities (Rᵀe_k, Rᵀ(e_k × r)) of the turns of space, for bodies on SE(3)."""
    R, (a, b, c) = g[:3, :3], g[:3, 3]
    across = sympy.Matrix([[0, -c, b], [c, 0, -a], [-b, a, 0]]) * R
    return [[*R[k, :], *across[k, :]] for k in range(3)]


def turn_about_the_vertical(x: Point, p: Parameters) -> list[Scalar]:
    """Return the velocity of the turn about e₃, for a mass in space or a body on SE(3)."""
    return [-x[1], x[0], sympy.Integer(0)] if x.cols == 1 else turns(x, p)[2]


def own_spin(g: Point, p: Parameters) -> list[Scalar]:
    """Return the velocity of the turn of each body on SE(3) about its own axis e₁."""
    return [sympy.Integer(int(k == 0)) for k in range(6)]
