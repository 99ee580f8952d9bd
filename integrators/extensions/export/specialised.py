"""A driver of the compiler as statements of `statements`: loops and branches on numbers stay.

The compiler's own writer runs the text (`compiler.llvm_writer`); here its numbers write statements
instead of instructions. Tuples, records and what Python knows exist only during this writing. Each
result first gets a name of its own (`settling`).
"""

from __future__ import annotations

import ast
import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from ...compiler import texts_of
from ...compiler.llvm_statements import Scope, loaded
from ...compiler.llvm_values import ARITHMETIC, Array, Value, mapped
from ...compiler.llvm_writer import Module
from ...numbers.types import Function
from .settling import FRESH, KINDS, Block, settled
from .statements import last_of

OPERATORS: dict[str, Any] = {
    "add": ast.Add, "sub": ast.Sub, "mul": ast.Mult, "truediv": ast.Div, "floordiv": ast.FloorDiv,
    "mod": ast.Mod, "lt": ast.Lt, "le": ast.LtE, "gt": ast.Gt, "ge": ast.GtE, "eq": ast.Eq,
    "ne": ast.NotEq,
}  # fmt: skip


def tree(number: Any) -> ast.expr:
    """Return a number, which Python may know, as an expression."""
    if not isinstance(number, Value):
        return ast.Constant(number)
    return ast.parse(number.name, mode="eval").body


class Writer:
    """Statements while they are written: what the compiler calls a routine."""

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

    def get(self, kind: str, value: ast.expr) -> Value:
        """Give a result a name."""
        name = self.name()
        self.do(ast.AnnAssign(ast.Name(name), ast.Name(KINDS[kind]), value, 1))
        return Value(kind, name, self)

    def memory(self, kind: str, length: int = 1, columns: int | None = None) -> Letter:
        """Return a variable."""
        name = self.name("v")
        self.variables[name] = kind
        return Letter(kind, name, self)

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
        if not whole:
            left, right = (float(e) if isinstance(e, int) else e for e in (left, right))
        one, other, made = tree(left), tree(right), OPERATORS[operator]
        if operator not in ARITHMETIC:
            return self.get("b", ast.Compare(one, [made()], [other]))
        if operator == "sub" and not isinstance(left, Value) and left == 0 and (
            whole or math.copysign(1, left) < 0
        ):  # fmt: skip
            return self.get("i" if whole else "f", ast.UnaryOp(ast.USub(), other))
        return self.get("i" if whole else "f", ast.BinOp(one, made(), other))

    def call(self, name: str, *arguments: Any) -> Value:
        """Call a function of numbers."""
        given = [tree(float(e) if isinstance(e, int) else e) for e in arguments]
        if name == "pow":
            return self.get("f", ast.BinOp(given[0], ast.Pow(), given[1]))
        return self.get("f", ast.Call(ast.Name("abs" if name == "fabs" else name), given, []))

    def select(self, test: Value, yes: Any, no: Any) -> Value:
        """Return `yes` if the test holds, else `no`."""
        kinds = {kind_of(yes), kind_of(no)}
        kind = kinds.pop() if len(kinds) == 1 else "f"
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


@dataclass(frozen=True)
class Letter:
    """A variable, with one entry as the compiler's variables."""

    kind: str
    name: str
    routine: Any

    def __getitem__(self, _: int) -> Value:
        found: Value = self.routine.get(self.kind, ast.Name(self.name))
        return found

    def __setitem__(self, _: int, number: Any) -> None:
        if self.kind == "f" and isinstance(number, int):
            number = float(number)
        self.routine.do(ast.Assign([ast.Name(self.name)], tree(number)))


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
        return row if self.columns == 1 else row * self.columns

    def __getitem__(self, index: Any) -> Any:
        if self.columns is not None and not isinstance(index, tuple):
            return replace(self, columns=None, first=self._row(index))
        return self.routine.get(self.kind, self._at(index))

    def __setitem__(self, index: Any, number: Any) -> None:
        if self.kind == "f" and isinstance(number, int):
            number = float(number)
        self.routine.do(ast.Assign([self._at(index)], tree(number)))


