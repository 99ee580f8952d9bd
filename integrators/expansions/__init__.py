"""Steps as power series: the modified equation of a scheme, derivatives of runs."""

from .modified_equation import ModifiedEquation
from .run_derivatives import RunDerivatives, RunDifferentiated, RunGradient
from .step_series import NotConsistent, NotExpanded, StepSeries

__all__ = [
    "ModifiedEquation", "NotConsistent", "NotExpanded", "RunDerivatives", "RunDifferentiated",
    "RunGradient", "StepSeries",
]  # fmt: skip
