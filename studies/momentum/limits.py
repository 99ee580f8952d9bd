"""The limits of drifts of momenta."""

from ..core.limits import Limit

LIMITS = {
    "walk": Limit(
        5, "standard deviations of the walk that round-off makes, (5/√3) κ ε √N + 2 e ε in all",
        "derived: x and μ are rounded once a step, ε/√3 in the mean square, and so are the sums "
        "that are added to them; κ is what both do to the quantity; 5 are passed once in a "
        "million walks (Feller, XIV); e is the round-off of the quantity itself",
    ),
    "program": Limit(
        8, "roundings of a program's step on each entry, and of one under contact, where a rule's "
        "compensated one has 1",
        "derived: to turn a vector takes three products and two sums of each entry, and each entry "
        "of the matrix a norm, a sine and a quotient; they walk too, √8 as far",
    ),
    "alike": Limit(
        4, "roundings of a program's step that may all go one way, in each of N steps",
        "set: its operations, such as the sines and cosines of a turn, round alike where angles "
        "hardly change; they are excused only as far as steps of a sixteenth and a 256th show "
        "them too, where a method that loses something loses less",
    ),
    "blind": Limit(
        1e-3, "share of a quantity's terms that such a limit may be",
        "set: where round-off alone may change so much nothing is told; it errs towards "
        "inconclusive",
    ),
}  # fmt: skip
