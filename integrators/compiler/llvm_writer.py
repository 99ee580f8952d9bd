"""From the text of kernels and driver to LLVM: a small part of Python, written as instructions.

Numbers are floats, whole numbers and truth values; tuples exist only while this is written, so
that each of their entries is a register; arrays are pointers to C-contiguous numbers. What Python
knows already (constants, lengths, functions) is decided here: such an `if` leaves one branch, and
a loop over a tuple is unrolled. Division by zero gives inf or nan, as in the arithmetic itself.
"""

from __future__ import annotations

import ast
import builtins
import operator
import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

#: LLVM's types of a float, a whole number, a truth value; the first may become a vector
TYPES = {"f": "double", "i": "i64", "b": "i1"}
FAST = "contract arcp nsz reassoc "
UNROLLED = 16  # turns of a loop of constant length that are written one after another
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


@dataclass(frozen=True)
class Value:
    """A number in a register: its kind (f, i or b) and LLVM's name of it."""

    kind: str
    name: str


@dataclass(frozen=True)
class Array:
    """Numbers in memory, by rows of `columns` where it has two indices."""

    kind: str
    name: str = ""
    columns: int | None = None


@dataclass
class Routine:
    """One function of LLVM's while it is written: its lines, and its variables at the entry."""

    lines: list[str] = field(default_factory=list)
    entry: list[str] = field(default_factory=list)
    count: int = 0
    open: bool = True  # whether an instruction would be reached here

    def name(self, letter: str = "%t") -> str:
        """A name that nothing else in this function has."""
        self.count += 1
        return f"{letter}{self.count}"

    def do(self, instruction: str) -> None:
        """Write an instruction without a result."""
        if self.open:
            self.lines.append(f"  {instruction}")

    def get(self, kind: str, instruction: str) -> Value:
        """Write an instruction, and name its result."""
        name = self.name()
        self.do(f"{name} = {instruction}")
        return Value(kind, name)

    def jump(self, label: str) -> None:
        """End this block."""
        self.do(f"br label %{label}")
        self.open = False

    def begin(self, label: str) -> None:
        """Begin a block, which what stands before it runs into."""
        if self.open:
            self.jump(label)
        self.lines.append(f"{label}:")
        self.open = True

    def variable(self, kind: str, length: int | None = None) -> str:
        """A place in memory at the function's entry; LLVM makes a register of a single number."""
        name, type_ = self.name("%v"), TYPES[kind]
        self.entry.append(
            f"  {name} = alloca {type_ if length is None else f'[{length} x {type_}]'}"
        )
        return name


class Module:
    """The functions of one text and the values of its names, and what is written of them.

    foreign: name → length of the result, of functions (double* arguments, double* result) that
    exist elsewhere in machine code.
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
            form = arrays.get(argument, Value("i", ""))
            given[argument] = replace(form, name=f"%{argument}")
        found = Scope(self, routine, node).call(list(given.values()))
        for i, value in enumerate(found):
            at = routine.get("i", f"getelementptr i64, ptr %out, i64 {i}")
            routine.do(f"store i64 {_name(value)}, ptr {at.name}")
        routine.do("ret void")
        types = [f"ptr noalias %{a}" if isinstance(v, Array) else f"i64 %{a}"
                 for a, v in given.items()]  # fmt: skip
        self._define(f"void @{name}({', '.join([*types, 'ptr noalias %out'])})", routine)

    def shared(self, node: ast.FunctionDef, arguments: list[Any]) -> tuple[str, list[Any], Any]:
        """(name, flat arguments, form of the result) of a function that is written once."""
        form = [_form(a) for a in arguments]
        key = (node.name, str(form))
        flat = [v for a in arguments for v in _flat(a)]
        if key not in self._shared:
            routine, name = Routine(), f"@{node.name}.{len(self._shared)}"
            inner = iter([replace(v, name=f"%a{i}") for i, v in enumerate(flat)])
            found = Scope(self, routine, node).call([_filled(f, inner) for f in form])
            values = [_register(v) for v in _flat(found)]
            type_ = f"{{{', '.join(TYPES[v.kind] for v in values)}}}"
            whole = "undef"
            for i, v in enumerate(values):
                one = f"insertvalue {type_} {whole}, {TYPES[v.kind]} {v.name}, {i}"
                whole = routine.get("f", one).name
            routine.do(f"ret {type_} {whole}")
            given = ", ".join(f"{_type(v)} %a{i}" for i, v in enumerate(flat))
            self._define(f"internal {type_} {name}({given})", routine)
            self._shared[key] = f"{type_} {name}", _form(found)
        name, result = self._shared[key]
        return name, flat, result

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


class Scope:
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
        kind = _register(found).kind
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
        place = self._place(_register(start))
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

    # -- expressions ----------------------------------------------------------------------------

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
        found = _register(found)
        if found.kind == kind:
            return found.name
        if (found.kind, kind) == ("i", "f"):
            if not found.name.startswith("%"):
                return _register(float(found.name)).name
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
        sides = [_register(left), _register(right)]
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
        sides = [_register(left), _register(right)]
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
        kinds = {_register(yes).kind, _register(no).kind}
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
            return Scope(self.module, self.routine, inner).call(arguments)
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
        name, flat, form = self.module.shared(inner, arguments)
        given = ", ".join(f"{_type(v)} {v.name}" for v in flat)
        type_, whole = name.rsplit(" ", 1)[0], routine.get("f", f"call {name}({given})").name
        kinds = [v.kind for v in _flat(form)]
        return _filled(form, iter([
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


def _register(found: Any) -> Value:
    """A number, which may be one that Python knows, as LLVM writes it."""
    if isinstance(found, Value):
        return found
    if isinstance(found, bool):
        return Value("b", str(found).lower())
    if isinstance(found, int):
        return Value("i", str(found))
    if isinstance(found, float):
        return Value("f", f"0x{struct.pack('>d', found).hex()}")
    raise NotImplementedError(f"{found!r} is no number")


def _name(found: Any) -> str:
    return _register(found).name


def _type(value: Any) -> str:
    return "ptr" if isinstance(value, Array) else TYPES[value.kind]


def _form(found: Any) -> Any:
    """A value without its name: what functions are written once for."""
    if isinstance(found, tuple):
        return tuple(_form(v) for v in found)
    if isinstance(found, Array):
        return Array(found.kind, "", found.columns)
    if isinstance(found, (Value, int, float)) and not isinstance(found, bool):
        return Value(_register(found).kind, "")
    return found


def _flat(found: Any) -> list[Any]:
    """The numbers and arrays in a tuple of tuples."""
    if isinstance(found, tuple):
        return [v for inner in found for v in _flat(inner)]
    if isinstance(found, Array):
        return [found]
    if isinstance(found, (Value, int, float)) and not isinstance(found, bool):
        return [_register(found)]
    return []


def _filled(form: Any, values: Any) -> Any:
    """Tuples of that form from values one after another."""
    if isinstance(form, tuple):
        return tuple(_filled(f, values) for f in form)
    return next(values) if isinstance(form, (Value, Array)) else form
