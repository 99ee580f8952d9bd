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

#: of single steps and of recorded rows: limits of the study of order, which the evidence reads
OF_ORDER = {
    "rows: power": Limit(
        0.5, "power of the step by which a recorded row, or all of them, may miss the others'",
        "derived: runs whose steps differ by 8 are compared, so half a power is a factor of 2.8, "
        "nearly twice what C of the defects C hᵖ may change over three short rows",
    ),
    "rows: change": Limit(
        1.5, "factor by which C of the defects C hᵖ of recorded rows may change over three rows",
        "derived: such rows are a sixth of the motion's length and less, in which C, a polynomial "
        "there, changes by less than a third",
    ),
    "rows: alone": Limit(
        8, "defect of a recorded row, or its differences, over the largest of its neighbours",
        "set: C may change by 1.5 from row to row and pass through 0, and high differences of it, "
        "which show one moved row, grow by less than that; it errs towards a pass",
    ),
    "rows: way": Limit(
        0.1, "defect of a row over the way from the row before, where no other run tells of it",
        "set: a step that follows the motion at all leaves less; it errs towards a pass, and one "
        "run, or runs whose steps differ by less than 8, say nothing finer of its motion",
    ),
    "rows: interpolated": Limit(
        100, "errors of the end of a run by which a row of a program's longer run may differ",
        "set: an interpolation of one power of the step less is 10 times worse at a step of a "
        "tenth, and so is a long last step beside one that is cut to end there; it errs towards a "
        "pass",
    ),
    "rows: enlarged": Limit(
        10, "growth of a change of the start with which a recorded motion excuses large errors",
        "set: errors of less than a hundredth of the motion are small, and a motion that enlarges "
        "a change less than tenfold leaves them below a tenth of it; it errs towards a fail",
    ),
    "floats: printed": Limit(
        113, "times what 4 last bits of each float change, in a power of the step that is too low",
        "derived: half a unit of the fourteenth digit, 5·10⁻¹⁴ of a coefficient, with which papers "
        "print them; a larger error of one is no rounding",
    ),
    "powers: rounded": Limit(
        10, "roundings of a program's step that a sum of powers of the step may leave",
        "set: a step has a few operations on each entry; it errs towards a pass",
    ),
    "powers: clearly": Limit(
        10, "times less that a sum leaves with a lower power of the step in place of a higher one",
        "set: a sum of noise may fit twice as well by chance; it errs towards a pass",
    ),
    "powers: together": Limit(
        2, "the same of squares, added over all components from all places",
        "derived: then the lower power is as large as all roundings, which of chance alone differ "
        "by a twentieth, the share of one factor in a ladder; it errs towards a pass",
    ),
}  # fmt: skip


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
