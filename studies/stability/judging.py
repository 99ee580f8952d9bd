"""The judge of stability: intervals, maps and the exchange of energy."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

from ..core.case import Case, Measurement, Verdict
from ..core.claims import not_claimed
from ..core.fingerprint import own_name
from ..core.outcome import of_control
from ..core.records import decoded
from . import exchange
from .limits import LIMITS
from .records import FARTHEST_OWN, Found, Measured, Row, percent
from .stiff import FAMILIES

# the possible classes of an orbit with an error as large as the energy itself
LOOSE = ("escaped", "resonant")
UNSOLVED = "Newton failed"


def judge(case: Case, measurement: Measurement) -> Verdict:
    """Return the verdict on a case.

    Linear: runs on both sides of the interval's ends confirm it, and the step is symplectic. Maps:
    bounded wherever the step resolves the motion; an escape or a resonance counts only where the
    family's bound excludes it as an effect of the energy's error; on fpu the exchange of energy at
    hω = 1/10 is right to a tenth. Controls: no interval at all, no bounded cell at all.
    """
    record = decoded(Found, measurement)
    measured = record.measured
    if record.kind == "linear":
        return _judge_linear(case, measured)
    reason = "" if case.control else not_claimed(case.rule, "symplectic")
    ended = None if case.control else _judge_ends(record.rows)
    if ended and (reason or ended.verdict == "fail"):
        return ended
    if reason:
        return Verdict("pass", "", {"not_demanded": reason})
    family = FAMILIES.get(own_name(case.scene))
    own = family is None
    if own and (verdict := _judge_own(measured)) is not None:
        return verdict
    bound = family and family.held
    # a run of the scene's own motion is held to the fastest rate of that motion
    slower = (measured.frequency or 1.0) / (measured.fastest or 1.0) if own else 1.0
    most = LIMITS["resolved"] * (1 + 1e-9) * min(1.0, slower)
    inside = [row for row in record.rows if row.z <= most]
    loose = [row for row in inside if bound and row.z > bound(Fraction(row.stiffness))]
    expected = {"bounded_up_to": LIMITS["resolved"] * min(1.0, slower), "of": len(inside),
                "escapes_not_judged": len(loose)}  # fmt: skip
    if case.control:
        # a resonance is bounded too
        caught = not {"bounded", "resonant"} & set(measured.classes or {})
        return of_control(caught, "some of its runs are bounded", {"bounded": 0})
    bad = [
        row for row in inside
        if row.outcome != "bounded" and not (row.outcome in LOOSE and row in loose)
    ]  # fmt: skip
    if not bad:
        return _judge_exchange(measured, expected)
    row = bad[0]
    said = f"{row.outcome} at hω = {row.z:.3g} and {record.label} = "
    said += f"{row.stiffness:g}, where the step resolves the motion"
    if own and all(row.outcome == UNSOLVED for row in bad):
        # the fastest rate is that of the reference, which is shorter than the run
        said += " from the start; the run may have come to a faster part of it: take fewer --steps."
        return Verdict("inconclusive", said, expected)
    return Verdict("fail", f"{said}.", expected)


def _judge_ends(rows: Sequence[Row]) -> Verdict | None:
    """Return the verdict on a map of which no run goes through, or None.

    Runs that grow beyond all bounds do go through, and are what a map shows. One that makes no step
    at all fails whatever it claims.
    """
    if not rows or not all(row.cause for row in rows):
        return None
    if any(row.steps for row in rows):
        said = f"no run goes through: at hω = {rows[0].z:.3g} {rows[0].cause}."
        return Verdict("inconclusive", said)
    return Verdict("fail", f"no step was made at any hω from {rows[0].z:.3g}: {rows[0].cause}.")


def _judge_own(measured: Measured) -> Verdict | None:
    """Return a fail if a step at the equilibrium is wrong, otherwise None.

    Rules are stable to hω = 2 at rest; of a steady rotation nothing is known, for the fixed point
    of a step moves with h, and the signatures of its modes may be mixed.
    """
    off, end = measured.off_circle, measured.stable_to
    expected = {"bounded_up_to": LIMITS["resolved"]}
    if off is not None:
        said = f"at the equilibrium the eigenvalues of a step at hω = {off:.3g} have another "
        said += "product than 1, so it damps or drives what should go on oscillating."
        return Verdict("fail", said, expected)
    if end is not None and end <= LIMITS["resolved"]:
        said = f"at the equilibrium an eigenvalue leaves the unit circle at hω = {end:.3g}, where "
        said += "the step resolves the motion"
        if measured.turns:  # what is stable at rest up to hω = 2 has no such bound in a rotation
            said += ": the body turns steadily there, and a step may move such a state to one that "
            said += "is unstable: give a start at rest."
            return Verdict("inconclusive", said, expected)
        return Verdict("fail", f"{said}.", expected)
    if not measured.runs:
        where = f"near hω = {end:.4f}" if end else f"up to hω = {FARTHEST_OWN:g}"
        said = f"runs beside the equilibrium {where} contradict the interval that was found."
        return Verdict("fail", said, expected)
    return None


def _judge_exchange(measured: Measured, expected: Mapping[str, Any]) -> Verdict:
    """Judge the exchange: springs that the step resolves pass on their energy as they should."""
    key = f"{float(exchange.AT):.3g}"
    errors = measured.exchange or {}
    if key not in errors:
        return Verdict("pass", "", expected)
    error = errors[key]
    expected = {**expected, "exchange": LIMITS["exchange"]}
    if error is not None and error <= LIMITS["exchange"]:
        return Verdict("pass", "", expected)
    how = "was not followed to its end" if error is None else f"is wrong by {percent(error)}"
    reason = f"the exchange of energy at hω = {key} {how}, where the step resolves the springs."
    return Verdict("fail", reason, expected)


def _judge_linear(case: Case, measured: Measured) -> Verdict:
    off, first = measured.off_circle, measured.stable_to
    if case.control:
        caught = off is not None or first == 0
        return of_control(caught, "it passes for symplectic", {"off_circle": True})
    if reason := not_claimed(case.rule, "symplectic"):
        return Verdict("pass", "", {"not_demanded": reason})
    expected = {"runs": True, "off_circle": None}
    if off is not None:
        return Verdict("fail", f"an eigenvalue leaves the unit circle at hω = {off:.3g}.", expected)
    if not measured.runs:
        where = f"near hω = {first:.6f}" if first else "up to hω = 1000"
        return Verdict("fail", f"runs {where} contradict the interval that was found.", expected)
    return Verdict("pass", "", expected)
