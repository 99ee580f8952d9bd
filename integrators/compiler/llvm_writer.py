"""From the text of kernels and driver to LLVM: Python runs it on numbers that write instructions.

A straight function is called as it is (`llvm_values`). In a function with branches and loops that
depend on numbers the statements are gone through here, one after another, and Python evaluates
their expressions. Tuples exist only while this is written, so that each entry is a register; what
Python knows already (constants, lengths, functions) is decided: such an `if` leaves one branch.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from .llvm_values import (
    TYPES,
    Array,
    Routine,
    Value,
    chosen,
    combined,
    filled,
    flat,
    form,
    mathematical,
    negated,
    register,
    whole,
)

UNROLLED = 16  # turns of a loop of constant length that are written one after another
#: decorators: flags of the arithmetic (sums in any order), whether it is written once and called
KINDS = {"kernel": (FAST := "contract arcp nsz reassoc ", False), "node": (FAST, True),
         "aside": ("", True), "helper": ("", False)}  # fmt: skip
LOOPS = (ast.While, ast.For)
STATEMENTS = (ast.Assign, ast.AugAssign, ast.Return, ast.Expr, ast.If, ast.Break, ast.Pass, *LOOPS)


class Module:
    """The functions of one text, and what is written of them.

    names: the values of its names, as Python runs it. foreign: name → length of the result, of
    functions (ptr arguments, ptr result) elsewhere.
    """

    def __init__(self, text: str, names: Mapping[str, Any], foreign: Mapping[str, int]) -> None:
        self.foreign, self.written = foreign, list[str]()
        self.declared: dict[str, str] = {}
        self.routine = Routine(self.declared)
        self._shared: dict[str, tuple[str, Any]] = {}
        inner = {n: mathematical(n, f) for n, f in names.items() if getattr(math, n, None) is f
                 and callable(f)}  # fmt: skip
        self.names = {**names, **inner, "_chosen": chosen, "_combined": combined,
                      "_negated": negated, "int": whole, "workspace": self._workspace}  # fmt: skip
        self.arguments: dict[str, list[str]] = {}
        for node in ast.parse(text).body:
            if isinstance(node, ast.FunctionDef):
                self.names[node.name] = self._function(node)
            else:
                self.run(node)

    def run(self, statement: ast.stmt) -> None:
        """Let Python run a statement of the text."""
        exec(compile(ast.Module([statement], []), "<kernels>", "exec"), self.names)

    def _function(self, node: ast.FunctionDef) -> Callable[..., Any]:
        """What a function's name stands for while instructions are written."""
        words = decorators(node)
        if node.name in self.foreign:
            return partial(self._foreign, node.name)
        self.arguments[node.name] = [a.arg for a in node.args.args]
        fast, shared = next((KINDS[w] for w in words if w in KINDS), ("", False))
        run: list[
            Callable[..., Any]
        ] = []  # made when it is called: a text has more than is written

        def called(*arguments: Any) -> Any:
            if not run:
                run.append(self._runnable(node))
            before, self.routine.fast = self.routine.fast, fast
            found = run[0](*arguments)
            self.routine.fast = before
            return found

        return partial(self._called, node.name, called) if shared else called

    def _runnable(self, node: ast.FunctionDef) -> Callable[..., Any]:
        node.decorator_list = []
        _Language().generic_visit(node)
        ast.fix_missing_locations(node)
        if any(_branches(n) for n in ast.walk(node) if n is not node.body[-1]):
            often = _assigned_often(node)
            return lambda *arguments: Scope(self, node, often).call(arguments)
        name, outer = node.name, self.names[node.name]
        self.run(node)
        found, self.names[name] = self.names[name], outer
        return found

    def text(self) -> str:
        """All that was written."""
        return "\n".join([*self.declared.values(), *self.written])

    def export(self, name: str, arrays: Mapping[str, Array]) -> None:
        """Write a function for callers outside: `arrays` by their names, else whole numbers.

        What it returns, whole numbers, is stored through one more pointer.
        """
        routine = self.routine
        given = [replace(arrays.get(a, Value("i")), name=f"%{a}", routine=routine)
                 for a in self.arguments[name]]  # fmt: skip
        out = Array("i", "%.out", routine=routine)
        for i, value in enumerate(self.names[name](*given)):
            out[i] = value
        routine.do("ret void")
        types = [("ptr noalias " if isinstance(v, Array) else "i64 ") + v.name
                 for v in (*given, out)]  # fmt: skip
        self._define(f"void @{name}({', '.join(types)})")

    def _define(self, head: str) -> None:
        body = [*self.routine.entry, *self.routine.lines]
        self.written.append("\n".join([f"define {head} {{", "entry:", *body, "}"]))

    def _called(self, name: str, function: Callable[..., Any], *arguments: Any) -> Any:
        """The call of a function that is written once for each form of its arguments."""
        caller, form_, given = self.routine, form(arguments), flat(arguments)
        key = f"{name} {form_}"
        if key not in self._shared:
            routine = self.routine = Routine(self.declared)
            inner = [replace(v, name=f"%a{i}", routine=routine) for i, v in enumerate(given)]
            found = function(*filled(form_, iter(inner)))
            values = flat(found)
            type_ = f"{{{', '.join(TYPES[v.kind] for v in values)}}}"
            result = "undef"
            for i, v in enumerate(values):
                one = f"insertvalue {type_} {result}, {TYPES[v.kind]} {v.name}, {i}"
                result = routine.get("f", one).name
            routine.do(f"ret {type_} {result}")
            place = f"{type_} @{name}.{len(self._shared)}"
            self._define(f"internal {place}({', '.join(map(_typed, inner))})")
            self._shared[key], self.routine = (place, form(found)), caller
        place, result_form = self._shared[key]
        whole_ = caller.get("f", f"call {place}({', '.join(map(_typed, given))})").name
        type_ = place.rsplit(" ", 1)[0]
        return filled(result_form, iter([
            caller.get(v.kind, f"extractvalue {type_} {whole_}, {i}")
            for i, v in enumerate(flat(result_form))
        ]))  # fmt: skip

    def _foreign(self, name: str, *arguments: Any) -> Array:
        """Numbers handed over in memory, and those that come back."""
        self.declared[name] = f"declare void @{name}(ptr, ptr)"
        given = self._memory(len(arguments))
        for i, argument in enumerate(arguments):
            given[i] = argument
        result = self._memory(self.foreign[name])
        self.routine.do(f"call void @{name}(ptr {given.name}, ptr {result.name})")
        return result

    def _memory(self, length: int, columns: int | None = None) -> Array:
        return Array("f", self.routine.variable("f", length), columns, self.routine)

    def _workspace(self, rows: int, columns: int) -> Array:
        """A matrix of zeros."""
        place = self._memory(rows * columns, columns)
        type_ = f"[{rows * columns} x {TYPES['f']}]"
        self.routine.do(f"store {type_} zeroinitializer, ptr {place.name}")
        return place


