"""What a discrete Lagrangian's derivatives and the forces of a step are made of."""

from __future__ import annotations

from dataclasses import dataclass, field

from ..numbers import sympy
from ..numbers.types import Column, Letter, SymbolicMatrix


@dataclass
class Covectors:
    """∂L_d along what it depends on, by the first letter of each column (`of`).

    forces: weighted forces at x and at points of the straight step, against their displacements.
    turned: what moving a base does to points b(base, W) of a curve, by e→(b) = 0 (m×1 each).
    """

    columns: dict[Letter | None, Column] = field(default_factory=dict)
    forces: dict[Letter | None, Column] = field(default_factory=dict)
    turned: dict[Letter | None, Column] = field(default_factory=dict)

    def of(self, letters: Column) -> Column:
        """∂L_d/∂letters as a column."""
        return self.columns.get(key_of(letters), 0 * letters)

    def add(self, letters: Column, value: Column) -> None:
        """Add a part of ∂L_d/∂letters."""
        if len(letters) and any(value):
            self.columns[key_of(letters)] = self.of(letters) + value

    def add_force(self, point: Column, force: Column) -> None:
        """Add a weighted force at x or at a point of the straight step."""
        self.forces[key_of(point)] = self.force_at(point, force) + force

    def force_at(self, point: Column, like: Column) -> Column:
        """The weighted force at a point, of the shape of `like`."""
        return self.forces.get(key_of(point), 0 * like)


def key_of(letters: Column) -> Letter | None:
    """What a column of letters is known by."""
    return letters[0] if len(letters) else None


def times(one: SymbolicMatrix, other: SymbolicMatrix) -> SymbolicMatrix:
    """one · other; nothing is multiplied by zero.

    Sympy's product asks of every entry whether 0 times it is 0, so whether each of its letters and
    functions is finite: with the gradient of many springs that takes longer than to derive it.
    """
    columns = other.T.tolist()
    return sympy.Matrix(one.rows, other.cols, [
        sympy.Add(*[a * e for a, e in zip(row, column, strict=True) if a != 0 and e != 0])
        for row in one.tolist() for column in columns
    ])  # fmt: skip
