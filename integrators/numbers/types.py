"""Names for the values that rooms exchange; sympy and gmpy2 have no types of their own."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

if TYPE_CHECKING:
    from flint import arb
    from numpy.typing import DTypeLike

#: a sympy expression, and a letter of one
Expression: TypeAlias = Any
Letter: TypeAlias = Any
#: a sympy matrix; n×1, it is a column
SymbolicMatrix: TypeAlias = Any
Column: TypeAlias = Any
#: a point x of the base, a velocity or element ξ of the algebroid, and a covector μ at a point:
#: columns of letters in a derivation, of numbers where a formula is evaluated
Point: TypeAlias = Column
Velocity: TypeAlias = Column
Covector: TypeAlias = Column
#: the parameters of a scene as its functions read them: p.mass
Parameters: TypeAlias = SimpleNamespace
#: the matrices of two frames of fields: left- and right-invariant, or e→ and e← on a point
FieldPair: TypeAlias = tuple[SymbolicMatrix, SymbolicMatrix]
#: letters or expressions in order: a list, or a column
Letters: TypeAlias = Sequence[Letter]
Expressions: TypeAlias = Sequence[Expression]
#: letter → the expression or number that replaces it
Replacement: TypeAlias = dict[Letter, Expression]
#: an int, Fraction or sympy number without any rounding
Exact: TypeAlias = Any
#: a number as a user gives it: exact, a float, or text such as "0.1"
Given: TypeAlias = Any
#: numbers as a user gives them: a list, a tuple, an array or a column
GivenVector: TypeAlias = Iterable[Given]
#: a number of an arithmetic: float or gmpy2's mpfr
Number: TypeAlias = Any
#: whatever a formula runs on, since it adds and multiplies: a number, an expression, a node of the
#: graph, a power series, a ball
Scalar: TypeAlias = Any
Scalars: TypeAlias = Sequence[Scalar]
#: a column, or a matrix row by row, of expressions of sympy or of nodes of the graph
Entries: TypeAlias = Any
#: an array, or what numpy makes one of: plain, or with bounds of errors (`Tracked`), which numpy's
#: functions take, too, but their types do not say so
Array: TypeAlias = Any
#: a real ball of flint: a number with a bound of its error
Ball: TypeAlias = "arb"
#: a number of mpmath
Mpf: TypeAlias = Any
#: numbers of an arithmetic in an array, of one and of two dimensions
Vector: TypeAlias = np.ndarray
Numbers: TypeAlias = Sequence[Number] | np.ndarray
Matrix: TypeAlias = np.ndarray
#: the type of an array's numbers: np.float64, object, or a dtype
DType: TypeAlias = "DTypeLike"
#: a matrix: an array, or one of scipy.sparse, which has no types of its own
MatrixLike: TypeAlias = Any
#: rows of numbers: nested sequences, or an array of two dimensions
Rows: TypeAlias = Sequence[Numbers] | np.ndarray
#: a function of a scene or a rule, or one made of a text; its place tells what it takes
Function: TypeAlias = Callable[..., Any]
#: the names that a text uses or defines, and what they stand for
Namespace: TypeAlias = dict[str, Any]
