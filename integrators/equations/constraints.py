"""A scene's constraints as expressions: φ(x, t) = 0 on the base, and A(x, t) ξ = a(x, t).

The rows of φ come first, of all constraints of the scene, then those given for the velocity.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from typing import NamedTuple

from ..errors import RAISED, BadInput, shown
from ..numbers import jacobian, sympy
from ..numbers.types import Column, Expression, SymbolicMatrix
from ..scene import Constraint, ConstraintParts
from .discrete_lagrangian import DiscreteLagrangian
from .rule_view import written
from .symbols import SceneSymbols, column, times


class _Given(NamedTuple):
    """φ, A and a as they are given at a point; reactions: (row of B, its entries) where B ≠ A."""

    phi: Column
    rows: SymbolicMatrix
    shift: Column
    reactions: list[tuple[int, Column]]


def constraint(s: SceneSymbols, x: Column) -> Column:
    """Return φ, the positions' part, at a column x, with its time if it contains one."""
    return _given(s, tuple(x)).phi.copy()


def constraint_matrix(s: SceneSymbols, x: Column) -> SymbolicMatrix:
    """Return A, k×m, of A ξ = a: φ′ρ̂ of the positions, then the given rows, at letters x."""
    phi, rows, *_ = _given(s, tuple(x))
    if not len(phi):
        return rows.copy()
    return times(jacobian(phi, x), s.groupoid.rho(x, s.h) / s.h).col_join(rows)


def constraint_shift(s: SceneSymbols, x: Column) -> Column:
    """Return a, k×1, of A ξ = a: −∂φ/∂t of the positions, then the given right sides."""
    phi, _, shift, _ = _given(s, tuple(x))
    return (-phi.diff(x[s.n]) if s.clocked else 0 * phi).col_join(shift)


def reaction_matrix(s: SceneSymbols, x: Column) -> SymbolicMatrix:
    """Return B, k×m, of the constraints' force Bᵀλ: A, unless a kind of constraint gives others."""
    matrix = constraint_matrix(s, x)
    for i, row in _given(s, tuple(x)).reactions:
        matrix[i, :] = row.T
    return matrix


def vanishing_at_states(s: SceneSymbols) -> Column:
    """Return φ(x) and A(x) ξ − a(x) of the velocity at x, in (x, ξ = v).

    Steps are compared with these: they do not use the rows that steps solve.
    """
    rows = constraint_matrix(s, s.x) * s.v - constraint_shift(s, s.x)
    return constraint(s, s.x).col_join(rows)


def vanishing_in_a_step(of: DiscreteLagrangian) -> Column:
    """Return Σ ω_i/h (A(x_i) u − a(x_i)) over the points x_i of a rule's values of L with weights
    ω_i, in (x, u), of the rows given for the velocity.

    Positions restrict only the end of a step, and are not among them.
    """
    points = [(written(w), column(map(written, call.args[: len(of.s.x)]))) for w, call in of.asked]
    return met_by_velocity(of.s, points)


def met_by_velocity(s: SceneSymbols, points: list[tuple[Expression, Column]]) -> Column:
    """Return Σ ω/h (A(x) u − a(x)) over points (ω, x), of the rows given for the velocity."""
    pairs = [(weight / s.h, _given(s, tuple(x))) for weight, x in points]
    terms = [weight * (parts.rows * s.u - parts.shift) for weight, parts in pairs]
    return sum(terms[1:], terms[0])


@lru_cache(maxsize=256)
def _given(s: SceneSymbols, point: tuple[Expression, ...]) -> _Given:
    """Return what the constraints' functions give at a point, the positions of all first."""
    x, m = column(point), len(s.u)
    parts = [(each, _parts(s, x, each)) for each in s.constraints]
    phi = [e for _, part in parts for e in part.positions]
    rows = [row for _, part in parts for row in part.rows]
    shift = [e for _, part in parts for e in part.shift]
    places, reactions = [0, len(phi)], list[tuple[int, Column]]()
    for each, part in parts:
        sizes = len(part.positions), len(part.rows)
        at = [first + i for first, size in zip(places, sizes, strict=True) for i in range(size)]
        places = [first + size for first, size in zip(places, sizes, strict=True)]
        if part.reactions is None:
            continue
        if len(part.reactions) != len(at) or any(len(row) != m for row in part.reactions):
            raise BadInput(
                f"{s.name}: its {each.kind.name} constraint needs {len(at)} reactions, rows of "
                f"{m} entries."
            )
        reactions += zip(at, map(column, part.reactions), strict=True)
    flat = [e for row in rows for e in row]
    return _Given(column(phi), sympy.Matrix(len(rows), m, flat), column(shift), reactions)


def _parts(s: SceneSymbols, x: Column, each: Constraint) -> ConstraintParts:
    """Return the parts of a constraint at a column x, as checked expressions."""
    time = (x[s.n],) if each.timed else ()
    s.refuse_attitude(each.function, "its constraint", s.parameters, *time)
    answer = s.evaluated(each.function, "its constraint", x[: s.n, :], s.parameters, *time)
    words = "x, p and t" if each.timed else "x and p"

    def checked(entries: Iterable[Expression]) -> list[Expression]:
        scalars = s.scalars(entries, "its constraint", each.function)
        s.refuse_unknown(scalars, x.free_symbols, "its constraint", each.function, words)
        return list(scalars)

    try:
        parts = each.kind.parts(answer, len(s.u))
    except BadInput as error:
        raise BadInput(f"{s.name}: {error}") from None
    except RAISED as error:
        wrong = f"raises {type(error).__name__}: {error}"
    else:
        wrong = "" if isinstance(parts, ConstraintParts) else f"gives {shown(parts)}"
    if wrong:
        raise BadInput(
            f"{s.name}: parts= of its {each.kind.name} constraint {wrong}; give a function "
            "(given, m) that returns ConstraintParts."
        )
    pushing = None if parts.reactions is None else list(map(checked, parts.reactions))
    rows, shift = list(map(checked, parts.rows)), checked(parts.shift)
    if any(len(row) != len(s.u) for row in rows) or len(shift) != len(rows):
        raise BadInput(
            f"{s.name}: parts= of its {each.kind.name} constraint gives {len(rows)} rows and "
            f"{len(shift)} right sides; give rows of {len(s.u)} entries, and as many right sides."
        )
    return ConstraintParts(checked(parts.positions), rows, shift, pushing)
