"""The judge of momenta: a drift may be round-off, and nothing more."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from discmech.integrators.numbers import arithmetic
from discmech.integrators.scene import Conserved

from ..causes.round_off import why_unknown
from ..core.case import Case, Measurement, Verdict
from ..core.outcome import named
from ..core.records import decoded
from ..evidence.judging import demand_consistency
from ..evidence.laws import ROUNDINGS
from .cause import cause_of_drift, of_scene
from .limits import LIMITS
from .measuring import WORKED, _claimed, _epsilon, _over, round_off, walks_of
from .quantities import kept_in
from .records import Found
from .sight import key_of


def judge(case: Case, measurement: Measurement) -> Verdict:
    """Judge a drift by round-off: the walk c·ε·√N of one rounding of x and μ per step, and J's own.

    A rounding of relative size ε at most is ε/√3 in the mean square, and N of them leave a walk
    whose farthest point is beyond 5 standard deviations once in a million runs (Feller, XIV).
    ``limits`` and ``over`` give the limit and the number of steps of each quantity; ``limit``
    is the largest. The bare walk ε√N is beside it, N the most steps of any quantity.

    A momentum of a lattice whose dJ/dt is not 0 at drawn states fails, whatever the run shows: it
    may be as much of its terms as single steps may change of a quantity.

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
    walks = record.walks or walks_of(case, record.steps)
    compensated = case.rule.is_formula and record.impacts is None
    roundings = 1.0 if compensated else LIMITS["program"]
    limits = round_off(case, walks, record.units, LIMITS["walk"] * math.sqrt(roundings))
    noise = round_off(case, walks, record.units)
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
    rates = record.measured.rate or {}
    name = max(judged, key=lambda k: rates.get(k, 0.0), default="")
    if (rate := rates.get(name, 0.0)) > ROUNDINGS * arithmetic(16).eps:
        drifts = name in drifting
        moves = f"drifts by {drift[name]:.2g} and" if drifts else "does not drift in this run, but"
        said = (
            f"{name} {moves} is no symmetry of L: by the equations of motion its momentum changes "
            f"beside the run, by {rate:.1g} of the terms of dJ/dt; no rule can keep it, so mend "
            "the symmetry, or the Lagrangian."
        )
        return Verdict("fail", said, expected)
    if not drifting:
        return _judge_faults(record, judged, limits, noise, expected)
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
            return _judge_faults(record, judged, limits, noise, expected)
    said = f"{name} drifts by {drift[name]:.2g}, more than {allowed:.1e}{steps}."
    return Verdict("fail", said, expected)


def _judge_faults(
    record: Found, judged: list[str], limits: Mapping[str, float], noise: Mapping[str, float],
    expected: Any,
) -> Verdict:  # fmt: skip
    """Return the verdict without a drift: it depends on whether a fault would have shown.

    noise: the round-off, `FAULT` times as large as which it is seeded. One that changes a quantity
    by more than the noise would, in proportion, change it by a limit if it were `FAULT` limits.
    A pass says how far quantities that a force, or their own equation, changes were followed.
    """
    for name in judged:
        limit, fault = limits.get(name, 0.0), (record.faults or {}).get(name)
        if not limit <= LIMITS["blind"]:
            said = (
                f"round-off alone may change {name} by {limit:.2g} of its terms: its formula "
                "magnifies it; write it without large factors, or take more --digits."
            )
            return Verdict("inconclusive", said, expected)
        if fault is not None and not fault.change > noise.get(name, 0.0):
            said = (
                f"nothing could fail: a fault that moves x and μ by {fault.size:.1e} of their "
                f"size changes {name} by {fault.change:.2g} only, and {noise[name]:.1e} may be "
                "round-off; it is a constant, or its large terms hide what moves."
            )
            return Verdict("inconclusive", said, expected)
    worked, said = [e for e in judged if expected["over"].get(e) == 1 < record.steps], ""
    if record.compared:
        said = (
            f"{', '.join(worked)}: held against its work in steps from {record.compared} rows of "
            "the run, and from as many drawn states beside them."
        )
    elif worked and record.rows:
        steps, last = min(WORKED, record.steps), record.rows[-1]
        free = steps if record.free is None else record.free
        rest = f"in {record.resting} of the steps a gap stays closed, or pushes before an impact, "
        rest += "and where its impulses act no row tells"
        if not free and record.resting:
            return Verdict("inconclusive", f"nothing could fail: {rest}.", expected)
        some = f"{free} of {steps}" if free < steps else steps
        said = (
            f"{', '.join(worked)}: held against its work or equation in {some} steps, "
            f"to t = {steps * last.time / last.step:.4g}, and in single steps from drawn places."
        )
        said += f" Not judged: {rest}." if record.resting else ""
    if (impacts := record.impacts) is not None:
        said = f"{said} The run has {impacts} impact{'s' * (impacts != 1)}".strip()
        said += ", where it changes by their impulses." if worked and impacts else "."
    return Verdict("pass", said, expected)


def diagnose(case: Case, measurement: Measurement) -> dict[str, Any] | None:
    """Return the cause of a drift beyond the limit (`cause_of_drift`), or in the step (`of_law`).

    None under a force.
    """
    from ..causes.diagnosis import of_law

    drift = measurement.measured["drift"]
    limits = judge(case, measurement).expected.get("limits", {})
    beyond = {k: v for k, v in drift.items() if not v <= limits.get(k, 0)}
    cause = cause_of_drift(case, beyond, measurement["steps"])
    return cause or _of_single_steps(case, measurement) or of_law(case, measurement, "momentum")


def _of_single_steps(case: Case, measurement: Measurement) -> dict[str, Any] | None:
    """Return the cause of a change by single steps of a rule, without a drift of its run."""
    laws = decoded(Found, measurement).local
    broken = [each for name, each in (laws.laws if laws else {}).items()
              if name.startswith(key_of("")) and each.broken]  # fmt: skip
    if case.scheme.arrows is None or case.scene.force is not None or not broken:
        return None
    worst = max(broken, key=lambda each: each.size or math.inf)
    for quantity in kept_in(case):
        if quantity.name == worst.name and isinstance(quantity, Conserved):
            if not quantity.attitude and (fault := of_scene(case.scheme.base, quantity)):
                return fault
            if quantity.of_step:
                return None
    if worst.step == float(case.scene.step):
        return None
    said = f"L_d is not invariant under the symmetry of {worst.name} at steps of {worst.step:.2g}; "
    said += f"at the scene's own, {float(case.scene.step):.2g}, the run keeps it: look for what "
    return named("invariance", said + "depends on the step.", {"step": worst.step})
