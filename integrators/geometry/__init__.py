"""First-order geometry of a step: TΨ, the prolongation, defects, transitions between arrows."""

from .adjoint import is_self_adjoint
from .local_geometry import LocalGeometry, StagesNotFound, frobenius, slopes
from .transitions import Arrow, poisson_defect, pullback_defect

__all__ = [
    "Arrow", "LocalGeometry", "StagesNotFound", "frobenius", "is_self_adjoint",
    "poisson_defect", "pullback_defect", "slopes",
]  # fmt: skip
