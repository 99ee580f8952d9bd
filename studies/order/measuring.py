"""Order of accuracy in (x, μ): errors on a ladder of step sizes against a certified reference."""

from __future__ import annotations

import itertools
import math
from dataclasses import asdict, replace
from fractions import Fraction
from typing import Any

from discmech.integrators import StepFailure
from discmech.integrators.rules import Composition

from ..core.case import Case, Choice, Progress, Verdict, plain_cases, silent
from ..core.fitting import BENT, asymptotic_window
from .local import NEAR as BESIDE
from .local import local_order

NAME = "order"
NEEDS = "it needs a Lagrangian, from which the reference is computed."
DIGITS = (16, 50)
TOLERANCE = {True: 0.05, False: 0.01}  # in double precision or not
RUNGS, MOST_RUNGS = {True: 9, False: 4}, {True: 16, False: 7}  # in double precision or not


#: rules of higher order meet round-off after two or three halvings: 50 digits judge them
HIGHEST_IN_DOUBLE = 4
#: errors that no longer sink above this are no ordinary round-off
STUCK = 1e-11


def cases(choice: Choice) -> list[Case]:
    """Every scene with a Lagrangian by every rule, in double precision too up to order 4.

    Precisions that are asked for are run whatever the order.
    """
    found = [c for c in plain_cases(NAME, choice, DIGITS) if c.scene.lagrangian is not None]
    return [
        c for c in found
        if choice.digits or c.digits > 16 or (c.rule.order or 0) <= HIGHEST_IN_DOUBLE
    ]  # fmt: skip


def notes(choice: Choice) -> list[str]:
    """Which rules double precision leaves out."""
    high = [r.name for r in choice.rules if (r.order or 0) > HIGHEST_IN_DOUBLE]
    if choice.digits or not high:
        return []
    return [
        f"{', '.join(high)}: above order {HIGHEST_IN_DOUBLE} 16 digits are left out, since "
        "round-off is met after two or three halvings; --digits 16 asks for them."
    ]


