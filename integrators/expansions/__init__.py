"""Steps as power series: the modified equation of a scheme, derivatives of runs."""

from .modified_equation import ModifiedEquation
from .step_series import NotExpanded, StepSeries

__all__ = ["ModifiedEquation", "NotExpanded", "StepSeries"]
