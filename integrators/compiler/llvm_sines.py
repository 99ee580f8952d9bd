"""Sine and cosine in all lanes at once, with errors below one unit in the last place.

The argument is reduced by k π/2, where π/2 is given in three parts of 33 bits so that k times a
part is exact (Cody, Waite); the polynomials on |r| ≤ π/4 are those of Sun's fdlibm. If a lane
exceeds 2²⁰, C's library computes the lanes one after another.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from .llvm_lanes import largest
from .llvm_values import OF_LANES, TYPES, Operand, Routine, Value

LARGEST = 2.0**20
ROUNDING = 1.5 * 2.0**52  # adding it rounds a number to an integer, held in the sum's last bits
PARTS = (1.57079632673412561417, 6.07710050630396597660e-11, 2.02226624879595063154e-21)
SINE = (-1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04,
        2.75573137070700676789e-06, -2.50507602534068634195e-08,
        1.58969099521155010221e-10)  # fmt: skip
COSINE = (4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05,
          -2.75573143513906633035e-07, 2.08757232129817482790e-09,
          -1.13596475577881948265e-11)  # fmt: skip


def sines_of_lanes(routine: Routine, x: Value) -> tuple[Value, Value]:
    """Return (sin x, cos x) in each lane; a second call with the same x reuses them."""
    if x.name not in routine.known:
        flags, routine.fast = routine.fast, ""
        pair = _with_large_arguments(routine, x)
        routine.fast = flags
        routine.known[x.name] = pair
    sine, cosine = routine.known[x.name]
    return sine, cosine


def _with_large_arguments(routine: Routine, x: Operand) -> tuple[Value, Value]:
    results = [routine.memory(x.kind) for _ in range(2)]
    near, far, after = (routine.name(label) for label in ("near", "far", "after"))
    test: Operand = largest(routine, abs(x)) < LARGEST
    routine.jump(f"i1 {test.name}, label %{near}, label %{far}")
    routine.begin(near)
    for place, value in zip(results, _near(routine, x), strict=True):
        place[0] = value
    routine.jump(f"label %{after}")
    routine.begin(far)
    for place, name in zip(results, ("sin", "cos"), strict=True):
        place[0] = routine.in_lanes(x.kind, None, partial(routine.call, name), (x,))
    routine.begin(after)
    sine, cosine = (place[0] for place in results)
    return sine, cosine


def _near(routine: Routine, x: Operand) -> tuple[Value, Value]:
    """Return (sin x, cos x) for |x| < 2²⁰."""
    shifted = x * (2 / np.pi) + ROUNDING
    k = shifted - ROUNDING
    first = x - k * PARTS[0]
    part = k * PARTS[1]
    rest = first - part
    lost = k * PARTS[2] - ((first - rest) - part)
    r = rest - lost
    tail = (rest - r) - lost
    routine.fast = "contract "
    z = r * r
    cube = z * r
    sine = r - ((z * (0.5 * tail - cube * _polynomial(z, SINE[1:])) - tail) - cube * SINE[0])
    half = 0.5 * z
    whole = 1.0 - half
    small = z * (z * _polynomial(z, COSINE)) - r * tail
    routine.fast = ""
    cosine = whole + (((1.0 - whole) - half) + small)
    return (_of_quadrant(routine, shifted, 0, sine, cosine),
            _of_quadrant(routine, shifted, 1, sine, cosine))  # fmt: skip


def _polynomial(z: Operand, coefficients: tuple[float, ...]) -> Operand:
    total: Operand = coefficients[-1]
    for c in reversed(coefficients[:-1]):
        total = total * z + c
    return total


def _of_quadrant(routine: Routine, shifted: Value, more: int, sine: Value, cosine: Value) -> Value:
    """Return ± sine or ± cosine, by the last two bits of k + more."""
    kind, count = shifted.kind, int(shifted.kind[1:])
    floats, bits = TYPES[kind], f"<{count} x i64>"

    def same(number: int) -> str:
        return f"<{', '.join([f'i64 {number}'] * count)}>"

    def do(instruction: str) -> str:
        return str(routine.get("", instruction).name)

    k = do(f"bitcast {floats} {shifted.name} to {bits}")
    k = do(f"add {bits} {k}, {same(more)}")
    odd = do(f"and {bits} {k}, {same(1)}")
    odd = do(f"icmp ne {bits} {odd}, {same(0)}")
    chosen = do(f"select <{count} x i1> {odd}, {floats} {cosine.name}, {floats} {sine.name}")
    sign = do(f"and {bits} {k}, {same(2)}")
    sign = do(f"shl {bits} {sign}, {same(62)}")
    raw = do(f"bitcast {floats} {chosen} to {bits}")
    raw = do(f"xor {bits} {raw}, {sign}")
    return Value(kind, do(f"bitcast {bits} {raw} to {floats}"), routine)


OF_LANES["sin"] = lambda routine, x: sines_of_lanes(routine, x)[0]
OF_LANES["cos"] = lambda routine, x: sines_of_lanes(routine, x)[1]
