"""First-order geometry of a step: TΨ, the prolongation, defects, transitions between arrows."""

from .adjoint import is_self_adjoint, order_of_step
from .composed_arrows import composed_arrows
from .defects import (
    Step,
    entrywise_defect,
    in_round_offs,
    poisson_defect,
    pullback_defect,
    step_round_off,
)
from .forced_form import FormChange, form_change
from .local_geometry import LocalGeometry, Maps, StagesNotFound, map_text, slopes
from .map_texts import text_of
from .one_step_geometry import OneStepGeometry, StepNotFound
from .restricted_form import restricted_defect
from .step_context import StepContext, vector_in
from .transitions import Arrow, defects, regularity, residual, singular_sign

__all__ = [
    "Arrow", "FormChange", "LocalGeometry", "Maps", "OneStepGeometry", "StagesNotFound", "Step",
    "StepContext", "StepNotFound", "composed_arrows", "defects", "entrywise_defect", "form_change",
    "in_round_offs", "is_self_adjoint", "map_text", "order_of_step", "poisson_defect",
    "pullback_defect", "regularity", "residual", "restricted_defect", "singular_sign", "slopes",
    "step_round_off", "text_of", "vector_in",
]  # fmt: skip
