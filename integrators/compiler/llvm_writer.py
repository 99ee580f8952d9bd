"""From the text of kernels and driver to LLVM: a small part of Python, written as instructions.

Numbers are floats, whole numbers and truth values; tuples exist only while this is written, so
that each of their entries is a register; arrays are pointers to C-contiguous numbers. What Python
knows already (constants, lengths, functions) is decided here: such an `if` leaves one branch, and
a loop over a tuple is unrolled. Division by zero gives inf or nan, as in the arithmetic itself.
"""

from __future__ import annotations

import ast
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from .llvm_expressions import FAST, INTRINSICS, Expressions, decorators
from .llvm_values import (
    TYPES,
    Array,
    Routine,
    Value,
    filled,
    flat,
    form,
    name_of,
    register,
    type_of,
)

UNROLLED = 16  # turns of a loop of constant length that are written one after another


class Module:
    """The functions of one text and the values of its names, and what is written of them.

    foreign: name → length of the result, of functions (ptr arguments, ptr result) elsewhere.
    """

    def __init__(
        self,
        functions: Mapping[str, ast.FunctionDef],
        names: Mapping[str, Any],
        foreign: Mapping[str, int],
    ) -> None:
        self.functions, self.names, self.foreign = functions, names, foreign
        self.written: list[str] = []
        self._declared: dict[str, str] = {}
        self._shared: dict[Any, tuple[str, Any]] = {}

    def text(self) -> str:
        """All that was written."""
        return "\n".join([*self._declared.values(), *self.written])

    def export(self, name: str, arrays: Mapping[str, Array]) -> None:
        """Write a function for callers outside: `arrays` by their names, else whole numbers.

        What it returns, whole numbers, is stored through one more pointer.
        """
        node, routine = self.functions[name], Routine()
        given: dict[str, Any] = {}
        for argument in (a.arg for a in node.args.args):
            kind = arrays.get(argument, Value("i", ""))
            given[argument] = replace(kind, name=f"%{argument}")
        found = Scope(self, routine, node).call(list(given.values()))
        for i, value in enumerate(found):
            at = routine.get("i", f"getelementptr i64, ptr %.out, i64 {i}")
            routine.do(f"store i64 {name_of(value)}, ptr {at.name}")
        routine.do("ret void")
        types = [f"ptr noalias %{a}" if isinstance(v, Array) else f"i64 %{a}"
                 for a, v in given.items()]  # fmt: skip
        self._define(f"void @{name}({', '.join([*types, 'ptr noalias %.out'])})", routine)

    def shared(self, node: ast.FunctionDef, arguments: list[Any]) -> tuple[str, list[Any], Any]:
        """(type and name, flat arguments, form of the result) of a function written once."""
        forms, given = [form(a) for a in arguments], [v for a in arguments for v in flat(a)]
        key = (node.name, str(forms))
        if key not in self._shared:
            routine, name = Routine(), f"@{node.name}.{len(self._shared)}"
            inner = iter([replace(v, name=f"%a{i}") for i, v in enumerate(given)])
            found = Scope(self, routine, node).call([filled(f, inner) for f in forms])
            values = [register(v) for v in flat(found)]
            returned = f"{{{', '.join(TYPES[v.kind] for v in values)}}}"
            whole = "undef"
            for i, v in enumerate(values):
                one = f"insertvalue {returned} {whole}, {TYPES[v.kind]} {v.name}, {i}"
                whole = routine.get("f", one).name
            routine.do(f"ret {returned} {whole}")
            parameters = ", ".join(f"{type_of(v)} %a{i}" for i, v in enumerate(given))
            self._define(f"internal {returned} {name}({parameters})", routine)
            self._shared[key] = f"{returned} {name}", form(found)
        return self._shared[key][0], given, self._shared[key][1]

    def declare(self, name: str, kinds: str) -> str:
        """The name of a function of floats, of C's library or an intrinsic."""
        name = f"@llvm.{name}.f64" if name in INTRINSICS else f"@{name}"
        self._declared[name] = f"declare double {name}({', '.join(TYPES[k] for k in kinds)})"
        return name

    def declare_foreign(self, name: str) -> None:
        """A function that is found by its name when the machine code is loaded."""
        self._declared[name] = f"declare void @{name}(ptr, ptr)"

    def _define(self, head: str, routine: Routine) -> None:
        body = [f"define {head} {{", "entry:", *routine.entry, *routine.lines, "}"]
        self.written.append("\n".join(body))


