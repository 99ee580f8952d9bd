"""The Taylor integration: equations as a tape, read as power series (mpfr) and as balls (arb)."""

from .integration import (
    BITS,
    STEP_BITS,
    Step,
    Sweep,
    TaylorSettings,
    integrate,
    polynomial,
    safe_step,
)
from .series import SeriesProgram, compile_series

__all__ = [
    "BITS", "STEP_BITS", "SeriesProgram", "Step", "Sweep", "TaylorSettings", "compile_series",
    "integrate", "polynomial", "safe_step",
]  # fmt: skip
