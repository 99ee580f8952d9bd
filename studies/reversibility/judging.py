"""The judge of reversibility: round-off of a step there and back."""

from __future__ import annotations

from typing import Any

from ..core.case import Case, Measurement, Verdict
from ..core.claims import not_claimed
from ..symplecticity.in_numbers import resolved
from ..symplecticity.limits import of_a_step


def judge(case: Case, measurement: Measurement) -> Verdict:
    """Judge the round-off of two steps, as the symplecticity study judges that of one."""
    if not case.rule.is_formula:
        return _judge_numbers(case, measurement)
    if reason := not_claimed(case.rule, "reversible"):
        return Verdict("pass", "", {"not_demanded": reason})
    defect, wanted = measurement.measured["defect"], of_a_step(case.digits)
    local = measurement.get("local")
    if defect <= wanted:
        if local is None or local["defect"] <= local["limit"]:
            return Verdict("pass", "", {"limit": wanted})
        said = f"the run goes back to round-off, but a step of {local['step']:.3g} from "
        said += f"{local['place']}, a place that was drawn around the motion (seed "
        said += f"{local['seed']}), and back misses it by {local['defect']:.2g} of the terms, "
        said += f"where round-off would leave {local['limit']:.0e}: Φ₋ₕ is not the inverse of Φₕ."
        return Verdict("fail", said, {"limit": wanted})
    said = f"a step back misses the start by {defect:.2g} of the terms that the two steps add up, "
    said += f"where round-off would leave {wanted:.0e}: Φ₋ₕ is not the inverse of Φₕ."
    return Verdict("fail", said, {"limit": wanted})


def _judge_numbers(case: Case, measurement: Measurement) -> Verdict:
    """Fail a certain defect, and pass a resolved absence."""
    measured, expected = measurement.measured, dict[str, Any](resolved=resolved(case))
    if reason := not_claimed(case.rule, "reversible"):
        return Verdict("pass", "", {**expected, "not_demanded": reason})
    if measured["defect"] is None:
        why = measurement.rows[0]["why_not"]
        return Verdict("inconclusive", f"no step back could be made: {why}.", expected)
    if measured["certain"] > 0:
        row = max(measurement.rows, key=lambda r: r.get("certain") or 0.0)
        said = (
            f"a step back misses the start by {measured['certain']:.2g} of the motion beyond all "
        )
        said += f"round-off, at step {row['step']:.3g}, t = {row['time']:.3g}: Φ₋ₕ is not the "
        said += "inverse of Φₕ."
        return Verdict("fail", said, expected)
    left = expected["left"] = measurement["left"]
    if measured["resolution"] <= resolved(case) * left:
        return Verdict("pass", "", expected)
    said = (
        f"a step back misses the start by nothing that is seen, but {measured['resolution']:.1e} "
    )
    said += f"could be hidden, where a method of this order may leave {left:.1e}."
    return Verdict("inconclusive", said, expected)
