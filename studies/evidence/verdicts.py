"""What single steps make of a verdict that others reached: a pass needs both.

For studies whose own numbers cannot tell a rule of a lower order, or one that follows another
motion: such as runs that are held against runs of the same rule.
"""

from __future__ import annotations

from typing import Any

from discmech.integrators import Scheme

from ..core.case import Verdict
from . import NEAR, evidence_of


def of_evidence(scheme: Scheme) -> dict[str, Any]:
    """The order of the single steps of a scheme, as it is kept in a measurement.

    floats: whether the last bits of a rule's floats explain an order that is too low, which doubles
    do not see.
    """
    evidence = evidence_of(scheme)
    found = evidence.order
    if found.unknown:
        return {"order": None, "unknown": found.unknown, "seed": evidence.seed}
    least = scheme.order or 1
    low = found.order is not None and found.order < least - NEAR
    return {
        "floats": low and evidence.floats(least).explain,
        "order": found.order, "component": found.component, "step": found.step,
        "place": str(found.place or ""), "exact": found.exact, "seed": evidence.seed,
    }  # fmt: skip


def judge(local: dict[str, Any] | None, told: Verdict, wanted: int | None, what: str) -> Verdict:
    """The verdict of the runs with what single steps say of them: a pass needs both.

    what: of which system the steps were, for the reason.
    """
    if local is None or local.get("exact") or local.get("floats"):
        return told
    order, least = local["order"], wanted or 1
    if order is None:
        if told.verdict != "pass":
            return told
        said = f"nothing is wrong with the runs, but no single step is judged: {local['unknown']}"
        return Verdict("inconclusive", said.rstrip(".") + ".", told.expected)
    told.expected["local_order"] = order
    if order >= least - NEAR or told.verdict == "fail":
        return told
    said = f"one step of {what} is of order {order:.2f} in {local['component']}, below "
    said += f"{'the declared ' if wanted else ''}{least}: from an exact state ({local['place']}) "
    said += f"a step of {local['step']:.1g} is off by O(h^{order + 1:.2f})"
    if order < 1 - NEAR:
        said += ", so the rule is not consistent: as h goes to 0 it follows another motion"
    return Verdict("fail", f"{said}.", told.expected)
