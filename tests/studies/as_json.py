"""Results as the dictionaries that are written: what a user finds in a file."""

from __future__ import annotations

from typing import Any

from discmech.studies.core import one_case, running
from discmech.studies.core.result import StudyResult, study_result_of


def read(*found: dict[str, Any]) -> list[StudyResult]:
    """The results of studies of the dictionaries that are written."""
    return list(map(study_result_of, found))


def run_case(*asked: Any, **more: Any) -> dict[str, Any]:
    return one_case.run_case(*asked, **more).to_json()


def run_study(*asked: Any, **more: Any) -> dict[str, Any]:
    return running.run_study(*asked, **more).to_json()


def run_studies(*asked: Any, **more: Any) -> tuple[list[dict[str, Any]], list[Any]]:
    results, said = running.run_studies(*asked, **more)
    return [result.to_json() for result in results], said
