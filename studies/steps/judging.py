"""The judge of varying steps: order, way back, form of the extended phase space, energy."""

from __future__ import annotations

import math
from typing import Any

from ..core.case import Case, Measurement, Verdict, worst
from ..core.records import decoded
from ..energy.judging_errors import judge_errors
from ..energy.records import Found as OfEnergy
from ..evidence.judging import judge as judge_evidence
from .limits import LIMITS
from .measuring import BACK, rule_of
from .records import Found

Expecting = dict[str, Any]


def judge(case: Case, measurement: Measurement) -> Verdict:
    """Return the worst verdict on order, way back, form and energy; the control must be caught."""
    expected: Expecting = {"order": case.order, "tolerance": LIMITS["order"]}
    judges = (_of_order, _of_back, _of_form, _of_energy)
    record = decoded(Found, measurement)
    parts = [judged(case, record, expected) for judged in judges]
    verdict = worst(part.verdict for part in parts)
    said = next((part.reason for part in parts if part.verdict == verdict), "")
    if case.control is None:
        alone = rule_of(case).way == "naive" and (record.measured.back or 0.0) > LIMITS["back"]
        if verdict == "pass" and alone:
            said = "a step that follows the present state alone loses what its rule keeps, which "
            said += f"nothing shows here, since {rule_of(case).base.name} is not self-adjoint."
            return Verdict("inconclusive", said, expected)
        return Verdict(verdict, said if verdict != "pass" else "", expected)
    broken = [part.verdict == "fail" for part in (parts[1], parts[3])]
    expected["caught"] = "a run and back miss their start, and the energy drifts"
    if all(broken):
        return Verdict("pass", "", expected)
    missed = "by the way back" if not broken[0] else "by its energy"
    return Verdict("fail", f"the naive step was not caught {missed}.", expected)


def _of_order(case: Case, record: Found, expected: Expecting) -> Verdict:
    order, wanted = record.measured.order, case.order
    allowed = LIMITS["order"]
    verdict = Verdict("pass", "", expected)
    if order is None or not math.isfinite(order):
        said = "every error is round-off, which says nothing of an order."
        verdict = Verdict("inconclusive", said, expected)
    elif wanted is not None and order > wanted + allowed and _as_declared(record, wanted):
        pass  # errors cancel on this motion, as where K is 0; single steps lie beside it
    elif wanted is not None and not abs(order - wanted) <= allowed:
        before = record.orders[-2]
        side = "below" if order < wanted else "above"
        said = f"order {order:.3f} in ε, at the times reached, is {side} the expected {wanted}"
        if abs(order - wanted) < abs(before - wanted) / 1.5:
            verdict = Verdict(
                "inconclusive", f"{said}, and comes nearer: take a smaller step.", expected
            )
        else:
            verdict = Verdict("fail", f"{said} by more than {allowed}.", expected)
    what = "the rule in its own time"
    return judge_evidence(record.local, verdict, wanted=wanted, asks_order=True, what=what)


def _as_declared(record: Found, wanted: int) -> bool:
    """True if single steps beside the motion are of the declared order and of no higher one."""
    order = None if record.local is None else record.local.order
    return order is not None and abs(order - wanted) <= LIMITS["order"]


def _of_back(case: Case, record: Found, expected: Expecting) -> Verdict:
    """Judge the way back where the rule is self-adjoint, or claims to be; the naive way fails."""
    claims = getattr(rule_of(case).base, "claims", None)
    claimed = claims is not None and claims.reversible is True
    if not claimed and not record.self_adjoint:
        expected["back"] = f"{rule_of(case).base.name} is not self-adjoint: measured only"
        return Verdict("pass")
    expected["back"] = LIMITS["back"]
    back = record.measured.back
    if back is None or (record.measured.lost and back <= LIMITS["back"]):
        return _lost(record, "way back")
    if back <= LIMITS["back"]:
        return Verdict("pass")
    said = f"{BACK} steps of ε and as many of −ε miss their start by {back:.2g}, where round-off "
    said += f"would leave at most {LIMITS['back']:.0e}"
    if rule_of(case).way == "naive":
        said += ": a step that follows the present state alone is another one on the way back"
    return Verdict("fail", f"{said}.")


def _lost(record: Found, what: str) -> Verdict:
    """Return the verdict on a number that is unknown at some place."""
    return Verdict("inconclusive", f"the {what} is unknown at some place: {record.measured.lost}")


def _of_form(case: Case, record: Found, expected: Expecting) -> Verdict:
    form = record.measured.form
    if rule_of(case).way != "poincare":
        expected["form"] = "no form is kept, for the size of a step depends on the state"
        return Verdict("pass")
    expected["form"] = LIMITS["form"]
    if form is None or (record.measured.lost and form <= LIMITS["form"]):
        return _lost(record, "form")
    if form <= LIMITS["form"]:
        return Verdict("pass")
    said = f"the form of the extended phase space changes by {form:.2g} in a step, where "
    said += f"differences of 60 digits would leave at most {LIMITS['form']:.0e}."
    return Verdict("fail", said)


def _of_energy(case: Case, record: Found, expected: Expecting) -> Verdict:
    """Judge the energy by Poincaré, where a modified K is kept, and of the naive step.

    A reversible method keeps the energy near an integrable reversible motion (Hairer, Lubich,
    Wanner, XI.3); in a chaotic one it may wander off (Faou, Hairer, Pham, BIT 44 (2004), 699).
    """
    energy = record.energy
    if not energy:
        expected["energy"] = "it is not constant"
        return Verdict("pass")
    verdict = Verdict("inconclusive", f"no long run goes through: {energy.get('failed')}")
    if "failed" not in energy:
        verdict = judge_errors(case.rule.unit(case.digits), decoded(OfEnergy, energy))
    if rule_of(case).way != "reversible" or case.control is not None:
        expected |= verdict.expected
        return verdict
    expected["energy"] = "measured only: nothing but an integrable motion makes it stay"
    return Verdict("pass")
