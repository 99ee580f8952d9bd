"""Derivatives of expressions that hold letters for points, charts and values of terms.

A `Block` is a column of letters with its derivatives by the letters it is made of. The chain rule
goes through blocks letter by letter, so an expression is never written out to be differentiated.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from ..groupoids import Motion
from ..numbers import Definition, jacobian, symbols_of, sympy
from ..numbers.types import Column, Expression, Expressions, Letter, SymbolicMatrix
from .symbols import column, vector

#: columns that something depends on, with its derivatives by them: a matrix, or one row of it
Partials = list[tuple[Column, SymbolicMatrix]]
Row = list[Expression]


@dataclass(eq=False)
class Block:
    """Letters for `values`; partials: [(column, ∂letters/∂column)], where the values do not say it.

    summed: the values are sums over many nodes, or one of a long chain of them, so their
    derivatives get letters of their own.
    A point at the fraction θ of the straight step has `theta`, its `motion`, and where a force acts
    in `displacement` how e→ and e← displace it (m×m each).
    """

    letters: Column
    values: Column
    partials: Partials = field(default_factory=list)
    summed: bool = False
    frame: Block | None = None
    commutators: SymbolicMatrix | None = None
    theta: Expression | None = None
    motion: Motion | None = None
    displacement: tuple[SymbolicMatrix, SymbolicMatrix] | None = None

    @property
    def is_end(self) -> bool:
        """Whether it is the point y = b(x, u; h)."""
        return bool(self.theta == 1)

    def partials_of(self, letter: Letter) -> list[tuple[Column, Row]]:
        """[(column, the letter's derivatives by it)]."""
        row = list(self.letters).index(letter)
        return [(by, list(matrix.row(row))) for by, matrix in self.partials]

    def definition(self) -> Definition:
        """What the letters stand for."""
        return Definition(tuple(self.letters), tuple(self.values))


class ChainRule:
    """Derivatives through blocks, which are added in an order in which each uses earlier ones.

    A point z of many coordinates moves in fewer directions, A(z)ζ. Where A's columns are letters of
    a frame ζ, sums over z are differentiated along ζ, which gets letters, and then multiplied by
    ∂ζ: (∂k/∂z A)∂ζ has far fewer products than ∂k/∂z (A ∂ζ).
    """

    def __init__(self) -> None:
        self.blocks: list[Any] = []
        self.owner: dict[Letter, Any] = {}
        self._frames: list[Block] = []
        self._known: dict[tuple[Letter, Letter, bool], Row] = {}

    def add(self, block: Any) -> Column:
        """Append a `Block`, or a node with the same members; returns its letters."""
        self.blocks.append(block)
        self.owner.update(dict.fromkeys(block.letters, block))
        return block.letters

    def add_point(self, block: Block, u: Column) -> Column:
        """Append a point with a motion and its partials; ∂/∂u is in a frame if that has less."""
        assert block.motion is not None
        anchor, slope, *_ = block.motion
        if anchor.cols < anchor.rows and symbols_of(anchor) & set(block.letters):
            frame = Block(vector(f"e{len(self.blocks)}", anchor.cols), column(()), [(u, slope)])
            self._frames.append(frame)
            self.owner.update(dict.fromkeys(frame.letters, frame))
            block.frame = frame
            block.partials.insert(0, (frame.letters, anchor))
        else:
            block.partials.insert(0, (u, anchor * slope))
        return self.add(block)

    def total(self, entries: Expressions, variable: Column, framed: bool = True) -> SymbolicMatrix:
        """d(entries)/d(variable) through all blocks; the variable is a column of letters.

        framed: whether frames move, too.
        """
        width = len(variable)
        symbols = symbols_of(entries) if width else set()
        rows = {s: self._row(s, variable, framed) for s in sorted(symbols, key=str)}
        letters = [s for s, row in rows.items() if any(e != 0 for e in row)]
        direct = jacobian(entries, letters)
        totals = [
            _combined([(direct[i, k], rows[s]) for k, s in enumerate(letters)], width)
            for i in range(len(entries))
        ]
        return sympy.Matrix(len(entries), width, [e for row in totals for e in row])

    def definitions(self) -> list[Definition]:
        """What all letters stand for, in order."""
        return [block.definition() for block in self.blocks]

    def _row(self, letter: Letter, variable: Column, framed: bool) -> Row:
        """The derivatives of one letter by the variable's."""
        if letter in set(variable):
            return [sympy.Integer(letter == v) for v in variable]
        block = self.owner.get(letter)
        if block is None or (block in self._frames and not framed):
            return [sympy.Integer(0)] * len(variable)
        key = (letter, variable[0], framed)
        if key not in self._known:
            if isinstance(block, Block) and not block.partials:
                value = block.values[list(block.letters).index(letter)]
                row = list(self.total([value], variable, False))
                if framed:
                    along = self._along_frames(letter, variable)
                    row = [a + b for a, b in zip(row, along, strict=True)]
            else:
                row = self._through(block.partials_of(letter), variable, framed)
            summed = isinstance(block, Block) and block.summed
            self._known[key] = self._named(row) if summed else row
        return self._known[key]

    def _along_frames(self, letter: Letter, variable: Column) -> Row:
        """What the frames' motion adds to a letter's derivatives."""
        pairs = [
            (slope, self._row(e, variable, True))
            for frame in self._frames
            if frame.letters != variable
            for e, slope in zip(frame.letters, self._along(letter, frame), strict=True)
        ]
        return _combined(pairs, len(variable))

    def _along(self, letter: Letter, frame: Block) -> Row:
        """The derivatives of one letter along a frame; half of those of a gradient are known."""
        block = self.owner[letter]
        if block.commutators is None or block.frame is not frame:
            return self._row(letter, frame.letters, False)
        i = list(block.letters).index(letter)
        earlier = [self._along(e, frame)[i] for e in block.letters[:i]]
        known = [e + c for e, c in zip(earlier, block.commutators[i, :i], strict=True)]
        return [*known, *self._row(letter, frame.letters[i:, :], False)]

    def _through(self, parts: list[tuple[Column, Row]], variable: Column, framed: bool) -> Row:
        pairs = [
            (slope, self._row(inner, variable, framed))
            for letters, partial in parts
            for inner, slope in zip(letters, partial, strict=True)
            if slope != 0
        ]
        return _combined(pairs, len(variable))

    def _named(self, row: Expressions) -> Row:
        """The row with letters for its sums."""
        values = [e for e in row if e.is_Add]
        letters = vector(f"f{len(self.blocks)}", len(values))
        if values:
            self.add(Block(letters, column(values), summed=True))
        swap = dict(zip(values, letters, strict=True))
        return [swap.get(e, e) for e in row]


def _combined(pairs: list[tuple[Expression, Row]], width: int) -> Row:
    """Σ slope·row over the pairs; nothing is multiplied by zero."""
    return [
        sympy.Add(*[slope * row[j] for slope, row in pairs if slope != 0 and row[j] != 0])
        for j in range(width)
    ]


def partials(values: Column, columns: list[Column]) -> Partials:
    """[(column, ∂values/∂column)] of those columns that the values hold."""
    symbols = symbols_of(values)
    return [(c, jacobian(values, c)) for c in columns if len(c) and symbols & set(c)]
