"""The exceptions of this package."""

from __future__ import annotations


class ReferenceFailure(ValueError):
    """A reference that cannot be computed: one sentence that names the thing and the mend."""


class MotionEnds(ReferenceFailure):
    """The solution itself goes on no further than to `time`: a collision, a pole of the equations,
    or constraints that do not say how."""

    def __init__(self, said: str, time: float) -> None:
        self.time = time
        super().__init__(said)

    def __reduce__(self) -> tuple[type[MotionEnds], tuple[str, float]]:
        return type(self), (str(self), self.time)  # to pickle it between processes


class Damaged(ReferenceFailure):
    """A file of references that cannot be read, with another checksum, or for another scene."""


class WrongDigits(ReferenceFailure):
    """A frozen table that says what a fresh computation does not."""


class Uncertain(ReferenceFailure):
    """Fewer digits are certain than a frozen table needs."""


class Unproven(ArithmeticError):
    """No rigorous bound is found for these equations, or for steps of this size."""


def shown(value: object) -> str:
    """What a message shows of a value; Python writes no whole number of more than 4300 digits."""
    try:
        return repr(value)
    except ValueError:
        return f"a {type(value).__name__} of too many digits"
