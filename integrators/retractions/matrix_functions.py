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
from itertools import combinations_with_replacement, product

from ..numbers import Arithmetic, code, entry, floats_exact, register, registered_function, sympy
from ..numbers.types import (
    Column,
    Exact,
    Expression,
    Function,
    Letter,
    Number,
    Numbers,
    SymbolicMatrix,
)
from . import matrix_numbers

Nested = tuple[tuple[Exact, ...], ...]
#: φ₁; its inverse, which is dexp⁻¹ and singular at the chart's edge only; and e^A − 1
DEXP, DEXP_INVERSE, DISPLACEMENT = 0, 1, 2


for _name in ("matrix_function", "matrix_sum", "matrix_block"):
    _source = partial(inspect.getsource, getattr(matrix_numbers, _name))
    register(_name, lambda source=_source: f"@aside\n{source()}")  # type: ignore[misc]


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

    def directions(self, order: int) -> dict[tuple[int, ...], int]:
        """The partial derivatives that a table of that order holds, each with its place."""
        return _places(len(self.basis), order)

    @cached_property
    def digest(self) -> str:
        """Part of a name that no other function has."""
        return hashlib.sha256(repr((self.kind, self.basis)).encode()).hexdigest()[:12]

    def text(self, order: int) -> str:
        """Text of the function (ξ_1, …, ξ_m) ↦ all derivatives of that order, one after another.

        Each is the upper right block of f on a matrix of 2^order × 2^order blocks.
        """
        m, size, blocks = len(self.basis), len(self.basis[0]), 2**order
        made = ["a", "phi", "other", "out"]
        lines = [f"{name} = zeros({size * blocks}, {size * blocks})" for name in made]
        directions = self.directions(order)
        for letter in ["own"] + [f"basis{k}" for k in range(m) if order]:
            lines.append(f"{letter} = zeros({size}, {size})")
        for i, j in product(range(size), range(size)):
            of_entry = [(k, floats_exact(b[i][j])) for k, b in enumerate(self.basis) if b[i][j]]
            if of_entry:
                terms = [f"R(1)*({code(e)})*xi{k}" for k, e in of_entry]
                lines.append(f"own[{i}, {j}] = {' + '.join(terms)}")
            if order:
                lines += [f"basis{k}[{i}, {j}] = R(1)*({code(e)})" for k, e in of_entry]
        for d, direction in enumerate(directions):
            lines.append(f"matrix_sum(a, 0, a, 0, {size * blocks})")
            for block in range(blocks):
                at = block * size
                lines.append(f"matrix_block(a, {at}, {at}, own, {size})")
                for bit in range(order):
                    if not block >> bit & 1:
                        to, k = (block | 1 << bit) * size, direction[bit]
                        lines.append(f"matrix_block(a, {at}, {to}, basis{k}, {size})")
            lines.append(f"matrix_function(out, a, phi, other, {size * blocks}, {self.kind})")
            corner = ", ".join(f"out[{i}, {size * (blocks - 1) + j}]"
                               for i, j in product(range(size), range(size)))  # fmt: skip
            lines.append(f"d{d} = ({corner},)")
        lines.append(f"return {' + '.join(f'd{d}' for d in range(len(directions)))}")
        xi = ", ".join(f"xi{k}" for k in range(m))
        return f"@table\ndef matrix_{self.digest}_{order}({xi}):\n    " + "\n    ".join(lines)


@lru_cache(maxsize=256)
def _places(m: int, order: int) -> dict[tuple[int, ...], int]:
    return {d: i for i, d in enumerate(combinations_with_replacement(range(m), order))}


@lru_cache(maxsize=256)
def _table(function: MatrixFunction, order: int) -> Function:
    """The sympy function whose entries are the partial derivatives of that order."""
    size = len(function.basis[0]) ** 2

    class Table(sympy.Function):
        def slope(self, index: int, s: Letter) -> Expression:
            which, at = divmod(index, size)
            chosen = list(function.directions(order))[which]
            total = 0
            for k, xi in enumerate(self.args):
                if s in xi.free_symbols:
                    higher = _table(function, order + 1)(*self.args)
                    place = function.directions(order + 1)[tuple(sorted((*chosen, k)))]
                    total += xi.diff(s) * entry(higher, place * size + at)
            return total

        def in_arithmetic(self, numbers: Arithmetic, values: Numbers) -> Number:
            """All numbers of the table."""
            return registered_function(type(self).__name__, numbers)(*values)

    Table.__name__ = register(f"matrix_{function.digest}_{order}", lambda: function.text(order))
    return Table
