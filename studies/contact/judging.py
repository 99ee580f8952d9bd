"""The judge of contact: laws to round-off, energies and times by the rule's order."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from discmech.integrators.extensions.contact import unsure_gaps

from ..core.case import Case, Measurement, Verdict
from ..core.outcome import of_control
from ..core.records import decoded
from ..evidence import judging as single_steps
from ..symplecticity.limits import LIMITS as OF_FORMS
from ..symplecticity.limits import limit
from .limits import LIMITS
from .measuring import FORM_DIGITS, _free_of_work, laws_of
from .records import Back, Measured

WORDS = {
    "penetration": "a gap is negative", "pull": "a contact pulls",
    "complementarity": "an open gap pushes", "cone": "friction leaves its cone",
    "slip": "friction is not against the slip", "impact_energy": "an impact adds energy",
    "jump": "a momentum does not change by its impulses",
    "restitution": "a rebound is not e times the approach",
    "course": "the motion between impacts is not that of the rule's free steps",
    "friction": "friction that slips has not its full size",
    "impact_friction": "friction of an impact is not that against its slip",
}  # fmt: skip


def does_not_fall(rises: Sequence[float], allowed: float) -> str:
    """Return a sentence if a rise does not vanish with the step (`falling`), otherwise ""."""
    if len(rises) == 1:
        return "" if rises[0] <= allowed else "the energy is no number."
    worst, last = max(rises[:-1]), rises[-1]
    if last <= worst / LIMITS["falls"]:
        return ""
    part = "half" if len(rises) == 2 else "an eighth of"
    said = f"the energy rises by {worst:.2g} of its terms, with {part} the step by {last:.2g}"
    return f"{said}: that does not vanish with the step."


def judge(case: Case, measurement: Measurement) -> Verdict:
    """Judge laws by round-off; rises of energy, and times of impacts, by the rule's order.

    A control has to break one of the laws a thousandfold.
    """
    allowed, record = limit(case.digits), decoded(Measured, measurement.measured)
    if case.control is not None:
        off = OF_FORMS["control"] * allowed
        most = {"slip": LIMITS["turn"]}
        broken = [k for k, v in measurement.measured.items() if not v <= most.get(k, off)]
        return of_control(broken, "it breaks no law of contact", {"at_least": off})
    order = case.order
    expected = {"limit": allowed, "slip": LIMITS["turn"], "late": 1.0}
    if order is not None:
        # while a gap stays closed the motion is of order 2, for any order of the rule
        expected["order"] = (min(order, 2) if record.rests else order) - LIMITS["slack"]
    verdict = Verdict("pass", "", expected)
    if reason := next(_broken(case, record, expected), ""):
        verdict = Verdict("fail", reason, expected)
    elif reason := next(_open_questions(record, expected), ""):
        verdict = Verdict("inconclusive", reason, expected)
    what, laws = "the motion between impacts", [law.name for law in laws_of(case)]
    verdict = single_steps.judge(
        record.local, verdict, *laws, wanted=order, asks_order=True, what=what
    )
    if record.back is None or record.back or verdict.verdict != "pass":
        return verdict
    said = f"{case.rule.name} goes back between impacts; {_NO_WAY_BACK}"
    return verdict.because(f"{said} {verdict.reason}".strip())


def _open_questions(record: Measured, expected: Mapping[str, float]) -> Iterator[str]:
    """Yield a sentence for each reason that leaves the verdict open."""
    if record.unsure:
        yield unsure_gaps([*record.unsure])
    if not record.touched:
        yield "no gap ever closes: nothing of contact was judged; take more steps or another start."
    if record.scaled:
        yield record.scaled[0]
    if record.apart:
        yield record.apart + ": the step is too long for what is there; take a smaller one."
    if record.time_error is None:
        yield (
            "with half or an eighth of the step there are others among the first two impacts: "
            "their times have no order to be judged; take a smaller step."
        )
    order, most = record.order, expected.get("order", 2.0) + LIMITS["excess"]
    if order is not None and order > most:
        yield (
            f"with half the step located impacts are off by 2^{order:.0f} times less, which is no "
            "order: one step of the coarser run went wrong, or it is too long; take a smaller one."
        )
    for mode, laws in record.modes:
        first, *finer = laws.rises
        if finer and first > 2**most * max(*finer, expected["limit"]):
            yield (
                f"{mode}, the energy rises by {first:.2g} of its terms, with half the step by "
                f"{finer[0]:.2g}: one step of the coarser run went wrong; take a smaller one."
            )
    if None in (record.form.across or ()):
        yield (
            "Ω was not judged across an elastic impact: the first one is not from open gaps, or "
            "is not alone in its step; take another start, or a smaller step."
        )


#: why no way back is asked through impacts
_NO_WAY_BACK = (
    "through them none is asked, since one that loses energy, depends on the time, or begins or "
    "ends at a closed gap has none."
)


def _missed(backs: Sequence[Back]) -> Iterator[str]:
    """Yield a sentence for each impact through which a step does not go back."""
    for back in backs:
        allowed = limit(FORM_DIGITS) * max(1.0, back.steep)
        if not back.missed <= allowed:
            yield (
                f"a way back through the impact at t = {back.time:.4g}, with reversed momenta, "
                f"misses its start by {back.missed:.2g} of the motion, where {allowed:.0e} may be "
                "round-off: the steps beside it, or the impact, are not reversible."
            )


def _broken(case: Case, record: Measured, expected: Mapping[str, float]) -> Iterator[str]:
    """Yield a sentence for each law that does not hold."""
    allowed = expected["limit"]
    still = _free_of_work(case)
    for mode, laws in record.modes:
        for name, words in WORDS.items():
            bound, value = LIMITS["turn"] if name == "slip" else allowed, getattr(laws, name)
            if not value <= bound:
                yield f"{mode}, {words}: {name} is {value:.2g}, where {bound:.0e} is allowed."
        rises = laws.rises
        if (still or len(rises) == 1) and (reason := does_not_fall(rises, allowed)):
            yield f"{mode}, {reason}"
    if record.late is not None and not -1e-6 <= record.late <= 1 + 1e-6:
        yield (
            f"the first impact, stepped, is late by {record.late:.2g} steps; an impact at the "
            "end of its step is late by 0 to 1."
        )
    order, wanted = record.order, expected.get("order")
    if order is not None and wanted is not None and not order >= wanted:
        yield f"located impacts are of order {order:.2f}, where {wanted:g} is the least."
    yield from _missed(record.back or ())
    across, falls = record.form.across or (), LIMITS["falls"]
    *longer, last = [e for e in across if e is not None] or [0.0]
    if len(across) == 1 + len(longer) and not last <= max(LIMITS["form"], max(longer) / falls):
        yield (
            f"across an elastic impact the defect of Ω is {max(longer):.2g}, with an eighth of the "
            f"step {last:.2g}: that does not vanish with the step."
        )
