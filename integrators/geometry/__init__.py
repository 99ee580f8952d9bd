"""First-order geometry of a step: TΨ, the prolongation, defects, transitions between arrows."""

from .adjoint import is_self_adjoint
from .local_geometry import (
    LocalGeometry,
    Maps,
    StagesNotFound,
    frobenius,
    relative_defect,
    slopes,
    text_of,
)
from .one_step_geometry import OneStepGeometry, StepNotFound
from .transitions import (
    Arrow,
    defects,
    poisson_defect,
    pullback_defect,
    regularity,
    residual,
    singular_sign,
)

__all__ = [
    "Arrow", "LocalGeometry", "Maps", "OneStepGeometry", "StagesNotFound", "StepNotFound",
    "defects", "frobenius", "is_self_adjoint", "poisson_defect", "pullback_defect", "regularity",
    "relative_defect", "residual", "singular_sign", "slopes", "text_of",
]  # fmt: skip
