"""Objects derived from one discrete Lagrangian: Legendre maps, residual, FL, W, Ω."""

from .absolute_terms import absolute_terms, energy_terms
from .arrows import Arrows
from .checks import (
    blamed,
    check_finite,
    check_force,
    check_momentum,
    check_regular,
    refuse_pieces,
)
from .constrained_equations import ConstrainedEquations
from .constrained_start import check_on_constraints, nearest_start, on_constraints
from .constraints import (
    constraint,
    constraint_matrix,
    constraint_shift,
    met_by_velocity,
    reaction_matrix,
    vanishing_at_states,
    vanishing_in_a_step,
)
from .continuous import (
    closed_velocity,
    energy,
    energy_gradient,
    field_parts,
    initial_momentum,
    inverse_two_form,
    mass_matrix,
    momentum,
    natural_structure,
    orientation,
    poisson_tensor,
    power,
    rates,
    vector_field,
)
from .discrete_lagrangian import DiscreteLagrangian
from .discretised_scene import DiscretisedScene
from .dual_system import DualSystem
from .legendre_inverse import legendre_inverse
from .rule_view import answers_of, written
from .stage_equations import no_stages, stage_source
from .step_equations import DiscreteEquations, StepEquations, composed_step
from .symbols import SceneSymbols, times, vector
from .virtual_work import discrete_force, force_points

__all__ = [
    "Arrows", "ConstrainedEquations", "DiscreteEquations", "DiscreteLagrangian", "DiscretisedScene",
    "DualSystem", "SceneSymbols", "StepEquations", "absolute_terms",
    "answers_of", "blamed", "check_finite", "check_force", "check_momentum", "check_on_constraints",
    "check_regular", "closed_velocity", "composed_step", "constraint",
    "constraint_matrix", "constraint_shift",
    "discrete_force", "energy", "energy_gradient", "energy_terms", "field_parts", "force_points",
    "initial_momentum", "inverse_two_form", "legendre_inverse", "mass_matrix", "met_by_velocity",
    "momentum", "natural_structure", "nearest_start", "no_stages", "on_constraints", "orientation",
    "poisson_tensor", "power", "rates", "reaction_matrix", "refuse_pieces", "stage_source", "times",
    "vanishing_at_states", "vanishing_in_a_step", "vector", "vector_field", "written",
]  # fmt: skip
