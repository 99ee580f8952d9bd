"""What single steps make of the verdict of the runs: `studies/evidence`.

A pass needs both. Runs see one trajectory at one final time, where errors may cancel, be hidden by
round-off or not be resolved; single steps see every component at many states, but no run. So steps
of a lower order deny what the runs say; and runs that depart from the declared order, where steps
have it, are asked whether something else than the method explains them.
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

from discmech.integrators import BadInput
from discmech.integrators.errors import CannotMeasure
from discmech.integrators.numbers import mpmath
from discmech.reference import surroundings

from ..core.case import Case, Verdict
from ..evidence import NEAR, Evidence, evidence_of
from ..systems import system_of
from .window import TOLERANCE

#: of the final time's state: errors of the declared order that add up to more at the coarsest step
#: leave no step of a ladder in which they are small
RESOLVED = 20.0
LONGEST = 2  # lengths (`Surroundings.length`) of a coarsest step, as it is
SHORTENED = Fraction(1, 2)  # lengths of a step where the ladder has to be another
FEWEST = 8  # steps of a coarsest run
UNRESOLVED = 0.02  # of the final state: errors at the finest step that are not yet small
#: standard deviations of a walk of roundings
WALK = 5


def measured(case: Case) -> dict[str, Any] | None:
    """What single steps say, as it is kept in a measurement; None where they say nothing."""
    try:
        scheme = system_of(case).single_steps()
    except (BadInput, CannotMeasure) as error:
        return {"order": None, "unknown": " ".join(str(error).split())}
    if scheme is None:
        return None
    evidence = evidence_of(scheme)
    found = evidence.order
    if found.unknown:
        return {"order": None, "unknown": found.unknown, "seed": evidence.seed}
    processed = {"effective": vars(evidence.effective)} if case.rule.effective else {}
    told: dict[str, Any] = {
        "order": found.order, "component": found.component, "step": found.step,
        "place": str(found.place or ""), "places": len(evidence.places), "exact": found.exact,
        "seed": evidence.seed, "rate": rate(case, evidence), "linear": evidence.linear,
        **processed,
    }  # fmt: skip
    least = case.scheme.order or 1
    if found.order is not None and found.order < least - NEAR:
        floats = evidence.floats(least)
        told["floats"] = {
            "values": list(floats.values), "explain": floats.explain, "size": floats.size,
        }  # fmt: skip
    return told


def rate(case: Case, evidence: Evidence) -> float | None:
    """The c of errors c h^p of a unit of time, relative to the state, p the expected order.

    From the components of that order at the places; None where there is none.
    """
    expected = case.scheme.order or 2
    worst = 0.0
    for c in evidence.order.components:
        if c.order is not None and c.constant and abs(c.order - expected) <= NEAR:
            with mpmath.workdps(20):
                size = mpmath.norm([*c.place.x, *c.place.mu], 2)
                worst = max(worst, float(c.constant / size)) if size else worst
    return worst or None


def resolved(case: Case, duration: Fraction, first: int) -> tuple[Fraction, int]:
    """A ladder (final time, steps of the coarsest run) in which errors of the order can be small.

    As it is given, unless its coarsest step is longer than the motion is a polynomial, or errors of
    the declared order would add up to more than the state: then shorter, with shorter steps.
    """
    evidence = evidence_of(case.scheme)
    found, expected = evidence.order, case.scheme.order or 2
    c = None if found.unknown else rate(case, evidence)
    if c is None:
        return duration, first
    length = min(place.length for place in evidence.places)
    step = duration / first
    grown = float(duration) * c * float(step) ** expected
    if step <= LONGEST * length and grown <= RESOLVED:
        return duration, first
    step = min(step, SHORTENED * length)
    time = min(float(duration), 1 / (c * float(step) ** expected))
    most = first if case.digits > 16 else math.inf
    steps = int(min(max(FEWEST, time / float(step)), most, 10**6))
    return steps * step, steps


def amplified(case: Case, duration: Fraction, steps: int) -> float | None:
    """What a walk of so many roundings of doubles may come to at the end, relative to the state.

    By the motion's own conditioning: what it makes of a relative change of its start. None where a
    rough integration does not reach the end.
    """
    grown = surroundings(case.scene).conditioning(duration)
    return None if grown is None else WALK * grown * 2.0**-53 * math.sqrt(steps)


def below(case: Case, found: dict[str, Any]) -> bool:
    """Whether the runs' order is below the expected one by more than its tolerance."""
    order, wanted = found["measured"]["order"], case.scheme.order
    return (
        order is not None and wanted is not None and order < wanted - TOLERANCE[case.digits == 16]
    )


