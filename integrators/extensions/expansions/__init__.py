"""Steps as power series: the modified equation of a scheme, derivatives of runs."""

from .laurent import TooLong
from .modified_equation import ModifiedEquation
from .run_derivatives import RunDifferentiated
from .series import NotKnown, Series, series_namespace
from .step_series import NoStep, NotConsistent, NotExpanded, StepSeries, series_function

__all__ = [
    "ModifiedEquation", "NoStep", "NotConsistent", "NotExpanded", "NotKnown", "RunDifferentiated",
    "Series", "StepSeries", "TooLong", "series_function", "series_namespace",
]  # fmt: skip
