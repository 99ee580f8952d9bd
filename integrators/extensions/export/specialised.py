"""A driver of the compiler as statements of `statements`: loops and branches on numbers stay.

The compiler's own writer runs the text (`compiler.llvm_writer`); here its numbers write statements
instead of instructions. Tuples, records and what Python knows exist only during this writing. Each
result first gets a name of its own; `settled` puts those that are used once back where they are
used, and leaves out what nothing needs.
"""

from __future__ import annotations

import ast
import math
import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from keyword import iskeyword
from typing import Any

from ...compiler import texts_of
from ...compiler.llvm_statements import Scope, loaded
from ...compiler.llvm_values import ARITHMETIC, Array, Value, mapped
from ...compiler.llvm_writer import Module
from ...numbers.types import Function
from .statements import KNOWN, last_of

Block = list[ast.stmt]
OPERATORS: dict[str, Any] = {
    "add": ast.Add, "sub": ast.Sub, "mul": ast.Mult, "truediv": ast.Div, "floordiv": ast.FloorDiv,
    "mod": ast.Mod, "lt": ast.Lt, "le": ast.LtE, "gt": ast.Gt, "ge": ast.GtE, "eq": ast.Eq,
    "ne": ast.NotEq,
}  # fmt: skip
KINDS = {"f": "float", "i": "int", "b": "bool"}
ZEROS: dict[str, Any] = {"f": 0.0, "i": 0, "b": False}
FRESH = re.compile(r"[tv]\d+_$")  # the names of results, and of variables, before `named`
#: words of some language, which no letter may be called by
RESERVED = {"end", "double", "int", "float", "long", "short", "char", "const", "static", "void",
            "do", "switch", "case", "default", "struct", "union", "enum", "function", "begin",
            "let", "local", "module", "using", "s", "N", "M", "state", "signed", "auto", "goto",
            "register", "extern", "inline", "restrict", "typedef", "sizeof", *KNOWN}  # fmt: skip


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
        made.body = settled(writer, {a.arg for a in made.args.args})
        return ast.fix_missing_locations(made)


# -- from a name for each result to a text that one reads ------------------------------------------


def settled(writer: Writer, taken: Iterable[str]) -> Block:
    """Return the statements without what nothing needs, each result where it is used, named."""
    block = writer.block
    while True:
        read = Counter(_read(block))
        lean = _lean(block, read)
        if _count(lean) == _count(block):
            break
        block = lean
    block = _Placing(read).block(block)
    beyond = _beyond(block, set())
    block = [_Outside(beyond, writer.variables).visit(s) for s in block]
    kept = {n for s in block for e in ast.walk(s) if isinstance(e, ast.Name) for n in [e.id]}
    first: Block = [
        ast.AnnAssign(ast.Name(name), ast.Name(KINDS[kind]), ast.Constant(ZEROS[kind]), 1)
        for name, kind in writer.variables.items() if name in kept
    ]  # fmt: skip
    return _named(first + block, writer.hints, {*taken})


def _count(block: Block) -> int:
    return sum(isinstance(e, ast.stmt) for s in block for e in ast.walk(s))


def _beyond(block: Block, known: set[str]) -> set[str]:
    """Return the results that are used outside the block in which they get their names."""
    here, found = set(known), set[str]()
    for s in block:
        found |= {n for n in _own(s) if n.startswith("t") and FRESH.match(n)} - here
        if isinstance(s, ast.AnnAssign):
            here |= {ast.unparse(s.target)}
        inner = here | ({ast.unparse(s.target)} if isinstance(s, ast.For) else set())
        for part in (getattr(s, "body", []), getattr(s, "orelse", [])):
            found |= _beyond(part, inner)
        if isinstance(s, ast.While):
            found |= {n for n in _names(s.test) if n.startswith("t") and FRESH.match(n)} - here
    return found


