"""A user's own `Study`: its functions may return anything, and their answers are checked here."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from discmech.integrators import BadInput
from discmech.integrators.errors import RAISED, DiscmechError, line_of, shown

from .outcome import VERDICTS, Measurement, Verdict

if TYPE_CHECKING:
    from .case import Case, Progress


def measured_by(study: Any, case: Case, progress: Progress) -> Measurement:
    """Return `Study.measure` as numbers that JSON can hold.

    Raises `BadInput` for an error in it, and for an answer that is not {"measured": {name:
    number}}.
    """
    answer = _asked(study, study.measure, case, progress)
    if not isinstance(answer, Mapping) or not isinstance(answer.get("measured"), Mapping):
        raise BadInput(
            f'the study {study.name}: measure() gave {_short(answer)}: return {{"measured": '
            '{name: number}, "rows": [{name: number}, ...]}.'
        )
    numbers = {key: _plain(study, key, value) for key, value in answer.items()}
    return Measurement.of(numbers)


def judged_by(study: Any, case: Case, measurement: Measurement) -> Verdict:
    """Return `Study.judge`; raises `BadInput` for an error in it or another answer."""
    said = _asked(study, study.judge, case, measurement)
    if not isinstance(said, Verdict) or said.verdict not in VERDICTS:
        raise BadInput(
            f"the study {study.name}: judge() gave {_short(said)}: return Verdict(word, reason), "
            f"where word is one of {', '.join(VERDICTS)}."
        )
    return replace(said, expected=_plain(study, "expected", said.expected))


def _asked(study: Any, function: Callable[..., Any], *arguments: Any) -> Any:
    try:
        return function(*arguments)
    except DiscmechError:
        raise
    except RAISED as error:
        from discmech.reference import ReferenceFailure

        if isinstance(error, ReferenceFailure):
            raise
        where = line_of(function, error)
        raise BadInput(
            f"the study {study.name}: {function.__name__}() raised {type(error).__name__}: {error} "
            f"({where})."
        ) from None


def _plain(study: Any, name: str, value: Any) -> Any:
    """Return the value in Python's own numbers, words, lists and dicts."""
    if value is None or isinstance(value, bool | str | int | float):
        return float(value) if isinstance(value, float) else value
    if isinstance(value, Mapping):
        return {str(key): _plain(study, f"{name}[{shown(key)}]", e) for key, e in value.items()}
    if hasattr(value, "tolist"):
        return _plain(study, name, value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(study, f"{name}[{k}]", e) for k, e in enumerate(value)]
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        raise BadInput(
            f"the study {study.name}: {name} is {_short(value)}: give numbers, words, lists and "
            "dicts."
        ) from None


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) < 60 else f"{text[:57]}..."
