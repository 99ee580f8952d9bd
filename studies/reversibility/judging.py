"""The judge of reversibility: round-off of a step there and back."""

from __future__ import annotations

from ..core.case import Case, Measurement, Verdict
from ..core.claims import not_claimed
from . import in_numbers
from .measuring import limit


def judge(case: Case, measurement: Measurement) -> Verdict:
    """Judge the round-off of two steps, as the symplecticity study judges that of one."""
    if not case.rule.is_formula:
        return in_numbers.judge(case, measurement)
    if reason := not_claimed(case.rule, "reversible"):
        return Verdict("pass", "", {"not_demanded": reason})
    defect, wanted = measurement.measured["defect"], limit(case.digits)
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
