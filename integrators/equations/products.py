"""Products of a matrix and a column of large expressions."""

from __future__ import annotations

from ..numbers import sympy
from ..numbers.types import Column, SymbolicMatrix
from .symbols import column


def times(matrix: SymbolicMatrix, entries: Column) -> Column:
    """matrix · column; nothing is multiplied by zero.

    Sympy's product asks of every entry whether 0 times it is 0, so whether each of its letters and
    functions is finite: with the gradient of many springs that takes longer than to derive it.
    """
    given = entries.flat()
    return column(
        sympy.Add(*[a * e for a, e in zip(row, given, strict=True) if a != 0 and e != 0])
        for row in matrix.tolist()
    )
