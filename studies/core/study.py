"""A study: one property of a method. All that is said of it, anywhere, comes from this one object.

A study is a folder beside this one. Its `__init__` says what it is (`STUDY`) and loads nothing;
`measuring` has `NEEDS`, `cases(choice)`, `measure(case, progress)` → numbers and
`judge(case, measurement)` → verdict, and may have `diagnose(case, measurement)`,
`notes(choice)`, `depends_on(case)`, `rules_beside(case)`, `timed(case)`, `together(case)` and
`complete(result)`;
`view`, where there is one, has `VIEW`: how its numbers are shown.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache, cached_property
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from .options import Option

if TYPE_CHECKING:
    from discmech.integrators.rules import Discretisation

    from .case import Case, Choice, Progress, Verdict

#: behind the name of a rule whose steps were chosen for tolerances
BY_TOLERANCE = ", tolerance"
FOLDER = Path(__file__).resolve().parents[1]


@dataclass(frozen=True)
class Study:
    """What a study is, in words, and what it needs.

    package: its folder's import name. place: where it comes in the report. summary: a line of help;
    asks: the README's question; measured, judged: the columns of docs/judged.md; about: a
    paragraph of the report. alone: it takes times,
    so its cases, or those that are `timed`, have the machine for themselves, but for those that
    are compared with each other, run by run in turn (`together`). usual: it is a command
    that takes scenes and rules; the others are about the bench itself, or are measured for an
    assertion alone. turn: among the cases of a scheme, 0 is quick on scenes of any size, 2 waits
    for a reference.
    """

    name: str
    package: str
    place: float
    title: str
    summary: str
    asks: str
    measured: str
    judged: str
    about: str
    alone: bool = False
    usual: bool = True
    turn: int = 1
    options: tuple[Option, ...] = ()

    @cached_property
    def measuring(self) -> ModuleType:
        """The module that measures and judges."""
        return import_module(f"{self.package}.measuring")

    @property
    def needs(self) -> str:
        """Why it may apply to nothing that was chosen."""
        return str(self.measuring.NEEDS)

    @cached_property
    def view(self) -> Any:
        """How its numbers are shown: a `report.view.View`."""
        if find_spec(f"{self.package}.view") is None:
            return _plain_view()
        return import_module(f"{self.package}.view").VIEW

    def cases(self, choice: Choice) -> list[Case]:
        """The cases of a choice; scenes that one study alone judges (`case.APART`) are its own."""
        case = import_module(f"{_PARENT}.core.case")
        own = self.name if self.name in case.APART else ""
        scenes = tuple(s for s in choice.scenes if case.judged_alone(s) == own)
        if choice.scenes and not scenes:
            return []
        cases = self.measuring.cases(replace(choice, scenes=scenes))
        return [found for found in cases if found.rule.measured_by(self.name)]

    def timed(self, case: Case) -> bool:
        """Whether a case takes times, so that the machine counts."""
        told = getattr(self.measuring, "timed", None)
        return self.alone and (told is None or bool(told(case)))

    def together(self, case: Case) -> Any:
        """What one process has to measure with other cases, as a race; None if it is no part."""
        told = getattr(self.measuring, "together", None)
        return None if told is None else told(case)

    def measure(self, case: Case, progress: Progress) -> dict[str, Any]:
        """The numbers of a case: {"measured": {...}, "rows": [...], ...}."""
        return dict(self.measuring.measure(case, progress))

    def judge(self, case: Case, measurement: dict[str, Any]) -> Verdict:
        """What the numbers mean; no measuring."""
        verdict: Verdict = self.measuring.judge(case, measurement)
        return verdict

    def diagnose(self, case: Case, measurement: dict[str, Any]) -> dict[str, Any] | None:
        """The cause of what did not pass, where one can be told."""
        told = getattr(self.measuring, "diagnose", None)
        return None if told is None else told(case, measurement)

    @property
    def tells_causes(self) -> bool:
        """Whether it looks for the cause of what did not pass."""
        return hasattr(self.measuring, "diagnose")

    def depends_on(self, case: Case) -> str:
        """What a result depends on beside the case's scene, rule and command."""
        told = getattr(self.measuring, "depends_on", None)
        return "" if told is None else str(told(case))

    def rules_beside(self, case: Case) -> list[Discretisation]:
        """The bench's own rules that it is measured with beside the case's."""
        told = getattr(self.measuring, "rules_beside", None)
        return [] if told is None else list(told(case))

    def notes(self, choice: Choice) -> list[str]:
        """What is to be said of the whole study, of the chosen systems that it is for."""
        from .case import judged_alone

        said = getattr(self.measuring, "notes", None)
        own = tuple(e for e in choice.scenes if judged_alone(e) in ("", self.name))
        return [] if said is None else list(said(replace(choice, scenes=own)))

    def completed(self, result: dict[str, Any]) -> dict[str, Any]:
        """The result of all cases, with what is said of them together."""
        told = getattr(self.measuring, "complete", None)
        return result if told is None else {**result, **told(result)}


def counts(case: Mapping[str, Any]) -> bool:
    """Whether a result is one of ours: what somebody else's integrator does says nothing of us."""
    return case.get("kind") != "peer"


@cache
def every_study() -> dict[str, Study]:
    """All studies by name, in the order of the report: whatever folder says that it is one."""
    found = []
    for file in sorted(FOLDER.glob("*/__init__.py")):
        if "STUDY" in file.read_text(encoding="utf-8"):
            found.append(import_module(f"{_PARENT}.{file.parent.name}").STUDY)
    return {study.name: study for study in sorted(found, key=lambda s: (s.place, s.name))}


def view_of(name: str) -> Any:
    """How the numbers of the study of that name are shown; of an unknown one, plainly."""
    study = every_study().get(name)
    return _plain_view() if study is None else study.view


_PARENT = __name__.rpartition(".core.")[0]


def _plain_view() -> Any:
    return import_module(f"{_PARENT}.report.view").View()
