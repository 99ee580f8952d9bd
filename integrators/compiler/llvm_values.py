"""Numbers and arrays whose operators write LLVM instructions instead of computing.

Everything that Python knows already (constants, lengths, tuples) is decided and unrolled while
instructions are written. Division by zero gives inf or nan.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, TypeAlias

import numpy as np

from ..numbers.types import Function

#: a register, a number that is known while the code is written, or nested tuples of these
Operand: TypeAlias = Any


class _Types(dict[str, str]):  # v8 is a vector of eight lanes
    def __missing__(self, kind: str) -> str:
        return f"<{kind[1:]} x double>"


TYPES = _Types(f="double", i="i64", b="i1")
#: largest array on the stack in bytes; a thread's stack may have only 128 KiB
ON_STACK = 2**15
#: functions that LLVM has as intrinsics; others are in C's library
INTRINSICS = {"sin", "cos", "exp", "log", "sqrt", "pow", "fabs"}
#: operator → instruction for floats, and for integers (// and % of numbers from 0)
ARITHMETIC = {"add": ("fadd", "add"), "sub": ("fsub", "sub"), "mul": ("fmul", "mul"),
              "truediv": ("fdiv", ""), "floordiv": ("", "sdiv"), "mod": ("", "srem")}  # fmt: skip
COMPARISONS = {"lt": ("fcmp olt", "icmp slt"), "le": ("fcmp ole", "icmp sle"),
               "gt": ("fcmp ogt", "icmp sgt"), "ge": ("fcmp oge", "icmp sge"),
               "eq": ("fcmp oeq", "icmp eq"), "ne": ("fcmp une", "icmp ne")}  # fmt: skip
OPERATORS = ARITHMETIC | COMPARISONS
#: functions of all lanes at once (`llvm_lanes`); others are computed lane by lane
OF_LANES: dict[str, Function] = {}


@dataclass(eq=False)
class Routine:
    """One LLVM function while it is written: its lines, and the variables at its entry.

    declared: the declarations of the module; heap: the arrays that are not on the stack; fast:
    floating-point flags of the arithmetic that is written now.
    """

    declared: dict[str, str]
    lines: list[str] = field(default_factory=list)
    entry: list[str] = field(default_factory=list)
    heap: list[str] = field(default_factory=list)
    count: int = 0
    open: bool = True  # True if an instruction written here can be reached
    known: dict[str, Operand] = field(default_factory=dict)  # reusable results of this block
    fast: str = ""

    def name(self, letter: str = "%t") -> str:
        """Return a name that is new in this function."""
        self.count += 1
        return f"{letter}{self.count}"

    def do(self, instruction: str) -> None:
        """Write an instruction without a result."""
        if self.open:
            self.lines.append(f"  {instruction}")

    def get(self, kind: str, instruction: str) -> Value:
        """Write an instruction and return its result."""
        name = self.name()
        self.do(f"{name} = {instruction}")
        return Value(kind, name, self)

    def jump(self, target: str) -> None:
        """End this block with `br` and the given target."""
        self.do(f"br {target}")
        self.open = False

    def begin(self, label: str) -> None:
        """Begin a block; the block before it continues into it."""
        if self.open:
            self.jump(f"label %{label}")
        self.lines.append(f"{label}:")
        self.open = True
        self.known.clear()

    def memory(self, kind: str, length: int = 1, columns: int | None = None) -> Array:
        """Reserve an array at the function's entry; LLVM turns a single number into a register."""
        name = self.name("%v")
        if 8 * length <= ON_STACK:
            self.entry.append(f"  {name} = alloca {TYPES[kind]}, i64 {length}")
        else:
            self.declared["@malloc"] = "declare noalias ptr @malloc(i64)"
            self.declared["@free"] = "declare void @free(ptr)"
            self.entry.append(f"  {name} = call ptr @malloc(i64 {8 * length})")
            self.heap.append(name)
        return Array(kind, name, columns, self)

    def end(self, result: str) -> None:
        """Release memory and return."""
        for name in self.heap:
            self.do(f"call void @free(ptr {name})")
        self.do(f"ret {result}")

    def operand(self, kind: str, number: Operand) -> str:
        """Return LLVM's type and name of a number, converted to the kind."""
        number = register(number)
        if number.kind == "i" and kind != "i":
            if number.name.startswith("%"):
                number = self.get("f", f"sitofp i64 {number.name} to {TYPES['f']}")
            else:
                number = register(float(number.name))
        if number.kind == "f" and kind.startswith("v"):
            number = self.spread(kind, number)
        assert number.kind == kind, f"{number} is no number of kind {kind}"
        return f"{TYPES[kind]} {number.name}"

    def call(self, name: str, *arguments: Operand) -> Value:
        """Call a function of floats, or of each lane: an intrinsic or a function of C's library."""
        if kind := lanes_among(arguments):
            return self.in_lanes(kind, OF_LANES.get(name), partial(self.call, name), arguments)
        float_ = TYPES["f"]
        place = f"@llvm.{name}.f64" if name in INTRINSICS else f"@{name}"
        operands = ", ".join(self.operand("f", a) for a in arguments)
        types = ", ".join([float_] * len(arguments))
        self.declared[place] = f"declare {float_} {place}({types})"
        return self.get("f", f"call {self.fast}{float_} {place}({operands})")

    def select(self, test: Value, yes: Operand, no: Operand) -> Value:
        """Return `yes` if the test holds, else `no`."""
        kind = register(yes).kind if register(yes).kind == register(no).kind else "f"
        one, other = (self.operand(kind, v) for v in (yes, no))
        return self.get(kind, f"select i1 {test.name}, {one}, {other}")

    def joint(self, word: str, one: Value, other: Value) -> Value:
        """Return `one and other`, or `or`."""
        return self.get("b", f"{word} i1 {one.name}, {other.name}")

    def negated(self, test: Value) -> Value:
        """Return `not test`."""
        return self.get("b", f"xor i1 {test.name}, true")

    def whole(self, number: Value) -> Value:
        """Return `int(number)`."""
        return self.get("i", f"fptosi {self.operand('f', number)} to i64")

    def spread(self, kind: str, number: Value) -> Value:
        """Return a vector with the number in all lanes."""
        type_, count = TYPES[kind], int(kind[1:])
        if not number.name.startswith("%"):
            return Value(kind, f"<{', '.join([f'double {number.name}'] * count)}>", self)
        one = self.get(kind, f"insertelement {type_} poison, double {number.name}, i64 0").name
        places = f"<{count} x i32> zeroinitializer"
        return self.get(kind, f"shufflevector {type_} {one}, {type_} poison, {places}")

    def lane(self, number: Operand, j: int) -> Operand:
        """Return lane j; a number without lanes is the same in all."""
        if not lanes_among([number]):
            return number
        lanes = register(number)
        return self.get("f", f"extractelement {TYPES[lanes.kind]} {lanes.name}, i64 {j}")

    def in_lanes(
        self, kind: str, whole: Function | None, single: Function, arguments: Sequence[Operand]
    ) -> Operand:
        """Apply `whole` to all lanes at once, or if it is None `single` lane by lane."""
        if whole is not None:
            return whole(self, *(Value(kind, self.operand(kind, a).removeprefix(f"{TYPES[kind]} "),
                                       self) for a in arguments))  # fmt: skip
        lanes = [single(*(self.lane(a, j) for a in arguments)) for j in range(int(kind[1:]))]
        return mapped(partial(self.joined, kind), *lanes)

    def joined(self, kind: str, *numbers: Operand) -> Value:
        """Join scalars into one vector value."""
        result = "poison"
        for j, number in enumerate(numbers):
            one = self.operand("f", number)
            result = self.get(kind, f"insertelement {TYPES[kind]} {result}, {one}, i64 {j}").name
        return Value(kind, result, self)

    def binary(self, operator: str, left: Operand, right: Operand) -> Value:
        """Write arithmetic or a comparison of two numbers; of floats if one is a float."""
        of_floats, of_whole = OPERATORS[operator]
        left, right = register(left), register(right)
        kind = "i" if of_whole and left.kind == right.kind == "i" else "f"
        kind = lanes_among((left, right)) or kind
        word = of_whole if kind == "i" else of_floats
        assert word, f"{operator} of floats is not of the language"
        compared = operator in COMPARISONS
        flags = "" if compared or kind == "i" else self.fast
        one, other = self.operand(kind, left), self.operand(kind, right)
        other = other.removeprefix(f"{TYPES[kind]} ")
        return self.get("b" if compared else kind, f"{word} {flags}{one}, {other}")


