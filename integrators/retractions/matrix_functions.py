"""Functions of matrices f(A(ξ)), A linear in ξ, with exact derivatives of every order.

The construction for algebras without a closed form. φ₁(A) = (e^A − 1)/A comes from its series at
A/2ⁿ and φ₁(2A) = (e^A + 1) φ₁(A)/2, convergent for every A (Higham, Functions of Matrices, 10.7).
The derivative along e_k is the upper right block of f on [[A, A(e_k)], [0, A]], and so on with
four blocks for two derivatives (Higham, 3.2): nothing is a difference quotient.
"""

from __future__ import annotations

import hashlib
import inspect
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial
from itertools import combinations_with_replacement
from typing import Any

from ..numbers import Arithmetic, code, entry, floats_exact, register, registered_function, sympy
from ..numbers.types import Column, Expression, Letter, Number, Numbers, SymbolicMatrix
from . import matrix_numbers

Nested = tuple[tuple[Any, ...], ...]
#: φ₁; its inverse, which is dexp⁻¹ and singular at the chart's edge only; and e^A − 1
DEXP, DEXP_INVERSE, DISPLACEMENT = 0, 1, 2


for _name in ("matrix_function", "combination", "partial_derivatives"):
    _source = partial(inspect.getsource, getattr(matrix_numbers, _name))
    register(_name, lambda source=_source: f"@arrays\n{source()}")  # type: ignore[misc]


@dataclass(frozen=True)
class MatrixFunction:
    """f(Σ ξ^k basis_k), N×N, of m real variables; basis: m matrices of rational numbers."""

    kind: int
    basis: tuple[Nested, ...]

    def __call__(self, xi: Column) -> SymbolicMatrix:
        """The N×N sympy matrix of its entries at ξ (m×1)."""
        size = len(self.basis[0])
        table = _table(self, 0)(*xi)
        return sympy.Matrix(size, size, [entry(table, i) for i in range(size**2)])

    def directions(self, order: int) -> list[tuple[int, ...]]:
        """Which partial derivatives a table of that order holds, in its order."""
        return list(combinations_with_replacement(range(len(self.basis)), order))

    @cached_property
    def digest(self) -> str:
        """Part of a name that no other function has."""
        return hashlib.sha256(repr((self.kind, self.basis)).encode()).hexdigest()[:12]

    def text(self, order: int) -> str:
        """Text of the function (ξ_1, …, ξ_m) ↦ all derivatives of that order, one after another."""
        m, size = len(self.basis), len(self.basis[0])
        xi = ", ".join(f"xi{k}" for k in range(m))
        entries = [(floats_exact(e), (k, i, j)) for k, b in enumerate(self.basis)
                   for i, row in enumerate(b) for j, e in enumerate(row) if e]  # fmt: skip
        name = f"{self.digest}_{order}"
        data = [f"NUMBERS_{name}", f"PLACES_{name}", f"DIRECTIONS_{name}", str(size)]
        called = f"partial_derivatives(({xi},), {', '.join(data)}, {self.kind})"
        if not order:
            called = f"matrix_function(combination(({xi},), {', '.join(data[:2])}, {size}), "
            called += f"{self.kind}).copy().reshape({size**2})"
        lines = [  # the numbers outside the function: machine code has no integers of any size
            f"NUMBERS_{name} = ({''.join(f'R(1)*({code(e)}), ' for e, _ in entries)})",
            f"PLACES_{name} = {tuple(place for _, place in entries)}",
            f"DIRECTIONS_{name} = {tuple(self.directions(order))}",
            f"@table\ndef matrix_{name}({xi}):\n    return {called}",
        ]
        return "\n".join(lines)


@lru_cache(maxsize=256)
def _table(function: MatrixFunction, order: int) -> Any:
    """The sympy function whose entries are the partial derivatives of that order."""
    size = len(function.basis[0]) ** 2

    class Table(sympy.Function):
        def slope(self, index: int, s: Letter) -> Expression:
            which, at = divmod(index, size)
            chosen = function.directions(order)[which]
            higher, total = None, 0
            for k, xi in enumerate(self.args):
                inner = xi.diff(s)
                if inner != 0:
                    higher = higher or _table(function, order + 1)
                    place = function.directions(order + 1).index(tuple(sorted((*chosen, k))))
                    total += inner * entry(higher(*self.args), place * size + at)
            return total

        def in_arithmetic(self, numbers: Arithmetic, values: Numbers) -> Number:
            """All numbers of the table."""
            return registered_function(type(self).__name__, numbers)(*values)

    Table.__name__ = register(f"matrix_{function.digest}_{order}", lambda: function.text(order))
    return Table