def _typed(value: Any) -> str:
    return f"{'ptr' if isinstance(value, Array) else TYPES[value.kind]} {value.name}"


class Scope:
    """One call of a function whose path depends on numbers."""

    def __init__(self, module: Module, node: ast.FunctionDef, often: set[str]) -> None:
        self.routine, self.node, self.often = module.routine, node, often
        self.names = dict(module.names)
        self.places: dict[str, Any] = {}  # of names that are assigned in several places
        self.result: Any = None
        self.ends: list[str] = []  # of the loops around

    def call(self, arguments: Sequence[Any]) -> Any:
        """What the function returns; tuples as Python's."""
        for argument, value in zip(self.node.args.args, arguments, strict=True):
            self._bind(argument.arg, value)
        self.exit = self.routine.name("exit")
        self._run(self.node.body)
        self.routine.begin(self.exit)
        return None if self.result is None else self._loaded(self.result)

    def value(self, node: ast.expr) -> Any:
        """What Python makes of an expression."""
        for name in sorted({n.id for n in ast.walk(node) if isinstance(n, ast.Name)}):
            if name in self.places:
                self.names[name] = self._loaded(self.places[name])
        return eval(compile(ast.Expression(node), "<kernels>", "eval"), self.names)

    def _run(self, statements: Sequence[Any]) -> None:
        for statement in statements:
            if not self.routine.open:
                return
            match statement:
                case ast.Assign(targets=[target], value=node):
                    self._assign(target, self.value(node))
                case ast.Return(value=node):
                    self._return(None if node is None else self.value(node))
                case ast.Expr(value=node):
                    self.value(node)
                case ast.If():
                    self._if(statement)
                case ast.While():
                    self._while(statement)
                case ast.For():
                    self._for(statement)
                case ast.Break():
                    self.routine.jump(f"label %{self.ends[-1]}")

    def _assign(self, target: Any, found: Any) -> None:
        if isinstance(target, ast.Tuple):
            for one, value in zip(target.elts, found, strict=True):
                self._assign(one, value)
        elif isinstance(target, ast.Subscript):
            self.value(target.value)[self.value(target.slice)] = found
        else:
            self._bind(target.id, found)

    def _bind(self, name: str, found: Any) -> None:
        """A name that is assigned in one place is its value; another is a variable."""
        if name not in self.often:
            self.names[name] = found
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
            self.routine.store(place.kind, found, place.name)

    def _loaded(self, place: Any) -> Any:
        if isinstance(place, tuple):
            return tuple(self._loaded(one) for one in place)
        return self.routine.load(place.kind, place.name)

    def _return(self, found: Any) -> None:
        if found is not None:
            if self.result is None:
                self.result = self._place(found)
            self._store(found, self.result)
        self.routine.jump(f"label %{self.exit}")

    def _if(self, node: ast.If) -> None:
        test = self.value(node.test)
        if not isinstance(test, Value):
            self._run(node.body if test else node.orelse)
            return
        yes, no, after = (self.routine.name(label) for label in ("yes", "no", "after"))
        self.routine.jump(f"i1 {test.name}, label %{yes}, label %{no}")
        for label, body in ((yes, node.body), (no, node.orelse)):
            self.routine.begin(label)
            self._run(body)
            self.routine.jump(f"label %{after}")
        self.routine.begin(after)

    def _while(self, node: ast.While) -> None:
        self._loop(lambda: self.value(node.test), lambda: self._run(node.body))

    def _loop(self, test: Callable[[], Any], turn: Callable[[], None]) -> None:
        """What `turn()` writes, while what `test()` writes is true."""
        routine = self.routine
        head, body, end = (routine.name(label) for label in ("head", "body", "end"))
        routine.begin(head)
        routine.jump(f"{routine.operand('b', test())}, label %{body}, label %{end}")
        routine.begin(body)
        self.ends.append(end)
        turn()
        self.ends.pop()
        routine.jump(f"label %{head}")
        routine.begin(end)

    def _for(self, node: ast.For) -> None:
        if not _counts(node):
            turns: Any = self.value(node.iter)
        else:
            bounds = [self.value(a) for a in node.iter.args]  # type: ignore[attr-defined]
            leaves = any(isinstance(n, ast.Break) for n in ast.walk(node))
            known = not leaves and all(isinstance(b, int) for b in bounds)
            turns = range(*bounds) if known else None
            if turns is None or len(turns) > UNROLLED:
                self._count(node, *(bounds if len(bounds) > 1 else (0, *bounds)))
                return
        for item in turns:
            self._assign(node.target, item)
            self._run(node.body)

    def _count(self, node: ast.For, start: Any, stop: Any, step: int = 1) -> None:
        """A loop over whole numbers in steps of a constant."""
        place = self._place(start)
        self._store(start, place)

        def turn() -> None:
            at = self._loaded(place)
            self._assign(node.target, at)
            self._run(node.body)
            self._store(at + step, place)

        word = "lt" if step > 0 else "gt"
        self._loop(lambda: self.routine.binary(word, self._loaded(place), stop), turn)


