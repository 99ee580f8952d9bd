"""The exceptions of this package."""

from __future__ import annotations


class ReferenceFailure(ValueError):
    """A reference that cannot be computed: one sentence that names the thing and the mend."""


class Damaged(ReferenceFailure):
    """A file of references that cannot be read, with another checksum, or for another scene."""


class WrongDigits(ReferenceFailure):
    """A frozen table that says what a fresh computation does not."""


class Uncertain(ReferenceFailure):
    """Fewer digits are certain than a frozen table needs."""


class Unproven(ArithmeticError):
    """No rigorous bound is found for these equations, or for steps of this size."""