class _Outside(ast.NodeTransformer):
    """Makes variables of results that are used outside their block."""

    def __init__(self, names: set[str], variables: dict[str, str]) -> None:
        self.names, self.variables = names, variables

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.stmt:
        name = ast.unparse(node.target)
        if name not in self.names or node.value is None:
            return node
        kinds = {word: kind for kind, word in KINDS.items()}
        self.variables[name] = kinds[ast.unparse(node.annotation)]
        return ast.Assign([node.target], node.value)


def _read(block: Sequence[ast.AST]) -> list[str]:
    """Return the names that are read, once for each time."""
    found = []
    for s in block:
        written = [*s.targets] if isinstance(s, ast.Assign) else []
        written += [s.target] if isinstance(s, (ast.AnnAssign, ast.For)) else []
        names = {id(e) for e in written if isinstance(e, ast.Name)}
        for e in ast.iter_child_nodes(s):
            if isinstance(e, ast.stmt):
                found += _read([e])
            elif id(e) not in names:
                found += [n.id for n in ast.walk(e) if isinstance(n, ast.Name)]
    return found


def _lean(block: Block, read: Mapping[str, int]) -> Block:
    """Return the statements without results and variables that are never read."""
    found: Block = []
    for s in block:
        target = s.targets[0] if isinstance(s, ast.Assign) else getattr(s, "target", None)
        own = isinstance(s, (ast.Assign, ast.AnnAssign)) and isinstance(target, ast.Name)
        if own and FRESH.match(target.id) and not read.get(target.id):  # type: ignore[union-attr]
            continue
        if isinstance(s, ast.If):
            yes, no = _lean(s.body, read), _lean(s.orelse, read)
            if yes or no:
                test = s.test if yes else ast.UnaryOp(ast.Not(), s.test)
                found.append(ast.If(test, yes or no, no if yes else []))
        elif isinstance(s, (ast.While, ast.For)):
            body = _lean(s.body, read)
            if isinstance(s, ast.While):
                found.append(ast.While(s.test, body, []))
            elif any(not (isinstance(e, ast.Expr) and isinstance(e.value, ast.Constant))
                     for e in body):  # fmt: skip
                found.append(ast.For(s.target, s.iter, body, []))
        else:
            found.append(s)
    return found


class _Placing(ast.NodeTransformer):
    """Puts results that are used once into the place of their use, if nothing writes between."""

    def __init__(self, read: Mapping[str, int]) -> None:
        self.read = read
        self.waiting: dict[str, tuple[ast.AnnAssign, set[str]]] = {}

    def visit_Name(self, node: ast.Name) -> ast.expr:
        if node.id not in self.waiting:
            return node
        found, _ = self.waiting.pop(node.id)
        assert found.value is not None
        return found.value

    def visit_UnaryOp(self, node: ast.UnaryOp) -> ast.expr:
        """Leave two signs out."""
        self.generic_visit(node)
        inner = node.operand
        if isinstance(node.op, ast.USub) and isinstance(inner, ast.UnaryOp):
            return inner.operand if isinstance(inner.op, ast.USub) else node
        return node

    def block(self, block: Block) -> Block:
        """Return the statements of a block."""
        found: Block = []
        outer, self.waiting = self.waiting, {}
        uses = [Counter(_own(s)) for s in block]
        for k, s in enumerate(block):
            if isinstance(s, ast.AnnAssign) and isinstance(s.target, ast.Name) and not _zeros(s):
                reads = {r for n in _names(s.value) if n in self.waiting
                         for r in self.waiting[n][1]} | _kept(s.value)  # fmt: skip
                s = ast.AnnAssign(s.target, s.annotation, self.visit(s.value), 1)  # type: ignore[arg-type]
                once = self.read.get(s.target.id, 0) == 1  # type: ignore[union-attr]
                if once and any(u[s.target.id] for u in uses[k + 1 :]):  # type: ignore[union-attr]
                    self.waiting[s.target.id] = (s, reads)  # type: ignore[union-attr]
                else:
                    found.append(s)
                continue
            written = _written([s])
            now = {*_own(s)}
            for name, (waits, reads) in [*self.waiting.items()]:
                if name not in now and reads & written:
                    found.append(waits)
                    del self.waiting[name]
            found.append(self._whole(s))
        found += [waits for waits, _ in self.waiting.values()]
        self.waiting = outer
        return found

    def _whole(self, s: ast.stmt) -> ast.stmt:
        if isinstance(s, ast.If):
            return ast.If(_plain(self.visit(s.test)), self.block(s.body), self.block(s.orelse))
        if isinstance(s, ast.For):
            return ast.For(s.target, self.visit(s.iter), self.block(s.body), [])
        if isinstance(s, ast.While):
            body, test = self.block(s.body), s.test
            first = body[0] if body else None
            if isinstance(first, ast.If) and not first.orelse and isinstance(
                first.body[0], ast.Break
            ):  # fmt: skip
                test, body = _plain(ast.UnaryOp(ast.Not(), first.test)), body[1:]
            return ast.While(test, body, [])
        made: ast.stmt = self.visit(s)
        return made


