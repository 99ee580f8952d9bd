"""The symmetries of well-known lattices, as velocities of a site, one row each."""

from __future__ import annotations

from ....numbers import sympy
from ....scene import Parameters, Point, Scalar

Rows = list[list[Scalar]]


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
