"""Value, gradient and Hessian of a scalar that is written with letters for its parts.

The scalar is a straight-line program, ℓ_1 = V_1(a), ℓ_2 = V_2(a, ℓ_1), …, f(a, ℓ). Each V and f is
differentiated symbolically by the few letters that it contains; the parts are joined as numbers.
With T = d(a, ℓ)/da forwards and ℓ̄ = df/dℓ backwards,

    df/da = ∂f/∂a + Σ ℓ̄_i ∂V_i/∂a,    d²f/da² = Tᵀ ∂²(f + Σ ℓ̄_i V_i)/∂(a, ℓ)² T.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from graphlib import TopologicalSorter
from typing import Any

import numpy as np

from ..equations import vector
from ..numbers import (
    arithmetic,
    numeric,
    opaque,
    symbols_of,
    sympy,
    within_doubles,
)
from ..numbers.types import Expression, Letter

#: number of array entries that are computed at a time
CHUNK = 2**21


class SecondDerivatives:
    """A scalar of `inputs` and `data` (letters) as a function of columns of numbers.

    known: the values of other letters of the scalar, in order. Raises `BadInput` for functions that
    double precision does not have.
    """

    def __init__(
        self,
        scalar: Expression,
        inputs: Sequence[Letter],
        data: Sequence[Letter],
        known: Mapping[Letter, Expression],
    ) -> None:
        program, scalar = _in_small_parts(known, scalar)
        letters, values = list(program), [*program.values(), scalar]
        self.size, self.count = len(inputs), len(letters)
        place = {letter: i for i, letter in enumerate([*inputs, *letters])}
        adjoint = [*vector("adjoint", len(letters)), sympy.Integer(1)]
        slopes: dict[tuple[int, int], Expression] = {}
        second: dict[tuple[int, int], Expression] = {}
        for i, value in enumerate(values):
            held = sorted((s for s in symbols_of([value]) if s in place), key=lambda s: place[s])
            for a in held:
                slope = value.diff(a)
                if slope == 0:
                    continue
                slopes[i, place[a]] = slope
                for b in held[: held.index(a) + 1]:
                    if (curvature := slope.diff(b)) != 0:
                        at = place[a], place[b]
                        second[at] = second.get(at, 0) + adjoint[i] * curvature
        self._slopes, self._second = list(slopes), list(second)
        given = {"a": list(inputs), "q": list(data)}
        self._first_order = _in_columns(given, [scalar, *letters, *slopes.values()], program)
        given |= {"l": letters, "b": adjoint[:-1]}
        self._second_order = _in_columns(given, [inputs[0], *second.values()])

    def __call__(self, a: np.ndarray, q: Sequence[Any]) -> tuple[np.ndarray, ...]:
        """Return (values (N,), gradients (N, k), Hessians (N, k, k)) at N rows of k inputs.

        q: the data, each a number or N numbers.
        """
        rows = max(1, CHUNK // ((self.size + self.count) * self.size))
        with within_doubles("the control problem"):
            parts = [
                self._at(a[i : i + rows], [e[i : i + rows] if np.ndim(e) else e for e in q])
                for i in range(0, len(a), rows)
            ]
        return tuple(map(np.concatenate, zip(*parts, strict=True)))

    def _at(self, a: np.ndarray, q: list[Any]) -> tuple[np.ndarray, ...]:
        rows, size, count = len(a), self.size, self.count
        first = self._first_order(a.T, q)
        # also for constants; integers beyond 2⁶³ are Python's own
        first = np.broadcast_to(first.reshape(len(first), -1).astype(float), (len(first), rows))
        letters, slopes = first[1 : 1 + count], first[1 + count :]
        tangent = np.zeros((size + count, rows, size))
        tangent[range(size), :, range(size)] = 1
        below = list(zip(self._slopes, slopes, strict=True))
        for (i, j), slope in below:
            if i < count:
                tangent[size + i] += slope[:, None] * tangent[j]
        adjoint = np.zeros((size + count, rows))
        for (i, j), slope in reversed(below):
            adjoint[j] += slope if i == count else slope * adjoint[size + i]
        second = self._second_order(a.T, q, letters, adjoint[size:])[1:].astype(float)
        curved = np.zeros_like(tangent)
        for (i, j), value in zip(self._second, second, strict=True):
            curved[i] += (value if i != j else value / 2)[:, None] * tangent[j]
        half = tangent.transpose(1, 2, 0) @ curved.transpose(1, 0, 2)
        return first[0], adjoint[:size].T, half + half.transpose(0, 2, 1)


def _in_small_parts(
    program: Mapping[Letter, Expression], scalar: Expression
) -> tuple[dict[Letter, Expression], Expression]:
    """Return letters and their values in order, with letters for shared parts, and the scalar."""
    names, values = [*program], [*program.values(), scalar]
    shared, reduced = sympy.cse(values, sympy.numbered_symbols("part", real=True), order="none")
    given = {**dict(zip(names, reduced, strict=False)), **dict(shared)}
    order = TopologicalSorter({k: symbols_of([v]) & given.keys() for k, v in given.items()})
    return {letter: given[letter] for letter in order.static_order()}, reduced[-1]


def _in_columns(
    arguments: Mapping[str, Sequence[Letter]],
    results: list[Expression],
    program: Mapping[Letter, Expression] = {},
) -> Callable[..., np.ndarray]:
    """Return the results (k, N) as a function of columns; row by row if they branch (tables)."""
    before = [([letter], [value]) for letter, value in program.items()]
    branching = any(map(opaque, (*results, *program.values())))
    f = numeric(arguments, [results], arithmetic(16), before, columns=not branching)
    if not branching:
        return f

    def by_rows(*columns: Any) -> np.ndarray:
        sizes = [len(part) for part in columns]
        entries = np.broadcast_arrays(*(e for part in columns for e in part))
        cuts = np.cumsum(sizes)[:-1]
        return np.array([f(*np.split(row, cuts)) for row in np.array(entries).T]).T

    return by_rows
