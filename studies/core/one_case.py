"""Measure a case and judge it; look for more numbers and for a cause if it does not pass."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from typing import TypeVar

from discmech.integrators import BadInput, StepFailure
from discmech.integrators.errors import CannotMeasure
from discmech.integrators.geometry import StagesNotFound
from discmech.integrators.numbers import arithmetic

from .case import Case, Measurement, Progress, Verdict, silent
from .decisions import decisions
from .ended import refuse_ended
from .outcome import Found, named
from .record import provenance
from .records import Json
from .result import DETAILS, AnyResult, Result
from .study import Study

Made = TypeVar("Made")


def run_case(
    study: Study, case: Case, progress: Progress = silent, *, causes: bool = True
) -> AnyResult:
    """Return the result of one case; a step that fails marks the case and is not raised.

    So does a rule that cannot be used on the scene: the case is then also marked `unusable`.
    causes: True to look for the cause of a verdict that is not a pass.
    """
    record, verdict = measured_fully(study, case, progress)
    cause = None
    if causes and asks_cause(study, case, verdict):
        cause = diagnosed(study, case, record, progress)
    return told_of(study, case, record, verdict, cause)


def measured_fully(study: Study, case: Case, progress: Progress = silent) -> tuple[Found, Verdict]:
    """Return the measurement, with what its first verdict asks for beside it, and the verdict."""
    record = measured_case(study, case, progress)
    verdict = judged(study, case, record)
    if asks_more(study, record, verdict):
        record = with_more(study, case, record, verdict)
        verdict = judged(study, case, record)
    return record, verdict


def told_of(
    study: Study, case: Case, record: Found, verdict: Verdict, cause: Json | None
) -> AnyResult:
    """Return the result of a case from its measurement, its verdict and the cause of that."""
    measurement = record.measurement or Measurement()
    extras = measurement.extras
    return Result(
        study=study.name,
        scene=case.scene.name,
        rule=case.label,
        retraction=case.scene.groupoid.retraction,
        digits=case.digits,
        verdict=verdict.verdict,
        reason=with_cause(verdict.reason, cause),
        command=case.command if case.repeatable else "",
        control=case.control is not None,
        wanted=verdict.expected,
        figures={**measurement.measured, **verdict.measured},
        data=measurement.rows if verdict.rows is None else verdict.rows,
        extras={key: extras[key] for key in DETAILS if key in extras},
        diagnosis=cause or None,
        unusable=verdict.unusable or None,
        why=verdict.why or None,
        seconds=record.seconds,
        measured_at=record.measured_at,
    )


def with_cause(reason: str, cause: Json | None) -> str:
    """Return the reason of a verdict, with its cause if that is known."""
    return f"{reason} Cause: {cause['cause']}: {cause['sentence']}" if cause else reason


def measured_case(study: Study, case: Case, progress: Progress = silent) -> Found:
    """Return the measurement of a case, in numbers of its digits, or why it cannot be measured."""
    from discmech.reference import progress_to

    def along(_: str, share: float) -> None:
        progress(f"{case.scene.name} {case.label}: reference", share)

    def measure() -> Measurement:
        watched = nullcontext() if progress is silent else progress_to(along)
        with watched:
            return study.measurement(case, progress)

    begun = time.perf_counter()
    with decisions() as made:
        record = _with(Found(decisions=made), _or_why(case, measure))
    seconds = time.perf_counter() - begun
    return replace(with_order(record, case), seconds=seconds, measured_at=provenance())


def judged(study: Study, case: Case, record: Found) -> Verdict:
    """Return the verdict on a measurement, or the reason why there is no measurement."""
    if record.knows_order:
        case.know_order(record.order)
    measurement = record.measurement
    if measurement is None:
        return record.failed or Verdict("inconclusive", "nothing was measured.")
    return _or_why(case, lambda: study.verdict(case, measurement).settled())


def asks_more(study: Study, record: Found, verdict: Verdict) -> bool:
    """Return True if more has to be measured before that verdict can be given."""
    asked = record.more or record.measurement is None or record.declined == _words(verdict)
    return verdict.is_trouble and study.measures_more and not asked


def with_more(study: Study, case: Case, record: Found, verdict: Verdict) -> Found:
    """Return the record with the numbers that are measured only if the first verdict is no pass."""
    begun, measurement = time.perf_counter(), record.measurement
    assert measurement is not None

    with decisions() as made:
        told = _or_why(case, lambda: study.measure_more(case, measurement, verdict))
    record = replace(record, decisions=[*record.decisions, *made])
    if isinstance(told, Verdict):
        record = _with(record, told)
    elif told:
        record = _with(record, replace(measurement, extras={**measurement.extras, **told}))
    # a judge that says something else later may ask for what this verdict did not need
    more, declined = (True, "") if told else (False, _words(verdict))
    seconds = record.seconds + time.perf_counter() - begun
    return replace(with_order(record, case), more=more, declined=declined, seconds=seconds)


def _words(verdict: Verdict) -> str:
    return f"{verdict.verdict}: {verdict.reason}"


def asks_cause(study: Study, case: Case, verdict: Verdict) -> bool:
    """Return True if the cause of a verdict is to be sought."""
    degenerate = getattr(case.scene, "one_form", None) is not None  # any study may see its modes
    seeks = study.tells_causes or degenerate
    return verdict.is_trouble and seeks and case.control is None


def diagnosed(study: Study, case: Case, record: Found, progress: Progress = silent) -> Json | None:
    """Return the cause of a verdict that is not a pass, or None if it is unknown.

    No error in the search for it takes the verdict away: an error of the search itself is told.
    progress: is told that the search begins, which may take longer than the measurement.
    """
    from discmech.reference import ReferenceFailure

    if record.measurement is None:
        return None
    progress(f"{case.scene.name} {case.label}: looking for the cause", 1.0)
    try:
        with _digits_of(case):
            return study.diagnose(case, record.measurement)
    except (StepFailure, BadInput, ReferenceFailure):
        return None
    except Exception as error:
        said = f"the search for it ended in an error of its own, {type(error).__name__}: {error}; "
        return named("not found", f"{said}please report it with the command.", {})


def _with(record: Found, told: Measurement | Verdict) -> Found:
    if isinstance(told, Verdict):
        return replace(record, failed=told, measurement=None)
    return replace(record, measurement=told)


def with_order(record: Found, case: Case) -> Found:
    """Return the record with the rule's order on the scene, if it was asked for."""
    return replace(record, order=case.order, knows_order=True) if case.knows_order else record


def _digits_of(case: Case) -> AbstractContextManager[object]:
    """Return the context in which each function of a study runs: that of the case's digits."""
    return arithmetic(max(16, case.digits)).user_working()


def _or_why(case: Case, make: Callable[[], Made]) -> Made | Verdict:
    """Return the value of a function of a study, or a verdict with the reason for its error."""
    from discmech.reference import ReferenceFailure

    try:
        with _digits_of(case):
            return make()
    except StepFailure as failure:
        try:
            refuse_ended(case, failure.time)
        except ReferenceFailure as end:
            return Verdict("inconclusive", f"{failure.sentence} But {end}.")
        return Verdict("fail", failure.sentence)
    except (CannotMeasure, ReferenceFailure, StagesNotFound) as failure:
        return Verdict("inconclusive", str(failure))
    except BadInput as error:
        return Verdict("inconclusive", str(error), unusable=True)
