"""A mass matrix of sympy, loaded with that when the first one is made."""

from __future__ import annotations

from typing import Any

from ..numbers import sympy
from ..numbers.types import SymbolicMatrix


class Mass(sympy.Matrix):
    """A mass matrix, whose inverse is that of cofactors up to three dimensions, or its diagonal's.

    sympy's own cancels the entries as polynomials in all letters, for minutes where L has hundreds.
    """

    def inv(self, method: str | None = None, **how: Any) -> SymbolicMatrix:
        """Return the inverse; method and the rest as sympy has them, which raises its errors."""
        diagonal = self.is_diagonal()
        if method or how or (self.rows > 3 and not diagonal):
            return super().inv(method, **how)
        size = sympy.Mul(*self.diagonal()) if diagonal else self.det()
        if size == 0:
            return super().inv()
        return sympy.diag(*(1 / e for e in self.diagonal())) if diagonal else self.adjugate() / size
