"""Combine the verdict of runs with the order of single steps: a pass needs both.

It serves studies whose own numbers cannot reveal a rule of a lower order, or one that follows
another motion, such as studies that compare runs of the same rule.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from discmech.integrators import Scheme
from discmech.integrators.errors import DiscmechError
from discmech.reference import ReferenceFailure

from ..core.case import Case, Measurement, Verdict
from ..core.outcome import Row
from ..systems import system_of
from . import NEAR, LocalOrder, evidence_of

#: the key of the consistency in a measurement
CONSISTENCY = "consistency"


def consistency_of(case: Case, least: int | None = 1) -> dict[str, Any] | None:
    """Return the order of a case's single steps, for `demand_consistency`; None if not asked.

    Controls are judged by being caught, and a recorded run makes no single steps. Of a program only
    components whose orders have settled count.
    """
    if case.control is not None or case.rule.is_recorded:
        return None
    try:
        scheme = system_of(case).single_steps()
        return (
            None if scheme is None else of_evidence(scheme, least, settled=not case.rule.is_formula)
        )
    except (ReferenceFailure, DiscmechError) as failure:
        return {"order": None, "unknown": " ".join(str(failure).split())}


def demand_consistency(measurement: Measurement, verdict: Verdict) -> Verdict:
    """Return the verdict of the runs, or a fail if a single step is not consistent.

    It is for studies that a rule of any order passes. If the scene has no exact motion to compare
    single steps with, the verdict of the runs stands; if the rule makes no single step, it does not
    pass, for the motion that it approximates as the step goes to 0 is unknown.
    """
    local = measurement.get(CONSISTENCY)
    if local is None or (local["order"] is None and not local.get("refused")):
        return verdict
    if local["order"] is not None and local["order"] >= 1 - NEAR:
        return verdict
    return judge(local, verdict, None, "the scene")


def of_evidence(scheme: Scheme, least: int | None = None, settled: bool = False) -> dict[str, Any]:
    """Return the order of the single steps of a scheme, as a measurement keeps it.

    least: the order below which it is too low; the declared one if None. settled: True to count
    only components whose errors sink as one power of the step. floats: whether the last bits of a
    rule's floats explain an order that is too low, which doubles do not show.
    """
    evidence = evidence_of(scheme)
    found = _settled(evidence.order) if settled else evidence.order
    if found.unknown:
        return {
            "order": None, "unknown": found.unknown, "seed": evidence.seed,
            "refused": found.refused and scheme.rule.is_formula,
        }  # fmt: skip
    least = least or scheme.order or 1
    low = found.order is not None and found.order < least - NEAR
    return {
        "floats": low and evidence.floats(least).explain,
        "order": found.order, "component": found.component, "step": found.step,
        "place": str(found.place or ""), "exact": found.exact, "seed": evidence.seed,
    }  # fmt: skip


def _settled(found: LocalOrder) -> LocalOrder:
    """Return the lowest of the component orders that have a constant: the others are noise."""
    known = [c for c in found.components if c.order is not None and c.constant is not None]
    lowest = min(known, key=lambda c: c.order or 0.0, default=None)
    if lowest is None:
        return replace(found, order=None, unknown=found.unknown or "no error of a step settles")
    return replace(found, order=lowest.order, component=lowest.name, place=lowest.place)


def judge(local: Row | None, verdict: Verdict, wanted: int | None, what: str) -> Verdict:
    """Return the verdict of the runs combined with the single steps: a pass needs both.

    what: the name of the system that made the steps, for the reason.
    """
    if local is None or local.get("exact") or local.get("floats"):
        return verdict
    order, least = local["order"], wanted or 1
    if order is None:
        if verdict.verdict != "pass":
            return verdict
        said = f"nothing is wrong with the runs, but no single step is judged: {local['unknown']}"
        return Verdict("inconclusive", said.rstrip(".") + ".", verdict.expected)
    verdict = verdict.expecting(local_order=order)
    if order >= least - NEAR or verdict.verdict == "fail":
        return verdict
    said = f"one step of {what} is of order {order:.2f} in {local['component']}, below "
    where = local["place"] + (f", seed {local['seed']}" if "seed" in local else "")
    said += f"{'the declared ' if wanted else ''}{least}: from an exact state ({where}) "
    said += f"a step of {local['step']:.1g} is off by O(h^{order + 1:.2f})"
    if order < 1 - NEAR:
        said += ", so the rule is not consistent: as h goes to 0 it follows another motion"
    return Verdict("fail", f"{said}.", verdict.expected)