def _own(s: ast.stmt) -> list[str]:
    """Return the names that a statement reads itself, not in its blocks."""
    if isinstance(s, ast.While):
        return []
    if isinstance(s, (ast.If, ast.For)):
        return _names(s.test if isinstance(s, ast.If) else s.iter)
    return _read([s])


def _names(e: ast.AST | None) -> list[str]:
    return [n.id for n in ast.walk(e) if isinstance(n, ast.Name)] if e is not None else []


def _zeros(s: ast.AnnAssign) -> bool:
    return isinstance(s.value, ast.BinOp) and isinstance(s.value.left, ast.List)


def _kept(e: ast.AST | None) -> set[str]:
    """Return the arrays and variables that an expression reads."""
    arrays = {ast.unparse(n.value) for n in ast.walk(e) if isinstance(n, ast.Subscript)}  # type: ignore[arg-type]
    return arrays | {n for n in _names(e) if FRESH.match(n) and n.startswith("v")}


def _written(block: Sequence[ast.stmt]) -> set[str]:
    """Return the arrays and variables that statements write."""
    found = set[str]()
    for s in block:
        for e in ast.walk(s):
            if isinstance(e, ast.Assign):
                (target,) = e.targets
                inner = target.value if isinstance(target, ast.Subscript) else target
                found.add(ast.unparse(inner))
            elif isinstance(e, ast.Expr) and isinstance(e.value, ast.Call):
                found |= {n for a in e.value.args for n in _names(a)}
    return found


OPPOSITE: dict[type, type] = {ast.Eq: ast.NotEq, ast.NotEq: ast.Eq}


def _plain(test: ast.expr) -> ast.expr:
    """Return a condition without two negations; a negated order stays, since NaN has none."""
    if isinstance(test, ast.UnaryOp) and isinstance(test.op, ast.Not):
        inner = test.operand
        if isinstance(inner, ast.UnaryOp) and isinstance(inner.op, ast.Not):
            return _plain(inner.operand)
        if isinstance(inner, ast.Compare) and type(inner.ops[0]) in OPPOSITE:
            return ast.Compare(inner.left, [OPPOSITE[type(inner.ops[0])]()], inner.comparators)
    return test


def _named(block: Block, hints: Mapping[str, str], taken: set[str]) -> Block:
    """Return the statements with names that the text has, each used for one thing."""
    seen = Counter[str]()
    found: dict[str, str] = {}

    class Naming(ast.NodeTransformer):
        def visit_Name(self, node: ast.Name) -> ast.expr:
            if FRESH.match(node.id) and node.id not in found:
                word = hints.get(node.id) or node.id[0]
                while True:
                    number, seen[word] = seen[word], seen[word] + 1
                    name = f"{word}_{number}" if number or word in RESERVED or iskeyword(word) \
                        else word  # fmt: skip
                    if name not in taken:
                        break
                taken.add(name)
                found[node.id] = name
            return ast.Name(found.get(node.id, node.id))

    return [Naming().visit(s) for s in block]
