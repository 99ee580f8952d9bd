"""The multipliers of constraints: how far they are off on the ladder, and what that denies."""

from __future__ import annotations

from typing import Any

from discmech.integrators import StepFailure, mean_multipliers
from discmech.integrators.flows import Flow, Trajectory

from ..causes.round_off import gap
from ..core.case import Case, Verdict
from .window import TOLERANCE, floor, not_converging, slope


def error(flow: Flow, run: Trajectory, forces: Any) -> float | None:
    """Relative error of the mean multipliers at a run's end; None where its step back fails."""
    try:
        off, size = gap(mean_multipliers(flow, run)[-1], forces)
    except StepFailure:  # says nothing of (x, μ)
        return None
    return float(off / size)


def decided(case: Case, rows: list[dict[str, Any]], certain: float) -> bool:
    """Whether multipliers have a slope, or none to have."""
    errors = [e for r in rows if (e := r.get("multipliers")) is not None]
    exact = max(errors, default=0.0) <= floor(case, certain)
    return exact or slope(case, rows, "multipliers", certain) is not None


def judge(case: Case, measurement: dict[str, Any], told: Verdict) -> Verdict:
    """What multipliers make of the verdict of (x, μ): they may deny it, and nothing else."""
    rows = [r for r in measurement["rows"] if "multipliers" in r]
    if not rows or told.expected["order"] is None:
        return told
    # their mean is even in h: an error of order 2, but for that of the row itself
    least = told.expected["multipliers"] = min(2, told.expected["order"])
    found = measurement["measured"]["multipliers"]
    errors = [r["multipliers"] for r in rows if r["multipliers"] is not None]
    if found is not None:
        wrong = found < least - TOLERANCE[case.digits == 16]
        said = f"are of order {found:.3f}, below {least}"
    else:
        wrong = bool(not_converging(rows, least, "multipliers"))
        said = f"do not converge, with errors of {', '.join(f'{e:.2g}' for e in errors)}"
    if wrong and told.verdict != "fail":
        said += ", though (x, μ) converges: the force of constraint is another."
        return Verdict("fail", f"the multipliers of the constraints {said}", told.expected)
    exact = bool(errors) and max(errors) <= floor(case, measurement["certain"])
    if found is None and told.verdict == "pass" and not exact:
        said = "(x, μ) has its order, but fewer than four errors of the multipliers of the "
        said += "constraints lie on a straight line above round-off: take more --steps."
        return Verdict("inconclusive", said, told.expected)
    return told
