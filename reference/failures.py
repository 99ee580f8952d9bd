"""The exceptions of this package."""

from __future__ import annotations


class ReferenceFailure(ValueError):
    """A reference that cannot be computed: one sentence names the object and the fix."""


class MotionEnds(ReferenceFailure):
    """The solution itself ends at `time`.

    The cause is a collision, a pole of the equations, or constraints that do not determine the
    motion.
    """

    def __init__(self, said: str, time: float) -> None:
        self.time = time
        super().__init__(said)

    def __reduce__(self) -> tuple[type[MotionEnds], tuple[str, float]]:
        return type(self), (str(self), self.time)  # for pickling between processes


class Damaged(ReferenceFailure):
    """A file of references that cannot be read, with another checksum, or for another scene."""


class WrongDigits(ReferenceFailure):
    """A frozen table differs from a fresh computation."""


class Uncertain(ReferenceFailure):
    """Fewer digits are certain than a frozen table needs."""


class Unproven(ArithmeticError):
    """No rigorous bound is found for these equations, or for steps of this size."""


def shown(value: object) -> str:
    """Return a value for a message; Python does not print integers with more than 4300 digits."""
    try:
        return repr(value)
    except ValueError:
        return f"a {type(value).__name__} of too many digits"
