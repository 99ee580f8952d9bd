"""The judge of lattices: order in space, and the law on patches."""

from __future__ import annotations

from typing import Any

from ..contact.judging import WORDS as OF_CONTACT
from ..contact.judging import does_not_fall
from ..core.case import Case, Measurement, Verdict
from ..core.outcome import of_control
from ..core.records import decoded
from ..evidence import judging as single_steps
from ..order.limits import tolerance as of_orders
from ..symplecticity.limits import LIMITS as OF_FORMS
from ..symplecticity.limits import limit, limits
from ..systems.known import known_of
from . import DAMPED, FLIPPED, RUNGE_KUTTA
from .measuring import SPACE_ORDER
from .records import Measured

#: the measurements that must show each control
SEEN = {DAMPED: ("poisson", "patch", "drift"), FLIPPED: ("poisson",), RUNGE_KUTTA: ("patch",)}


def judge(case: Case, measurement: Measurement) -> Verdict:
    """Judge order in space on both sides, the law on patches by round-off, single steps by the
    order.

    Times are not judged. A control has to show a thousandfold in all its measurements.
    """
    record, allowed = decoded(Measured, measurement.measured), limit(16)
    if case.control is not None:
        wanted = OF_FORMS["control"] * allowed
        defects = {name: getattr(record, name) for name in SEEN[case.control]}
        missed = [k for k, v in defects.items() if v is None or not v >= wanted]
        return of_control(not missed, f"its {', '.join(missed)} is round-off", {"at_least": wanted})
    verdict = _judge_contact(case, record) if record.contact else _of_laws(case, record, allowed)
    return single_steps.judge(
        record.local, verdict, wanted=case.order, asks_order=True, what="the lattice"
    )


def _of_laws(case: Case, record: Measured, allowed: float) -> Verdict:
    tolerance, order = of_orders(16), record.space_order
    expected: dict[str, Any] = {"limit": allowed}
    residual = expected["residual"] = limits(16)["residual"]
    for name, words, most in (
        ("residual", "the step that runs is not that of the equations", residual),
        ("constraint", "a step does not end on the constraints", residual),
        ("hidden", "a row's velocity does not meet the constraints", residual),
        ("bond", "one end of a bond gains what the other does not lose", allowed),
        ("patch", "of the energy that enters a patch of the lattice some is lost there", allowed),
    ):
        value = getattr(record, name)
        if value is not None and not value <= most:
            return Verdict("fail", f"{words}: {name} is {value:.2g}, where {most:.0e} is "
                           "allowed.", expected)  # fmt: skip
    if known_of(case.scene).refined is not None:  # type: ignore[arg-type]
        expected |= {"space_order": SPACE_ORDER, "tolerance": tolerance}
        if order is None:
            said = "fewer than four errors in space lie on a straight line above round-off."
            return Verdict("inconclusive", said, expected)
        if abs(order - SPACE_ORDER) > tolerance:
            side = "below" if order < SPACE_ORDER else "above"
            return Verdict("fail", f"the order in space is {order:.3f}, {side} the expected "
                           f"{SPACE_ORDER} by more than {tolerance}.", expected)  # fmt: skip
    return Verdict("pass", "", expected)


SHARED = ("penetration", "pull", "complementarity", "restitution")
WORDS = {name: OF_CONTACT[name] for name in SHARED}
WORDS |= {"missed": "a gap is closed and closing after a step"}


def _judge_contact(case: Case, measured: Measured) -> Verdict:
    """Judge laws by round-off, and rises of energy by their fall with the step, not times.

    Under a force or an explicit time the energy may rise, as long as it is a number.
    """
    lattice: Any = case.scene
    still, allowed = not (lattice.forced or lattice.timed), limit(16)
    expected, laws = {"laws": allowed}, measured.contact or {}
    for name, words in WORDS.items():
        defect = laws[name]
        if not defect <= allowed:
            return Verdict("fail", f"{words}: {name} is {defect:.2g}, where "
                           f"{allowed:.0e} is allowed.", expected)  # fmt: skip
    rises = measured.rises
    if (still or len(rises) == 1) and (reason := does_not_fall(rises, allowed)):
        return Verdict("fail", reason, expected)
    if not measured.impacts and not measured.pushed:
        return Verdict("inconclusive", "no gap has closed; take more --steps.", expected)
    return Verdict("pass", "", expected)
