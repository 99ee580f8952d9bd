"""Generated kernels as statements that every language has: results are written into arguments.

A kernel's text (`compiler.KernelText`) is straight-line Python that returns tuples. Here it becomes
a function with annotated letters, whose columns of results are its first arguments; the driver
(`stepping`) is written so from the beginning. All of it is trees of Python's `ast`.
"""

from __future__ import annotations

import ast
import inspect
import math
from collections.abc import Iterable, Mapping, Sequence
from textwrap import dedent
from types import MappingProxyType
from typing import Any

from ...errors import CannotMeasure
from ...numbers import Double

#: (columns of results, True if a number is returned beside them) of each kernel
RESULTS: dict[str, tuple[tuple[str, ...], bool]] = {
    "solver": (("dw",), True),
    "update": (("dx", "dmu", "new_k"), False),
    "carry": (("new_k",), False),
    "prepare": (("c",), False),
    "extents": (("sizes", "rests"), False),
    "branch": ((), True),
}
#: those of the kernels of stages; True if the columns, and other vectors, have all nodes
OF_STAGES: dict[str, tuple[tuple[str, ...], bool]] = {
    "velocity": (("moves", "xi", "mu"), True), "force": (("gains", "turns"), True),
    "moved": (("out",), True), "pulled": (("out",), True), "shift": (("more",), False),
    "update": (("dx", "dmu"), False), "extents": (("sizes", "rests"), False),
    "prepare": (("c",), False),
}  # fmt: skip
#: what each kernel does, for the reader of a file
ABOUT = {
    "solver": "Write a correction of the unknowns of a step, or the solution; return its size.",
    "update": "Write what x and mu grow by, less what the rounding of earlier sums added.",
    "carry": "Write the functions of x that the step after needs again.",
    "prepare": "Write what depends on the step and the parameters alone.",
    "extents": "Write sizes that tell how near a step is to the edge of its chart.",
    "branch": "Return a number that tells branches of solutions apart.",
    "velocity": "Write velocities and momenta at the nodes of a step.",
    "force": "Write the rates of momenta at the nodes.",
    "moved": "Write the rates of w, in the chart, of velocities at the nodes.",
    "pulled": "Write momenta at the nodes as those of the chart.",
    "shift": "Write the correction of the momenta at the start of a step.",
    "energy_at": "Return the energy at x, v and mu.",
    "momenta_at": "Write the quantities that the scene declares.",
    "rates_at": "Write the rates of x and mu.", "speed_at": "Write the velocity of a momentum.",
}  # fmt: skip
#: the names that a text may use; others are functions of the text itself
KNOWN = {"sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "exp", "log",
         "sqrt", "abs", "zeros", "eliminate"}  # fmt: skip


def parsed(text: str) -> list[ast.FunctionDef]:
    """Return the functions of a text."""
    return [e for e in ast.parse(text).body if isinstance(e, ast.FunctionDef)]


def source_of(*functions: Any) -> list[ast.FunctionDef]:
    """Return functions of ours as trees; a letter without annotation is a float."""
    found = [f for e in functions for f in parsed(dedent(inspect.getsource(e)))]
    for f in found:
        _Declaring({a.arg for a in f.args.args}).visit(f)
    return found


class _Declaring(ast.NodeTransformer):
    """Annotates the first assignment of each letter that is not declared."""

    def __init__(self, declared: set[str]) -> None:
        self.declared = declared

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.stmt:
        self.declared.add(ast.unparse(node.target))
        return node

    def visit_Assign(self, node: ast.Assign) -> ast.stmt:
        (target,) = node.targets
        if not isinstance(target, ast.Name) or target.id in self.declared:
            return node
        self.declared.add(target.id)
        return ast.AnnAssign(target, ast.Name("float"), node.value, 1)


def told(function: ast.FunctionDef) -> ast.FunctionDef:
    """Return a kernel that says what it does."""
    said = ABOUT.get(function.name.partition("_of_")[0])
    function.body[:0] = [] if said is None else [ast.Expr(ast.Constant(said))]
    return ast.fix_missing_locations(function)


