"""Operations on all lanes of a vector at once: sums, sizes, sines.

A lane is one stage of a rule, and one instruction computes four or eight of them.
"""

from __future__ import annotations

from .llvm_values import OF_LANES, TYPES, Array, Operand, Routine, Value, lanes_among


def _intrinsic(routine: Routine, name: str, *lanes: Value) -> Value:
    """Call an LLVM intrinsic that has a vector form."""
    kind = lanes[0].kind
    place, type_ = f"@llvm.{name}.{kind}f64", TYPES[kind]
    types = ", ".join([type_] * len(lanes))
    routine.declared[place] = f"declare {type_} {place}({types})"
    arguments = ", ".join(f"{type_} {e.name}" for e in lanes)
    return routine.get(kind, f"call {routine.fast}{type_} {place}({arguments})")


OF_LANES["sqrt"] = lambda routine, x: _intrinsic(routine, "sqrt", x)
OF_LANES["fabs"] = lambda routine, x: _intrinsic(routine, "fabs", x)


# -- operations that the driver of the stages uses ------------------------------------------------


def total(routine: Routine, numbers: Operand) -> Operand:
    """Return the sum of all lanes, in any order."""
    kind = numbers.kind
    place = f"@llvm.vector.reduce.fadd.{kind}f64"
    routine.declared[place] = f"declare double {place}(double, {TYPES[kind]})"
    zero = "double 0x8000000000000000"
    return routine.get("f", f"call reassoc double {place}({zero}, {TYPES[kind]} {numbers.name})")


def larger(routine: Routine, one: Operand, other: Operand) -> Operand:
    """Return the larger number in each lane; `other` if one of the two is NaN."""
    kind = lanes_among([one, other]) or "f"
    a, b = routine.operand(kind, one), routine.operand(kind, other)
    test = f"<{kind[1:]} x i1>" if kind != "f" else "i1"
    return routine.get(kind, f"select {test} {routine.binary('gt', one, other).name}, {a}, {b}")


def largest(routine: Routine, numbers: Operand) -> Operand:
    """Return the largest lane; NaN if the last lane is NaN."""
    count = int(numbers.kind[1:])
    while count > 1:
        type_, half = TYPES[numbers.kind], count // 2
        parts = []
        for first in (0, count - half):
            places = ", ".join(f"i32 {first + j}" for j in range(half))
            cut = f"shufflevector {type_} {numbers.name}, {type_} poison, <{half} x i32> <{places}>"
            parts.append(routine.get(f"v{half}", cut))
        numbers, count = larger(routine, *parts), half
    return routine.lane(numbers, 0)


def read_lanes(routine: Routine, array: Array, index: Operand, count: int) -> Operand:
    """Return `count` entries of an array, from `index` on, as lanes."""
    place = array._place(index)
    return routine.get(f"v{count}", f"load {TYPES[f'v{count}']}, ptr {place}, align 8")


def write_lanes(
    routine: Routine, array: Array, index: Operand, numbers: Operand, count: int
) -> None:
    """Store lanes in an array, from `index` on."""
    place = array._place(index)
    routine.do(f"store {routine.operand(f'v{count}', numbers)}, ptr {place}, align 8")


PRIMITIVES = {
    f.__name__: f for f in (Routine.lane, total, larger, largest, read_lanes, write_lanes)
}