@dataclass(frozen=True)
class Table:
    """Whole numbers that are known, in rows; none lets a loop be unrolled."""

    rows: Sequence[Sequence[int]]
    routine: Any

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, tuple):
            return Value("i", str(int(self.rows[index[0]][index[1]])), self.routine)
        return [Value("i", str(int(e)), self.routine) for e in self.rows[index]]


class Structured(Scope):
    """One call of a function: its branches and loops become statements."""

    def call(self, arguments: Sequence[Any], turn: Callable[[Any], None] | None = None) -> Any:
        """Write the statements of the call and return its result."""
        routine, block, before = self.routine, self.routine.block, len(self.routine.loops)
        said = ast.get_docstring(self.node)
        if said and self.node.name not in TOOLS and not _small(self.node):
            routine.do(ast.Expr(ast.Constant(said.split("\n\n")[0])))
        self.turn, self.inside, self.ended = turn, before, ""
        for argument, value in zip(self.node.args.args, arguments, strict=True):
            self._bind(argument.arg, value)
        self._run(self.node.body)
        if self.returned:
            return self.returned[0]
        routine.block, routine.open = block, True
        return loaded(self.places["return"]) if "return" in self.places else None

    def _turn(self, node: ast.For, value: Any) -> None:
        """Write one turn; the loop's letters are nobody else's."""
        letters = node.target.elts if isinstance(node.target, ast.Tuple) else [node.target]
        values = value if isinstance(node.target, ast.Tuple) else [value]
        for letter, one in zip(letters, values, strict=True):
            if isinstance(letter, ast.Name):
                self.places.pop(letter.id, None)
                self.names[letter.id] = one
                self._hint(letter.id, one)
        self._run(node.body)

    def _bind(self, name: str, numbers: Any) -> None:
        super()._bind(name, numbers)
        self._hint(name, numbers)

    def _hint(self, name: str, numbers: Any) -> None:
        several = isinstance(numbers, tuple)
        for i, e in enumerate(numbers if several else [numbers]):
            if isinstance(e, Value) and FRESH.match(e.name):
                self.routine.hints.setdefault(e.name, f"{name}_{i}" if several else name)

    def _put(self, name: str, numbers: Any) -> None:
        if name not in self.places:
            made = iter(range(999))
            several = isinstance(numbers, tuple)

            def letter(e: Any) -> Letter:
                found: Letter = self.routine.memory(kind_of(e))
                word = re.sub(r"\W.*", "", name.removeprefix("turns of the loop"))
                self.routine.hints[found.name] = f"{word}_{next(made)}" if several else word
                return found

            self.places[name] = mapped(letter, numbers)
        super()._put(name, numbers)

    def _return(self, numbers: Any) -> None:
        if not (self.branches or self.left):
            self.returned = [numbers]
            return
        assert len(self.routine.loops) == self.inside, "a loop is not left by a return"
        self.left, self.ended = True, "return"
        if numbers is not None:
            self._put("return", numbers)
        self.routine.open = False

    def _if(self, node: ast.If) -> None:
        test, routine = self.value(node.test), self.routine
        if not isinstance(test, Value):
            self._run(node.body if test else node.orelse)
            return
        outer, parts = routine.block, []
        self.branches += 1
        for body in (node.body, node.orelse):
            made: Block = []
            routine.block, routine.open, self.ended = made, True, ""
            self._run(body)
            parts.append((made, routine.block, routine.open, self.ended))
        self.branches -= 1
        outer.append(ast.If(tree(test), parts[0][0], parts[1][0]))
        going = [last for _, last, is_open, _ in parts if is_open]
        ends = {ended for _, _, is_open, ended in parts if not is_open}
        routine.block, routine.open = outer, bool(going)
        if len(going) == 1 and "return" in ends:  # what follows belongs to the other branch
            routine.block = going[0]
        else:
            assert all(made is last for made, last, is_open, _ in parts if is_open)

    def _loop(self, test: Callable[[], Any], turn: Callable[[], None]) -> None:
        def body() -> None:
            if (goes := test()) is not True:
                leaves = ast.UnaryOp(ast.Not(), tree(goes))
                self.routine.do(ast.If(leaves, [ast.Break()], []))
            turn()

        self._looping(lambda made: ast.While(ast.Constant(True), made, []), body)

    def _looping(self, loop: Callable[[Block], ast.stmt], write: Callable[[], None]) -> None:
        routine, outer, made = self.routine, self.routine.block, list[ast.stmt]()
        self.ends.append(routine.name("end"))
        flags: list[str] = []
        routine.loops.append((outer, flags))
        routine.block = made
        self.branches += 1
        write()
        self.branches -= 1
        self.ends.pop()
        routine.loops.pop()
        outer.append(loop(made))
        outer += [ast.If(ast.Name(flag), [ast.Break()], []) for flag in flags]
        routine.block, routine.open = outer, True

    def _count(self, node: ast.For, start: Any, stop: Any, step: int = 1) -> None:
        routine = self.routine
        name = routine.name()
        routine.hints[name] = ast.unparse(node.target)
        at = Value("i", name, routine)
        length = stop if step > 0 else start - stop
        loop = ast.Call(ast.Name("range"), [tree(start if step > 0 else 0), tree(length)], [])

        def write() -> None:
            self._turn(node, at if step > 0 else start - at)

        self._looping(lambda made: ast.For(ast.Name(name), loop, made, []), write)

    def _run(self, statements: Sequence[ast.stmt]) -> None:
        for s in statements:
            if self.returned or not self.routine.open:
                return
            if isinstance(s, ast.Break):
                self.routine.leave(self.ends[-1])
                self.ended = "break"
            else:
                super()._run([s])


