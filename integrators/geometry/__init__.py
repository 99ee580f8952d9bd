"""First-order geometry of a step: TΨ, the prolongation, defects, transitions between arrows."""

from .adjoint import is_self_adjoint, order_of_step
from .defects import (
    Step,
    in_round_offs,
    poisson_defect,
    pullback_defect,
)
from .forced_form import FormChange, form_change, restricted_defect
from .map_texts import composed_arrows, text_of
from .step_context import (
    Arrow,
    StepContext,
    defects,
    regularity,
    residual,
    singular_sign,
    vector_in,
)
from .step_map import Maps, StagesNotFound, StepMap, StepNotFound, map_text

__all__ = [
    "Arrow", "FormChange", "Maps", "StagesNotFound", "Step", "StepContext", "StepMap",
    "StepNotFound", "composed_arrows", "defects", "form_change",
    "in_round_offs", "is_self_adjoint", "map_text", "order_of_step", "poisson_defect",
    "pullback_defect", "regularity", "residual", "restricted_defect", "singular_sign",
    "text_of", "vector_in",
]  # fmt: skip
