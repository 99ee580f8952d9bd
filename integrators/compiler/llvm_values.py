"""Numbers, arrays and tuples while they are written as LLVM's instructions."""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from typing import Any

#: LLVM's types of a float, a whole number, a truth value; the first may become a vector
TYPES = {"f": "double", "i": "i64", "b": "i1"}


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
        type_ = type_ if length is None else f"[{length} x {type_}]"
        self.entry.append(f"  {name} = alloca {type_}")
        return name


def register(found: Any) -> Value:
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


def name_of(found: Any) -> str:
    return register(found).name


def type_of(value: Any) -> str:
    return "ptr" if isinstance(value, Array) else TYPES[value.kind]


def form(found: Any) -> Any:
    """A value without its name: what functions are written once for."""
    if isinstance(found, tuple):
        return tuple(form(v) for v in found)
    if isinstance(found, Array):
        return Array(found.kind, "", found.columns)
    if isinstance(found, (Value, int, float)) and not isinstance(found, bool):
        return Value(register(found).kind, "")
    return found


def flat(found: Any) -> list[Any]:
    """The numbers and arrays in a tuple of tuples."""
    if isinstance(found, tuple):
        return [v for inner in found for v in flat(inner)]
    if isinstance(found, Array):
        return [found]
    if isinstance(found, (Value, int, float)) and not isinstance(found, bool):
        return [register(found)]
    return []


def filled(form: Any, values: Any) -> Any:
    """Tuples of that form from values one after another."""
    if isinstance(form, tuple):
        return tuple(filled(f, values) for f in form)
    return next(values) if isinstance(form, (Value, Array)) else form