class Scope(Expressions):
    """One function of the text at one place where it is called."""

    def __init__(self, module: Module, routine: Routine, node: ast.FunctionDef) -> None:
        self.module, self.routine, self.node = module, routine, node
        self.fast = FAST if decorators(node) & {"kernel", "node"} else ""
        self.known: dict[str, Any] = {}
        self.branching = any(_branches(n) for n in ast.walk(node) if n is not node.body[-1])
        self.often = _assigned_often(node) if self.branching else set()
        self.places: dict[str, Any] = {}
        self.exit = self.result = None
        self.ends: list[str] = []  # of the loops around

    def call(self, arguments: list[Any]) -> Any:
        """What the function returns; tuples as Python's."""
        for argument, value in zip(self.node.args.args, arguments, strict=True):
            self._bind(argument.arg, value)
        if not self.branching:
            *body, last = self.node.body
            self._run(body)
            if isinstance(last, ast.Return):
                return None if last.value is None else self.value(last.value)
            return self._run([last])
        self.exit = self.routine.name("exit")
        self._run(self.node.body)
        self.routine.begin(self.exit)
        return None if self.result is None else self._loaded(self.result)

    # -- statements -----------------------------------------------------------------------------

    def _run(self, statements: Sequence[Any]) -> None:
        for statement in statements:
            if not self.routine.open:
                return
            match statement:
                case ast.Assign(targets=[target], value=node):
                    self._assign(target, self.value(node))
                case ast.AugAssign(target=target, op=op, value=node):
                    read = ast.copy_location(ast.parse(ast.unparse(target), mode="eval").body, node)
                    self._assign(target, self._binary(op, self.value(read), self.value(node)))
                case ast.Return(value=node):
                    self._return(None if node is None else self.value(node))
                case ast.Expr(value=node):
                    self.value(node)
                case ast.If():
                    self._if(statement)
                case ast.While(orelse=[]):
                    self._while(statement)
                case ast.For(orelse=[]):
                    self._for(statement)
                case ast.Break():
                    self.routine.jump(self.ends[-1])
                case ast.Pass():
                    pass
                case _:
                    raise self._unknown(statement)

    def _unknown(self, node: Any) -> NotImplementedError:
        return NotImplementedError(f"{self.node.name}: {ast.unparse(node)} is not of the language")

    def _assign(self, target: Any, found: Any) -> None:
        if isinstance(target, ast.Tuple):
            for one, value in zip(target.elts, found, strict=True):
                self._assign(one, value)
        elif isinstance(target, ast.Subscript):
            array, at = self._entry(target)
            self.routine.do(f"store {TYPES[array.kind]} {self._as(array.kind, found)}, ptr {at}")
        else:
            self._bind(target.id, found)

    def _bind(self, name: str, found: Any) -> None:
        """A name that is assigned once is its value; another is a variable."""
        if name not in self.often:
            self.known[name] = found
            return
        if name not in self.places:
            self.places[name] = self._place(found)
        self._store(found, self.places[name])

    def _place(self, found: Any) -> Any:
        """Variables for a number or a tuple of them."""
        if isinstance(found, tuple):
            return tuple(self._place(v) for v in found)
        kind = register(found).kind
        return Array(kind, self.routine.variable(kind))

    def _store(self, found: Any, place: Any) -> None:
        if isinstance(place, tuple):
            for value, one in zip(found, place, strict=True):
                self._store(value, one)
        else:
            self.routine.do(f"store {TYPES[place.kind]} {self._as(place.kind, found)}, "
                            f"ptr {place.name}")  # fmt: skip

    def _loaded(self, place: Any) -> Any:
        if isinstance(place, tuple):
            return tuple(self._loaded(one) for one in place)
        return self.routine.get(place.kind, f"load {TYPES[place.kind]}, ptr {place.name}")

    def _return(self, found: Any) -> None:
        if found is not None:
            if self.result is None:
                self.result = self._place(found)
            self._store(found, self.result)
        self.routine.jump(str(self.exit))

    def _if(self, node: ast.If) -> None:
        test = self.value(node.test)
        if not isinstance(test, Value):
            self._run(node.body if test else node.orelse)
            return
        routine = self.routine
        yes, no, after = (routine.name(label) for label in ("yes", "no", "after"))
        routine.do(f"br i1 {test.name}, label %{yes}, label %{no}")
        routine.open = False
        for label, body in ((yes, node.body), (no, node.orelse)):
            routine.begin(label)
            self._run(body)
            if routine.open:
                routine.jump(after)
        routine.begin(after)

    def _while(self, node: ast.While) -> None:
        routine = self.routine
        head, body, end = (routine.name(label) for label in ("head", "body", "end"))
        routine.begin(head)
        test = self._as("b", self.value(node.test))
        routine.do(f"br i1 {test}, label %{body}, label %{end}")
        routine.open = False
        routine.begin(body)
        self._turn(node.body, end)
        routine.jump(head)
        routine.begin(end)

    def _turn(self, body: list[Any], end: str) -> None:
        self.ends.append(end)
        self._run(body)
        self.ends.pop()

    def _for(self, node: ast.For) -> None:
        counted = isinstance(node.iter, ast.Call) and getattr(node.iter.func, "id", "") == "range"
        if not counted:
            turns: Any = self._items(node.iter)
        else:
            bounds = [self.value(a) for a in node.iter.args]  # type: ignore[attr-defined]
            whole = all(isinstance(b, int) for b in bounds)
            turns = range(*bounds) if whole else None
            leaves = any(isinstance(n, ast.Break) for s in node.body for n in ast.walk(s))
            if turns is None or len(turns) > UNROLLED or leaves:
                self._count(node, bounds)
                return
        for item in turns:
            self._assign(node.target, item)
            self._run(node.body)

    def _count(self, node: Any, bounds: list[Any]) -> None:
        """A loop over whole numbers in steps of a constant."""
        routine = self.routine
        start, stop, step = [0, bounds[0], 1] if len(bounds) == 1 else [*bounds, 1][:3]
        place = self._place(register(start))
        self._store(start, place)
        head, body, end = (routine.name(label) for label in ("head", "body", "end"))
        routine.begin(head)
        at = self._loaded(place)
        test = self._compare(ast.Lt() if step > 0 else ast.Gt(), at, stop)
        routine.do(f"br i1 {self._as('b', test)}, label %{body}, label %{end}")
        routine.open = False
        routine.begin(body)
        self._assign(node.target, at)
        self._turn(node.body, end)
        self._store(self._binary(ast.Add(), at, step), place)
        routine.jump(head)
        routine.begin(end)


def _branches(node: Any) -> bool:
    """Whether the path through a function may depend on numbers there."""
    counted = isinstance(node, ast.For) and isinstance(node.iter, ast.Call)
    if counted and getattr(node.iter.func, "id", "") != "range":
        counted = False
    return counted or isinstance(node, (ast.If, ast.While, ast.Return))


def _assigned_often(node: ast.FunctionDef) -> set[str]:
    """The names that more than one place of a function assigns."""
    seen = [a.arg for a in node.args.args]
    inner = {id(n) for c in ast.walk(node) if isinstance(c, ast.ListComp) for n in ast.walk(c)}
    for n in ast.walk(node):
        if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store) and id(n) not in inner:
            seen.append(n.id)
        if isinstance(n, ast.AugAssign) and isinstance(n.target, ast.Name):
            seen.append(n.target.id)
    return {name for name in seen if seen.count(name) > 1}
