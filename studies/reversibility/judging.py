"""The judge of reversibility: round-off of a step there and back."""

from __future__ import annotations

from typing import Any

from ..core.case import Case, Measurement, Verdict
from ..core.claims import not_claimed
from ..core.limits import of_a_step
from ..core.records import decoded
from ..evidence.cloud import STEPS_ASKED
from ..evidence.judging import demand_consistency
from ..evidence.laws import WAY_BACK
from ..symplecticity.in_numbers import at_step, may_hide, wanted_share
from .records import Found, FoundOfNumbers

_NO_WAY_BACK = "Φ₋ₕ is not the inverse of Φₕ."
#: of a map without h, whose step back is one forth between two turns of the momenta
_NO_TURN = "between two turns of all momenta, p ↦ −p, the map is not the inverse of itself."


def judge(case: Case, measurement: Measurement) -> Verdict:
    """Judge the round-off of two steps, as the symplecticity study judges that of one."""
    if not case.rule.is_formula:
        return _judge_numbers(case, decoded(FoundOfNumbers, measurement))
    if reason := not_claimed(case.rule, "reversible"):
        return Verdict("pass", "", {"not_demanded": reason})
    record, wanted = decoded(Found, measurement), of_a_step(case.digits)
    defect, expected = record.measured.defect, {"limit": wanted}
    if defect is not None and defect <= wanted:
        return demand_consistency(measurement, Verdict("pass", "", expected), WAY_BACK.name)
    said = f"a step back misses the start by {defect:.2g} of the terms that the two steps add up, "
    said += f"where round-off would leave {wanted:.0e}{_place(record)}: {_NO_WAY_BACK}"
    return Verdict("fail", said, expected)


def _place(record: Found) -> str:
    """Return at which step of the run a step back misses most; "" without rows."""
    worst = max(record.rows, key=lambda row: row.defect or 0.0, default=None)
    return "" if worst is None else f", most from t = {worst.time:.3g}"


def _judge_numbers(case: Case, record: FoundOfNumbers) -> Verdict:
    """Fail a certain defect, and pass a resolved absence."""
    measured, left = record.measured, record.left or 0.0
    expected: dict[str, Any] = {"resolved": wanted_share(case, left)}
    if reason := not_claimed(case.rule, "reversible"):
        return Verdict("pass", "", {**expected, "not_demanded": reason})
    if measured.defect is None:
        said = f"no step back could be made: {record.rows[0].why_not}."
        return Verdict("inconclusive", said, expected)
    if measured.certain:
        row = max(record.rows, key=lambda row: row.certain or 0.0)
        back = "a step back misses" if row.count == 1 else f"{row.count} steps back miss"
        said = f"{back} the start by {measured.certain:.2g} of the motion beyond all round-off, "
        said += f"most in {row.entry}, {at_step(case, row)}: "
        said += _NO_WAY_BACK if case.rule.follows_motion else _NO_TURN
        return Verdict("fail", said, expected)
    resolution, expected["left"] = measured.resolution or 0.0, left
    if resolution <= may_hide(case, left):
        said = f"{record.asked} {STEPS_ASKED} went back, all along the motion" * bool(record.asked)
        rough = [row for row in record.rows if (row.defect or 0.0) > may_hide(case, left)]
        if rough:  # no defect is certain there
            worst = max(rough, key=lambda row: row.defect or 0.0)
            said = f"{said + ', but f' if said else 'F'}rom {len(rough)} of {len(record.rows)} "
            said += f"places a step is too rough to tell, most {at_step(case, worst)}, where "
            said += f"{worst.defect:.1e} of the motion is missed"
        return Verdict("pass", f"{said}." if said else "", expected)
    said = f"a step back misses the start by nothing that is seen, but {resolution:.1e} "
    said += f"could be hidden, where a method of this order may leave {left:.1e}."
    return Verdict("inconclusive", said, expected)


def diagnose(case: Case, measurement: Measurement) -> dict[str, Any] | None:
    """Return the cause of a step back that misses its start, in the step itself (`of_law`)."""
    from ..causes.diagnosis import of_law

    return of_law(case, measurement, "reversibility")