class _Language(ast.NodeTransformer):
    """Conditions in expressions as calls, and `a += b` as `a = a + b`.

    Raises `NotImplementedError` for statements that `Scope` does not have.
    """

    def visit(self, node: Any) -> Any:
        """The node, if the language has it."""
        plain = not isinstance(node, ast.stmt) or isinstance(node, STATEMENTS)
        several = isinstance(node, ast.Assign) and len(node.targets) > 1
        loose = getattr(node, "ifs", ()) or (isinstance(node, LOOPS) and node.orelse)
        if not plain or several or loose:
            raise NotImplementedError(f"{ast.unparse(node)} is not of the language")
        return super().visit(node)

    def visit_AugAssign(self, node: ast.AugAssign) -> Any:
        """A plain assignment."""
        read = ast.parse(ast.unparse(node.target), mode="eval").body
        value = ast.BinOp(read, node.op, node.value)
        return self.generic_visit(ast.Assign([node.target], value))

    def visit_IfExp(self, node: ast.IfExp) -> Any:
        """`chosen`, which asks for what it needs."""
        self.generic_visit(node)
        none = ast.arguments([], [], None, [], [], None, [])
        return _call(
            "chosen", node.test, ast.Lambda(none, node.body), ast.Lambda(none, node.orelse)
        )

    def visit_BoolOp(self, node: ast.BoolOp) -> Any:
        """`combined`."""
        self.generic_visit(node)
        return _call("combined", ast.Constant(isinstance(node.op, ast.And)), *node.values)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> Any:
        """`negated` for `not`."""
        self.generic_visit(node)
        return _call("negated", node.operand) if isinstance(node.op, ast.Not) else node


def _call(name: str, *arguments: ast.expr) -> ast.Call:
    return ast.Call(ast.Name(f"_{name}", ast.Load()), list(arguments), [])


def decorators(node: ast.FunctionDef) -> set[str]:
    """The names in front of a function: how it is written."""
    return {d.id for d in node.decorator_list if isinstance(d, ast.Name)}


def _counts(node: Any) -> bool:
    """Whether a statement is a loop over a range."""
    call = node.iter if isinstance(node, ast.For) else None
    return isinstance(call, ast.Call) and getattr(call.func, "id", "") == "range"


def _branches(node: Any) -> bool:
    """Whether the path through a function may depend on numbers there."""
    return _counts(node) or isinstance(node, (ast.If, ast.While, ast.Return))


def _assigned_often(node: ast.FunctionDef) -> set[str]:
    """The names that more than one place of a function assigns."""
    inner = {id(n) for c in ast.walk(node) if isinstance(c, ast.ListComp) for n in ast.walk(c)}
    seen = [a.arg for a in node.args.args] + [
        n.id for n in ast.walk(node)
        if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store) and id(n) not in inner
    ]  # fmt: skip
    return {name for name in seen if seen.count(name) > 1}
