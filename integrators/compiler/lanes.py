"""Vectors of lanes as numpy arrays, for Python, and the tables of Gauss and Lobatto nodes.

Machine code has vectors in place of these arrays, and the tables as constants.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeAlias

import numpy as np
from numpy.polynomial.polynomial import polyfromroots, polyint, polyval

from ..numbers import Arithmetic, mpmath, working_digits
from ..numbers.types import Function, Mpf, Namespace, Number, Vector

#: digits ↦ [(node, weight)] in order, on [0, 1]
Nodes: TypeAlias = Callable[[int], Sequence[tuple[Mpf, Mpf]]]
#: sweeps of a fixed point for each digit; if more are needed, Newton's method is faster
SWEEPS = 4


def lane_namespace(count: int, numbers: Arithmetic, widest: int) -> Namespace:
    """Return the names that the text of a collocation step uses beside its own and `tables`.

    widest: the number of lanes in a vector in machine code.
    """
    width = count if numbers.digits > 16 else min(widest, 2 ** (count - 1).bit_length())
    functions = {
        name: f for name, f in numbers.array_namespace().items()
        if callable(f) and name.islower() and name not in ("array", *numbers.matrices())
    }  # fmt: skip
    of_numbers = {**functions, "helper": elementwise, "table": elementwise}
    own = {} if numbers.digits == 16 else of_numbers
    return own | {
        # as lists, which Python reads sooner than the arrays of `zeros`
        "blank": lambda rows, columns: [[0] * columns for _ in range(rows)],
        "lane": lambda v, j: v[j],
        "total": lambda v: sum(v),
        "larger": np.maximum,
        "largest": max,
        "read_lanes": lambda a, i, count: a[i : i + count],
        "write_lanes": _write,
        "WIDTH": width,
        "PYTHON": numbers.digits > 16,
        "MOST_SWEEPS": SWEEPS * numbers.digits,
    }  # fmt: skip


def _write(array: Vector, index: int, lanes: Vector, count: int) -> None:
    array[index : index + count] = lanes


def elementwise(function: Function) -> Function:
    """Return the function extended to arrays: it is applied to each lane separately."""

    def of_lanes(*arguments: Number | Vector) -> Number | Vector | tuple[Vector, ...]:
        length = next((len(g) for g in arguments if isinstance(g, np.ndarray)), None)
        if length is None:
            return function(*arguments)
        rows = [
            function(*(g[j] if isinstance(g, np.ndarray) else g for g in arguments))
            for j in range(length)
        ]
        if not isinstance(rows[0], (tuple, list, np.ndarray)):
            return np.array(rows, dtype=object)
        return tuple(np.array(column, dtype=object) for column in zip(*rows, strict=True))

    return of_lanes


def tables(nodes: Nodes, count: int, width: int, numbers: Arithmetic) -> Namespace:
    """Return the tables of `sweeps`: of each part, columns of lanes.

    MU: μ_ij = a_ij/b_j for positions; MU_OF_MOMENTUM: 1 − μ_ji, on Gauss nodes the same table. The
    smaller number of such a pair is 1 minus the larger, which is exact in binary. LEGENDRE: (2j +
    1) P_j at the nodes, for each degree j.
    """
    with working_digits(numbers.digits + 30):
        c, b = zip(*nodes(numbers.digits + 30), strict=True)
        basis = [_lagrange(c, j) for j in range(count)]
        pairs = [[_pair(polyval(c[i], polyint(basis[j])) / b[j], numbers) for j in range(count)]
                 for i in range(count)]  # fmt: skip
        mu = [[pair[0] for pair in row] for row in pairs]
        dual = [[pairs[j][i][1] for j in range(count)] for i in range(count)]
        later = [1 + e for e in c]
        # the end of a step is one more node, unless the last node is there already
        inner = c[-1] < 1
        ends = (*c, mpmath.mpf(1)) if inner else c
        extended = [_lagrange(ends, j) for j in range(len(ends))] + [[mpmath.mpf(0)]] * (not inner)
        velocity = [[numbers.number(polyval(t, e)) for e in basis] for t in later]
        momentum = [[numbers.number(polyval(t, e)) for e in extended] for t in later]
        weights = [[numbers.number(e)] for e in b]
        legendre = [[[numbers.number((2 * j + 1) * mpmath.legendre(j, 2 * e - 1))] for e in c]
                    for j in range(count - (not inner))]  # fmt: skip
    none = [0 * weights[0][0]]

    def single(column: list[list[Number]]) -> tuple[Vector, ...]:
        return tuple(part[0] for part in _parts(column, width, numbers, none))

    return {
        "MU": _parts(mu, width, numbers, mu[-1]),
        "MU_OF_MOMENTUM": _parts(dual, width, numbers, dual[-1]),
        "WEIGHTS": single(weights),
        "LEGENDRE": tuple(map(single, legendre)),
        "OF_VELOCITY": _parts(velocity, width, numbers, velocity[-1]),
        "OF_MOMENTUM": _parts(momentum, width, numbers, momentum[-1]),
    }


def _pair(mu: Mpf, numbers: Arithmetic) -> tuple[Number, Number]:
    """Return μ and 1 − μ, rounded so that the smaller is exactly 1 minus the larger."""
    larger = numbers.number(max(mu, 1 - mu))
    return (larger, 1 - larger) if 2 * mu > 1 else (1 - larger, larger)


def _parts(
    rows: list[list[Number]], width: int, numbers: Arithmetic, last: list[Number]
) -> tuple[tuple[Vector, ...], ...]:
    """Return the columns of each group of `width` rows as lanes; `last` fills the rest."""
    filled = rows + [last] * (-len(rows) % width)
    return tuple(
        tuple(np.array(column, dtype=numbers.dtype) for column in zip(*part, strict=True))
        for part in (filled[i : i + width] for i in range(0, len(filled), width))
    )


def _lagrange(nodes: Sequence[Mpf], j: int) -> np.ndarray:
    """Return coefficients, the constant first, of the polynomial 1 at node j, 0 at others."""
    p = polyfromroots([node for k, node in enumerate(nodes) if k != j])
    return np.asarray(p / polyval(nodes[j], p))
