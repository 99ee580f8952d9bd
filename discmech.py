"""A bench for people who design variational integrators.

You write one discrete Lagrangian; the bench derives everything else exactly, runs it compiled and
at any number of digits, and measures order, symplecticity, momentum, energy and stability. The
three packages behind it are `discmech.integrators`, `discmech.reference` and `discmech.studies`;
importing this one loads neither sympy nor numba.
"""

from __future__ import annotations

from pathlib import Path

__path__ = [
    str(Path(__file__).resolve().parent)
]  # in a checkout this file lies beside its packages

from discmech.integrators import (
    BadInput,
    Bisection,
    Conserved,
    DiscmechError,
    Discretisation,
    EvolutionOperator,
    Groupoid,
    LocalGroupoid,
    MatrixAlgebra,
    Scene,
    Scheme,
    StepFailure,
    action,
    cayley,
    discretisation,
    exponential,
    imex,
    lie_group,
    midpoint,
    on_group,
    pair,
    product,
    rectangle,
    scenes,
    se,
    sl,
    so,
    sp,
    su,
    trapezoidal,
)
from discmech.reference import solution
from discmech.studies import check, show

__all__ = [
    "BadInput",
    "Bisection",
    "Conserved",
    "DiscmechError",
    "Discretisation",
    "EvolutionOperator",
    "Groupoid",
    "LocalGroupoid",
    "MatrixAlgebra",
    "Scene",
    "Scheme",
    "StepFailure",
    "action",
    "cayley",
    "check",
    "discretisation",
    "exponential",
    "imex",
    "lie_group",
    "midpoint",
    "on_group",
    "pair",
    "product",
    "rectangle",
    "scenes",
    "se",
    "show",
    "sl",
    "so",
    "solution",
    "sp",
    "su",
    "trapezoidal",
]
