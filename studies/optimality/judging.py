"""The judge of optimal control: each kind of unknown has the order of the rule."""

from __future__ import annotations

from itertools import pairwise

from ..core.case import Case, Measurement, Verdict
from ..core.records import decoded
from ..evidence import judging as single_steps
from ..order.limits import tolerance as of_orders
from .limits import LIMITS
from .records import Found


def judge(case: Case, measurement: Measurement) -> Verdict:
    """Return the verdict of solutions and of the pushed scene's steps: a pass needs both."""
    record = decoded(Found, measurement)
    verdict = _judge_solutions(case, record)
    what = "the scene under its inputs"
    return single_steps.judge(record.local, verdict, wanted=case.order, asks_order=True, what=what)


def _judge_solutions(case: Case, record: Found) -> Verdict:
    """Judge that each kind has the order of the rule, or changes only by round-off."""
    measured, tolerance = record.measured, of_orders(16)
    wanted = case.order
    expected = {"order": wanted, "tolerance": tolerance}
    orders = {k: p for k, p in measured.orders.items() if k not in measured.exact}
    if wanted is None:
        return Verdict("pass", "", {**expected, "not_demanded": "the rule declares no order"})
    last = [row.controls for row in record.rows][-3:]
    grows = len(last) == 3 and all(b > LIMITS["grows"] * a for a, b in pairwise(last))
    if grows and "controls" in orders:  # not if they are exact, and changes are round-off
        return Verdict(
            "inconclusive", "the controls change by more and more as the steps are halved: they "
            "grow without bound somewhere, so the problem has no bounded optimum to converge to; "
            "let the cost grow faster with its controls.", expected,
        )  # fmt: skip
    unclear = [kind for kind, order in orders.items() if order is None]
    for kind, order in orders.items():
        if order is not None and abs(order - wanted) > tolerance:
            side = "below" if order < wanted else "above"
            return Verdict(
                "fail",
                f"the {kind} are of order {order:.3f}, {side} the expected {wanted} by more than "
                f"{tolerance}.",
                expected,
            )
    if unclear:
        return Verdict(
            "inconclusive",
            f"fewer than four changes of the {' and '.join(unclear)} lie on a straight line above "
            f"round-off, {record.floor:.1g}: start with other --steps.",
            expected,
        )
    return Verdict("pass", "", expected)
