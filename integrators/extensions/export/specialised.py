"""A driver of the compiler as statements: loops and branches on numbers stay.

The compiler's own writer runs the text (`compiler.llvm_writer`); here its numbers write statements
instead of instructions. Tuples, records and what Python knows exist only during this writing. Each
result first gets a name of its own (`settling`).
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial, reduce
from types import SimpleNamespace
from typing import Any

import numpy as np

from ...compiler import names_of, texts_of
from ...compiler.llvm_statements import Scope, loaded
from ...compiler.llvm_values import Value, mapped
from ...compiler.llvm_writer import Module, decorators
from ...numbers import Double
from ...numbers.types import Function
from .lane_loops import LANE
from .settling import FRESH, Block, settled
from .written import Entries, Joined, Letter, Registers, Writer, among, kind_of, tree


def last_of(called: str) -> int | None:
    """Return K of a table (c_0, ..., c_K) of Stumpff's functions; None for other functions."""
    word, _, last = called.partition("_")
    return int(last) if word == "stumpff" and last.isdigit() else None


class Structured(Scope):
    """One call of a function: its branches and loops become statements."""

    def call(self, arguments: Sequence[Any], turn: Callable[[Any], None] | None = None) -> Any:
        """Write the statements of the call and return its result."""
        routine, block, before = self.routine, self.routine.block, len(self.routine.loops)
        said = self.module.said.get(self.node.name)
        if said and routine.count and self.node.name not in TOOLS and not _small(self.node):
            routine.do(ast.Expr(ast.Constant(said)))
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
                place: Letter = self.routine.memory(kind_of(e))
                word = re.sub(r"\W.*", "", name.removeprefix("turns of the loop"))
                self.routine.hints[place.name] = f"{word}_{next(made)}" if several else word
                return place

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
TOOLS = {"advance", "balanced", "put_flat"} | {
    f.name for f in ast.parse(texts_of("tuple_operations")).body if isinstance(f, ast.FunctionDef)
}


