"""The continuous equations of a scene, derived exactly from its data on its Lie algebroid."""

from .algebroid import Algebroid, algebroid_of
from .euler_lagrange import (
    Balance,
    Equations,
    Mechanics,
    T,
    balance_of,
    equations_of,
    mechanics_of,
    velocity_of,
)
from .exact import exact_time, is_short, number_to_mpf, number_to_mpfr, parameter_values, to_mpf
from .fingerprint import fingerprint

__all__ = [
    "Algebroid", "Balance", "Equations", "Mechanics", "T", "algebroid_of", "balance_of",
    "equations_of", "exact_time", "fingerprint", "is_short", "mechanics_of", "number_to_mpf",
    "number_to_mpfr", "parameter_values", "to_mpf", "velocity_of",
]  # fmt: skip
