"""The verdict of the runs combined with single steps: a pass needs both."""

from __future__ import annotations

from dataclasses import replace

from ..core.case import Case, Verdict
from ..evidence import NEAR
from .limits import LIMITS
from .records import Found, Local


def judge(case: Case, found: Found, local: Local, verdict: Verdict) -> Verdict:
    """Return the verdict of the runs combined with that of single steps."""
    expected, wanted = verdict.expected, verdict.expected["order"]
    order, least = local.order, wanted or 1
    if local.exact:
        return _of_exact(verdict)
    if order is None:
        if verdict.verdict == "pass" and local.unknown:
            said = f"the runs have their order, but no single step could be judged: {local.unknown}"
            verdict = Verdict("inconclusive", said.rstrip(".") + ".", expected)
        return _with_floor(local, verdict)
    verdict = _with_floor(local, verdict.expecting(local_order=order))
    expected = verdict.expected
    if order < least - NEAR:
        return _of_lower(local, verdict, order, least)
    if wanted is None:
        return verdict
    if verdict.verdict == "fail" and "above" in verdict.reason:
        return _of_higher(found, local, verdict, wanted)
    if verdict.verdict == "fail" and (why := _unresolved(case, found, local)):
        return Verdict("inconclusive", why, expected)
    if verdict.reason.startswith("every error is round-off"):
        return verdict.because(
            "every error of the runs is round-off beside the largest component, which says nothing "
            f"of the order; one step is of order {order:.2f} in {local.component}: take another "
            "scene, or --digits 50."
        )
    return verdict


def _with_floor(local: Local, verdict: Verdict) -> Verdict:
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


def judge_effective(case: Case, local: Local, verdict: Verdict) -> Verdict:
    """Return the verdict of the order and of the effective order, if the rule declares one."""
    if case.rule.effective is None or verdict.verdict != "pass":
        return verdict
    found = local.effective
    if found is None:
        said = f"nothing is known of the effective order {case.rule.effective} that it declares."
        return Verdict("inconclusive", said, verdict.expected)
    if found.verdict:
        verdict = verdict.expecting(effective=case.rule.effective)
        if found.reached:
            verdict = replace(verdict, measured={"effective": found.reached})
    said = " ".join(filter(None, (verdict.reason, found.reason)))
    return replace(verdict, verdict=found.verdict or "pass", reason=said)


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


def _of_lower(local: Local, verdict: Verdict, order: float, least: int) -> Verdict:
    """Return the verdict on steps of an order below the expected one, or inconsistent."""
    floats = local.floats
    if floats.explain:
        values = ", ".join(f"{v!r}" for v in floats.values[:3])
        more = ", …" if len(floats.values) > 3 else ""
        said = (
            f"the coefficients {values}{more} are floats, and as floats they end at "
            f"{floats.size:.1g} of a step: below that there is no order"
        )
        if verdict.verdict == "pass":
            return Verdict("pass", f"{said}; above it the order is as expected.", verdict.expected)
        if verdict.verdict == "fail" and "go" in verdict.reason:
            hint = "write them exactly, or judge the rule by --digits 16."
            return Verdict("inconclusive", f"{said}; {hint}", verdict.expected)
        return verdict
    if verdict.verdict == "fail":
        return verdict
    where = f" ({local.place})" if local.place else ""
    below = f"one step is of order {order:.2f} in {local.component}, below the expected {least}"
    if order < 1 - NEAR:
        said = (
            f"the rule is not consistent: in {local.component} a step of {local.step:.1g} "
            f"from an exact state{where} is off by O(h^{order + 1:.2f}), so as h goes to 0 it "
            "follows another motion than the scene's."
        )
        said = said if verdict.expected["order"] is None else f"{below}: {said}"
        return Verdict("fail", said, verdict.expected)
    said = f"{below}: from an exact state{where} a step of {local.step:.1g} is off by "
    said += f"O(h^{order + 1:.2f}), however little that is in the runs."
    if verdict.verdict == "pass" and (along := local.on_motion or 0.0) >= least - NEAR:
        said += (
            f" The rule is of order {along:.2f} along the motion of the scene and of order "
            f"{order:.2f} beside it, as where coefficients are computed from the scene's start."
        )
    return Verdict("fail", said, verdict.expected)


def _of_higher(found: Found, local: Local, verdict: Verdict, wanted: int) -> Verdict:
    """Return the verdict on runs above the expected order: by the time, the scene, or the rule."""
    order, runs = local.order or 0.0, found.measured.order
    if order <= wanted + NEAR:
        said = (
            f"the runs are of order {runs:.2f}, since at this final time errors cancel; single "
            f"steps, also beside the motion, are of order {order:.2f}, as declared."
        )
        return Verdict("pass", said, verdict.expected)
    if local.linear:
        said = (
            f"on this linear scene the rule is of order {order:.2f}, above the declared {wanted}: "
            "a linear field asks for fewer of the order conditions, so that may be all of it."
        )
        return Verdict("pass", said, verdict.expected)
    return verdict.because(
        verdict.reason + f" One step says so too: the order is higher than declared, {order:.2f}."
    )


def _unresolved(case: Case, found: Found, local: Local) -> str:
    """Return why the runs' errors are not small yet although single steps have the order; or ""."""
    steps = [row.step for row in found.rows if row.error is not None]
    if not steps or not local.rate:
        return ""
    off = found.duration * local.rate * min(steps) ** (case.order or 2)
    if off < LIMITS["unresolved"]:
        return ""
    return (
        f"single steps are of order {local.order:.2f}, as declared, but their errors add up to "
        f"{off:.2g} of the state at the finest step: no run resolves the motion; take more --steps."
    )
