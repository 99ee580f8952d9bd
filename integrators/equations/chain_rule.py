"""Derivatives of expressions that hold letters for points, charts and values of terms.

A `Block` is a column of letters with its derivatives by the letters it is made of. The chain rule
goes through blocks letter by letter, so an expression is never written out to be differentiated.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from ..numbers import Definition, jacobian, symbols_of, sympy


@dataclass(eq=False)
class Block:
    """Letters for `values`; partials: [(column, ∂letters/∂column)].

    summed: the values are sums over many nodes, so their derivatives get letters of their own.
    A point at the fraction θ of the straight step has `theta`, and in `fields` how e→ and e← move
    it (n×m each).
    """

    letters: Any
    values: Any
    partials: list[tuple[Any, Any]] = field(default_factory=list)
    summed: bool = False
    theta: Any = None
    fields: tuple[Any, Any] | None = None

    @property
    def is_end(self) -> bool:
        """Whether it is the point y = b(x, u; h)."""
        return bool(self.theta == 1)

    def partials_of(self, letter: Any) -> list[tuple[Any, list[Any]]]:
        """[(column, the letter's derivatives by it)]."""
        row = list(self.letters).index(letter)
        return [(column, list(matrix.row(row))) for column, matrix in self.partials]

    def definition(self) -> Definition:
        """What the letters stand for."""
        return Definition(tuple(self.letters), tuple(self.values))


class ChainRule:
    """Derivatives through blocks, which are added in an order in which each uses earlier ones."""

    def __init__(self) -> None:
        self.blocks: list[Any] = []
        self.owner: dict[Any, Any] = {}
        self._known: dict[tuple[Any, Any], list[Any]] = {}

    def add(self, block: Any) -> Any:
        """Append a block; returns its letters."""
        self.blocks.append(block)
        self.owner.update(dict.fromkeys(block.letters, block))
        return block.letters

    def total(self, column: Any, variable: Any) -> Any:
        """d(column)/d(variable) through all blocks; the variable is a column of letters."""
        width = len(variable)
        symbols = symbols_of(column) if width else set()
        rows = {s: self._row(s, variable) for s in sorted(symbols, key=str)}
        letters = [s for s, row in rows.items() if any(e != 0 for e in row)]
        direct = jacobian(column, letters)
        totals = [
            _combined([(direct[i, k], rows[s]) for k, s in enumerate(letters)], width)
            for i in range(len(column))
        ]
        return sympy.Matrix(len(column), width, [e for row in totals for e in row])

    def definitions(self) -> list[Definition]:
        """What all letters stand for, in order."""
        return [block.definition() for block in self.blocks]

    def _row(self, letter: Any, variable: Any) -> list[Any]:
        """The derivatives of one letter by the variable's."""
        if letter in set(variable):
            return [sympy.Integer(letter == v) for v in variable]
        block = self.owner.get(letter)
        if block is None:
            return [sympy.Integer(0)] * len(variable)
        key = (letter, variable[0])
        if key not in self._known:
            if isinstance(block, Block) and block.summed:
                value = block.values[list(block.letters).index(letter)]
                self._known[key] = self._named(self.total([value], variable))
            else:
                self._known[key] = self._through(block.partials_of(letter), variable)
        return self._known[key]

    def _through(self, parts: list[tuple[Any, list[Any]]], variable: Any) -> list[Any]:
        pairs = [
            (slope, self._row(inner, variable))
            for column, partial in parts
            for inner, slope in zip(column, partial, strict=True)
            if slope != 0
        ]
        return _combined(pairs, len(variable))

    def _named(self, row: Any) -> list[Any]:
        """The row with letters for its sums."""
        values = [e for e in row if e.is_Add]
        name = f"f{len(self.blocks)}"
        letters = [sympy.Symbol(f"{name}_{i}", real=True) for i in range(len(values))]
        if values:
            self.add(Block(sympy.Matrix(letters), sympy.Matrix(values), summed=True))
        swap = dict(zip(values, letters, strict=True))
        return [swap.get(e, e) for e in row]


def _combined(pairs: list[tuple[Any, list[Any]]], width: int) -> list[Any]:
    """Σ slope·row over the pairs; nothing is multiplied by zero."""
    return [
        sympy.Add(*[slope * row[j] for slope, row in pairs if slope != 0 and row[j] != 0])
        for j in range(width)
    ]


def partials(values: Any, columns: list[Any]) -> list[tuple[Any, Any]]:
    """[(column, ∂values/∂column)] of those columns that the values hold."""
    symbols = symbols_of(values)
    return [(c, jacobian(values, c)) for c in columns if len(c) and symbols & set(c)]
