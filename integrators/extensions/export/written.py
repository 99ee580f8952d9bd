"""Numbers, variables and arrays whose operators write statements instead of computing.

They take the place of the compiler's own (`compiler.llvm_values`), whose operators write
instructions.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

from ...compiler.llvm_values import ARITHMETIC, Array, Value
from .settling import KINDS, Block

OPERATORS: dict[str, Any] = {
    "add": ast.Add, "sub": ast.Sub, "mul": ast.Mult, "truediv": ast.Div, "floordiv": ast.FloorDiv,
    "mod": ast.Mod, "lt": ast.Lt, "le": ast.LtE, "gt": ast.Gt, "ge": ast.GtE, "eq": ast.Eq,
    "ne": ast.NotEq,
}  # fmt: skip


def tree(number: Any) -> ast.expr:
    """Return a number, which Python may know, as an expression."""
    if not isinstance(number, Value):
        return ast.Constant(number)
    name = number.name
    return ast.Name(name) if name.isidentifier() else ast.parse(name, mode="eval").body


class Writer:
    """Statements while they are written: what the compiler calls a routine.

    New names begin with t: a result; p: a result that stays where it is made; v: a variable.
    Capitals are those of lanes (`lane_loops`).
    """

    def __init__(self) -> None:
        self.block: Block = []
        self.open, self.fast, self.count = True, "", 0
        # of the enclosing loops: the block round each, and the flags that leave that as well
        self.loops: list[tuple[Block, list[str]]] = []
        self.depths: dict[str, int] = {}  # by labels: the loops that stay if one jumps there
        self.hints: dict[str, str] = {}  # what a name is called in the text
        self.variables: dict[str, str] = {}  # name → kind

    def name(self, letter: str = "t") -> str:
        """Return a new name, or a label for the end of the loops that follow."""
        self.count += 1
        made = f"{letter}{self.count}_"
        self.depths[made] = len(self.loops)
        return made

    def do(self, statement: ast.stmt) -> None:
        """Write a statement, if it can be reached."""
        if self.open:
            self.block.append(statement)

    def get(self, kind: str, value: ast.expr, letter: str = "t") -> Value:
        """Give a result a name."""
        name = self.name(letter.upper() if kind == "v" else letter)
        self.do(ast.AnnAssign(ast.Name(name), ast.Name(KINDS[kind]), value, 1))
        return Value(kind, name, self)

    def memory(self, kind: str, length: int = 1, columns: int | None = None) -> Letter:
        """Return a variable."""
        name = self.name("V" if kind == "v" else "v")
        self.variables[name] = kind
        return Letter(kind, name, self)

    def called(self, kind: str, name: str, *arguments: ast.expr) -> Value | None:
        """Call a function of the file, which may change what its arguments hold."""
        call = ast.Call(ast.Name(name), list(arguments), [])
        if not kind:
            self.do(ast.Expr(call))
            return None
        result = self.memory(kind)
        self.do(ast.Assign([ast.Name(result.name)], call))
        return result[0]

    def binary(self, operator: str, left: Any, right: Any) -> Any:
        """Write arithmetic or a comparison; of whole numbers that are known it is done."""
        whole = all(kind_of(e) == "i" for e in (left, right)) and operator != "truediv"
        known = [int(e.name) if isinstance(e, Value) else e for e in (left, right)
                 if not isinstance(e, Value) or e.name.lstrip("-").isdigit()]  # fmt: skip
        if whole:
            if len(known) == 2:
                return getattr(known[0], f"__{operator}__")(known[1])
            left, right = (int(e.name) if isinstance(e, Value) and e.name.isdigit() else e
                           for e in (left, right))  # fmt: skip
        if operator in ("add", "sub") and not isinstance(right, Value) and right == 0:
            return left  # the sign of a zero is nobody's concern
        if (operator, left if not isinstance(left, Value) else None) in (("add", 0), ("mul", 1)):
            return right
        if operator == "mul" and not isinstance(right, Value) and right == 1:
            return left
        if not whole:
            left, right = (float(e) if isinstance(e, int) else e for e in (left, right))
        one, other, made = tree(left), tree(right), OPERATORS[operator]
        kind = "i" if whole else among(left, right)
        if operator not in ARITHMETIC:
            return self.get("b", ast.Compare(one, [made()], [other]))
        if operator == "sub" and not isinstance(left, Value) and left == 0 and (
            whole or math.copysign(1, left) < 0
        ):  # fmt: skip
            return self.get(kind, ast.UnaryOp(ast.USub(), other))
        return self.get(kind, ast.BinOp(one, made(), other))

    def call(self, name: str, *arguments: Any) -> Value:
        """Call a function of numbers."""
        trees = [tree(float(e) if isinstance(e, int) else e) for e in arguments]
        kind = among(*arguments)
        if name == "pow":
            return self.get(kind, ast.BinOp(trees[0], ast.Pow(), trees[1]))
        return self.get(kind, ast.Call(ast.Name("abs" if name == "fabs" else name), trees, []))

    def select(self, test: Value, yes: Any, no: Any) -> Value:
        """Return `yes` if the test holds, else `no`."""
        kinds = {kind_of(yes), kind_of(no)}
        kind = kinds.pop() if len(kinds) == 1 else among(yes, no)
        one, other = (tree(float(e) if kind == "f" and isinstance(e, int) else e)
                      for e in (yes, no))  # fmt: skip
        return self.get(kind, ast.IfExp(tree(test), one, other))

    def joint(self, word: str, one: Value, other: Value) -> Value:
        """Return `one and other`, or `or`."""
        made = ast.And() if word == "and" else ast.Or()
        return self.get("b", ast.BoolOp(made, [tree(one), tree(other)]))

    def negated(self, test: Value) -> Value:
        """Return `not test`."""
        return self.get("b", ast.UnaryOp(ast.Not(), tree(test)))

    def whole(self, number: Value) -> Value:
        """Return `int(number)`."""
        return self.get("i", ast.Call(ast.Name("int"), [tree(number)], []))

    def begin(self, label: str) -> None:
        """Go on behind the loops that the label leaves."""
        self.open = True

    def leave(self, label: str) -> None:
        """Leave the loops round which the label was made."""
        depth = self.depths[label]
        if len(self.loops) > depth + 1:
            left = self.memory("b")
            self.hints[left.name] = "left"
            self.loops[depth][0].append(ast.Assign([ast.Name(left.name)], ast.Constant(False)))
            left[0] = True
            for _, flags in self.loops[depth + 1 :]:
                flags.append(left.name)
        self.do(ast.Break())
        self.open = False


def kind_of(number: Any) -> str:
    """Return the kind of a number, f, i or b."""
    if isinstance(number, Value):
        return number.kind
    return "b" if isinstance(number, bool) else "i" if isinstance(number, int) else "f"


def among(*numbers: Any) -> str:
    """Return the kind of a result of numbers: lanes if one has them."""
    return "v" if any(kind_of(e) == "v" for e in numbers) else "f"


@dataclass(frozen=True)
class Letter:
    """A variable, with one entry as the compiler's variables."""

    kind: str
    name: str
    routine: Any

    def __getitem__(self, _: int) -> Value:
        value: Value = self.routine.get(self.kind, tree(Value(self.kind, self.name)))
        return value

    def __setitem__(self, _: int, number: Any) -> None:
        if self.kind == "f" and isinstance(number, int):
            number = float(number)
        self.routine.do(ast.Assign([tree(Value(self.kind, self.name))], tree(number)))


