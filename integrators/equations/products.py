"""Products of matrices of large expressions."""

from __future__ import annotations

from ..numbers import sympy
from ..numbers.types import SymbolicMatrix


def times(one: SymbolicMatrix, other: SymbolicMatrix) -> SymbolicMatrix:
    """one · other; nothing is multiplied by zero.

    Sympy's product asks of every entry whether 0 times it is 0, so whether each of its letters and
    functions is finite: with the gradient of many springs that takes longer than to derive it.
    """
    columns = other.T.tolist()
    return sympy.Matrix(one.rows, other.cols, [
        sympy.Add(*[a * e for a, e in zip(row, column, strict=True) if a != 0 and e != 0])
        for row in one.tolist() for column in columns
    ])  # fmt: skip
