"""Write kernels and driver as LLVM: Python runs their text on numbers that write instructions.

Straight-line functions are called on `llvm_values`; `llvm_statements` handles the others. Tuples
exist only during this writing, so that each entry is a register. Everything that Python knows
already (constants, lengths, functions) is decided: an `if` on it leaves one branch.
"""

from __future__ import annotations

import ast
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache, partial
from typing import Any

from ..numbers.types import Function
from .layout import STATUSES
from .llvm_lanes import PRIMITIVES
from .llvm_matrices import MATRICES
from .llvm_sines import LARGEST  # noqa: F401 - with it sine and cosine are known
from .llvm_statements import CONDITIONS, Scope, mathematical, parsed, runnable, whole
from .llvm_values import (
    TYPES,
    Array,
    Operand,
    Routine,
    Value,
    filled,
    flat,
    form,
    lanes_among,
    register,
)

#: decorators → (floating-point flags: sums in any order, or in the order written; True if the
#: function is written once and called). Other functions are written wherever they are called,
#: without flags
KINDS = {"kernel": (FAST := "contract arcp nsz reassoc ", False), "node": (FAST, True),
         "ordered": ("contract nsz ", False), "aside": ("", True),
         "table": ("", True)}  # fmt: skip

_PARTS = re.compile(r"\n\n+(?=@|def )")  # where a function begins, with its decorators
MOST = 16  # largest number of results that are returned in registers