def of_kernel(
    function: ast.FunctionDef,
    results: Sequence[str],
    number: bool,
    lengths: Mapping[str, int] = MappingProxyType({}),
) -> ast.FunctionDef:
    """Return a kernel that writes its columns into first arguments of these names.

    number: True if it returns a number beside them. lengths: how many results each function has
    that it may call. Raises `CannotMeasure` if the text calls what
    only this package has, such as a table of the exponential map.
    """
    return told(_Writing(function, results, number, lengths).function)


def of_called(function: ast.FunctionDef, lengths: Mapping[str, int]) -> ast.FunctionDef:
    """Return a function of numbers, which several kernels call, with one column `out`."""
    made = _Writing(function, ["out"], False, lengths).function
    for argument in made.args.args[1:]:
        argument.annotation = ast.Name("float")
    return made


class _Writing(ast.NodeTransformer):
    """Rewrites one kernel."""

    def __init__(
        self, function: ast.FunctionDef, results: Sequence[str], number: bool,
        lengths: Mapping[str, int],
    ) -> None:  # fmt: skip
        self.results, self.number, self.lengths = results, number, lengths
        self.widths: dict[str, int] = {}  # of the names of matrices
        *lines, last = function.body
        body = [s for line in lines for s in self._statements(line)]
        assert isinstance(last, ast.Return) and last.value is not None
        body += self._returned(last.value)
        given = [(name, "Out") for name in results]
        given += [(a.arg, "Vector") for a in function.args.args]
        names = [name for name, _ in given]
        # a column and an argument may share their name, such as the coefficients c
        assert len(set(names)) == len(names), names
        arguments = ", ".join(f"{name}: {kind}" for name, kind in given)
        answer = "float" if number else "None"
        (self.function,) = parsed(f"def {function.name}({arguments}) -> {answer}:\n    pass")
        self.function.body = body or self.function.body
        ast.fix_missing_locations(self.function)

    def _returned(self, value: ast.expr) -> list[ast.stmt]:
        """Return the statements that write the results."""
        parts = list(value.elts) if isinstance(value, ast.Tuple) else [value]
        while self.number and isinstance(parts[-1], ast.Tuple):  # the one entry of a column
            parts[-1] = parts[-1].elts[0]
        if len(self.results) == 1 and not any(isinstance(e, ast.Tuple) for e in parts):
            parts = [ast.Tuple(parts)]  # a function of numbers returns its entries
        returned = [ast.Return(self.visit(parts.pop()))] if self.number else []
        found: list[ast.stmt] = []
        for name, column in zip(self.results, parts, strict=True):
            assert isinstance(column, ast.Tuple)
            for i, e in enumerate(column.elts):
                found.append(ast.Assign([_entry(name, i)], self.visit(e)))
        return found + returned

    def _statements(self, line: ast.stmt) -> list[ast.stmt]:
        """Return the statements of one line, of which each name is assigned once."""
        if isinstance(line, ast.Expr):  # eliminate(t, m)
            return [ast.Expr(self.visit(line.value))]
        assert isinstance(line, ast.Assign)
        (target,), value = line.targets, line.value
        if isinstance(target, ast.Subscript):
            return [ast.Assign([self.visit(target)], self.visit(value))]
        assert isinstance(target, ast.Name)
        if isinstance(value, ast.Call) and isinstance(value.func, ast.Name):
            called = value.func.id
            if called == "zeros":
                rows, columns = (ast.literal_eval(e) for e in value.args)
                self.widths[target.id] = columns
                return [_array(target.id, rows * columns)]
            last = last_of(called)
            if called in self.lengths or last is not None:
                length = self.lengths[called] if last is None else last + 1
                more = [] if last is None else [ast.Constant(last)]
                given = [ast.Name(target.id), *more, *map(self.visit, value.args)]
                word = ast.Name(called if last is None else "stumpff")
                return [_array(target.id, length), ast.Expr(ast.Call(word, given, []))]
        return [ast.AnnAssign(ast.Name(target.id), ast.Name("float"), self.visit(value), 1)]

    def visit_Subscript(self, node: ast.Subscript) -> ast.expr:
        """Write an entry of a matrix as one of its rows one after another."""
        inner = node.value
        if isinstance(inner, ast.Subscript) and isinstance(inner.value, ast.Name):
            row, column = ast.literal_eval(inner.slice), ast.literal_eval(node.slice)
            return _entry(inner.value.id, row * self.widths[inner.value.id] + column)
        return node

    def visit_Call(self, node: ast.Call) -> ast.expr:
        """Write numbers as numbers, and refuse unknown functions."""
        name = ast.unparse(node.func)
        if not isinstance(number := number_of(node), ast.Call):
            return number
        if name not in KNOWN:
            raise CannotMeasure(
                "a step has functions of matrices, whose table only this package has, so it cannot "
                "be exported: with --retraction cayley it can."
            )
        return ast.Call(node.func, [self.visit(e) for e in node.args], [])

    def visit_Name(self, node: ast.Name) -> ast.expr:
        """Write π as a number."""
        return number_of(node)


