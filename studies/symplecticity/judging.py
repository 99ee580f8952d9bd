"""The judge of forms: every defect is round-off."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

from ..core.case import Case, Measurement, Verdict
from ..core.claims import keeps_volume, not_claimed
from ..core.outcome import of_control
from ..evidence.judging import demand_consistency
from ..evidence.laws import FORM, VOLUME
from ..systems import system_of
from . import judging_numbers
from .limits import CHANGES, FORMS, LIMITS, limit, limits
from .measuring import _kinds, badness, worst_row
from .records import Found, FoundOfNumbers, Row, found_in


def demanded(case: Case) -> tuple[str, ...]:
    """Return the defects that have to be round-off: no form under a force or nonholonomic
    constraint.

    But under a force Ω has to change by the differential of its one-form; and always steps have to
    be those of the equations and meet the constraints.
    """
    kinds = _kinds(case)
    if not_claimed(case.rule, "symplectic"):
        return ("volume",) if keeps_volume(case.rule) and "volume" in kinds else ()
    return tuple(k for k in kinds if k not in FORMS or not _free_of_forms(case))


def _free_of_forms(case: Case) -> str:
    """Return why no form need be kept; "" if one is demanded."""
    if system_of(case).form_kinds is not None:
        return ""
    if reason := case.scene.no_form:
        return reason
    if case.scene.force is not None:
        return "forced: Ω need not be kept; it changes by dθ_f, and a step solves its equations"
    return ""


def _broken(case: Case, record: Found) -> dict[str, float]:
    """Return the defects that exceed round-off; one that is not a number does."""
    allowed, asked = limits(case.digits), demanded(case)
    return {k: v for k, v in record.measured.items()
            if v is not None and k in asked and not v <= allowed[k]}  # fmt: skip


def judge(case: Case, measurement: Measurement) -> Verdict:
    """Judge the form and the steps: keeping the form of another motion fails too."""
    laws = [] if not_claimed(case.rule, "symplectic") else [FORM.name]
    laws += [VOLUME.name] if keeps_volume(case.rule) else []
    kept = "the form is kept"
    return demand_consistency(measurement, _judge(case, measurement), *laws, kept=kept)


def _judge(case: Case, measurement: Measurement) -> Verdict:
    """Judge schemes by round-off, controls by a thousandfold defect (10²⁰-fold at 50 digits)."""
    record = found_in(measurement)
    if isinstance(record, FoundOfNumbers):
        return judging_numbers.judge(case, record)
    if case.control:
        off = LIMITS["control" if case.digits == 16 else "control with more digits"]
        wanted = limit(case.digits) * off
        defects = [defect for defect in record.measured.values() if defect is not None]
        caught = max(defects) >= wanted
        return of_control(caught, f"its defect is {max(defects):.2g}", {"at_least": wanted})
    allowed = limits(case.digits)
    expected: dict[str, Any] = {"limit": limit(case.digits), "residual": allowed["residual"]}
    if reason := not_claimed(case.rule, "symplectic"):
        expected["not_demanded"] = reason
        if not (asked := demanded(case)):
            return Verdict("pass", "", expected)
        expected["demanded"] = list(asked)
    elif reason := _free_of_forms(case):
        expected |= {"not_demanded": reason, "demanded": list(demanded(case))}
    broken = _broken(case, record)
    if not broken:
        return Verdict("pass", "", expected)
    kind, row = _seen_in(broken, record)
    said = f"the {kind} defect is {broken[kind]:.2g} at step {row.step:.3g}, "
    said += f"t = {row.time:.3g}; round-off would leave at most {allowed[kind]:.0e}."
    return Verdict("fail", said, expected)


def _seen_in(broken: dict[str, float], record: Found) -> tuple[str, Row]:
    """Return the kind of the largest of these defects, and its row."""
    kind = max(broken, key=lambda k: badness(broken[k]))
    row = worst_row(record.rows, kind)
    assert row is not None
    return kind, row


def diagnose(case: Case, measurement: Measurement) -> dict[str, Any] | None:
    """Return which is to blame for a defect: the solver's residual, the update or the structure."""
    if case.control is not None:
        return None
    from ..causes.diagnosis import of_law
    from ..core.outcome import named

    record = found_in(measurement)
    if isinstance(record, FoundOfNumbers):
        told = judging_numbers.cause_of_jump(case, record) or judging_numbers.cause_in_box(
            case, record
        )
        return told or of_law(case, measurement, "symplecticity")
    broken = _broken(case, record)
    if any(k in broken for k in CHANGES):
        if case.scene.force is None:  # the map itself changes the volume that it claims to keep
            return None
        return named(
            "discrete force", "F± are not those of one discrete Lagrangian with the force that "
            "acts where the rule asks for L.", {},
        )  # fmt: skip
    if not broken:  # the defect is only at the places, where no solver has a part
        at_places = record.local.laws.get(FORM.name) if record.local else None
        if at_places is None or not at_places.broken:
            return of_law(case, measurement, "symplecticity")
        said = "the step itself does not keep the form; the run's states, steps and times hide it."
        return named("structure", said, {})
    # a broken form is a fault of the maps; the residual alone concerns the run
    kind, row = _seen_in({k: broken[k] for k in FORMS if k in broken} or broken, record)
    from ..causes.solver_sweep import of_symplecticity

    own = float(case.scene.step)
    step = Fraction(case.scene.step if row.step == own else row.step)
    return of_symplecticity(
        case, kind, step, round(row.time / float(step)), limits(case.digits)[kind]
    )
