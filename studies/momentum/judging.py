"""The judge of momenta: a drift may be round-off, and nothing more."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from ..causes.round_off import why_unknown
from ..core.case import Case, Measurement, Verdict
from ..core.records import decoded
from ..evidence.judging import demand_consistency
from .cause import cause_of_drift
from .limits import LIMITS
from .measuring import _claimed, _epsilon, _over, limits_of, walks_of
from .records import Found
from .sight import key_of

#: share of the terms of dJ/dt: a sum that is 0 to round-off, for up to 10⁶ sites, is far below
NO_RATE = 2.0**-30


def judge(case: Case, measurement: Measurement) -> Verdict:
    """Judge a drift by round-off: the walk c·ε·√N of one rounding of x and μ per step, and J's own.

    A rounding of relative size ε at most is ε/√3 in the mean square, and N of them leave a walk
    whose farthest point is beyond 5 standard deviations once in a million runs (Feller, XIV).
    ``limits`` and ``over`` give the limit and the number of steps of each quantity; ``limit``
    is the largest. The bare walk ε√N is beside it, N the most steps of any quantity.

    A pass needs more: single steps beside the motion that keep it too, a limit that is not blind,
    and a seeded fault of one step that would have failed (`sight`). A quantity that never changes,
    or whose value is all round-off, is undecided.

    And the steps have to be consistent: a method of another motion may keep all quantities.
    """
    laws = map(key_of, _judged(case, measurement.measured["drift"]))
    kept = "every momentum keeps its law"
    return demand_consistency(measurement, _judge(case, measurement), *laws, kept=kept)


def _judged(case: Case, drift: Mapping[str, float]) -> list[str]:
    """Return the names of the quantities that the rule has to keep."""
    return [*drift] if case.rule.claims is None else _claimed(case)


def _judge(case: Case, measurement: Measurement) -> Verdict:
    record = decoded(Found, measurement)
    over = record.over or _over(case, record.steps)
    limits = limits_of(case, record.walks or walks_of(case, record.steps), record.units)
    walk = _epsilon(case) * math.sqrt(max(over.values()))
    limit = max(limits.values(), default=0.0)
    expected: dict[str, Any] = {"limit": limit, "limits": limits, "random_walk": walk,
                                "over": over}  # fmt: skip
    drift = record.measured.drift
    judged = _judged(case, drift)
    if not judged:
        expected["not_demanded"] = f"{case.rule.name} claims to keep none of them: measured only"
    drifting = [k for k, v in drift.items()
                if k in judged and not v <= limits.get(k, limit)]  # fmt: skip
    if not drifting:
        return _judge_faults(record, judged, limits, expected)
    name = max(drifting, key=lambda k: drift[k])
    steps = f" in {over[name]} steps" if name in over else ""
    allowed = limits.get(name, limit)
    lost = record.lost or 0.0
    if case.rule.is_formula:
        most = {k: lost * max(1.0, record.units.get(k, (1.0,))[0]) for k in drifting}
        if all(drift[k] <= most[k] for k in drifting):
            return Verdict("inconclusive", why_unknown(name, drift[name], most[name]), expected)
    else:  # twice what shorter steps lose, up to roundings that are alike
        most = {k: min(2 * lost, LIMITS["alike"] * _epsilon(case) * over[k]) for k in drifting}
        if all(drift[k] <= limits.get(k, limit) + most[k] for k in drifting):
            expected["limits"] = {k: v + most.get(k, 0.0) for k, v in limits.items()}
            expected["limit"] = max(expected["limits"].values())
            return _judge_faults(record, judged, limits, expected)  # faults are of their size
    said = f"{name} drifts by {drift[name]:.2g}, more than {allowed:.1e}{steps}."
    rate = (record.measured.rate or {}).get(name, 0.0)
    if rate > NO_RATE:
        said += (
            " It is no symmetry of L: by the equations of motion its momentum changes, by "
            f"{rate:.1g} of the terms of dJ/dt."
        )
    return Verdict("fail", said, expected)


def _judge_faults(
    record: Found, judged: list[str], limits: dict[str, float], expected: Any
) -> Verdict:
    """Return the verdict without a drift: it depends on whether a fault would have shown."""
    for name in judged:
        limit, fault = limits.get(name, 0.0), (record.faults or {}).get(name)
        if not limit <= LIMITS["blind"]:
            said = (
                f"round-off alone may change {name} by {limit:.2g} of its terms: its formula "
                "magnifies it; write it without large factors, or take more --digits."
            )
            return Verdict("inconclusive", said, expected)
        if fault is not None and not fault.change > limit:
            said = (
                f"nothing could fail: a fault that moves x and μ by {fault.size:.1e} of their "
                f"size changes {name} by {fault.change:.2g} only, and {limit:.1e} is allowed; "
                "it is a constant, or its large terms hide what moves."
            )
            return Verdict("inconclusive", said, expected)
    return Verdict("pass", "", expected)


def diagnose(case: Case, measurement: Measurement) -> dict[str, Any] | None:
    """Return the cause of a drift beyond the limit (`cause_of_drift`); None under a force."""
    drift = measurement.measured["drift"]
    limits = judge(case, measurement).expected.get("limits", {})
    return cause_of_drift(case, {k: v for k, v in drift.items() if not v <= limits.get(k, 0)})
