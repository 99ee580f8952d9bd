"""A matrix algebra in one arithmetic, for what a retraction computes with numbers."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from ..algebras import MatrixAlgebra
from ..numbers import Arithmetic
from ..numbers.types import Matrix, Numbers, Rows, Vector


class AlgebraInNumbers:
    """A matrix algebra in one arithmetic: matrices and coordinates as numpy arrays."""

    def __init__(self, algebra: MatrixAlgebra, numbers: Arithmetic) -> None:
        self.algebra, self.numbers = algebra, numbers

    def array(self, rows: Rows) -> Matrix:
        """A matrix of exact entries in this arithmetic."""
        number = self.numbers.number
        return np.array([[number(e) for e in row] for row in rows], dtype=self.numbers.dtype)

    @cached_property
    def e(self) -> Matrix:
        """The identity, N×N."""
        return self.numbers.identity(self.algebra.size)

    @cached_property
    def _basis(self) -> np.ndarray:
        return np.array([self.array(e) for e in self.algebra.basis])

    @cached_property
    def _dual(self) -> Matrix:
        return self.array(self.algebra.dual.tolist())

    def hat(self, xi: Numbers) -> Matrix:
        """ξ^γ e_γ, N×N."""
        return np.tensordot(xi, self._basis, 1)

    def read(self, matrix: Matrix) -> Vector:
        """The coordinates of a matrix of the algebra, m."""
        return np.asarray(self._dual @ matrix.ravel())
