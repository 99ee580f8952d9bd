"""A scene's constraints as expressions: φ(x, t) = 0 on the base, and A(x, t) ξ = a(x, t).

The rows of φ come first, of all constraints of the scene, then those given for the velocity.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from ..errors import BadInput
from ..numbers import jacobian, sympy
from ..numbers.types import Column, SymbolicMatrix
from ..scene import Constraint, ConstraintParts
from .discrete_lagrangian import DiscreteLagrangian
from .rule_view import written
from .symbols import SceneSymbols, column, times


def constraint(s: SceneSymbols, x: Column) -> Column:
    """Return φ, the positions' part, at a column x, with its time if it contains one."""
    return column(e for each, parts in _given(s, x) for e in _column(s, x, each, parts.positions))


def constraint_matrix(s: SceneSymbols, x: Column) -> SymbolicMatrix:
    """Return A, k×m, of A ξ = a: φ′ρ̂ of the positions, then the given rows, at letters x."""
    return _of_positions(s, x).col_join(_of_velocities(s, x)[0])


def constraint_shift(s: SceneSymbols, x: Column) -> Column:
    """Return a, k×1, of A ξ = a: −∂φ/∂t of the positions, then the given right sides."""
    phi = constraint(s, x)
    moving = -phi.diff(x[s.n]) if s.clocked else 0 * phi
    return moving.col_join(_of_velocities(s, x)[1])


def reaction_matrix(s: SceneSymbols, x: Column) -> SymbolicMatrix:
    """Return B, k×m, of the constraints' force Bᵀλ: A, unless a kind of constraint gives others."""
    own, given = constraint_matrix(s, x), list(_given(s, x))
    places = [0, sum(len(parts.positions) for _, parts in given)]
    for each, parts in given:
        sizes = len(parts.positions), len(parts.rows)
        if parts.reactions is not None:
            rows = [_column(s, x, each, row) for row in parts.reactions]
            if len(rows) != sum(sizes) or any(len(row) != len(s.u) for row in rows):
                raise BadInput(
                    f"{s.name}: its {each.kind.name} constraint needs {sum(sizes)} reactions, rows "
                    f"of {len(s.u)} entries."
                )
            at = [place + i for place, size in zip(places, sizes, strict=True) for i in range(size)]
            for i, row in zip(at, rows, strict=True):
                own[i, :] = row.T
        places = [place + size for place, size in zip(places, sizes, strict=True)]
    return own


def vanishing_at_states(s: SceneSymbols) -> Column:
    """Return φ(x) and A(x) ξ − a(x) of the velocity at x, in (x, ξ = v).

    Steps are compared with these: they do not use the rows that steps solve.
    """
    found = constraint_matrix(s, s.x) * s.v - constraint_shift(s, s.x)
    return constraint(s, s.x).col_join(found)


def vanishing_in_a_step(of: DiscreteLagrangian) -> Column:
    """Return Σ ω_i/h (A(x_i) u − a(x_i)) over the points x_i of a rule's values of L with weights
    ω_i, in (x, u), of the rows given for the velocity.

    Positions restrict only the end of a step, and are not among them.
    """
    points = [(written(w), column(map(written, call.args[: len(of.s.x)]))) for w, call in of.asked]
    return met_by_velocity(of.s, points)


def met_by_velocity(s: SceneSymbols, points: list[tuple[Any, Column]]) -> Column:
    """Return Σ ω/h (A(x) u − a(x)) over points (ω, x), of the rows given for the velocity."""
    found = [(weight / s.h, *_of_velocities(s, x)) for weight, x in points]
    terms = [weight * (rows * s.u - shift) for weight, rows, shift in found]
    return sum(terms[1:], terms[0])


def _of_positions(s: SceneSymbols, x: Column) -> SymbolicMatrix:
    """Return φ′ρ̂ at letters x."""
    phi = constraint(s, x)
    if not len(phi):
        return sympy.zeros(0, len(s.u))
    return times(jacobian(phi, x), s.groupoid.rho(x, s.h) / s.h)


def _of_velocities(s: SceneSymbols, x: Column) -> tuple[SymbolicMatrix, Column]:
    """Return A and a as they are given for the velocity."""
    rows, shift = sympy.zeros(0, len(s.u)), sympy.zeros(0, 1)
    for each, parts in _given(s, x):
        entries = _column(s, x, each, [e for row in parts.rows for e in row])
        rows = rows.col_join(entries.reshape(len(parts.rows), len(s.u)))
        shift = shift.col_join(_column(s, x, each, parts.shift))
    return rows, shift


def _given(s: SceneSymbols, x: Column) -> Iterator[tuple[Constraint, ConstraintParts]]:
    """Yield each constraint, and its parts at a column x."""
    for each in s.constraints:
        time = (x[s.n],) if each.timed else ()
        given = s.evaluated(each.function, "its constraint", x[: s.n, :], s.parameters, *time)
        try:
            yield each, each.kind.parts(given, len(s.u))
        except BadInput as error:
            raise BadInput(f"{s.name}: {error}") from None


def _column(s: SceneSymbols, x: Column, each: Constraint, entries: Any) -> Column:
    found = s.scalars(entries, "its constraint", each.function)
    words = "x, p and t" if each.timed else "x and p"
    s.refuse_unknown(found, x.free_symbols, "its constraint", each.function, words)
    return found