def ladder(case: Case) -> tuple[Fraction, int]:
    """(final time T, steps of the coarsest run); each further run has twice the steps.

    Double precision runs the scene's whole duration from its own step on, which suits order 2,
    and from coarser ones at higher order; more digits run a fortieth of it in 128 to 1024 steps,
    where there is no round-off to wait for.
    """
    duration = Fraction(case.scene.duration)
    if case.digits > 16:
        return duration / 40, case.steps or 128
    coarser = 1 if (case.scheme.order or 0) <= 2 else 4 if case.scheme.order == 4 else 8
    return duration, case.steps or max(4, case.scene.steps_for(case.scene.step) // coarser)


def measure(case: Case, progress: Progress = silent) -> dict[str, Any]:
    """Rows {steps, step, error, error_x, error_mu, used, why_not}; measured order and interval.

    error = ‖(x, μ) − (x̂, μ̂)‖₂ / ‖(x̂, μ̂)‖₂ at the same time T.
    """
    import mpmath

    from discmech.reference import solution

    _ = case.scheme  # what cannot be used is said before a reference is made for it
    duration, first = ladder(case)
    rungs, most = RUNGS[case.digits == 16], MOST_RUNGS[case.digits == 16]
    progress(f"{case.scene.name} {case.label}: reference", 0.0)
    exact = solution(case.scene, duration, digits=max(30, case.digits + 5))
    rows: list[dict[str, Any]] = []
    for i in range(most):
        # go on only while the asymptotic window has not been reached, and may yet be
        certain = exact.certain_digits
        if i >= rungs and _decided(case, rows, certain):
            break
        steps = first * 2**i
        progress(f"{case.scene.name} {case.label}: {steps} steps", i / most)
        step = duration / steps
        row: dict[str, Any] = {"steps": steps, "step": float(step)}
        try:
            run = case.scheme.flow(step, case.digits).trajectory(steps, every=steps)
        except StepFailure as failure:
            rows.append({**row, "error": None, "error_x": None, "error_mu": None,
                         "used": False, "why_not": "failed", "cause": failure.cause})  # fmt: skip
            continue
        with mpmath.workdps(case.digits + 15):
            dx, x = _gap(run.x[-1], exact.x)
            dmu, mu = _gap(run.mu[-1], exact.mu)
            size = mpmath.sqrt(x**2 + mu**2)
            row["error"] = float(mpmath.sqrt(dx**2 + dmu**2) / size)
            row["error_x"] = float(dx / size) if len(exact.x) else None
            row["error_mu"] = float(dmu / size)
        rows.append({**row, "used": False, "why_not": ""})
    found = {"rows": rows, **_fit(case, rows, exact.certain_digits)}
    progress(f"{case.scene.name} {case.label}: one step", 1.0)
    return {**found, "local": _local(case)}


def _local(case: Case) -> dict[str, Any] | None:
    """What one very small step says of the order; None where it cannot be made."""
    from discmech.reference.failures import ReferenceFailure

    try:
        return asdict(local_order(case.scheme))
    except (StepFailure, ReferenceFailure):
        return None


def _gap(got: Any, wanted: Any) -> tuple[Any, Any]:
    """(‖got − wanted‖₂, ‖wanted‖₂) in mpmath."""
    import mpmath

    exact = [mpmath.mpf(w) for w in wanted]
    gap = [mpmath.mpf(g) - w for g, w in zip(got, exact, strict=True)]
    return mpmath.norm(gap, 2) if gap else mpmath.mpf(0), (
        mpmath.norm(exact, 2) if exact else mpmath.mpf(0)
    )


def _floor(case: Case, certain: int) -> float:
    """A run of N steps collects a few √N units of round-off; nothing below is the method's."""
    floor = 32 * 2.0**-53 if case.digits == 16 else 10.0 ** (3 - case.digits)
    return max(floor, 10.0 ** (2 - certain))


NOWHERE = 1e-2  # relative error at the finest step of a run that does not converge
AWAY = 0.1  # of a local order that is not the expected one
NEAR = 0.05  # of an order that may still come to the expected one at smaller steps


def _decided(case: Case, rows: list[dict[str, Any]], certain: int) -> bool:
    """Whether smaller steps would change nothing."""
    order = _fit(case, rows, certain)["measured"]["order"]
    if order is None:
        return bool(_departure(case, rows, certain))
    return not _approaches(case, rows, order)


def _approaches(case: Case, rows: list[dict[str, Any]], order: float) -> bool:
    """Whether the slope misses the expected order by little, and the local orders run towards it.

    A line through the first steps of a method of order p, straight as it looks, may have a slope
    that is off by the next term of the error.
    """
    expected = case.scheme.order
    if expected is None or not TOLERANCE[case.digits == 16] < abs(order - expected) <= NEAR:
        return False
    used = [r for r in rows if r["used"]]
    missed = [abs(math.log2(a["error"] / b["error"]) / math.log2(a["step"] / b["step"]) - expected)
              for a, b in itertools.pairwise(used)]  # fmt: skip
    return missed[-1] < 0.75 * missed[0] and missed == sorted(missed, reverse=True)


def _departure(case: Case, rows: list[dict[str, Any]], certain: int) -> str:
    """Why errors on no straight line cannot be those of the expected order; empty if they can.

    Local orders of a method of order p come nearer to p at ever smaller steps. Three that miss it
    and go away, or agree with each other, belong to another; so do errors that all the steps did
    not bring down.
    """
    order = case.scheme.order
    bent = BENT * _floor(case, certain)
    clear = [r for r in rows if r["error"] is not None and r["error"] > bent]
    if order is None or len(clear) < 4:
        return ""
    finest = clear[-1]["error"]
    halvings = math.log2(clear[0]["step"] / clear[-1]["step"])
    overall = math.log2(clear[0]["error"] / finest) / halvings
    if finest > NOWHERE and overall < order / 2:
        return (
            f"the runs do not converge: {halvings:.0f} halvings of the step leave an error of "
            f"{finest:.2g}, where order {order} is expected."
        )
    local = [math.log2(a["error"] / b["error"]) / math.log2(a["step"] / b["step"])
             for a, b in itertools.pairwise(clear[-4:])]  # fmt: skip
    missed = [abs(p - order) for p in local]
    one_side = len({p > order for p in local}) == 1  # round-off goes to both
    away = one_side and missed[0] <= missed[1] <= missed[2]
    settled = max(local) - min(local) < min(missed) / 4
    if min(missed) > AWAY and (away or settled):
        return (
            f"the local order {'goes away from' if away else 'settles beside'} the expected "
            f"{order}: {', '.join(f'{p:.2f}' for p in local)} at the finest steps."
        )
    return ""


def _fit(case: Case, rows: list[dict[str, Any]], certain: int) -> dict[str, Any]:
    """Find the asymptotic window; say of every other point why it is left out."""
    errors = [math.nan if r["error"] is None else r["error"] for r in rows]
    floor = _floor(case, certain)
    straight = 0.012 if case.digits == 16 else 0.005
    window = asymptotic_window([r["step"] for r in rows], errors, floor, straight)
    for i, row in enumerate(rows):
        row["used"], row["why_not"] = False, row["why_not"] if row["error"] is None else ""
        if window is not None and window.first <= i <= window.last:
            row["used"] = True
        elif row["error"] is not None:
            below = errors[i] <= floor or (window is not None and i > window.last)
            row["why_not"] = "round-off" if below else "pre-asymptotic"
    if window is None:
        return {"measured": {"order": None, "interval": None, "points": 0}, "certain": certain}
    line = window.line
    return {
        "measured": {
            "order": line.slope,
            "interval": list(line.interval),
            "points": window.last - window.first + 1,
        },
        "certain": certain,
    }


def judge(case: Case, measurement: dict[str, Any]) -> Verdict:
    """From both sides: an order above the expected one is as suspicious as one below.

    What runs cannot tell, or tell well, one very small step may still deny: of an order that is
    lower in any component an error is only small, or hidden by this final time.
    """
    told = _judge_runs(case, measurement)
    local, wanted = measurement.get("local") or {}, told.expected["order"]
    order = local.get("order")
    if order is None or wanted is None:
        return told
    told.expected["local_order"] = order
    if told.verdict != "fail" and order < wanted - BESIDE:
        return Verdict(
            "fail",
            f"one step is of order {order:.2f} in {local['component']}, below the expected "
            f"{wanted}: from an exact state a step of {local['step']:.1g} is off by "
            f"O(h^{order + 1:.2f}), however little that is in the runs.",
            told.expected,
        )
    if told.reason.startswith("every error is round-off"):
        told.reason = (
            "every error of the runs is round-off beside the largest component, which says nothing "
            f"of the order; one step is of order {order:.2f} in {local['component']}: take another "
            "scene, or --digits 50."
        )
    if told.verdict == "fail" and order > wanted + BESIDE and "above" in told.reason:
        told.reason += f" One step says so too: the order is higher than declared, {order:.2f}."
    return told


def _judge_runs(case: Case, measurement: dict[str, Any]) -> Verdict:
    order = measurement["measured"]["order"]
    tolerance = TOLERANCE[case.digits == 16]
    expected = {"order": case.scheme.order, "tolerance": tolerance}
    if case.rule.order and expected["order"] and case.rule.order > expected["order"]:
        expected["declared"] = case.rule.order  # this chart takes it away: see Scheme.order
    if order is None:
        failed = [r for r in measurement["rows"] if r["why_not"] == "failed"]
        if len(failed) == len(measurement["rows"]):
            return Verdict("fail", f"every run failed: {failed[0]['cause']}.", expected)
        wrong = _departure(case, measurement["rows"], measurement["certain"])
        if wrong:
            return Verdict("fail", wrong, expected)
        errors = [r["error"] for r in measurement["rows"] if r["error"] is not None]
        if max(errors) <= _floor(case, measurement["certain"]):
            return Verdict(
                "inconclusive",
                "every error is round-off: the method is exact on this scene, which says nothing "
                "of its order; take another scene.",
                expected,
            )
        return Verdict(
            "inconclusive",
            "fewer than four step sizes lie on a straight line above round-off; "
            f"start the ladder elsewhere with --steps (the reference has {measurement['certain']} "
            "certain digits)" + (", or judge it by --digits 50." if case.digits == 16 else "."),
            expected,
        )
    if expected["order"] is None:
        return Verdict("pass", "the rule declares no order: measured only.", expected)
    rule = case.scheme.rule
    if isinstance(rule, Composition):
        # a wrong digit of size δ bends the line only where δh² is no longer small beside h^p
        defect = float(rule.method.defect(case.digits))
        if defect > 10.0 ** (3 - case.digits):
            return Verdict(
                "fail",
                f"the coefficients of {rule.method.name} miss a condition of order "
                f"{rule.method.order} by {defect:.2g}.",
                expected,
            )
    if abs(order - expected["order"]) <= tolerance:
        return Verdict("pass", "", expected)
    if _approaches(case, measurement["rows"], order):
        return Verdict(
            "inconclusive",
            f"order {order:.3f} still comes nearer to the expected {expected['order']} at the "
            "finest steps: take more --steps.",
            expected,
        )
    side = "below" if order < expected["order"] else "above"
    return Verdict(
        "fail",
        f"order {order:.3f} is {side} the expected {expected['order']} by more than {tolerance}.",
        expected,
    )


def diagnose(case: Case, measurement: dict[str, Any]) -> dict[str, Any] | None:
    """The cause of an order below the expected one, or of errors that stop sinking too early."""
    order, wanted = measurement["measured"]["order"], case.scheme.order
    rows = [r for r in measurement["rows"] if r["error"] is not None]
    if wanted is None or len(rows) < 2 or (order is not None and order > wanted):
        return None
    if order is None:
        (before, last), halvings = rows[-2:], math.log2(rows[-2]["step"] / rows[-1]["step"])
        stuck = last["error"] > max(before["error"] / 1.5, STUCK)
        slow = before["error"] < last["error"] * 2 ** (wanted * halvings)
        if not stuck and not (slow and _departure(case, rows, measurement["certain"])):
            return None
    from ..causes.diagnosis import of_order

    def at_50_digits() -> Any:
        return measure(replace(case, digits=50, steps=None))["measured"]["order"]

    return of_order(case, measurement, ladder(case)[0], at_50_digits)
