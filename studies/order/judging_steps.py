"""The verdict of the runs combined with single steps: a pass needs both."""

from __future__ import annotations

from dataclasses import replace

from ..core.case import Case, Verdict
from ..core.outcome import ABOVE, GOING_AWAY, ROUND_OFF
from ..core.single_steps import SingleSteps
from ..evidence import NEAR
from ..evidence.judging import judge as judge_evidence
from .limits import LIMITS
from .records import Found


def judge(case: Case, record: Found, local: SingleSteps, verdict: Verdict) -> Verdict:
    """Return the verdict of the runs combined with that of single steps."""
    wanted, order = verdict.expected["order"], local.order
    if local.exact:
        return _of_exact(verdict)
    if order is not None and order < (wanted or 1) - NEAR and local.floats.explain:
        return _of_floats(local, _with_floor(local, verdict.expecting(local_order=order)))
    verdict = judge_evidence(local, verdict, wanted=wanted, asks_order=True)
    if order is not None and order < (wanted or 1) - NEAR:
        return verdict
    verdict = _with_floor(local, verdict)
    if order is None or wanted is None:
        return verdict
    if verdict.why == ABOVE:
        return _of_higher(record, local, verdict, wanted)
    if verdict.verdict == "fail" and (why := _unresolved(case, record, local)):
        return Verdict("inconclusive", why, verdict.expected)
    if verdict.why == ROUND_OFF:
        said = "every error of the runs is round-off beside the largest component, as at rest"
        # no step of a formula depends on those before, so that a run adds nothing to single ones
        if case.rule.is_formula and abs(order - wanted) <= NEAR:
            said += f"; single steps, also beside the motion, are of order {order:.2f}."
            return Verdict("pass", said, verdict.expected)
        return verdict.because(
            f"{said}, which says nothing of the order; one step is of order {order:.2f} in "
            f"{local.component}: take another scene{', or --digits 50' * (case.digits == 16)}."
        )
    return verdict


def _with_floor(local: SingleSteps, verdict: Verdict) -> Verdict:
    """Return the verdict with the floor of a program's own numbers, above which alone it holds."""
    if not local.floor or verdict.verdict == "fail":
        return verdict
    said, single = f"a floor of its own of {local.floor}", "single precision" in local.floor
    if single:
        said += ', where double precision is claimed: say numbers="float32" if it is meant'
    if local.order is None or verdict.verdict == "inconclusive":
        return verdict.because(f"{verdict.reason} It has {said}.")
    told = f"one step is of order {local.order:.2f} down to {said}."
    return Verdict("inconclusive" if single else "pass", told, verdict.expected)


def judge_effective(case: Case, local: SingleSteps, verdict: Verdict) -> Verdict:
    """Return the verdict of the order and of the effective order, if the rule declares one."""
    if case.rule.effective is None or verdict.verdict != "pass":
        return verdict
    effective = local.effective
    if effective is None:
        said = f"nothing is known of the effective order {case.rule.effective} that it declares."
        return Verdict("inconclusive", said, verdict.expected)
    if effective.verdict:
        verdict = verdict.expecting(effective=case.rule.effective)
        if effective.reached:
            verdict = replace(verdict, measured={"effective": effective.reached})
    said = " ".join(filter(None, (verdict.reason, effective.reason)))
    if not effective.verdict:  # the order alone is no pass of a rule that declares more
        return replace(verdict.expecting(not_demanded=said), verdict="measured", reason=said)
    return replace(verdict, verdict=effective.verdict, reason=said)


def _of_exact(verdict: Verdict) -> Verdict:
    """Return the verdict on a method whose every step, from every place, is exact to round-off."""
    if verdict.verdict == "inconclusive":
        verdict = Verdict("pass", "", verdict.expected)
    if verdict.verdict == "pass":
        return verdict.because(
            "the method is exact on this scene: every single step, also beside its motion, ends "
            "where the motion does, to round-off."
        )
    return verdict


def _of_floats(local: SingleSteps, verdict: Verdict) -> Verdict:
    """Return the verdict on steps whose order is too low by the rule's floats alone."""
    floats = local.floats
    values = ", ".join(f"{v!r}" for v in floats.values[:3])
    more = ", …" if len(floats.values) > 3 else ""
    said = (
        f"the coefficients {values}{more} are floats, which are rounded, so that each step errs "
        f"by {floats.size:.1g} of its length; below that no order can be seen"
    )
    if verdict.verdict == "pass":
        return Verdict("pass", f"{said}; above it the order is as expected.", verdict.expected)
    if verdict.why == GOING_AWAY:
        hint = "write them exactly, or judge the rule by --digits 16."
        return Verdict("inconclusive", f"{said}; {hint}", verdict.expected)
    return verdict


def _of_higher(record: Found, local: SingleSteps, verdict: Verdict, wanted: int) -> Verdict:
    """Return the verdict on runs above the expected order: by the time, the scene, or the rule."""
    order, runs = local.order or 0.0, record.measured.order
    if order <= wanted + NEAR:
        said = (
            f"the runs are of order {runs:.2f}, since at this final time errors cancel; single "
            f"steps, also beside the motion, are of order {order:.2f}, as declared."
        )
        return Verdict("pass", said, verdict.expected)
    if verdict.expected.get("or_above"):
        said = f"order {runs:.3f}, above the claimed {wanted}, which is that of every value; one "
        return Verdict("pass", f"{said}step says so too, {order:.2f}.", verdict.expected)
    if local.linear:
        said = (
            f"on this linear scene the rule is of order {order:.2f}, above the declared {wanted}: "
            "a linear field asks for fewer of the order conditions, so that may be all of it."
        )
        return Verdict("pass", said, verdict.expected)
    return verdict.because(
        verdict.reason + f" One step says so too: the order is higher than declared, {order:.2f}."
    )


def _unresolved(case: Case, record: Found, local: SingleSteps) -> str:
    """Return why the runs' errors are not small yet although single steps have the order; or ""."""
    steps = [row.step for row in record.rows if row.error is not None]
    if not steps or not local.rate:
        return ""
    off = record.duration * local.rate * min(steps) ** (case.order or 2)
    if off < LIMITS["unresolved"]:
        return ""
    return (
        f"single steps are of order {local.order:.2f}, as declared, but their errors add up to "
        f"{off:.2g} of the state at the finest step: no run resolves the motion; take more --steps."
    )
