"""Derivatives of expressions that hold letters for points, charts and values of terms.

A `Block` is a column of letters with its derivatives by the letters it is made of. The chain rule
goes through blocks letter by letter, so an expression is never written out to be differentiated.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from ..groupoids import Motion
from ..numbers import Definition, jacobian, slopes, symbols_of, sympy
from ..numbers.types import Column, Expression, Expressions, Letter, SymbolicMatrix
from .symbols import column, vector

#: columns that something depends on, with its derivatives by them: a matrix, or what makes it where
#: few rules need it, such as a whole Hessian
Partials = list[tuple[Column, Any]]
Row = list[Expression]
#: the place of each letter of a variable, in order
Index = dict[Letter, int]
#: partials of one letter
RowPartials = list[tuple[Column, Iterable[Expression]]]


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

    @cached_property
    def index(self) -> Index:
        """The place of each letter."""
        return indexed(self.letters)

    @cached_property
    def _rows(self) -> dict[int, list[Row]]:
        return {}

    def _row(self, number: int, letter: Letter) -> Iterator[Expression]:
        if number not in self._rows:
            matrix = self.partials[number][1]
            self._rows[number] = (matrix() if callable(matrix) else matrix).tolist()
        yield from self._rows[number][self.index[letter]]

    def partials_of(self, letter: Letter) -> RowPartials:
        """[(column, the letter's derivatives by it)]; the partials do not change from now on."""
        return [(by, self._row(number, letter)) for number, (by, _) in enumerate(self.partials)]

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
        #: by the letter, the first of the variable's and their number, and whether frames move
        self._known: dict[tuple[Letter, Letter, int, bool], Row] = {}

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

    def total(
        self, entries: Expressions, variable: Expressions, framed: bool = True
    ) -> SymbolicMatrix:
        """d(entries)/d(variable) through all blocks; the variable is a column of letters.

        framed: whether frames move, too.
        """
        rows = self._totals(entries, indexed(variable), framed)
        return sympy.Matrix(len(rows), len(variable), [e for row in rows for e in row])

    def _totals(self, entries: Expressions, variable: Index, framed: bool) -> list[Row]:
        symbols = symbols_of(entries) if variable else set()
        rows = {s: self._row(s, variable, framed) for s in sorted(symbols, key=str)}
        letters = [s for s, row in rows.items() if any(row)]
        return [
            _combined([(direct[s], rows[s]) for s in letters if s in direct], len(variable))
            for direct in slopes(entries, letters)
        ]

    def definitions(self) -> list[Definition]:
        """What all letters stand for, in order."""
        return [block.definition() for block in self.blocks]

    def _row(self, letter: Letter, variable: Index, framed: bool) -> Row:
        """The derivatives of one letter by the variable's."""
        if letter in variable:
            return [sympy.Integer(i == variable[letter]) for i in range(len(variable))]
        block = self.owner.get(letter)
        if block is None or (block in self._frames and not framed):
            return [sympy.Integer(0)] * len(variable)
        key = (letter, next(iter(variable)), len(variable), framed)
        if key not in self._known:
            if isinstance(block, Block) and not block.partials:
                value = block.values[block.index[letter]]
                row = self._totals([value], variable, False)[0]
                if framed:
                    along = self._along_frames(letter, variable)
                    row = [a + b for a, b in zip(row, along, strict=True)]
            else:
                row = self._through(block.partials_of(letter), variable, framed)
            summed = isinstance(block, Block) and block.summed
            self._known[key] = self._named(row) if summed else row
        return self._known[key]

    def _along_frames(self, letter: Letter, variable: Index) -> Row:
        """What the frames' motion adds to a letter's derivatives."""
        pairs = [
            (slope, self._row(e, variable, True))
            for frame in self._frames
            if next(iter(variable)) not in frame.index
            for e, slope in zip(frame.letters, self._along(letter, frame), strict=True)
        ]
        return _combined(pairs, len(variable))

    def _along(self, letter: Letter, frame: Block) -> Row:
        """The derivatives of one letter along a frame; half of those of a gradient are known."""
        block, letters = self.owner[letter], list(frame.letters)
        if block.commutators is None or block.frame is not frame:
            return self._row(letter, frame.index, False)
        m = len(letters)
        if (letter, letters[0], m, False) not in self._known:
            rows = list[Row]()
            for i, (e, value) in enumerate(zip(block.letters, block.values, strict=True)):
                known = [row[i] + c for row, c in zip(rows, block.commutators[i, :i], strict=True)]
                row = self._totals([value], indexed(letters[i:]), False)[0]
                rows.append([*known, *self._named(row)])
                self._known[e, letters[0], m, False] = rows[-1]
        return self._known[letter, letters[0], m, False]

    def _through(self, parts: RowPartials, variable: Index, framed: bool) -> Row:
        pairs = [
            (slope, self._row(inner, variable, framed))
            for letters, partial in parts
            if any(any(self._row(inner, variable, framed)) for inner in letters)
            for inner, slope in zip(letters, partial, strict=True)
            if slope
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


def indexed(letters: Iterable[Letter]) -> Index:
    """The place of each letter."""
    return {letter: i for i, letter in enumerate(letters)}


def _combined(pairs: list[tuple[Expression, Row]], width: int) -> Row:
    """Σ slope·row over the pairs; nothing is multiplied by zero."""
    return [
        sympy.Add(*[slope * row[j] for slope, row in pairs if slope and row[j]])
        for j in range(width)
    ]


def partials(values: Column, columns: list[Column]) -> Partials:
    """[(column, ∂values/∂column)] of those columns that the values hold."""
    symbols = symbols_of(values)
    return [(c, jacobian(values, c)) for c in columns if len(c) and symbols & set(c)]