@dataclass(frozen=True, eq=False)
class Value:
    """A number in a register, or lanes: its kind (f, i, b or v8) and its LLVM name."""

    __array_ufunc__ = None  # numpy arrays leave their operators to this class

    kind: str
    name: str = ""
    routine: Any = field(default=None, repr=False)

    def __neg__(self) -> Value:
        return self.routine.binary("sub", 0 if self.kind == "i" else -0.0, self)

    def __abs__(self) -> Value:
        return self.routine.call("fabs", self)

    def __pow__(self, exponent: Operand) -> Operand:
        if not isinstance(exponent, int):
            return self.routine.call("pow", self, exponent)
        if exponent < 0:
            return 1.0 / self**-exponent
        if exponent < 2:
            return self if exponent else 1.0
        half = self ** (exponent // 2)
        return half * half * self if exponent % 2 else half * half

    def __rpow__(self, base: Operand) -> Value:
        return self.routine.call("pow", base, self)

    def __bool__(self) -> bool:
        raise AssertionError("a number decides here, where only a constant can")


def _give_operators(name: str) -> None:
    setattr(Value, f"__{name}__", lambda self, other: self.routine.binary(name, self, other))
    if name in ARITHMETIC:  # Python itself reverses comparisons
        setattr(Value, f"__r{name}__", lambda self, other: self.routine.binary(name, other, self))


for _name in OPERATORS:
    _give_operators(_name)


@dataclass(frozen=True)
class Array:
    """Numbers in memory; if it has two indices, rows of `columns` numbers."""

    kind: str
    name: str = ""
    columns: int | None = None
    routine: Any = field(default=None, repr=False)
    __iter__ = None  # the length is unknown

    def _place(self, index: Operand) -> str:
        if self.columns is not None:
            row, column = index if isinstance(index, tuple) else (index, 0)
            index = row * self.columns + column
        if isinstance(index, int) and index == 0:
            return self.name
        at = self.routine.operand("i", index)
        place = f"getelementptr {TYPES[self.kind]}, ptr {self.name}, {at}"
        return str(self.routine.get("i", place).name)

    def __getitem__(self, index: Operand) -> Operand:
        place = self._place(index)
        if self.columns is not None and not isinstance(index, tuple):
            return replace(self, name=place, columns=None)  # a row
        return self.routine.get(self.kind, f"load {TYPES[self.kind]}, ptr {place}")

    def __setitem__(self, index: Operand, number: Operand) -> None:
        entry = self.routine.operand(self.kind, number)
        self.routine.do(f"store {entry}, ptr {self._place(index)}")


def register(number: Operand) -> Value:
    """Return a number, which Python may know, in LLVM's notation."""
    if isinstance(number, Value):
        return number
    if isinstance(number, bool):
        return Value("b", str(number).lower())
    if isinstance(number, int):
        return Value("i", str(number))
    if isinstance(number, np.ndarray):
        lanes = ", ".join(f"double {register(float(e)).name}" for e in number)
        return Value(f"v{len(number)}", f"<{lanes}>")
    assert isinstance(number, float), f"{number!r} is no number"
    return Value("f", f"0x{struct.pack('>d', number).hex()}")


def lanes_among(numbers: Iterable[Operand]) -> str:
    """Return the kind of the lanes among the numbers, or "" if there are no lanes."""
    kinds = (f"v{len(n)}" if isinstance(n, np.ndarray) else getattr(n, "kind", "") for n in numbers)
    return next((kind for kind in kinds if kind.startswith("v")), "")


def mapped(function: Function, *trees: Operand) -> Operand:
    """Apply a function to each leaf of nested tuples."""
    if isinstance(trees[0], tuple):
        return tuple(mapped(function, *branches) for branches in zip(*trees, strict=True))
    return function(*trees)


def flat(tree: Operand, known: bool = True) -> list[Operand]:
    """Return the numbers and arrays in nested tuples; if `known`, also Python's own numbers."""
    leaves: list[Operand] = []
    mapped(lambda e: leaves.append(e) if _is_number(e, known) else None, tree)
    return [e if isinstance(e, Array) else register(e) for e in leaves]


def filled(tree: Operand, values: Iterable[Operand], known: bool = True) -> Operand:
    """Return the nested tuples with their numbers replaced by `values` in order."""
    rest = iter(values)
    return mapped(lambda leaf: next(rest) if _is_number(leaf, known) else leaf, tree)


def form(tree: Operand, known: bool = True) -> Operand:
    """Return nested tuples with unnamed numbers: a shared function is written once per form."""
    return filled(tree, [replace(v, name="", routine=None) for v in flat(tree, known)], known)


def _is_number(leaf: Operand, known: bool) -> bool:
    plain = isinstance(leaf, (int, float, np.ndarray)) and not isinstance(leaf, bool)
    return isinstance(leaf, (Value, Array)) or (known and plain)
