"""Numbers: exact input, double and any precision, and functions made of symbolic expressions.

Importing this package loads neither sympy nor gmpy2.
"""

from __future__ import annotations

from .arithmetic import Arithmetic, Double, Multiple, arithmetic
from .differentiation import jacobian
from .evaluation import evaluate, evaluate_matrix
from .exact import exact, exact_matrices, exact_nested, exact_rational, exact_vector
from .identities import first_violation, is_zero, random_columns, random_point
from .lazy import sympy
from .newton import newton
from .numeric import numeric, numeric_function, numeric_text

__all__ = [
    "Arithmetic", "Double", "Multiple", "arithmetic", "evaluate", "evaluate_matrix", "exact",
    "exact_matrices", "exact_nested", "exact_rational", "exact_vector", "first_violation",
    "is_zero", "jacobian", "newton", "numeric", "numeric_function", "numeric_text",
    "random_columns", "random_point", "sympy",
]  # fmt: skip