def number_of(node: ast.expr) -> ast.expr:
    """Return the double of π, of a whole number or of a constant by its name; others unchanged."""
    if isinstance(node, ast.Name) and node.id == "PI":
        return ast.Constant(math.pi)
    if isinstance(node, ast.Call) and ast.unparse(node.func) in ("R", "constant"):
        value = ast.literal_eval(node.args[0])
        named = ast.unparse(node.func) == "constant"
        return ast.Constant(float(Double().constant(value) if named else value))
    return node


def last_of(called: str) -> int | None:
    """Return K of a table (c_0, ..., c_K) of Stumpff's functions; None for other functions."""
    word, _, last = called.partition("_")
    return int(last) if word == "stumpff" and last.isdigit() else None


def at_lanes(function: ast.FunctionDef, columns: Iterable[str]) -> ast.FunctionDef:
    """Return a kernel of one node as a loop over all; columns: the vectors that nodes have."""
    said, *body = function.body
    at_node = [_AtLane({*columns}).visit(e) for e in body]
    nodes = ast.Call(ast.Name("range"), [ast.Name("LANES")], [])
    function.body = [said, ast.For(ast.Name("j"), nodes, at_node, [])]
    return ast.fix_missing_locations(function)


class _AtLane(ast.NodeTransformer):
    """Writes entry i of a column as that of node j."""

    def __init__(self, columns: set[str]) -> None:
        self.columns = columns

    def visit_Subscript(self, node: ast.Subscript) -> ast.expr:
        if isinstance(node.value, ast.Name) and node.value.id in self.columns:
            i = ast.literal_eval(node.slice)
            first = f"{i}*LANES + j" if i > 1 else "LANES + j" if i else "j"
            return ast.Subscript(node.value, ast.parse(first, mode="eval").body)
        return node


def _entry(name: str, i: int) -> ast.Subscript:
    return ast.Subscript(ast.Name(name), ast.Constant(i))


def _array(name: str, length: int) -> ast.stmt:
    """Return the declaration of an array of zeros."""
    zeros = ast.BinOp(ast.List([ast.Constant(0.0)]), ast.Mult(), ast.Constant(length))
    return ast.AnnAssign(ast.Name(name), ast.Name("Out"), zeros, 1)


# -- a program of functions ------------------------------------------------------------------------


