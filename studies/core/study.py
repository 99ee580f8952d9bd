"""A study: one property of a method. All its texts, everywhere, come from this one object.

A user's own study is a subclass of `Study` in a file, or in a package that names it under the entry
point "discmech.studies". Those of the bench are folders beside this one (`StudyFolder`).
"""

from __future__ import annotations

import math
import re
import sys
import warnings
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from functools import cache, cached_property
from importlib import import_module
from importlib.metadata import entry_points
from importlib.util import find_spec
from pathlib import Path
from types import MappingProxyType, ModuleType
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

from .limits import filled_in, told
from .options import Option
from .outcome import Measurement, Verdict

if TYPE_CHECKING:
    from discmech.integrators.rules import Discretisation

    from .case import Case, Choice, Progress

Whole = TypeVar("Whole")  # the result of a study's cases, a `result.StudyResult`
#: suffix of the name of a rule whose steps were chosen for tolerances
BY_TOLERANCE = ", tolerance"
FOLDER = Path(__file__).resolve().parents[1]
OF_THE_BENCH = FOLDER.parent / "tests" / "bench"  # studies that test the bench itself
# the name of a study, and of a file that `discmech new` writes
NAME = r"[a-z][a-z0-9]*(-[a-z0-9]+)*"


class Study:
    """A property of a method: its words, the measured quantities of which cases, and their
    judgement.

    A user's own study needs `name` and `measure`, and `limits` or `judge`.

    title, about: the heading and a paragraph of its page. summary: a line of help; asks, measured,
    judged: the columns of docs/judged.md. place: its place in the report. digits: the precisions
    that are measured by default. limits: the numbers by name to which its judge holds measurements,
    which help, page and docs/verdicts.md show with their reasons (`Limit`); without a judge of its
    own, the largest value of each measured quantity in a case that passes. `judged` and `about` may
    name a limit in braces. example: the scene and the steps of the smallest case that says
    something, for tests. needs: a sentence with the reason why it may apply to nothing that was
    chosen. alone: it measures times, so its cases, or those that are `timed`, have the machine
    alone, except those that are compared with each other, run by run in turn (`together`).
    of_systems: its command takes scenes and rules. of_the_bench: it tests the bench itself, and no
    method. usual: it is asked of every method, and not only of one that claims something. turn:
    among the cases of a scheme, 0 is quick on scenes of any size, 2 waits for a reference.
    asks_for: the part of a system that it needs, one of `parts.PARTS`. claims: the claims that it
    judges, words of `claims.stated`.
    """

    name: str = ""
    title: str = ""
    summary: str = ""
    asks: str = ""
    measured: str = ""
    judged: str = ""
    about: str = ""
    place: float = 100
    alone: bool = False
    usual: bool = True
    claims: tuple[str, ...] = ()
    of_systems: bool = True
    of_the_bench: bool = False
    turn: int = 1
    asks_for: str = "equations"
    options: tuple[Option, ...] = ()
    digits: tuple[int, ...] = (16,)
    limits: Mapping[str, float] = MappingProxyType({})
    example: tuple[str, int] = ("pendulum", 100)
    is_study: ClassVar[bool] = True  # marks it for a user's file, which is read without this module

    @property
    def needs(self) -> str:
        """The reason why it may apply to nothing that was chosen."""
        return "no chosen rule can be used there."

    def lacks(self, choice: Choice) -> str:
        """Return why it applies to nothing chosen: what rules say, each once, or else `needs`."""
        said = {rule: rule.unmeasured(self.name) for rule in choice.rules}
        if not said or not all(said.values()):
            return self.needs
        alike = Counter(reason.replace(rule.name, "") for rule, reason in said.items())
        first = {reason.replace(r.name, ""): reason for r, reason in reversed(said.items())}
        return " ".join(f"{first[of]} So of {n - 1} other rules." if n > 1 else first[of]
                        for of, n in alike.items())  # fmt: skip

    def with_limits(self, words: str) -> str:
        """Return its `judged` or `about` with the values of the limits that the text names."""
        return filled_in(words, self.limits)

    def told_limits(self) -> list[tuple[str, str, str, str]]:
        """Return (name, what, value, reason) of each limit."""
        return told(self.limits)

    @cached_property
    def view(self) -> Any:
        """The columns that show its numbers, a `report.view.View`."""
        return _plain_view()

    def cases(self, choice: Choice) -> list[Case]:
        """Return the cases of a choice: every scene with every rule at every precision."""
        from discmech.integrators.scenes import all_scenes

        from .case import lattice_cases, plain_cases

        own = self._own(replace(choice, scenes=choice.scenes or tuple(all_scenes())))
        cases = plain_cases(self.name, own, self.digits) if own.scenes else []
        if own.scenes and self.asks_for != "equations":
            cases += lattice_cases(self.name, own)
        return [c for c in cases if self._of(c)]

    def measure(self, case: Case, progress: Progress) -> Mapping[str, Any]:
        """Return the numbers of a case, {"measured": {name: number}, "rows": [{...}]}, without
        verdict.

        Numbers have the case's digits while it runs.
        """
        raise NotImplementedError

    def judge(self, case: Case, measurement: Measurement) -> Verdict:
        """Judge the numbers without measuring: by default, none may be above its limit."""
        return _within_limits(self, measurement.measured)

    def measurement(self, case: Case, progress: Progress) -> Measurement:
        """Return `measure`, checked: a function of a user's file may return anything.

        Raises `BadInput`, with the line, for an error in it and for entries that are not numbers.
        """
        from .own_study import measured_by

        return measured_by(self, case, progress)

    def verdict(self, case: Case, measurement: Measurement) -> Verdict:
        """Return `judge`, checked in the same way."""
        from .own_study import judged_by

        return judged_by(self, case, measurement)

    def trouble(self) -> str:
        """Return why it cannot be used, without a full stop; "" if it can."""
        if not isinstance(self.name, str) or not re.fullmatch(NAME, self.name):
            return f"its name is {self.name!r}: use small letters, digits and dashes between them"
        if type(self).measure is Study.measure:
            return f"{self.name} has no measure(self, case, progress)"
        return ""

    def clash(self) -> str:
        """Return why its name cannot be a file's study's, without a full stop; "" if it can."""
        taken = every_study().get(self.name, self) is not self
        return f"the name {self.name} is taken; choose another name" if taken else ""

    def timed(self, case: Case) -> bool:
        """True if a case measures times, so that the machine counts."""
        return self.alone and bool(self._hook("timed", True, case))

    def together(self, case: Case) -> Any:
        """Return the key of a race, whose cases one process measures; None for a single case."""
        return self._hook("together", None, case)

    def before_race(self, kept: Mapping[Case, Measurement]) -> None:
        """Take the stored measurements of a race, before its other cases are measured."""
        self._hook("before_race", None, kept)

    def measure_more(
        self, case: Case, measurement: Measurement, said: Verdict
    ) -> Mapping[str, Any]:
        """Return further measurements that are made only if the first verdict is not a pass."""
        return {}

    @property
    def measures_more(self) -> bool:
        """True if it may measure more after a first verdict that is not a pass."""
        return type(self).measure_more is not Study.measure_more

    def diagnose(self, case: Case, measurement: Measurement) -> Mapping[str, Any] | None:
        """Return the cause of a verdict that is not a pass, if it can be found."""
        return None

    @property
    def tells_causes(self) -> bool:
        """True if it seeks the cause of a verdict that is not a pass."""
        return type(self).diagnose is not Study.diagnose

    def depends_on(self, case: Case) -> str:
        """Return the text on which a result depends beside the case's scene, rule and command."""
        return str(self._hook("depends_on", "", case))

    def rules_beside(self, case: Case) -> list[Discretisation]:
        """Return the bench's own rules that it measures beside the case's."""
        return list(self._hook("rules_beside", [], case))

    def notes(self, choice: Choice) -> list[str]:
        """Return sentences about the whole study for the chosen systems."""
        return list(self._hook("notes", [], self._own(choice)))

    def completed(self, result: Whole) -> Whole:
        """Return the result of all cases, with entries about them together."""
        completed: Whole = self._hook("complete", result, result)
        return completed

    def _hook(self, name: str, otherwise: Any, *arguments: Any) -> Any:
        """Return what a function of that name in its folder answers; a class has methods."""
        return otherwise

    def _own(self, choice: Choice) -> Choice:
        """Return the choice without systems that lack the part that this study asks for."""
        from .parts import parts_of

        scenes = tuple(s for s in choice.scenes if self.asks_for in parts_of(s))
        return replace(choice, scenes=scenes)

    def _of(self, case: Case) -> bool:
        from .parts import parts_of

        has = self.asks_for in parts_of(case.scene)
        return has and not case.rule.unmeasured(self.name)