@dataclass(frozen=True)
class Entries(Array):
    """An array; one with two indices is kept row after row. first: where a row begins."""

    first: Any = 0

    def _at(self, index: Any) -> ast.expr:
        if self.columns is not None:
            row, column = index if isinstance(index, tuple) else (index, 0)
            index = self._row(row) + column
        if isinstance(self.first, Value) or self.first != 0:
            index = self.first + index
        return ast.Subscript(tree(Value("f", self.name)), tree(index))

    def _row(self, row: Any) -> Any:
        return row if isinstance(self.columns, int) and self.columns == 1 else row * self.columns

    def __getitem__(self, index: Any) -> Any:
        if self.columns is not None and not isinstance(index, tuple):
            return replace(self, columns=None, first=self._row(index))
        return self.routine.get(self.kind, self._at(index))

    def __setitem__(self, index: Any, number: Any) -> None:
        if self.kind == "f" and isinstance(number, int):
            number = float(number)
        self.routine.do(ast.Assign([self._at(index)], tree(number)))


class Registers:
    """An array at whose places, all known, there are variables.

    places: what is at some of them: a number that stays, or a `Letter`.
    """

    def __init__(self, routine: Any, places: Mapping[int, Any] = MappingProxyType({})) -> None:
        self.routine, self.places = routine, dict[int, Any](places)

    def place(self, index: int, kind: str) -> Any:
        """Return the variable at a place."""
        return self.places.setdefault(index, self.routine.memory(kind))

    def __getitem__(self, index: int) -> Any:
        place = self.place(index, "f")
        return place[0] if isinstance(place, Letter) else place

    def __setitem__(self, index: int, number: Any) -> None:
        place = self.place(index, "f")
        if isinstance(place, Letter):
            place[0] = number


@dataclass(frozen=True)
class Joined:
    """Arrays, each with its length, as one; indices that are unknown are in the last."""

    parts: Sequence[tuple[int, Any]]

    def _at(self, index: Any) -> tuple[Any, Any]:
        first = 0
        for length, array in self.parts[:-1]:
            if not isinstance(index, Value) and index < first + length:
                return array, index - first
            first += length
        return self.parts[-1][1], index - first

    def __getitem__(self, index: Any) -> Any:
        array, at = self._at(index)
        return array[at]

    def __setitem__(self, index: Any, number: Any) -> None:
        array, at = self._at(index)
        array[at] = number


class Nowhere:
    """An array of rows that nobody reads."""

    def __getitem__(self, index: Any) -> Nowhere:
        return self

    def __setitem__(self, index: Any, number: Any) -> None:
        """Leave it out."""


@dataclass(frozen=True)
class Table:
    """Whole numbers that are known, in rows; none lets a loop be unrolled."""

    rows: Sequence[Sequence[int]]
    routine: Any

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, tuple):
            return Value("i", str(int(self.rows[index[0]][index[1]])), self.routine)
        return [Value("i", str(int(e)), self.routine) for e in self.rows[index]]