class Module:
    """The functions of one text, and the LLVM code written for them.

    names: the values of its names, as Python runs it. loops: True if a loop over integers was
    written.
    """

    loops = False
    scope = Scope  # what runs a function whose path depends on numbers

    def __init__(self, text: str, names: Mapping[str, Any]) -> None:
        self.written = list[str]()
        self.declared: dict[str, str] = {}
        self.routine = self.new_routine()
        self._shared: dict[str, tuple[str, str, Operand]] = {}
        functions = {n: mathematical(n, getattr(math, n)) for n, f in names.items()
                     if callable(f) and getattr(math, n, None) is f}  # fmt: skip
        self.names = {**names, **functions, **CONDITIONS, "int": whole,
                      "zeros": self._zeros, "blank": self._zeros,
                      "columns": lambda array: array.columns,
                      **{name: self._primitive(f) for name, f in PRIMITIVES.items()}}  # fmt: skip
        for part in _PARTS.split(MATRICES * ("matrix_" in text) + text):
            for node in parsed(part):
                if isinstance(node, ast.FunctionDef):
                    self.names[node.name] = self._function(node, part, names.get(node.name))
                else:
                    exec(compile(ast.Module([node], []), "<kernels>", "exec"), self.names)

    def new_routine(self) -> Any:
        """Return what instructions of a new function are written into."""
        return Routine(self.declared)

    def _function(self, node: ast.FunctionDef, part: str, function: Any) -> Function:
        """Return the function that writes the instructions of a function of the text."""
        words = decorators(node)
        fast, shared = next((kind for word, kind in KINDS.items() if word in words), ("", False))
        # only for functions that are called
        run = cache(partial(runnable, self, node, part, function))

        def inline(*arguments: Operand) -> Operand:
            if "helper" in words and (kind := lanes_among(arguments)):
                return self.routine.in_lanes(kind, None, inline, arguments)
            before, self.routine.fast = self.routine.fast, fast
            returned = run()(*arguments)
            self.routine.fast = before
            return returned

        called = partial(self._called, node.name, inline)

        def lane_by_lane(*arguments: Operand) -> Operand:
            kind = lanes_among(arguments)
            if kind:
                return self.routine.in_lanes(kind, None, called, arguments)
            return called(*arguments)

        return lane_by_lane if "table" in words else called if shared else inline

    def _primitive(self, function: Function) -> Function:
        """Return a function of lanes that is written wherever it is called."""
        return lambda *arguments: function(self.routine, *arguments)

    def text(self) -> str:
        """Return everything written so far."""
        return "\n".join([*self.declared.values(), *self.written])

    def export(self, name: str, parameters: Sequence[str], arrays: Mapping[str, Array]) -> None:
        """Write a function for outside callers; `arrays` are pointers, other parameters integers.

        Its results are an index and a status, returned as one number (`STATUSES`).
        """
        routine = self.routine
        values = [replace(arrays.get(a, Value("i")), name=f"%{a}", routine=routine)
                  for a in parameters]  # fmt: skip
        index, status = self.names[name](*values)
        routine.end(f"i64 {register(STATUSES * index + status).name}")
        types = [("ptr noalias " if isinstance(v, Array) else "i64 ") + v.name for v in values]
        self._define(f"i64 @{name}({', '.join(types)})")

    def _define(self, head: str) -> None:
        body = [*self.routine.entry, *self.routine.lines]
        # a vector on the stack that lies across two cache lines takes twice the time
        aligned = " alignstack(64)" if any(" x double>" in line for line in body) else ""
        self.written.append("\n".join([f"define {head}{aligned} {{", "entry:", *body, "}"]))

    def _called(self, name: str, function: Function, *arguments: Operand) -> Operand:
        """Call a function that is written once for each form of its arguments.

        Results that Python knows are returned unchanged.
        """
        caller, values = self.routine, flat(arguments)
        key = f"{name} {form(arguments)}"
        if key not in self._shared:
            routine = self.routine = self.new_routine()
            inner = [replace(v, name=f"%a{i}", routine=routine) for i, v in enumerate(values)]
            returned = function(*filled(arguments, inner))
            results = flat(returned, known=False)
            type_, result = "void", "void"
            if in_memory(results):
                inner.append(Array("f", "%.out", routine=routine))
                for i, v in enumerate(results):
                    inner[-1][i] = v
            else:
                type_ = f"{{{', '.join(TYPES[v.kind] for v in results)}}}"
                result = f"{type_} undef"
                for i, v in enumerate(results):
                    one = f"insertvalue {result}, {TYPES[v.kind]} {v.name}, {i}"
                    result = f"{type_} {routine.get('', one).name}"
            routine.end(result)
            place = f"@{name}.{len(self._shared)}"
            self._define(f"internal {type_} {place}({', '.join(map(_typed, inner))})")
            self._shared[key], self.routine = (type_, place, form(returned, known=False)), caller
        type_, place, result_form = self._shared[key]
        results = flat(result_form, known=False)
        if in_memory(results):
            out = caller.memory("f", len(results))
            caller.do(f"call void {place}({', '.join(map(_typed, [*values, out]))})")
            numbers = [out[i] for i in range(len(results))]
            return filled(result_form, numbers, known=False)
        result = caller.get("", f"call {type_} {place}({', '.join(map(_typed, values))})").name
        numbers = [caller.get(v.kind, f"extractvalue {type_} {result}, {i}")
                   for i, v in enumerate(results)]  # fmt: skip
        return filled(result_form, numbers, known=False)

    def _zeros(self, rows: int, columns: int) -> Array:
        place = self.routine.memory("f", rows * columns, columns)
        name, size = "@llvm.memset.p0.i64", 8 * rows * columns
        self.declared[name] = f"declare void {name}(ptr, i8, i64, i1)"
        self.routine.do(f"call void {name}(ptr {place.name}, i8 0, i64 {size}, i1 false)")
        return place


def in_memory(results: Sequence[Value]) -> bool:
    """Return True if results are passed in memory: LLVM is slow with many in one structure."""
    return len(results) > MOST and all(v.kind == "f" for v in results)


def _typed(value: Operand) -> str:
    return f"{'ptr' if isinstance(value, Array) else TYPES[value.kind]} {value.name}"


def decorators(node: ast.FunctionDef) -> set[str]:
    """Return the names of a function's decorators, which say how it is written."""
    return {d.id for d in node.decorator_list if isinstance(d, ast.Name)}
