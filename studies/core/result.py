"""The result of a case and of a study, read by attributes; JSON has its writer and reader here."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any, Generic, TypeVar

from .outcome import VERDICTS, Made, is_trouble
from .records import HIDDEN, OPTIONAL, SPREAD, Json, decoded, encoded
from .study import view_of

#: version of saved and written results: another one where keys of JSON mean something else or go
SCHEMA = 2
#: the default retraction, which names omit
USUAL_RETRACTION = "cayley"
NONE = "—"
NOT_AGAIN = (
    "by no command: its rule or its scene is no variable of a file, or has other values there"
)

Measured = TypeVar("Measured")
Expected = TypeVar("Expected")
Row = TypeVar("Row")


@dataclass(frozen=True, slots=True)
class Smallest:
    """The smallest case that fails as well: its command, and the parameters without effect."""

    scene: str = ""
    steps: int | None = None
    command: str = ""
    reason: str = ""
    whatever: Sequence[str] = ()


@dataclass(frozen=True, slots=True)
class Race:
    """The race in which a method was timed: its date and all its methods."""

    date: str | None = None
    names: Sequence[str] = field(default=(), metadata={"key": "with"})


@dataclass(frozen=True, slots=True)
class Crossing:
    """The error and the work at which the fastest methods of two kinds change places."""

    error: float = 0.0
    work: float = 0.0


@dataclass(frozen=True, slots=True)
class Standing:
    """The kind of method that is faster at the accuracies that both reach; `sure` if at each."""

    leader: str | None = None
    loosest: float = 0.0
    tightest: float = 0.0
    sure: bool = False


@dataclass(frozen=True, slots=True)
class Details:
    """What some studies tell of a case beside its numbers: the extras of a measurement that are
    shown.
    """

    kind: str | None = None
    periods: int | None = None
    duration: float | None = None
    whole: float | None = None
    floor: Any = None
    crossovers: Sequence[Crossing] = ()
    standing: Standing | None = None
    race: Race = field(default_factory=Race)
    label: str | None = None
    title: str | None = None
    extreme: str | None = None
    slice: Any = None
    local: Any = None
    left_out_step: float | None = None


DETAILS = tuple(one.name for one in fields(Details))


@dataclass(frozen=True)
class Result(Generic[Measured, Expected, Row]):
    """The result of a case: what was measured and expected, and the verdict.

    figures, wanted, data, extras: the figures that were measured, the expectations of the judge,
    the runs or points of which the figures were made, and what else is shown, each by the names
    that it has in JSON. `measured`, `expected`, `rows` and `details` are the same as records, the
    first three as those of the study's view (mappings if it has none), where numbers that are not
    finite are None. why: in a few fixed words what decides, if single steps alone do, or how errors
    run. study_command: the command of all cases of the study; named: the name of the rule in a
    figure, where `rule` is its label; remembered: True if the case was
    measured by an earlier run.
    """

    study: str = field(default="unnamed", metadata=HIDDEN)
    scene: str | None = None
    rule: str | None = None
    retraction: str | None = None
    digits: int = 16
    verdict: str = "inconclusive"
    reason: str = ""
    command: str = ""
    control: bool = False
    wanted: Json = field(default_factory=dict, metadata={"key": "expected"})
    figures: Json = field(default_factory=dict, metadata={"key": "measured"})
    data: Sequence[Json] = field(default=(), metadata={"key": "rows"})
    extras: Json = field(default_factory=dict, metadata=SPREAD)
    diagnosis: Json | None = field(default=None, metadata=OPTIONAL)
    unusable: bool | None = field(default=None, metadata=OPTIONAL)
    why: str | None = field(default=None, metadata=OPTIONAL)
    seconds: float = 0.0
    measured_at: Made = field(default_factory=Made)
    smallest: Smallest | None = field(default=None, metadata=OPTIONAL)
    study_command: str = field(default="", metadata=HIDDEN)
    named: str | None = field(default=None, metadata=HIDDEN)
    remembered: bool = field(default=False, metadata=HIDDEN)

    @cached_property
    def measured(self) -> Measured:
        """The figures as the record of the study's view."""
        return decoded(view_of(self.study).measured, self.figures, finite=True)

    @cached_property
    def expected(self) -> Expected:
        """The expectations as the record of the study's view."""
        return decoded(view_of(self.study).expected, self.wanted, finite=True)

    @cached_property
    def rows(self) -> Sequence[Row]:
        """The runs or points as records of the study's view; empty if the run failed."""
        kind = view_of(self.study).row
        return [decoded(kind, row, finite=True) for row in self.data]

    @cached_property
    def details(self) -> Details:
        """What the study tells of the case beside its numbers."""
        return decoded(Details, self.extras, finite=True)

    @property
    def counts(self) -> bool:
        """True if the result is one of ours: another program's does not count for us."""
        return self.extras.get("kind") != "peer"

    @property
    def passed(self) -> bool:
        """True for a pass."""
        return self.verdict == "pass"

    @property
    def is_trouble(self) -> bool:
        """True for a verdict that somebody has to look at: a fail, or an inconclusive one."""
        return is_trouble(self.verdict)

    @property
    def again(self) -> str:
        """The command that measures the case again, or why there is none."""
        return self.command or NOT_AGAIN

    @property
    def word(self) -> str:
        """The verdict; of a control, which passes if the fault was caught, whether it was.

        A control that is proven to be no fault is "equivalent". A peer's verdict is marked.
        """
        if not self.control:
            return self.verdict if self.counts else f"{self.verdict} (peer)"
        if self.figures.get("equivalent"):
            return "equivalent"
        return {"pass": "caught", "fail": "missed"}.get(self.verdict, "inconclusive")

    @property
    def in_unusual_chart(self) -> bool:
        """True if the case runs in another chart than the default one of groupoids."""
        return self.retraction not in (None, USUAL_RETRACTION)

    @property
    def method(self) -> str:
        """The rule, with the retraction if it is not the usual one."""
        rule = self.rule or NONE
        return f"{rule}, {str(self.retraction)[:3]}" if self.in_unusual_chart else rule

    @property
    def name(self) -> str:
        """A name such as: heavy-top, midpoint, cayley, 16 digits."""
        named = ", ".join(filter(None, (self.scene, self.rule, self.retraction)))
        return f"{named}, {self.digits} digits" if self.digits else named

    def to_json(self) -> dict[str, Any]:
        """Return the dictionary that is written."""
        return dict(encoded(self))


