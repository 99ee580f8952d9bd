"""One case: measured, judged, and with a cause where it did not pass."""

from __future__ import annotations

import time
from contextlib import nullcontext
from typing import Any

from discmech.integrators import BadInput, StepFailure
from discmech.integrators.errors import CannotMeasure
from discmech.integrators.geometry import StagesNotFound

from .case import DETAILS, Case, Progress, Verdict, silent
from .record import provenance
from .runs import refuse_ended
from .study import Study


def _diagnose(study: Study, case: Case, measurement: dict[str, Any], said: Verdict) -> None:
    """Add the cause, where one can be told; the verdict stays what it is."""
    from discmech.reference import ReferenceFailure

    try:
        found = study.diagnose(case, measurement)
    except (StepFailure, BadInput, ReferenceFailure):
        return
    if found is not None:
        measurement["diagnosis"] = found
        said.reason = f"{said.reason} Cause: {found['cause']}: {found['sentence']}"


def run_case(
    study: Study, case: Case, progress: Progress = silent, *, causes: bool = True
) -> dict[str, Any]:
    """One case's result; a step that fails marks the case and is not raised.

    So does a rule that cannot be used on the scene: the case is then also marked `unusable`.
    causes: whether the cause of what did not pass is looked for.
    """
    begun = time.perf_counter()
    measurement: dict[str, Any] = {"measured": {}, "rows": []}
    from discmech.reference import ReferenceFailure, progress_to

    def along(_: str, share: float) -> None:
        progress(f"{case.scene.name} {case.label}: reference", share)

    try:
        with nullcontext() if progress is silent else progress_to(along):
            measurement = study.measurement(case, progress)
        verdict = study.verdict(case, measurement)
        if causes and verdict.verdict != "pass":
            _diagnose(study, case, measurement, verdict)
    except StepFailure as failure:
        verdict = Verdict("fail", str(failure))
        try:
            refuse_ended(case, failure.time)
        except ReferenceFailure as end:
            verdict = Verdict("inconclusive", f"{failure} But {end}.")
    except (CannotMeasure, ReferenceFailure, StagesNotFound) as failure:
        verdict = Verdict("inconclusive", str(failure))
    except BadInput as error:
        measurement["unusable"] = True
        verdict = Verdict("inconclusive", str(error))
    return {
        "scene": case.scene.name,
        "rule": case.label,
        "retraction": case.scene.groupoid.retraction,
        "digits": case.digits,
        "verdict": verdict.verdict,
        "reason": verdict.reason,
        "command": case.command,
        "control": case.control is not None,
        "expected": verdict.expected,
        "measured": measurement["measured"],
        "rows": measurement["rows"],
        **{key: measurement[key] for key in DETAILS if key in measurement},
        "seconds": time.perf_counter() - begun,
        "measured_at": provenance(),
    }
