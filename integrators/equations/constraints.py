"""A scene's constraints as expressions: φ(x) = 0 on the base, or A(x) ξ = 0 of the velocity."""

from __future__ import annotations

from typing import Any

from ..errors import BadInput, shown
from ..numbers import jacobian, sympy
from ..numbers.types import Column, SymbolicMatrix
from .discrete_lagrangian import DiscreteLagrangian
from .rule_view import written
from .symbols import SceneSymbols, column, entries_of, times


def constraint(s: SceneSymbols, x: Column) -> Column:
    """Return φ(x), k×1, at a column x, with its time if it contains one."""
    given = _given(s, x)
    if not given or any(hasattr(e, "__iter__") or hasattr(e, "shape") for e in given):
        raise BadInput(
            f"{s.name}: its constraint gives {' '.join(shown(given).split())}, but must give a "
            "list of expressions φ, each a constraint: [x.dot(x) - 1], say."
        )
    return _column(s, x, given)


def constraint_matrix(s: SceneSymbols, x: Column) -> SymbolicMatrix:
    """Return A, k×m, of A(x) ξ = 0: φ′(x) ρ̂(x), or the given rows."""
    if s.holonomic:
        return times(jacobian(constraint(s, x), x), s.groupoid.rho(x, s.h) / s.h)
    m, given = len(s.u), _given(s, x)
    rows = [entries_of(row) for row in given]
    if not rows or any(len(row) != m for row in rows):
        raise BadInput(
            f"{s.name}: nonholonomic= gives {shown(given)}, but must give a list of rows of {m} "
            "entries, each a constraint of the velocity."
        )
    return _column(s, x, [e for row in rows for e in row]).reshape(len(rows), m)


def vanishing_at_states(s: SceneSymbols) -> Column:
    """Return φ(x), if it is holonomic, and A(x) ξ of the velocity at x, in (x, ξ = v).

    Steps are compared with these: they do not use the rows that steps solve.
    """
    found = constraint(s, s.x) if s.holonomic else sympy.zeros(0, 1)
    return found.col_join(constraint_matrix(s, s.x) * s.v)


def vanishing_in_a_step(of: DiscreteLagrangian) -> Column:
    """Return Σ ω_i/h A(x_i) u over the points x_i of a rule's values of L with weights ω_i, in (x,
    u).

    It is for a nonholonomic scene: a holonomic one restricts only the end (0×1).
    """
    s, n = of.s, len(of.s.x)
    if s.holonomic:
        return sympy.zeros(0, 1)
    terms = [
        written(weight) / s.h * constraint_matrix(s, column(map(written, call.args[:n]))) * s.u
        for weight, call in of.asked
    ]
    return sum(terms[1:], terms[0])


def _column(s: SceneSymbols, x: Column, entries: list[Any]) -> Column:
    found = s.scalars(entries, "its constraint", s.restricted)
    s.refuse_unknown(found, x.free_symbols, "its constraint", s.restricted, "x and p")
    return found


def _given(s: SceneSymbols, x: Column) -> list[Any]:
    assert s.restricted is not None
    given = s.evaluated(s.restricted, "its constraint", x[: s.n, :], s.parameters)
    if hasattr(given, "tolist"):
        given = given.tolist()
    return entries_of(given)
