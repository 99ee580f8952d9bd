"""What is derived from one discrete Lagrangian: Legendre maps, residual, FL, W, Ω."""

from .absolute_terms import absolute_terms, energy_terms
from .checks import check_momentum, check_start
from .continuous import energy, initial_momentum, mass_matrix, state_function, vector_field
from .discrete_equations import DiscreteEquations
from .discretised_scene import DiscretisedScene
from .legendre_inverse import legendre_inverse
from .symbols import SceneSymbols
from .system import step_system

__all__ = [
    "DiscreteEquations", "DiscretisedScene", "SceneSymbols", "absolute_terms", "check_momentum",
    "check_start", "energy", "energy_terms", "initial_momentum", "legendre_inverse", "mass_matrix",
    "state_function", "step_system", "vector_field",
]  # fmt: skip
