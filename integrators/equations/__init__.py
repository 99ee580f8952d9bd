"""What is derived from one discrete Lagrangian: Legendre maps, residual, FL, W, Ω."""

from .checks import check_momentum, check_start
from .continuous import energy, initial_momentum, mass_matrix, state_function, vector_field
from .discrete_equations import DiscreteEquations
from .discretised_scene import DiscretisedScene
from .symbols import SceneSymbols
from .system import step_system

__all__ = [
    "DiscreteEquations", "DiscretisedScene", "SceneSymbols", "check_momentum", "check_start",
    "energy", "initial_momentum", "mass_matrix", "state_function", "step_system", "vector_field",
]  # fmt: skip
