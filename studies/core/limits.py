"""The limits of a study, as data that its judge, its help, its page and the documentation read."""

from __future__ import annotations

from collections.abc import Mapping


class Limit(float):
    """A number to which a judge holds measurements, with its meaning and its reason.

    what: the quantity and its unit. reason: it begins with "derived" if the number follows from
    something, and with "set" if it was chosen; then it says to which side it errs.
    """

    what: str
    reason: str

    def __new__(cls, value: float, what: str, reason: str) -> Limit:
        made = super().__new__(cls, value)
        made.what, made.reason = what, reason
        return made

    def __reduce__(self) -> tuple[type[Limit], tuple[float, str, str]]:
        return type(self), (float(self), self.what, self.reason)


#: of a step's equations and of the way back: of symplecticity, reversibility, and single steps
STEP = Limit(
    64,
    "round-offs of a step's residual and constraints, each over its own bound",
    "derived: two, for a kernel adds in another order than the maps; and where Newton ends at "
    "ε of the sum of all unknowns, as many as there are unknowns, some tens",
)

#: of a program's steps: of symplecticity, and of single steps
MADE_AGAIN = Limit(
    1024,
    "round-offs by which a program's step, made again, may differ",
    "set: a map of (q, p) and h gives the same again, but threads may add in another order; it "
    "errs towards a pass",
)


def of_a_step(digits: int) -> float:
    """Return the largest defect of a step, over its own bound, that is round-off."""
    from discmech.integrators.numbers import arithmetic

    return STEP * float(arithmetic(digits).eps)


def told(limits: Mapping[str, float]) -> list[tuple[str, str, str, str]]:
    """Return (name, what, value, reason) of each limit; a plain number is its name's own value."""
    return [
        (name, getattr(most, "what", name), f"{most:g}", getattr(most, "reason", ""))
        for name, most in limits.items()
    ]


def filled_in(words: str, limits: Mapping[str, float]) -> str:
    """Return a text with the values of the limits that it names in braces."""
    for name, _, value, _ in told(limits):
        words = words.replace(f"{{{name}}}", value)
    return words
