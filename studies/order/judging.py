"""The judge of orders, above and below."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import Any

from ..core.case import Case, Measurement, Verdict
from ..core.outcome import ABOVE, GOING_AWAY, MORE_STEPS, NOT_CONVERGING, ROUND_OFF
from ..core.parts import parts_of
from ..core.records import decoded
from ..core.single_steps import SingleSteps
from ..evidence import NEAR as BESIDE
from . import judging_steps, multipliers
from .limits import LIMITS
from .limits import tolerance as allowed
from .measuring import BESIDE_EARLY, HIGHEST_IN_DOUBLE, LARGE, PART, ladder, measure
from .recorded import FEWEST
from .records import BLEW_UP, Found, is_of_a_value
from .window import (
    clear_orders,
    clear_rows,
    departure,
    floor,
    hidden_share,
    not_converging,
    off_its_neighbours,
    off_the_line,
    too_few,
)

NO_ORDER = "the rule declares no order"
#: errors that stop sinking above this are no ordinary round-off
STUCK = 1e-11

#: Of c hᵖ + d hᵖ⁺¹ the order lies between p and p + 1, nearer to p where the first power is the
#: larger one. Above `HIGHEST_IN_DOUBLE` round-off comes before steps are so short that the second
#: is gone, so that such an order denies nothing there.
BETWEEN = 0.5


def judge(case: Case, measurement: Measurement) -> Verdict:
    """Judge on both sides: an order above the expected one is as suspicious as one below.

    One very small step may still deny the runs: an order that is lower in any component may have
    only a small error, or one that this final time hides.
    """
    record = decoded(Found, measurement)
    verdict = _with_multipliers(case, record, _judge_runs(case, record))
    if case.rule.is_recorded:
        return _of_recorded(case, record, verdict)
    local = record.local or SingleSteps()
    verdict = judging_steps.judge(case, record, local, verdict)
    return judging_steps.judge_effective(case, local, verdict)


def _judge_runs(case: Case, record: Found) -> Verdict:
    order = record.measured.order
    tolerance = allowed(case.digits)
    expected: dict[str, Any] = {"order": case.order, "tolerance": tolerance}
    # the digits in which the two references of a scene in numbers agree
    if is_of_a_value(case.rule.name) or is_of_a_value(str(case.scene.name)):
        expected["or_above"] = True
    if record.agreed is not None:
        expected["agreed"] = record.agreed
    if case.rule.order and expected["order"] and case.rule.order > expected["order"]:
        expected["declared"] = case.rule.order  # this chart lowers it: see Scheme.order
    fail, unknown = (partial(Verdict, v, expected=expected) for v in ("fail", "inconclusive"))
    rows, certain, known = record.rows, record.trusted, record.certain
    if rows and rows[-1].cause == BLEW_UP:  # whatever longer steps do
        said = f"the run at the finest step, {rows[-1].step:.3g}, does not converge: {BLEW_UP}."
        return fail(said, why=NOT_CONVERGING)
    if order is None:
        failed = [row for row in rows if row.why_not == "failed"]
        if len(failed) == len(rows):
            return fail(f"every run failed: {failed[0].cause}.")
        if wrong := departure(case, rows, certain):
            return fail(wrong[1], why=wrong[0])
        if max(row.error for row in rows if row.error is not None) <= floor(case, certain):
            if expected["order"] is None:
                return Verdict("pass", "", {**expected, "not_demanded": NO_ORDER})
            return unknown(
                "every error is round-off: the method is exact on this scene, which says nothing "
                "of its order; take another scene.",
                why=ROUND_OFF,
            )
        more = 50 if case.digits == 16 else case.digits + 30
        digits = f", or judge it by --digits {more}" if case.rule.runs_at(more) else ""
        return unknown(
            "fewer than four step sizes lie on a straight line above round-off; start the ladder "
            f"elsewhere with --steps (the reference has {known:.3g} certain digits){digits}.",
            why=MORE_STEPS,
        )
    if expected["order"] is None:
        return Verdict("pass", "", {**expected, "not_demanded": NO_ORDER})
    rule = case.rule
    if rule.method is not None:
        # a wrong digit of size δ bends the line only where δh² is no longer small beside h^p
        defect = float(rule.method.defect(case.digits))
        if defect > 10.0 ** (3 - case.digits):
            return fail(
                f"the coefficients of {rule.method.name} miss a condition of order "
                f"{rule.method.order} by {defect:.2g}."
            )
    if abs(order - expected["order"]) <= tolerance:
        return Verdict("pass", _cut(case, record), expected)
    share = hidden_share(case, rows, certain, order)
    if share is not None and share <= tolerance:
        said = (
            f"the slope of a line is {order:z.3f}, and order {case.order} is reached as the step "
        )
        said += "goes to 0: the errors are a sum of this power of the step and the next ones, in "
        said += f"which a lower power changes the finest error by less than {max(share, 1e-3):.1%}."
        return Verdict("pass", f"{said} {_cut(case, record)}".rstrip(), expected)
    if too_few(case, rows, certain):
        return unknown(
            f"order {order:z.3f} still comes nearer to the expected {expected['order']} at the "
            "finest steps: take more --steps.",
            why=MORE_STEPS,
        )
    if share is not None:
        return unknown(
            f"order {order:z.3f} may still reach the expected {expected['order']}: the errors are "
            "a sum of this power of the step and the next ones, but a lower power may change the "
            f"finest error by {min(share, 1):.0%}: take more --steps.",
            why=MORE_STEPS,
        )
    program = not case.rule.is_formula
    if (
        program
        and abs(order - expected["order"]) < BESIDE_EARLY
        and (rows[-1].error or 0.0) > LARGE
    ):
        return unknown(
            f"order {order:z.3f} is beside the expected {expected['order']}, but the error at the "
            f"finest step is {rows[-1].error:.1g} still: take more --steps.",
            why=MORE_STEPS,
        )
    side = "below" if order < expected["order"] else "above"
    high = case.digits == 16 and expected["order"] > HIGHEST_IN_DOUBLE
    if high and 0 < order - expected["order"] < BETWEEN:
        return unknown(
            f"order {order:z.3f} lies between {expected['order']} and {expected['order'] + 1}, as "
            "the order of a sum of both powers of the step does: take more --steps.",
            why=MORE_STEPS,
        )
    return fail(
        f"order {order:z.3f} is {side} the expected {expected['order']} by more than {tolerance}.",
        why=ABOVE if side == "above" else "",
    )


def _cut(case: Case, found: Found) -> str:
    """Return a sentence on runs that are shorter than any ladder means to be; "" if they are not.

    They are where steps that resolve all of the motion would be too many (`resolved`).
    """
    if not found.duration or case.rule.is_recorded or "sites" in parts_of(case.scene):
        return ""  # a lattice's ladder is as many of its steps as it needs
    whole = float(case.scene.duration)
    if found.duration >= whole / PART:
        return ""
    return (
        f"this is the order up to t = {found.duration:.4g} of {whole:.4g}: later the motion asks "
        "for steps so short that longer runs would take too many."
    )


def diagnose(case: Case, measurement: Measurement) -> dict[str, Any] | None:
    """Return the cause of an order below the expected one, or of errors that stop sinking too
    early."""
    if case.rule.is_recorded:
        from ..causes import recorded

        return recorded.of_rows(case)
    record = decoded(Found, measurement)
    local = record.local or SingleSteps()
    of_step = local.order
    as_wanted = of_step is not None and of_step >= (case.order or 1) - BESIDE
    if case.scheme.arrows is None and not (as_wanted and case.rule.is_formula):
        from ..causes import one_step

        if (
            cause := one_step.of_step(
                case, finest=next(iter(clear_orders(case, record)[-1:]), None)
            )
        ) is not None:
            return cause
    if as_wanted and local.effective and local.effective.cause:
        return {"cause": "the processed order", "sentence": local.effective.cause + "."}
    order, wanted = record.measured.order, case.order
    rows = [(row.step, row.error) for row in record.rows if row.error is not None]
    if wanted is None or len(rows) < 2:
        return None
    near = order is not None and order > wanted - allowed(case.digits)
    if near and (of_step is None or of_step > wanted - BESIDE):
        return None  # runs and steps have the order, so that no fault of theirs is the cause
    if order is None:
        (longer, before), (shorter, last) = rows[-2:]
        stuck = last > max(before / 1.5, STUCK)
        slow = before < last * (longer / shorter) ** wanted
        if not stuck and not (slow and departure(case, record.rows, record.trusted)):
            return None
    from ..causes.diagnosis import of_order

    def at_50_digits() -> Any:
        return measure(replace(case, digits=50, steps=None)).measured.order

    return of_order(case, measurement, ladder(case).duration, at_50_digits)


def diagnose_lattice(case: Case) -> dict[str, Any] | None:
    """Return the cause of an order below the expected one on a lattice."""
    from ..causes.diagnosis import of_part

    lattice: Any = case.scene
    return of_part(lattice, case.rule)


def _with_multipliers(case: Case, record: Found, verdict: Verdict) -> Verdict:
    """Return the verdict of (x, μ) after the multipliers, which may only deny it."""
    errors = [(row.step, row.multipliers) for row in record.rows if row.multipliers is not None]
    if not errors or verdict.expected["order"] is None:
        return verdict
    # their mean is even in h: an error of order 2, except for that of the row itself
    least = min(2, verdict.expected["order"])
    verdict = verdict.expecting(multipliers=least)
    slope, known = record.measured.multipliers, multipliers.known(record.rows)
    if slope is not None and not math.isnan(slope):
        wrong, why = slope < least - allowed(case.digits), ""
        said = f"are of order {slope:.3f}, below {least}"
    else:
        slope = None
        sure = [(step, error) for step, error in errors if not math.isnan(error)]
        wrong, why = bool(not_converging(sure, least)), NOT_CONVERGING
        said = f"do not converge, with errors of {', '.join(f'{e:.2g}' for e in known)}"
    if wrong and verdict.verdict != "fail":
        said += ", though (x, μ) converges: the force of constraint is another."
        said = f"the multipliers of the constraints {said}"
        return Verdict("fail", said, verdict.expected, why=why)
    exact = bool(known) and max(known) <= floor(case, record.certain)
    if slope is None and verdict.verdict == "pass" and not exact:
        said = "(x, μ) has its order, but fewer than four errors of the multipliers of the "
        said += "constraints lie on a straight line above round-off: take more --steps."
        return Verdict("inconclusive", said, verdict.expected, why=MORE_STEPS)
    return verdict


def _of_recorded(case: Case, record: Found, verdict: Verdict) -> Verdict:
    """Return the verdict on runs, in words for a user who can only record more of them.

    Their rows have to be steps of one method. And if the steps from row to row have the order, and
    errors do not sink, the motion has enlarged them.
    """
    local = record.local or SingleSteps()
    if len(record.rows) < FEWEST and record.measured.order is None:
        said = (
            f"an order needs runs at {FEWEST} steps or more, each half of the one before, say; "
            f"recorded are {len(record.rows)}."
        )
        return Verdict("inconclusive", said, verdict.expected)
    few = len(clear_orders(case, record)) < FEWEST - 1
    if verdict.verdict == "inconclusive" and case.rule.unit(16) > 2.0**-53 and few:
        return verdict.because(
            f"the runs were written with digits of {case.rule.unit(16):.0e} of the motion, and too "
            "few of their errors are above these: record them with 17 digits."
        )
    if verdict.verdict == "pass" and local.unknown:
        said = f"the errors at all rows have their order, but {local.unknown.rstrip('.')}."
        return Verdict("inconclusive", said, verdict.expected)
    least = (case.order or math.inf) - LIMITS["rows: power"]
    steps = local.order is not None and local.order > least
    enlarged, large = record.grown or 1.0, verdict.why == NOT_CONVERGING
    if verdict.verdict == "fail" and steps and large and enlarged >= LIMITS["rows: enlarged"]:
        said = f"the steps from row to row are of order {local.order:.2f}, as declared, and the "
        said += f"motion enlarges a change of its start {enlarged:.2g} times until the last row, "
        said += "so no error is small there: record shorter runs."
        return Verdict("inconclusive", said, verdict.expected)
    if steps or verdict.why == MORE_STEPS:
        verdict = _by_steps(case, record, verdict)
    slope = record.measured.order or case.order or 0.0
    row = off_the_line(record.rows, slope) or off_its_neighbours(clear_rows(case, record), slope)
    if verdict.verdict == "pass" and row is not None:
        said = (
            f"the run of the step {row.step:.6g} is off by {row.error:.2g}, which is not on the "
            f"line of the others, order {slope:.2f}, and neither its step nor round-off explains "
            "it: record all runs by one method."
        )
        return Verdict("inconclusive", said, verdict.expected)
    return verdict


def _by_steps(case: Case, record: Found, verdict: Verdict) -> Verdict:
    """Return the verdict on errors on no straight line, where the steps from row to row have the
    order, or are not known.

    If each step has it, so have the runs, and their errors have only to agree: local orders that
    come nearer to it, and reach it at the finest steps. Over a long time an error of a higher power
    may grow faster, and hide it.
    """
    local, orders = record.local or SingleSteps(), clear_orders(case, record)
    listed = ", ".join(f"{p:.2f}" for p in orders)
    missed = [abs(p - (case.order or 0)) for p in orders]
    if verdict.why == MORE_STEPS:
        near = [e <= allowed(case.digits) for e in missed[-2:]]
        nearer = len(missed) > 2 and near[-1] and (all(near) or missed == sorted(missed)[::-1])
        if local.order == case.order and nearer:
            said = f"from run to run the errors have the local orders {listed}, which come to the "
            said += "declared one, and each step from row to row has it."
            return Verdict("pass", said, verdict.expected, measured={"order": orders[-1]})
        steps, few = [row.step for row in record.rows], len(orders) < FEWEST - 1
        more = f"longer steps, from {2 * max(steps):.4g} on" if few else (
            f"shorter steps, from {min(steps) / 2:.4g} on")  # fmt: skip
        return verdict.because(
            "fewer than four of the recorded runs have errors on a straight line above round-off"
            f"{f' (local orders {listed})' if listed else ''}: record runs at {more}."
        )
    above = verdict.why == GOING_AWAY and orders[-1] > (case.order or 0)
    if not above or local.order != case.order:
        return verdict
    said = f"the steps from row to row are of order {local.order:.2f}, as declared, but errors at "
    said += f"the rows sink faster (local orders {listed}), as where one of a higher power has "
    said += "grown over the time: record runs of shorter time, or of steps below "
    said += f"{min(row.step for row in record.rows):.4g}."
    return Verdict("inconclusive", said, verdict.expected)