class StudyFolder(Study):
    """A study of the bench: a folder of `studies/`, whose `__init__` has its words and loads
    nothing.

    package: the folder's import name. `measuring` there has `NEEDS`, `cases(choice)` and
    `measure(case, progress)`, and may have functions named as other methods of `Study`, and
    `complete(result)`. `judging` has `judge(case, measurement)` and, if it finds causes,
    `diagnose(case, measurement)`, of a lattice `diagnose_lattice(case)`: a change there measures
    nothing anew. `view`, if there is one, has `VIEW`.
    """

    def __init__(self, *, package: str, **words: Any) -> None:
        if unknown := words.keys() - Study.__annotations__.keys():
            raise TypeError(f"{package}: a study has no {', '.join(sorted(unknown))}.")
        self.package = package
        vars(self).update(words)

    @cached_property
    def measuring(self) -> ModuleType:
        """The module that measures."""
        return import_module(f"{self.package}.measuring")

    @cached_property
    def judging(self) -> ModuleType:
        """The module that judges and finds causes; without one, the module that measures."""
        name = f"{self.package}.judging"
        return self.measuring if find_spec(name) is None else import_module(name)

    @property
    def needs(self) -> str:
        return str(self.measuring.NEEDS)

    @cached_property
    def view(self) -> Any:
        """The columns that show its numbers, a `report.view.View`."""
        if find_spec(f"{self.package}.view") is None:
            return _plain_view()
        return import_module(f"{self.package}.view").VIEW

    def cases(self, choice: Choice) -> list[Case]:
        """Return the cases of a choice, of systems with the part it asks for (`parts.PARTS`)."""
        own = self._own(choice) if choice.scenes else choice
        if choice.scenes and not own.scenes:
            return []
        return [c for c in self.measuring.cases(own) if self._of(c)]

    def measure(self, case: Case, progress: Progress) -> Measurement:
        """Return the numbers of a case: {"measured": {...}, "rows": [...], ...}."""
        return Measurement.of(self.measuring.measure(case, progress))

    measurement = measure

    def judge(self, case: Case, measurement: Measurement) -> Verdict:
        """Judge the numbers without measuring."""
        verdict: Verdict = self.judging.judge(case, Measurement.of(measurement))
        return verdict

    verdict = judge

    def diagnose(self, case: Case, measurement: Measurement) -> Mapping[str, Any] | None:
        from .parts import parts_of

        if "sites" in parts_of(case.scene):  # others are found in the equations of a scene
            of_lattice: Any = getattr(self.judging, "diagnose_lattice", None)
            return of_lattice(case) if of_lattice else None
        from .parasitic import parasitic

        if (told := parasitic(case)) is not None or not self.tells_causes:
            return told
        cause: Mapping[str, Any] | None = self.judging.diagnose(case, measurement)
        return cause

    @property
    def tells_causes(self) -> bool:
        return hasattr(self.judging, "diagnose")

    def measure_more(
        self, case: Case, measurement: Measurement, said: Verdict
    ) -> Mapping[str, Any]:
        numbers: Mapping[str, Any] = self.measuring.measure_more(case, measurement, said)
        return numbers

    @property
    def measures_more(self) -> bool:
        return hasattr(self.measuring, "measure_more")

    def _hook(self, name: str, otherwise: Any, *arguments: Any) -> Any:
        told = getattr(self.measuring, name, None)
        return otherwise if told is None else told(*arguments)