AnyResult = Result[Any, Any, Any]


@dataclass(frozen=True)
class StudyResult:
    """The results of a study's cases, or of several studies' together.

    record: machine, versions and settings. remembered: the number of cases that an earlier run
    measured. baseline: the comparison with an earlier result (`baseline.Comparison`); asked: the
    scenes' values, where results are compared (`baseline.asked_of`). schemes,
    proofs, comparison, advice: what `verify` and `compare` add; more: what a study says of all its
    cases.
    """

    schema: int = SCHEMA
    study: str = "unnamed"
    verdict: str = "inconclusive"
    command: str = ""
    record: Json = field(default_factory=dict)
    remembered: int = 0
    notes: Sequence[str] = ()
    cases: Sequence[AnyResult] = ()
    tables: Sequence[Json] | None = field(default=None, metadata=OPTIONAL)
    schemes: Sequence[Json] | None = field(default=None, metadata=OPTIONAL)
    proofs: Sequence[Json] | None = field(default=None, metadata=OPTIONAL)
    comparison: Sequence[Json] | None = field(default=None, metadata=OPTIONAL)
    advice: Sequence[Json] | None = field(default=None, metadata=OPTIONAL)
    baseline: Any = field(default=None, metadata=OPTIONAL)
    asked: Mapping[str, Mapping[str, str]] | None = field(default=None, metadata=OPTIONAL)
    more: Json = field(default_factory=dict, metadata=SPREAD)

    def to_json(self) -> dict[str, Any]:
        """Return the dictionary that is written; a case of another study names it."""
        made = dict(encoded(replace(self, cases=())))
        cases = [{"study": one.study, **one.to_json()} if one.study != self.study else one.to_json()
                 for one in self.cases]  # fmt: skip
        return made | {"cases": cases}


def result_of(study: str, entries: Json) -> AnyResult:
    """Return the result of a case from the dictionary that is written."""
    made: AnyResult = _read(Result, entries)
    return replace(made, study=study)


def study_result_of(entries: Json) -> StudyResult:
    """Return the result of a study from the dictionary that is written."""
    made: StudyResult = _read(StudyResult, entries)
    cases = entries.get("cases") or ()
    return replace(made, cases=[result_of(str(one.get("study") or made.study), one)
                                for one in cases])  # fmt: skip


def _read(kind: type[Any], entries: Json) -> Any:
    """Return the record, without entries that are null; an unknown verdict is inconclusive."""
    said = entries.get("verdict")
    known = {key: value for key, value in entries.items() if value is not None}
    return decoded(kind, known | {"verdict": said if said in VERDICTS else "inconclusive"})