def _small(node: ast.FunctionDef) -> bool:
    """Return True if a function needs no word, because its own lines say what it does."""
    return not any(isinstance(e, (ast.For, ast.While)) for e in ast.walk(node))


#: functions whose calls need no word
TOOLS = {"advance", *(f.name for f in ast.parse(texts_of("tuple_operations")).body
                      if isinstance(f, ast.FunctionDef))}  # fmt: skip


class Specialised(Module):
    """A text of the compiler whose functions write statements."""

    scope = Structured

    def __init__(self, text: str, names: Mapping[str, Any]) -> None:
        self.used: set[str] = set()
        super().__init__(text, names)
        self.names |= {word: self._table(word) for word in self.names if last_of(word) is not None}
        self.names["eliminate"] = self._eliminate

    def new_routine(self) -> Any:
        """Return a writer."""
        return Writer()

    def _called(self, name: str, function: Function, *arguments: Any) -> Any:
        return function(*arguments)

    def _zeros(self, rows: int, columns: int) -> Any:
        return self._array(rows * columns, columns)

    def _array(self, length: int, columns: int | None = None) -> Entries:
        name = self.routine.name("v")
        self.routine.hints[name] = "rows" if columns else "table"
        zeros = ast.BinOp(ast.List([ast.Constant(0.0)]), ast.Mult(), ast.Constant(length))
        self.routine.do(ast.AnnAssign(ast.Name(name), ast.Name("Out"), zeros, 1))
        return Entries("f", name, columns, self.routine)

    def _eliminate(self, a: Entries, m: int) -> None:
        self._call("eliminate", ast.Name(a.name), ast.Constant(m))

    def _table(self, word: str) -> Function:
        last = last_of(word)
        assert last is not None

        def table(z: Any) -> Any:
            made = self._array(last + 1)
            self._call("stumpff", ast.Name(made.name), ast.Constant(last), tree(z))
            return tuple(made[k] for k in range(last + 1))

        return table

    def _call(self, name: str, *arguments: ast.expr) -> None:
        self.used.add(name)
        self.routine.do(ast.Expr(ast.Call(ast.Name(name), list(arguments), [])))

    def function(self, head: str, write: Callable[[Callable[..., Any]], Any]) -> ast.FunctionDef:
        """Return a function of a file.

        head: its first line, with the letters that it takes. write: calls functions of the text,
        whose names it is given, and returns the result, or None.
        """
        self.routine = writer = Writer()
        result = write(self.names.__getitem__)
        if result is not None:
            writer.do(ast.Return(tree(result)))
        (made,) = ast.parse(f"{head}\n    pass").body
        assert isinstance(made, ast.FunctionDef)
        made.body = settled(
            writer.block, writer.variables, writer.hints, {a.arg for a in made.args.args}
        )
        return ast.fix_missing_locations(made)
