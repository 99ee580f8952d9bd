"""One case of a study, and how a study runs over many: measured, judged, never lost.

A study module gives `NAME`, `DIGITS` (the precisions it runs at by default), `cases(choice)`,
`measure(case, progress)` → numbers and `judge(case, measurement)` → verdict. A case that cannot be
measured is marked with the reason; the others go on.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from types import ModuleType
from typing import Any

from integrators import BadInput, Scheme, StepFailure, discretisations, scenes
from integrators.discretisations import Discretisation
from integrators.errors import CannotMeasure
from integrators.scene import Scene

SCHEMA = 1
VERDICTS = ("fail", "inconclusive", "pass")  # worst first
Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Choice:
    """What the user asked for: scenes and rules (all if empty), precisions and steps."""

    scenes: tuple[Scene, ...] = ()
    rules: tuple[Discretisation, ...] = ()
    retractions: tuple[str, ...] = ()
    digits: tuple[int, ...] = ()
    steps: int | None = None
    controls: tuple[str, ...] = ()

    def pairs(self) -> Iterator[tuple[Scene, Discretisation]]:
        """Every scene with every rule, of the retractions asked for."""
        rules = self.rules or tuple(discretisations.BUILT_IN.values())
        for scene in self.scenes or scenes.all_scenes():
            if self.retractions and scene.groupoid.retraction not in (None, *self.retractions):
                continue
            for rule in rules:
                yield scene, rule


@lru_cache(maxsize=256)
def scheme_of(scene: Scene, rule: Discretisation) -> Scheme:
    """One scheme for all studies and precisions: what it derives, it derives once."""
    return Scheme(scene, rule)


@dataclass(frozen=True)
class Case:
    """One measurement: a scene by a rule at a precision, or a control that must be caught."""

    study: str
    scene: Scene
    rule: Discretisation
    digits: int
    steps: int | None = None
    control: str | None = None

    @property
    def scheme(self) -> Scheme:
        """The scene discretised by the rule."""
        return scheme_of(self.scene, self.rule)

    @property
    def label(self) -> str:
        """The rule's name, or the control's."""
        return self.control or self.rule.name

    @property
    def command(self) -> str:
        """What reproduces this case."""
        parts = ["discmech", self.study, self.scene.name]
        if self.control is None:
            parts += ["--rule", self.rule.name]
        else:
            parts += ["--control", f'"{self.control}"']
        parts += ["--digits", str(self.digits)]
        if self.steps is not None:
            parts += ["--steps", str(self.steps)]
        return " ".join(parts)


@dataclass
class Verdict:
    """What `judge` says: a verdict, one sentence where it is no pass, what was expected."""

    verdict: str
    reason: str = ""
    expected: dict[str, Any] = field(default_factory=dict)


def silent(label: str, fraction: float) -> None:
    """No progress shown."""


def run_study(
    study: ModuleType, choice: Choice, progress: Progress = silent, *, keep: bool = False
) -> dict[str, Any]:
    """Measure and judge every case; the study's verdict is the worst of its cases'.

    With `keep`, finished cases are written down as they come, and a run that was interrupted goes
    on where it stopped (for scenes and rules known by name). Raises `BadInput` if no case of the
    study applies to what was chosen.
    """
    from .record import record

    begun = time.perf_counter()
    cases = list(study.cases(choice))
    if not cases:
        raise BadInput(
            f"the study {study.NAME} applies to none of the chosen scenes"
            + (f" ({', '.join(s.name for s in choice.scenes)})" if choice.scenes else "")
            + f": {study.NEEDS}"
        )
    from .journal import Journal

    journal = Journal(study.NAME, choice) if keep else None
    done = []
    for i, case in enumerate(cases):
        result = journal.find(case) if journal else None
        if result is None:
            result = run_case(study, case, _share(progress, i, len(cases)))
            if journal:
                journal.add(case, result)
        done.append(result)
    if journal:
        journal.close()
    return {
        "schema": SCHEMA,
        "study": study.NAME,
        "verdict": worst(c["verdict"] for c in done),
        "command": f"discmech {study.NAME}",
        "record": record(time.perf_counter() - begun, {"steps": choice.steps}),
        "cases": done,
    }


def run_case(study: ModuleType, case: Case, progress: Progress = silent) -> dict[str, Any]:
    """One case's result; a step that fails marks the case and is not raised."""
    begun = time.perf_counter()
    measurement: dict[str, Any] = {"measured": {}, "rows": []}
    from reference import ReferenceFailure

    try:
        measurement = study.measure(case, progress)
        verdict = study.judge(case, measurement)
    except StepFailure as failure:
        verdict = Verdict("fail", str(failure))
    except (CannotMeasure, ReferenceFailure) as failure:
        verdict = Verdict("inconclusive", str(failure))
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
        "seconds": time.perf_counter() - begun,
    }


def worst(verdicts: Iterable[str]) -> str:
    """The worst of some verdicts; inconclusive if there is none."""
    return min(verdicts, key=VERDICTS.index, default="inconclusive")


def plain_cases(study: str, choice: Choice, default_digits: Sequence[int]) -> list[Case]:
    """Every chosen scene by every chosen rule at every precision."""
    return [
        Case(study, scene, rule, digits, choice.steps)
        for digits in choice.digits or default_digits
        for scene, rule in choice.pairs()
    ]


def _share(progress: Progress, index: int, total: int) -> Progress:
    def inner(label: str, fraction: float) -> None:
        progress(label, (index + fraction) / total)

    return inner
