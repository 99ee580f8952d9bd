"""What is derived from one discrete Lagrangian: Legendre maps, residual, FL, W, Ω."""

from .checks import check_momentum, check_start
from .continuous import initial_momentum, mass_matrix
from .discrete_equations import DiscreteEquations
from .system import step_system

__all__ = [
    "DiscreteEquations", "check_momentum", "check_start", "initial_momentum", "mass_matrix",
    "step_system",
]  # fmt: skip
