"""Numbers: exact input, double and any precision, and functions made of symbolic expressions.

Importing this package loads neither sympy nor gmpy2.
"""

from .arithmetic import (
    MOST_DIGITS,
    Arithmetic,
    Double,
    Multiple,
    NotComputed,
    NotSmooth,
    arithmetic,
    finite,
)
from .evaluation import evaluate, evaluate_at, evaluate_matrix, node_values, number
from .exact import (
    exact,
    exact_matrices,
    exact_nested,
    exact_rational,
    exact_vector,
    flatten,
    floats_exact,
    listed,
    measure,
    refuse_large,
    refuse_unwritten,
    short_numbers,
    to_sympy,
    whole_number,
    within_doubles,
    without_text,
)
from .graph import Graph, parts_of, replaced, symbols_of
from .held import Frame, Scope, jacobian
from .identities import (
    first_violation,
    is_zero,
    null_direction,
    random_columns,
    random_point,
    shown,
    vanishes,
    vanishes_as,
)
from .lazy import LazyModule, mpmath, sympy, uncollected, working_digits
from .multi_output import InArithmetic, as_one_number, entry, opaque
from .newton import newton, over, steepness
from .nodes import Node, NodeMatrix, Nodes, Rational, ratio
from .numeric import numeric, numeric_function, numeric_text, registered_function, run_text
from .operations import Coefficients, Operations, Value
from .prime_field import BITS, NotRational, PrimeField, Residue, small_fraction
from .registered import collect, register, with_tables
from .running_error import (
    Tracked,
    from_balls,
    inverse_sizes,
    rounded,
    solve,
    tracked,
    tracked_later,
    with_running_errors,
)
from .statements import called_text, code, coefficients_text, function_text, text_of, with_arguments
from .types import Letters, Matrix, Number, Numbers, Vector

__all__ = [
    "Arithmetic", "BITS", "Coefficients", "Double", "Frame", "Graph", "InArithmetic",
    "LazyModule", "Letters", "MOST_DIGITS", "Matrix", "Multiple", "Node", "NodeMatrix", "Nodes",
    "NotComputed", "NotRational", "NotSmooth", "Number", "Numbers", "Operations",
    "PrimeField", "Rational", "Residue", "Scope", "Tracked", "Value", "Vector",
    "arithmetic", "as_one_number", "called_text", "code", "coefficients_text", "collect", "entry",
    "evaluate", "evaluate_at", "evaluate_matrix", "exact", "exact_matrices", "exact_nested",
    "exact_rational", "exact_vector", "finite", "first_violation", "flatten", "floats_exact",
    "from_balls",
    "function_text", "inverse_sizes", "is_zero", "jacobian", "listed", "measure", "mpmath",
    "newton", "node_values", "null_direction", "number", "numeric", "numeric_function",
    "numeric_text", "opaque", "over", "parts_of", "random_columns", "random_point", "ratio",
    "refuse_large", "refuse_unwritten", "register", "registered_function", "replaced", "rounded",
    "run_text", "short_numbers", "shown", "small_fraction", "solve",
    "steepness", "symbols_of", "sympy", "text_of", "to_sympy", "tracked", "tracked_later",
    "uncollected", "vanishes", "vanishes_as", "whole_number", "with_arguments",
    "with_running_errors", "with_tables", "within_doubles", "without_text", "working_digits",
]  # fmt: skip