class _Folding(ast.NodeTransformer):
    """Decides what the constants of a file decide, and names kernels without their kind."""

    def __init__(self, flags: Mapping[str, Any], kernels: Iterable[str]) -> None:
        self.flags, self.kernels = flags, {*kernels}

    def visit_Name(self, node: ast.Name) -> ast.expr:
        return ast.Constant(self.flags[node.id]) if node.id in self.flags else node

    def visit_Subscript(self, node: ast.Subscript) -> ast.expr:
        if isinstance(node.value, ast.Name) and node.value.id in self.flags:
            return ast.Constant(self.flags[node.value.id])
        return self.generic_visit(node)  # type: ignore[return-value]

    def visit_BoolOp(self, node: ast.BoolOp) -> ast.expr:
        conjunction, parts = isinstance(node.op, ast.And), list[ast.expr]()
        for e in map(self.visit, node.values):
            if not isinstance(e, ast.Constant):
                parts.append(e)
            elif bool(e.value) != conjunction:
                return ast.Constant(not conjunction)
        if len(parts) > 1:
            return ast.BoolOp(node.op, parts)
        return parts[0] if parts else ast.Constant(conjunction)

    def visit_Compare(self, node: ast.Compare) -> ast.expr:
        self.generic_visit(node)
        parts = [node.left, *node.comparators]
        if all(isinstance(e, ast.Constant) for e in parts):
            return ast.Constant(eval(ast.unparse(node), {}))  # of two numbers of ours
        return node

    def visit_IfExp(self, node: ast.IfExp) -> ast.expr:
        test = self.visit(node.test)
        if isinstance(test, ast.Constant):
            return self.visit(node.body if test.value else node.orelse)
        return ast.IfExp(test, self.visit(node.body), self.visit(node.orelse))

    def visit_If(self, node: ast.If) -> Any:
        test = self.visit(node.test)
        if isinstance(test, ast.Constant):
            return [
                e for s in (node.body if test.value else node.orelse) for e in _many(self.visit(s))
            ]
        node.test = test
        node.body, node.orelse = ([e for s in part for e in _many(self.visit(s))]
                                  for part in (node.body, node.orelse))  # fmt: skip
        return node if node.body or node.orelse else []

    def visit_For(self, node: ast.For) -> Any:
        self.generic_visit(node)
        bound = node.iter.args[-1]  # type: ignore[attr-defined]
        empty = isinstance(bound, ast.Constant) and len(node.iter.args) == 1 and bound.value == 0  # type: ignore[attr-defined]
        return node if node.body and not empty else []

    def visit_Call(self, node: ast.Call) -> ast.expr:
        self.generic_visit(node)
        if isinstance(node.func, ast.Name) and node.func.id in self.kernels:
            node.args = node.args[1:]
        return node


def _many(found: Any) -> list[Any]:
    return found if isinstance(found, list) else [found] if found is not None else []


def folded(
    functions: Iterable[ast.FunctionDef], flags: Mapping[str, Any], kernels: Iterable[str]
) -> list[ast.FunctionDef]:
    """Return functions without the branches that flags rule out.

    kernels: those of which there is one kind, called without it.
    """
    fold = _Folding(flags, kernels)
    made = []
    for function in functions:
        function.body = [e for s in function.body for e in _many(fold.visit(s))] or [ast.Pass()]
        ended = next((i for i, s in enumerate(function.body) if isinstance(s, ast.Return)), None)
        function.body = function.body[: None if ended is None else ended + 1]
        made.append(ast.fix_missing_locations(function))
    return made


def reached(functions: Iterable[ast.FunctionDef], roots: Iterable[str]) -> list[ast.FunctionDef]:
    """Return the functions that the roots need, each after those that it calls."""
    known = {f.name: f for f in functions}
    order: dict[str, ast.FunctionDef] = {}

    def visit(name: str) -> None:
        if name in known and name not in order:
            for called in called_in(known[name]):
                if called != name:
                    visit(called)
            order.setdefault(name, known[name])

    for root in roots:
        visit(root)
    return list(order.values())


def called_in(function: ast.FunctionDef) -> list[str]:
    """Return the names that a function calls, in the order of its text."""
    calls = [e for e in ast.walk(function) if isinstance(e, ast.Call)]
    return list(dict.fromkeys(e.func.id for e in calls if isinstance(e.func, ast.Name)))


def names_in(function: ast.FunctionDef) -> set[str]:
    """Return all names that a function's body uses."""
    return {e.id for s in function.body for e in ast.walk(s) if isinstance(e, ast.Name)}
