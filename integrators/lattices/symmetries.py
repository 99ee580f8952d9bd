"""Symmetries of lattices: the natural velocities with which they move a site, one row each."""

from __future__ import annotations

from typing import Any

from ..numbers import sympy
from ..numbers.types import Column, Expression

Rows = list[list[Expression]]


def along(x: Column, p: Any) -> list[Expression]:
    """Return the velocity of a shift, for points on a line."""
    return [sympy.Integer(1)]


def turns_of_attitude(g: Column, p: Any) -> Rows:
    """Return the velocities Rᵀe_k of the turns of space, for bodies on SO(3)."""
    return [list(g[k, :]) for k in range(3)]


def shifts(g: Column, p: Any) -> Rows:
    """Return the velocities (0, Rᵀe_k) of the shifts of space, for bodies on SE(3)."""
    return [[*[sympy.Integer(0)] * 3, *g[k, :3]] for k in range(3)]


def turns(g: Column, p: Any) -> Rows:
    """Return the velocities (Rᵀe_k, Rᵀ(e_k × r)) of the turns of space, for bodies on SE(3)."""
    R, (a, b, c) = g[:3, :3], g[:3, 3]
    across = sympy.Matrix([[0, -c, b], [c, 0, -a], [-b, a, 0]]) * R
    return [[*R[k, :], *across[k, :]] for k in range(3)]


def turn_about_the_vertical(x: Column, p: Any) -> list[Expression]:
    """Return the velocity of the turn about e₃, for a mass in space or a body on SE(3)."""
    return [-x[1], x[0], sympy.Integer(0)] if x.cols == 1 else turns(x, p)[2]


def own_spin(g: Column, p: Any) -> list[Expression]:
    """Return the velocity of the turn of each body on SE(3) about its own axis e₁."""
    return [sympy.Integer(int(k == 0)) for k in range(6)]