def judge(case: Case, measurement: dict[str, Any], told: Verdict) -> Verdict:
    """The verdict of the runs with what single steps say of them."""
    local = measurement.get("local") or {}
    expected, wanted = told.expected, told.expected["order"]
    order, least = local.get("order"), wanted or 1
    if local.get("exact"):
        return _of_exact(told)
    if order is None:
        if told.verdict == "pass" and local.get("unknown") and case.rule.is_formula:
            said = (
                f"the runs have their order, but no single step could be judged: {local['unknown']}"
            )
            return Verdict("inconclusive", said.rstrip(".") + ".", expected)
        return told
    expected["local_order"] = order
    if order < least - NEAR:
        return _of_lower(local, told, order, least)
    if wanted is None:
        return told
    if told.verdict == "fail" and "above" in told.reason:
        return _of_higher(measurement, local, told, wanted)
    if told.verdict == "fail" and (why := _unresolved(case, measurement, local)):
        return Verdict("inconclusive", why, expected)
    if told.reason.startswith("every error is round-off"):
        told.reason = (
            "every error of the runs is round-off beside the largest component, which says nothing "
            f"of the order; one step is of order {order:.2f} in {local['component']}: take another "
            "scene, or --digits 50."
        )
    return told


def judge_effective(case: Case, measurement: dict[str, Any], told: Verdict) -> Verdict:
    """The verdict of the order with that of the effective one, where the rule declares one."""
    if case.rule.effective is None or told.verdict != "pass":
        return told
    found = (measurement.get("local") or {}).get("effective")
    if found is None:
        said = f"nothing is known of the effective order {case.rule.effective} that it declares."
        return Verdict("inconclusive", said, told.expected)
    if found["verdict"]:
        told.expected["effective"] = case.rule.effective
        if found["reached"]:
            measurement["measured"]["effective"] = found["reached"]
    said = " ".join(filter(None, (told.reason, found["reason"])))
    return Verdict(found["verdict"] or "pass", said, told.expected)


def _of_exact(told: Verdict) -> Verdict:
    """A method without any error: every step, from every place, is the motion to round-off."""
    if told.verdict == "inconclusive":
        told = Verdict("pass", "", told.expected)
    if told.verdict == "pass":
        told.reason = (
            "the method is exact on this scene: every single step, also beside its motion, ends "
            "where the motion does, to round-off."
        )
    return told


def _of_lower(local: dict[str, Any], told: Verdict, order: float, least: int) -> Verdict:
    """Steps of an order that is lower than the expected one, or inconsistent."""
    floats = local.get("floats") or {}
    if floats.get("explain"):
        values = ", ".join(f"{v!r}" for v in floats["values"][:3])
        more = ", …" if len(floats["values"]) > 3 else ""
        said = (
            f"the coefficients {values}{more} are floats, and as floats they end at "
            f"{floats['size']:.1g} of a step: below that there is no order"
        )
        if told.verdict == "pass":
            return Verdict("pass", f"{said}; above it the order is as expected.", told.expected)
        if told.verdict == "fail" and "go" in told.reason:
            hint = "write them exactly, or judge the rule by --digits 16."
            return Verdict("inconclusive", f"{said}; {hint}", told.expected)
        return told
    if told.verdict == "fail":
        return told
    where = f" ({local['place']})" if local.get("place") else ""
    below = f"one step is of order {order:.2f} in {local['component']}, below the expected {least}"
    if order < 1 - NEAR:
        said = (
            f"the rule is not consistent: in {local['component']} a step of {local['step']:.1g} "
            f"from an exact state{where} is off by O(h^{order + 1:.2f}), so as h goes to 0 it "
            "follows another motion than the scene's."
        )
        said = said if told.expected["order"] is None else f"{below}: {said}"
        return Verdict("fail", said, told.expected)
    said = f"{below}: from an exact state{where} a step of {local['step']:.1g} is off by "
    said += f"O(h^{order + 1:.2f}), however little that is in the runs."
    return Verdict("fail", said, told.expected)


def _of_higher(
    measurement: dict[str, Any], local: dict[str, Any], told: Verdict, wanted: int
) -> Verdict:
    """Runs of a higher order than the expected one: by this final time, this scene, or the rule."""
    order, runs = local["order"], measurement["measured"]["order"]
    if order <= wanted + NEAR:
        said = (
            f"the runs are of order {runs:.2f}, since at this final time errors cancel; single "
            f"steps, also beside the motion, are of order {order:.2f}, as declared."
        )
        return Verdict("pass", said, told.expected)
    if local.get("linear"):
        said = (
            f"on this linear scene the rule is of order {order:.2f}, above the declared {wanted}: "
            "a linear field asks for fewer of the order conditions, so that may be all of it."
        )
        return Verdict("pass", said, told.expected)
    told.reason += f" One step says so too: the order is higher than declared, {order:.2f}."
    return told


def _unresolved(case: Case, measurement: dict[str, Any], local: dict[str, Any]) -> str:
    """Why the runs' errors are no small ones yet, where single steps have the order; else empty."""
    steps = [row["step"] for row in measurement["rows"] if row["error"] is not None]
    if not steps or not local.get("rate"):
        return ""
    off = measurement["duration"] * local["rate"] * min(steps) ** (case.scheme.order or 2)
    if off < UNRESOLVED:
        return ""
    return (
        f"single steps are of order {local['order']:.2f}, as declared, but their errors add up to "
        f"{off:.2g} of the state at the finest step: no run resolves the motion; take more --steps."
    )
