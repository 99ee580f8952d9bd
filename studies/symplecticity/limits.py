"""The limits of defects of forms, of steps and of constraints."""

from ..core.limits import MADE_AGAIN, STEP, Limit, of_a_step

FORMS = ("pullback", "poisson")
#: under a force: the change of Ω and that of a volume, less those by the force's one-form
CHANGES = ("change", "volume")

LIMITS = {
    "form": Limit(
        1e-13, "defect of a form in double precision, each entry over the sum of its terms",
        "set: maps are evaluated to twice the digits, so a sound one has 10⁻²⁴ or less; it is what "
        "double precision could tell of a step, and errs towards a pass",
    ),
    "digits of a form": Limit(
        5, "digits that the round-off of a form may take, with more digits",
        "set: 10⁵ times the last digit, as in double precision; it errs towards a pass",
    ),
    "step": STEP,
    "control": Limit(
        1e3, "limits by which a control is off in double precision",
        "set: a defect that lies so far above round-off is none; it errs towards a fail",
    ),
    "control with more digits": Limit(
        1e20, "limits by which a control is off with more digits",
        "set: a control has a defect of some power of the step, 10⁻¹⁰ and more; it errs towards a "
        "fail",
    ),
    "made again": MADE_AGAIN,
    "own derivative": Limit(
        1e-7, "error of a program's own derivative that differences may hide, in double precision",
        "set: they see 10⁻⁹ of a smooth map, and a sum over a run has many steps; an error of a "
        "millionth shows ten times over; it errs towards inconclusive",
    ),
    "jump across": Limit(
        0.01, "share of a map's jump that is not along the image of the surface at which it jumps",
        "derived: bends and distances leave 300 times less of a jump along it, such as a kick's or "
        "a wall's, which keeps the form; by any other the images of both sides overlap, or part",
    ),
    "jump nearby": Limit(
        1 / 8, "such a jump over the motion by which both images are still neighbours",
        "set: an exchange of intervals may jump by more and be one to one; it errs towards "
        "inconclusive",
    ),
}  # fmt: skip


def limit(digits: int) -> float:
    """Return the largest defect of a form that is round-off."""
    return LIMITS["form"] if digits == 16 else 10.0 ** (LIMITS["digits of a form"] - digits)


def limits(digits: int) -> dict[str, float]:
    """Return the largest defect of each kind that is round-off."""
    own = of_a_step(digits)
    of_steps = dict.fromkeys(("residual", "constraint", "hidden"), own)
    return {**dict.fromkeys((*FORMS, *CHANGES), limit(digits)), **of_steps}