class Specialised(Module):
    """A text of the compiler whose functions write statements.

    fields: name → (kind, lengths) of the state's; constants: name → what the file has by that name
    as well: a number, numbers, or lanes, of `width` numbers, in nested tuples. made: the functions
    that are written.
    """

    scope = Structured

    def __init__(
        self, text: str, names: Mapping[str, Any], fields: Mapping[str, Any],
        constants: Mapping[str, Any], width: int = 0,
    ) -> None:  # fmt: skip
        self.fields, self.constants, self.width = fields, constants, width
        self.letters: dict[str, list[str]] = {}  # by functions: the names of what they take
        self.said: dict[str, str] = {}  # by functions: what they do
        self.made: dict[str, ast.FunctionDef] = {}
        self.lengths: dict[str, int] = {}  # of the results of functions of numbers
        super().__init__(text, names_of(text, Double(), **names))
        self.names |= {word: partial(self._called, word, self.names[word])
                       for word in self.names if last_of(word) is not None}  # fmt: skip
        self.names |= {f.__name__: f for f in (
            self.lane, self.total, self.larger, self.largest, self.read_lanes, self.write_lanes,
        )}  # fmt: skip
        self.names["blank"] = lambda rows, _: [Registers(self.routine) for _ in range(rows)]
        self._elimination: Any = self.names.get("eliminate")
        self.names["eliminate"] = self._eliminate

    def new_routine(self) -> Any:
        """Return a writer."""
        return Writer()

    def _function(self, node: ast.FunctionDef, part: str, function: Any) -> Function:
        self.letters[node.name] = [a.arg for a in node.args.args]
        self.said[node.name] = (ast.get_docstring(node) or "").split("\n\n")[0]
        made = super()._function(node, part, function)
        if "kernel" not in decorators(node):
            return made
        # an unknown that is always 0 is a number like the others
        return lambda *e: mapped(lambda k: float(k) if type(k) is int else k, made(*e))

    def _called(self, name: str, function: Function, *arguments: Any) -> Any:
        """Call a function of numbers, which the file has; write others where they are called."""
        if not all(isinstance(e, (Value, int, float)) for e in arguments):
            return function(*arguments)
        if name not in self.made:

            def write(_: Any, out: Entries, *numbers: Any) -> None:
                results = function(*numbers)
                self.lengths[name] = len(results)
                for i, e in enumerate(results):
                    out[i] = e

            letters = "".join(f", {e}: float" for e in self.letters[name])
            self.function(f"def {name}(out: Out{letters}) -> None:", write)
        made, kind = self._array(self.lengths[name]), among(*arguments)
        self.routine.called("", name, *map(tree, (Value("f", made.name), *arguments)))
        return tuple(self.routine.get(kind, made._at(k), "p") for k in range(self.lengths[name]))

    def _zeros(self, rows: int, columns: int) -> Any:
        return self._array(rows * columns, columns)

    def _array(self, length: int, columns: int | None = None) -> Entries:
        name = self.routine.name("v")
        self.routine.hints[name] = "rows" if columns else "table"
        zeros = ast.BinOp(ast.List([ast.Constant(0.0)]), ast.Mult(), ast.Constant(length))
        self.routine.do(ast.AnnAssign(ast.Name(name), ast.Name("Out"), zeros, 1))
        return Entries("f", name, columns, self.routine)

    def _eliminate(self, a: Entries, m: int) -> None:
        if "eliminate" not in self.made:
            self.function("def eliminate(a: Out, m: int) -> None:", lambda _, a, m:
                          self._elimination(replace(a, columns=m + 1), m))  # fmt: skip
        self.routine.called("", "eliminate", ast.Name(a.name), ast.Constant(m))

    def lane(self, number: Any, j: int) -> Any:
        """Return lane j; a number without lanes is the same in all."""
        if kind_of(number) != "v":
            return number
        return self.routine.get("f", ast.Subscript(tree(number), ast.Constant(j)))

    def total(self, number: Any) -> Any:
        """Return the sum of all lanes."""
        return sum((self.lane(number, j) for j in range(1, self.width)), self.lane(number, 0))

    def larger(self, one: Any, other: Any) -> Any:
        """Return the larger number in each lane; `other` if one of the two is NaN."""
        a, b = tree(one), tree(other)
        choice = ast.IfExp(ast.Compare(a, [ast.Gt()], [b]), a, b)
        return self.routine.get(among(one, other), choice)

    def largest(self, number: Any) -> Any:
        """Return the largest lane; NaN if the last lane is NaN."""
        return reduce(self.larger, (self.lane(number, j) for j in range(self.width)))

    def read_lanes(self, array: Any, index: Any, _: int) -> Any:
        """Return entries of an array as lanes."""
        if isinstance(array, Registers):
            return array.place(index, "v")[0]
        return self.routine.get("v", self._lanes_at(array, index))

    def write_lanes(self, array: Any, index: Any, numbers: Any, _: int) -> None:
        """Write lanes into an array."""
        if isinstance(array, Registers):
            array.place(index, "v")[0] = numbers
        else:
            self.routine.do(ast.Assign([self._lanes_at(array, index)], tree(numbers)))

    def _lanes_at(self, array: Any, index: Any) -> ast.expr:
        if isinstance(array, Joined):
            array, index = array._at(index)
        at = ast.BinOp(tree(index), ast.Add(), ast.Name(LANE))
        return ast.Subscript(tree(Value("f", array.name)), at)

    def function(self, head: str, write: Callable[..., Any] | None = None, said: str = "") -> None:
        """Write a function of a file, which the text then calls by its name.

        head: its first line, with what it takes. write: calls functions `of(name)` of the text with
        that, and returns the result, or None; by default that of the same name. said: what it does,
        if the text does not say it.
        """
        (made,) = ast.parse(f"{head}\n    pass").body
        assert isinstance(made, ast.FunctionDef) and made.returns is not None
        name, before = made.name, self.routine
        self.routine = writer = Writer()
        outer = {e: self.names.get(e) for e in self.constants}  # numbers write into their function
        self.names |= {e: self._constant(e, v) for e, v in self.constants.items()}
        letters = [self._letter(a.arg, ast.unparse(a.annotation or a)) for a in made.args.args]
        result = (write or (lambda of, *e: of(name)(*e)))(self.names.__getitem__, *letters)
        if result is not None:
            writer.do(ast.Return(tree(result)))
        taken = {a.arg for a in made.args.args}
        made.body = settled(writer.block, writer.variables, writer.hints, taken, self.width)
        said = said or self.said.get(name, "")
        made.body[:0] = [ast.Expr(ast.Constant(said))] if said else []
        self.made[name], self.routine = ast.fix_missing_locations(made), before
        self.names |= outer
        if name not in self.lengths:
            self.knows(made)

    def knows(self, *functions: ast.FunctionDef) -> None:
        """Let the text call functions of the file by their names."""
        for f in functions:
            kind = {"int": "i", "float": "f"}.get(ast.unparse(f.returns or f), "")
            self.names[f.name] = partial(self._call, kind, f.name)

    def _call(self, kind: str, name: str, *arguments: Any) -> Any:
        return self.routine.called(kind, name, *map(_given, arguments))

    def _letter(self, name: str, kind: str) -> Any:
        """Return what a function takes: a number, an array, or the state."""
        if kind == "State":
            return SimpleNamespace(name=name, **{
                e: Entries(k[0], f"{name}.{e}", lengths[-1], self.routine) if len(lengths) == 2
                else Entries(k[0], f"{name}.{e}", None, self.routine) if lengths
                else Letter(k[0], f"{name}.{e}", self.routine)
                for e, (k, lengths) in self.fields.items()
            })  # fmt: skip
        if kind in ("Vector", "Out"):
            return Entries("f", name, None, self.routine)
        return Value(kind[0], name, self.routine)

    def _constant(self, name: str, value: Any, first: int = 0) -> Any:
        """Return a constant of the file as the text finds it."""
        if isinstance(value, (int, float)):
            name = "LARGE" if name == "HUGE" else name  # C may have a HUGE of its own
            return Value("i" if isinstance(value, int) else "f", name, self.routine)
        if isinstance(value, list):
            return Entries("i" if isinstance(value[0], int) else "f", name, None, self.routine)
        if not isinstance(value, tuple):
            return Value("v", f"{name}[{f'{first} + ' if first else ''}{LANE}]", self.routine)
        entries = []
        for part in value:
            entries.append(self._constant(name, part, first))
            first += np.size(part)
        return tuple(entries)


def _given(e: Any) -> ast.expr:
    """Return an argument: a number, an array, or the state."""
    return ast.Name(e.name) if isinstance(e, SimpleNamespace) else tree(
        Value("", e.name) if isinstance(e, Entries) else e)  # fmt: skip