def _within_limits(study: Study, measured: Mapping[str, Any]) -> Verdict:
    expected = {"limits": dict(study.limits)}
    if not study.limits:
        said = f"the study {study.name} has no limits and no judge(), so nothing can fail."
        return Verdict("inconclusive", said, expected)
    values = {name: measured.get(name) for name in study.limits}
    known = {n: value for n, value in values.items() if value is not None and math.isfinite(value)}
    above = [name for name, value in known.items() if value > study.limits[name]]
    said = " and ".join(f"{n} is {known[n]:.3g}, above {study.limits[n]:.3g}" for n in above)
    if above:
        return Verdict("fail", f"{said}.", expected)
    if lost := [name for name in values if name not in known]:
        said = f"{' and '.join(lost)} could not be measured."
        return Verdict("inconclusive", said, expected)
    return Verdict("pass", "", expected)


@cache
def every_study() -> dict[str, Study]:
    """Return all studies by name, in the order of the report: of folders, then of packages."""
    studies = {}
    for folder, package in ((FOLDER, _PARENT), (OF_THE_BENCH, f"{_ROOT}.tests.bench")):
        for file in sorted(folder.glob("*/__init__.py")):
            if "STUDY" in file.read_text(encoding="utf-8"):
                study = import_module(f"{package}.{file.parent.name}").STUDY
                studies[study.name] = study
    for point in entry_points(group="discmech.studies"):
        try:
            study = point.load()
            trouble = refusal(study) or (
                f"the name {study.name} is taken" * (study.name in studies)
            )
        except Exception as error:  # any error of another package that is loaded
            trouble = f"{type(error).__name__}: {error}"
        if trouble:
            whose = f"the study {point.value} of another package is left out"
            warnings.warn(f"{whose}: {trouble}.", stacklevel=2)
        else:
            studies[study.name] = study
    return dict(sorted(studies.items(), key=lambda item: (item[1].place, item[0])))


