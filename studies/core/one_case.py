"""One case: measured, then judged; the cause is sought only if it did not pass."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import nullcontext
from typing import Any

from discmech.integrators import BadInput, StepFailure
from discmech.integrators.errors import CannotMeasure
from discmech.integrators.geometry import StagesNotFound
from discmech.integrators.numbers import arithmetic

from .case import DETAILS, Case, Progress, Verdict, silent
from .record import provenance
from .runs import refuse_ended
from .study import Study

#: the JSON-able record of a case: "measurement" of the study, or "failed", [verdict, reason], if it
#: cannot be measured; "unusable" if that is bad input; "order" of the rule on the scene, if it was
#: needed; "more" once `Study.measure_more` was called; "seconds", and "measured_at"
Found = dict[str, Any]


def run_case(
    study: Study, case: Case, progress: Progress = silent, *, causes: bool = True
) -> dict[str, Any]:
    """Return one case's result; a step that fails marks the case and is not raised.

    So does a rule that cannot be used on the scene: the case is then also marked `unusable`.
    causes: True to seek the cause if it did not pass.
    """
    found = measured_case(study, case, progress)
    verdict = judged(study, case, found)
    if asks_more(study, found, verdict):
        found = with_more(study, case, found, verdict)
        verdict = judged(study, case, found)
    cause = diagnosed(study, case, found) if causes and asks_cause(study, case, verdict) else None
    return result_of(case, found, verdict, cause)


def measured_case(study: Study, case: Case, progress: Progress = silent) -> Found:
    """Return the measurement of a case, in numbers of its digits, or why it cannot be measured."""
    from discmech.reference import progress_to

    def along(_: str, share: float) -> None:
        progress(f"{case.scene.name} {case.label}: reference", share)

    def measure() -> Found:
        watched = nullcontext() if progress is silent else progress_to(along)
        with watched, arithmetic(case.digits).working():
            return {"measurement": study.measurement(case, progress)}

    begun = time.perf_counter()
    found = _or_why(case, measure)
    seconds = time.perf_counter() - begun
    return {**found, **_order_of(case), "seconds": seconds, "measured_at": provenance()}


def judged(study: Study, case: Case, found: Found) -> Verdict:
    """Return the verdict, made anew from the measurement."""
    if "order" in found:
        case.know_order(found["order"])
    if "measurement" in found:
        told = _or_why(case, lambda: {"verdict": study.verdict(case, found["measurement"])})
        if "verdict" in told:
            verdict: Verdict = told["verdict"]
            return verdict
        found = told
    word, reason = found["failed"]
    return Verdict(word, reason, unusable="unusable" in found)


def asks_more(study: Study, found: Found, verdict: Verdict) -> bool:
    """True if more has to be measured before that verdict can be given."""
    asked = "more" in found or "measurement" not in found
    return verdict.verdict != "pass" and study.measures_more and not asked


def with_more(study: Study, case: Case, found: Found, verdict: Verdict) -> Found:
    """Return the record with measurements that are made only if the first verdict is not a pass."""
    begun = time.perf_counter()

    def measure() -> Found:
        with arithmetic(case.digits).working():
            more = study.measure_more(case, found["measurement"], verdict)
        return {"measurement": {**found["measurement"], **more}}

    told = _or_why(case, measure)
    seconds = found["seconds"] + time.perf_counter() - begun
    return {**found, **told, **_order_of(case), "more": True, "seconds": seconds}


def asks_cause(study: Study, case: Case, verdict: Verdict) -> bool:
    """True if the cause of a verdict is to be sought."""
    degenerate = getattr(case.scene, "one_form", None) is not None  # any study may see its modes
    seeks = study.tells_causes or degenerate
    return verdict.verdict != "pass" and seeks and case.control is None


def diagnosed(study: Study, case: Case, found: Found) -> dict[str, Any] | None:
    """Return the cause of a verdict that is not a pass, if it can be found."""
    from discmech.reference import ReferenceFailure

    if "measurement" not in found:
        return None
    try:
        return study.diagnose(case, found["measurement"])
    except (StepFailure, BadInput, ReferenceFailure):
        return None


def result_of(
    case: Case, found: Found, verdict: Verdict, cause: dict[str, Any] | None
) -> dict[str, Any]:
    """Return the result of a case: JSON-able, as it is shown, written and compared."""
    measurement = found.get("measurement", {"measured": {}, "rows": []})
    told = f" Cause: {cause['cause']}: {cause['sentence']}" if cause else ""
    return {
        "scene": case.scene.name,
        "rule": case.label,
        "retraction": case.scene.groupoid.retraction,
        "digits": case.digits,
        "verdict": verdict.verdict,
        "reason": verdict.reason + told,
        "command": case.command,
        "control": case.control is not None,
        "expected": verdict.expected,
        "measured": {**measurement["measured"], **verdict.measured},
        "rows": measurement["rows"] if verdict.rows is None else verdict.rows,
        **{key: measurement[key] for key in DETAILS if key in measurement},
        **({"diagnosis": cause} if cause else {}),
        **({"unusable": True} if verdict.unusable else {}),
        "seconds": found["seconds"],
        "measured_at": found["measured_at"],
    }


def _order_of(case: Case) -> Found:
    return {"order": case.order} if case.knows_order else {}


def _or_why(case: Case, make: Callable[[], Found]) -> Found:
    """Return the result of a function, or the record of why it failed."""
    from discmech.reference import ReferenceFailure

    try:
        return make()
    except StepFailure as failure:
        try:
            refuse_ended(case, failure.time)
        except ReferenceFailure as end:
            return {"failed": ["inconclusive", f"{failure} But {end}."]}
        return {"failed": ["fail", str(failure)]}
    except (CannotMeasure, ReferenceFailure, StagesNotFound) as failure:
        return {"failed": ["inconclusive", str(failure)]}
    except BadInput as error:
        return {"failed": ["inconclusive", str(error)], "unusable": True}
