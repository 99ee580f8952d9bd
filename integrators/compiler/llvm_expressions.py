"""Expressions of the generated text, written as LLVM's instructions."""

from __future__ import annotations

import ast
import builtins
import operator
from collections.abc import Callable
from typing import Any

from .llvm_values import TYPES, Array, Routine, Value, filled, flat, register, type_of

FAST = "contract arcp nsz reassoc "
#: functions with an intrinsic of LLVM's; others are those of C's library
INTRINSICS = {"sin", "cos", "exp", "log", "sqrt", "pow", "fabs"}
LIBRARY = {"tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh"}
_ARITHMETIC: dict[type, tuple[str, str, Callable[[Any, Any], Any]]] = {
    ast.Add: ("fadd", "add", operator.add),
    ast.Sub: ("fsub", "sub", operator.sub),
    ast.Mult: ("fmul", "mul", operator.mul),
    ast.Div: ("fdiv", "", operator.truediv),
    ast.FloorDiv: ("", "sdiv", operator.floordiv),  # of numbers from 0
    ast.Mod: ("", "srem", operator.mod),
    ast.Pow: ("", "", operator.pow),
}
_COMPARED: dict[type, tuple[str, str, Callable[[Any, Any], Any]]] = {
    ast.Lt: ("olt", "slt", operator.lt),
    ast.LtE: ("ole", "sle", operator.le),
    ast.Gt: ("ogt", "sgt", operator.gt),
    ast.GtE: ("oge", "sge", operator.ge),
    ast.Eq: ("oeq", "eq", operator.eq),
    ast.NotEq: ("une", "ne", operator.ne),
}