def judging(scene: Any) -> str:
    """Return the commands of the studies that judge a scene or a lattice."""
    from .parts import parts_of

    parts = parts_of(scene)
    return ", ".join(f"`discmech {s.name}`" for s in every_study().values()
                     if s.usual and s.asks_for in parts)  # fmt: skip


def refusal(study: Any) -> str:
    """Return why an object can be no study, without a full stop; "" if it can be one."""
    if isinstance(study, Study):
        return study.trouble()
    made = isinstance(study, type) and issubclass(study, Study)
    return f"it is the class: give {study.__name__}()" if made else "it is no Study"


def known_study(name: str) -> Study | None:
    """Return the study of that name: one of all, or of a user's file that was loaded."""
    study = every_study().get(name)
    files = sys.modules.get(f"{_PARENT}.core.userfile")  # otherwise no file was loaded
    for file in files.loaded() if study is None and files is not None else ():
        study = file.studies.get(name, study)
    return study


def view_of(name: str) -> Any:
    """Return the view of the study of that name; a plain one if it is unknown."""
    study = known_study(name)
    return _plain_view() if study is None else study.view


_PARENT = __name__.rpartition(".core.")[0]
_ROOT = _PARENT.rpartition(".")[0]


def _plain_view() -> Any:
    return import_module(f"{_PARENT}.report.view").View()
