"""Combine the verdict of runs with the order of single steps: a pass needs both.

It serves studies whose own numbers cannot reveal a rule of a lower order, or one that follows
another motion, such as studies that compare runs of the same rule.
"""

from __future__ import annotations

from ..core.case import Measurement, Verdict
from ..core.records import decoded
from ..core.single_steps import SingleSteps
from . import NEAR
from .consistency import CONSISTENCY


def demand_consistency(measurement: Measurement, verdict: Verdict) -> Verdict:
    """Return the verdict of the runs, or a fail if a single step is not consistent.

    It is for studies that a rule of any order passes. If the scene has no exact motion to compare
    single steps with, the verdict of the runs stands; if the rule makes no single step, it does not
    pass, for the motion that it approximates as the step goes to 0 is unknown.
    """
    given = measurement.get(CONSISTENCY)
    local = decoded(SingleSteps, given)
    if given is None or (local.order is None and not local.refused):
        return verdict
    if local.order is not None and local.order >= 1 - NEAR:
        return verdict
    return judge(local, verdict, None, "the scene")


def judge(local: SingleSteps | None, verdict: Verdict, wanted: int | None, what: str) -> Verdict:
    """Return the verdict of the runs combined with the single steps: a pass needs both.

    what: the name of the system that made the steps, for the reason.
    """
    if local is None or local.exact or local.floats:
        return verdict
    order, least = local.order, wanted or 1
    if order is None:
        if verdict.verdict != "pass":
            return verdict
        said = f"nothing is wrong with the runs, but no single step is judged: {local.unknown}"
        return Verdict("inconclusive", said.rstrip(".") + ".", verdict.expected)
    verdict = verdict.expecting(local_order=order)
    if order >= least - NEAR or verdict.verdict == "fail":
        return verdict
    said = f"one step of {what} is of order {order:.2f} in {local.component}, below "
    where = local.place + ("" if local.seed is None else f", seed {local.seed}")
    said += f"{'the declared ' if wanted else ''}{least}: from an exact state ({where}) "
    said += f"a step of {local.step:.1g} is off by O(h^{order + 1:.2f})"
    if order < 1 - NEAR:
        said += ", so the rule is not consistent: as h goes to 0 it follows another motion"
    return Verdict("fail", f"{said}.", verdict.expected)