class Expressions:
    """What the expressions of one function are at one place where it is called."""

    module: Any
    routine: Routine
    node: ast.FunctionDef
    fast: str
    known: dict[str, Any]
    places: dict[str, Any]

    def value(self, node: Any) -> Any:
        """`Value`, `Array`, something that Python knows, or a tuple of these."""
        match node:
            case ast.Constant():
                return node.value
            case ast.Name(id=name):
                if name in self.places:
                    return self._loaded(self.places[name])
                return self.known[name] if name in self.known else self.module.names[name]
            case ast.Tuple():
                return tuple(self.value(e) for e in node.elts)
            case ast.Attribute():
                return getattr(self.value(node.value), node.attr)
            case ast.UnaryOp(op=ast.USub()):
                return self._negative(self.value(node.operand))
            case ast.UnaryOp(op=ast.Not()):
                found = self.value(node.operand)
                if not isinstance(found, Value):
                    return not found
                return self.routine.get("b", f"xor i1 {found.name}, true")
            case ast.BinOp():
                return self._binary(node.op, self.value(node.left), self.value(node.right))
            case ast.BoolOp():
                return self._truth(node)
            case ast.Compare(ops=[op], comparators=[right]):
                return self._compare(op, self.value(node.left), self.value(right))
            case ast.IfExp():
                test = self.value(node.test)
                if not isinstance(test, Value):
                    return self.value(node.body if test else node.orelse)
                return self._chosen(test, self.value(node.body), self.value(node.orelse))
            case ast.Subscript():
                return self._read(node)
            case ast.ListComp(generators=[ast.comprehension(ifs=[]) as loop]):
                return self._listed(node.elt, loop)
            case ast.Call(keywords=[]):
                return self._called(node)
        raise self._unknown(node)

    def _as(self, kind: str, found: Any) -> str:
        """LLVM's name of a number, as one of that kind."""
        found = register(found)
        if found.kind == kind:
            return found.name
        if (found.kind, kind) == ("i", "f"):
            if not found.name.startswith("%"):
                return register(float(found.name)).name
            return self.routine.get("f", f"sitofp i64 {found.name} to double").name
        raise NotImplementedError(f"{self.node.name}: {found} is no number of kind {kind}")

    def _negative(self, found: Any) -> Any:
        if not isinstance(found, Value):
            return -found
        if found.kind == "i":
            return self._binary(ast.Sub(), 0, found)
        return self.routine.get("f", f"fneg {self.fast}{TYPES['f']} {found.name}")

    def _binary(self, op: Any, left: Any, right: Any) -> Any:
        of_floats, of_whole, exact = _ARITHMETIC[type(op)]
        if not isinstance(left, Value) and not isinstance(right, Value):
            return exact(left, right)
        if isinstance(op, ast.Pow):
            if isinstance(right, int):
                return self._power(left, right)
            return self._function("pow", [left, right])
        sides = [register(left), register(right)]
        if of_whole and all(s.kind == "i" for s in sides):
            return self.routine.get("i", f"{of_whole} i64 {sides[0].name}, {sides[1].name}")
        if not of_floats:
            raise NotImplementedError(f"{self.node.name}: {type(op).__name__} of floats")
        a, b = (self._as("f", s) for s in sides)
        return self.routine.get("f", f"{of_floats} {self.fast}{TYPES['f']} {a}, {b}")

    def _power(self, base: Any, exponent: int) -> Any:
        """A whole power by squaring."""
        times = ast.Mult()
        if exponent < 0:
            return self._binary(ast.Div(), 1.0, self._power(base, -exponent))
        result: Any = 1.0
        while exponent:
            if exponent & 1:
                result = base if result == 1.0 else self._binary(times, result, base)
            exponent >>= 1
            base = self._binary(times, base, base) if exponent else base
        return result

    def _compare(self, op: Any, left: Any, right: Any) -> Any:
        of_floats, of_whole, exact = _COMPARED[type(op)]
        if not isinstance(left, Value) and not isinstance(right, Value):
            return exact(left, right)
        sides = [register(left), register(right)]
        if all(s.kind == "i" for s in sides):
            test = f"icmp {of_whole} i64 {sides[0].name}, {sides[1].name}"
        else:
            a, b = (self._as("f", s) for s in sides)
            test = f"fcmp {of_floats} {TYPES['f']} {a}, {b}"
        return self.routine.get("b", test)

    def _truth(self, node: ast.BoolOp) -> Any:
        """All parts are computed: none has an effect."""
        both = isinstance(node.op, ast.And)
        result: Any = both
        for part in node.values:
            found = self.value(part)
            if not isinstance(found, Value):
                if bool(found) is not both:
                    return not both
            elif isinstance(result, Value):
                word = "and" if both else "or"
                result = self.routine.get("b", f"{word} i1 {result.name}, {found.name}")
            else:
                result = found
        return result

    def _chosen(self, test: Value, yes: Any, no: Any) -> Any:
        """One of two, which are both computed."""
        if isinstance(yes, tuple):
            return tuple(self._chosen(test, a, b) for a, b in zip(yes, no, strict=True))
        kinds = {register(yes).kind, register(no).kind}
        kind = kinds.pop() if len(kinds) == 1 else "f"
        one, other = (f"{TYPES[kind]} {self._as(kind, v)}" for v in (yes, no))
        return self.routine.get(kind, f"select i1 {test.name}, {one}, {other}")

    def _read(self, node: ast.Subscript) -> Any:
        whole = self.value(node.value)
        if not isinstance(whole, Array):
            if isinstance(node.slice, ast.Slice):
                parts = (node.slice.lower, node.slice.upper)
                return whole[slice(*(None if p is None else self.value(p) for p in parts))]
            return whole[self.value(node.slice)]
        if whole.columns is not None and not isinstance(node.slice, ast.Tuple):
            return Array(whole.kind, self._entry(node)[1])  # a row
        array, at = self._entry(node)
        return self.routine.get(array.kind, f"load {TYPES[array.kind]}, ptr {at}")

    def _entry(self, node: ast.Subscript) -> tuple[Array, str]:
        """An array, and where an entry of it is (or a row, of one with two indices)."""
        array = self.value(node.value)
        indices = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        at: Any = self.value(indices[0])
        if array.columns is not None:
            at = self._binary(ast.Mult(), at, array.columns)
            if len(indices) == 2:
                at = self._binary(ast.Add(), at, self.value(indices[1]))
        place = f"getelementptr {TYPES[array.kind]}, ptr {array.name}, i64 {self._as('i', at)}"
        return array, self.routine.get("i", place).name

    def _items(self, node: Any) -> Any:
        """What a loop that is unrolled goes through."""
        match node:
            case ast.Call(func=ast.Name(id="zip")):
                return list(zip(*map(self.value, node.args), strict=True))
            case ast.Call(func=ast.Name(id="enumerate")):
                return list(enumerate(self.value(node.args[0])))
            case ast.Call(func=ast.Name(id="range")):
                return range(*map(self.value, node.args))
        return self.value(node)

    def _listed(self, element: Any, loop: Any) -> tuple[Any, ...]:
        found = []
        before = dict(self.known)
        for item in self._items(loop.iter):
            self._assign(loop.target, item)
            found.append(self.value(element))
        self.known = before
        return tuple(found)

    def _called(self, node: ast.Call) -> Any:
        """A function of the text, of mathematics, or one of the few that the language has."""
        name = getattr(node.func, "id", "")
        arguments = [self.value(a) for a in node.args]
        if not name:
            name = self.value(node.func).__name__
        inner = self.module.functions.get(name)
        if name in self.module.foreign:
            return self._foreign(name, arguments)
        if inner is not None:
            if decorators(inner) & {"aside", "node"}:
                return self._shared(inner, arguments)
            return type(self)(self.module, self.routine, inner).call(arguments)  # type: ignore[call-arg, attr-defined]
        if name == "abs" and isinstance(arguments[0], Value):
            return self._function("fabs", arguments)
        if name == "int" and isinstance(arguments[0], Value):
            return self.routine.get("i", f"fptosi double {self._as('f', arguments[0])} to i64")
        if name == "workspace":
            return self._workspace(*arguments)
        if name in INTRINSICS | LIBRARY and any(isinstance(a, Value) for a in arguments):
            return self._function(name, arguments)
        if name == "tuple":
            return arguments[0]
        called = self.module.names.get(name, getattr(builtins, name, None))
        if called is None:
            raise self._unknown(node)
        return called(*arguments)

    def _function(self, name: str, arguments: list[Any]) -> Value:
        declared = self.module.declare(name, "f" * len(arguments))
        given = ", ".join(f"{TYPES['f']} {self._as('f', a)}" for a in arguments)
        return self.routine.get("f", f"call {self.fast}{TYPES['f']} {declared}({given})")

    def _shared(self, inner: ast.FunctionDef, arguments: list[Any]) -> Any:
        routine = self.routine
        name, numbers, result = self.module.shared(inner, arguments)
        given = ", ".join(f"{type_of(v)} {v.name}" for v in numbers)
        type_, whole = name.rsplit(" ", 1)[0], routine.get("f", f"call {name}({given})").name
        kinds = [v.kind for v in flat(result)]
        return filled(result, iter([
            routine.get(kind, f"extractvalue {type_} {whole}, {i}") for i, kind in enumerate(kinds)
        ]))  # fmt: skip

    def _foreign(self, name: str, arguments: list[Any]) -> Array:
        """Numbers handed over in memory, and those that come back."""
        self.module.declare_foreign(name)
        given = self.routine.variable("f", len(arguments))
        for i, argument in enumerate(arguments):
            at = self.routine.get("i", f"getelementptr double, ptr {given}, i64 {i}").name
            self.routine.do(f"store double {self._as('f', argument)}, ptr {at}")
        result = self.routine.variable("f", self.module.foreign[name])
        self.routine.do(f"call void @{name}(ptr {given}, ptr {result})")
        return Array("f", result)

    def _workspace(self, rows: int, columns: int) -> Array:
        """A matrix of zeros."""
        place = self.routine.variable("f", rows * columns)
        self.routine.do(f"store [{rows * columns} x double] zeroinitializer, ptr {place}")
        return Array("f", place, columns)


def decorators(node: ast.FunctionDef) -> set[str]:
    """The names in front of a function: how it is written."""
    return {d.id for d in node.decorator_list if isinstance(d, ast.Name)}
