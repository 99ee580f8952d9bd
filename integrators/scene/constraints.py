"""Kinds of constraints as data: what holds at a state, in a step, and of form and energy.

Everything that the bench asks of a constraint follows from its kind: the rows of a step, how a
start is projected, what the momentum after a step satisfies, the states on which a form is kept,
the work of the constraint, and the equations of its reference.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

from ..errors import BadInput, shown
from ..numbers.types import Function, Scalar, Scalars
from .quantities import arguments_of

#: what a user's function gives: a scalar, or scalars and rows in a list, an array or a matrix
Answer: TypeAlias = Any


@dataclass(frozen=True)
class ConstraintParts:
    """A constraint at a point x and a time t, in the letters that its function was given.

    positions: φ, expressions that vanish at every state: a step ends where φ(y) = 0, and velocities
    satisfy dφ/dt = 0, whose rows are A = φ′ρ̂ and whose right side is a = −∂φ/∂t.
    rows, shift: A (k×m) and a (k) of A ξ = a of natural velocities ξ: a step satisfies it in the
    mean of the points where its rule evaluates L, and every state by itself.
    reactions: the rows B (one for each position, then one for each row) of the force Bᵀλ of the
    constraint. None: B = A, so it does no work on admitted displacements (d'Alembert).
    """

    positions: Scalars = ()
    rows: Sequence[Scalars] = ()
    shift: Scalars = ()
    reactions: Sequence[Scalars] | None = None

    def __post_init__(self) -> None:
        """Take arrays, matrices and single expressions for lists, as of a scene's own functions."""
        for word in ("positions", "shift"):
            object.__setattr__(self, word, _column(getattr(self, word)))
        for word in ("rows", "reactions"):
            if (matrix := getattr(self, word)) is not None:
                rows = list(map(_column, entries_of(_listed(matrix))))
                object.__setattr__(self, word, rows)


@dataclass(frozen=True)
class ConstraintKind:
    """A kind of constraint. Call it with a function (x, p) or (x, p, t) for a `Constraint`.

    name: the adjective in messages; parts: the function (what a constraint's function gave, m) →
    `ConstraintParts`, which raises `BadInput`, a sentence without the scene's name, for a wrong
    shape. no_form: the reason why no symplectic form is kept on the states that the constraint
    leaves, "" if one is. no_energy: the reason why no band of the energy is demanded while the
    constraint does no work, "" if it is; where it does work, energy and work have to balance.
    """

    name: str
    parts: Callable[[Answer, int], ConstraintParts]
    no_form: str = ""
    no_energy: str = ""

    def __call__(self, function: Function) -> Constraint:
        return Constraint(self, function)


@dataclass(frozen=True)
class Constraint:
    """A function (x, p) or (x, p, t) of a scene, and the kind of constraint that it gives."""

    kind: ConstraintKind
    function: Function

    @property
    def timed(self) -> bool:
        """True if it depends on the time: its function has a third argument without a default."""
        return arguments_of(self.function) == 3


def entries_of(value: Answer) -> list[Answer]:
    """Return the given value as a list; of one entry if it is no collection."""
    shape = getattr(value, "shape", None)
    many = hasattr(value, "__iter__") if shape is None else shape != ()
    return list(value) if many and not isinstance(value, str | dict) else [value]


def _positions(answer: Answer, m: int) -> ConstraintParts:
    """Return φ of a list of expressions."""
    phi = _column(answer)
    if not phi or any(map(_has_entries, phi)):
        raise BadInput(
            f"its constraint gives {_written(phi)}, but must give a list of expressions φ, each a "
            "constraint: [x.dot(x) - 1], say."
        )
    return ConstraintParts(positions=phi)


def velocity_rows(answer: Answer, m: int) -> ConstraintParts:
    """Return A and a of a list of rows, with a = 0, or of the pair (rows, right sides)."""
    moving, right = answer, ()
    if paired := isinstance(answer, tuple) and len(answer) == 2 and _is_pair(*answer, m):
        moving, right = answer
    rows = [_column(row) for row in entries_of(_listed(moving))]
    if not rows or any(len(row) != m or any(map(_has_entries, row)) for row in rows):
        raise BadInput(
            f"nonholonomic= gives {_written(moving)}, but must give a list of rows of {m} entries, "
            "each a constraint of the velocity, or a pair (rows, right sides) for A(x) ξ = a(x)."
        )
    shift = _column(right) if paired else [0] * len(rows)
    if len(shift) != len(rows) or any(map(_has_entries, shift)):
        raise BadInput(
            f"nonholonomic= gives {len(rows)} row{'s' * (len(rows) > 1)} A and the right sides "
            f"{_written(right)}; A(x) ξ = a(x) needs as many expressions a as rows: "
            "([[1, 0, 0]], [speed]), say."
        )
    return ConstraintParts(rows=rows, shift=shift)


def _listed(answer: Answer) -> Answer:
    """Return an array, or a matrix of sympy, as nested lists."""
    return answer.tolist() if hasattr(answer, "tolist") else answer


def _column(answer: Answer) -> list[Scalar]:
    """Return the entries of a list, or of a matrix with one row or one column."""
    entries = entries_of(_listed(answer))
    shape = getattr(answer, "shape", ())
    return [e for row in entries for e in row] if len(shape) == 2 and 1 in shape else entries


def _has_entries(value: object) -> bool:
    many = hasattr(value, "__iter__") or hasattr(value, "shape")
    return (many and not isinstance(value, str)) or value is None


def _is_pair(first: Answer, second: Answer, m: int) -> bool:
    """Return True for (rows, right sides), False for two rows, which may be matrices 1×m."""
    if not any(map(_has_entries, entries_of(_listed(first)))):
        return False
    return not (m > 1 and 1 in getattr(first, "shape", ()) and len(_column(second)) == m)


def _written(value: object) -> str:
    """Return a value for a message, on one line."""
    return " ".join(shown(value).split())


HOLONOMIC = ConstraintKind("holonomic", _positions)
NONHOLONOMIC = ConstraintKind(
    "nonholonomic",
    velocity_rows,
    no_form="nonholonomic: Ω need not be kept; a step solves its equations",
    no_energy="nonholonomic: measured only",
)
