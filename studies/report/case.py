"""A result as it is shown: read from JSON once, so that tables, figures and the page have names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any, Generic, TypeVar

from ..core.outcome import VERDICTS, is_trouble
from ..core.records import decoded
from ..core.study import view_of

#: the default retraction, which names omit
USUAL_RETRACTION = "cayley"
NONE = "—"
NOT_AGAIN = (
    "by no command: its rule or its scene is no variable of a file, or has other values there"
)

Measured = TypeVar("Measured")
Expected = TypeVar("Expected")
Row = TypeVar("Row")
Kinds = tuple[type[Any], type[Any], type[Any]]


@dataclass(frozen=True, slots=True)
class Smallest:
    """The smallest case that fails as well: its command, and the parameters without effect."""

    scene: str = ""
    steps: int | None = None
    command: str = ""
    whatever: Sequence[str] = ()


@dataclass(frozen=True, slots=True)
class Made:
    """The date of a measurement, and the commit of the text that made it."""

    date: str | None = None
    commit: str | None = None
    clean: bool = False


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


@dataclass(frozen=True)
class Case(Generic[Measured, Expected, Row]):
    """The result of a case; `measured`, `expected` and `rows` are the records of its study's view.

    given: the dictionary of JSON. kinds: the types of those records; a plain mapping for a study
    that has none.
    """

    given: Mapping[str, Any] = field(default_factory=dict, repr=False)
    kinds: Kinds = field(default=(dict, dict, dict), repr=False)
    study: str = "unnamed"
    scene: str | None = None
    rule: str | None = None
    retraction: str | None = None
    digits: int = 16
    verdict: str = "inconclusive"
    reason: str = ""
    command: str = ""
    study_command: str = ""
    control: bool = False
    kind: str | None = None
    title: str | None = None
    label: str | None = None
    extreme: str | None = None
    periods: int | None = None
    duration: float | None = None
    floor: Any = None
    crossovers: Sequence[Crossing] = ()
    standing: Standing | None = None
    smallest: Smallest | None = None
    measured_at: Made = field(default_factory=Made)
    race: Race = field(default_factory=Race)

    @cached_property
    def measured(self) -> Measured:
        """The figures that were measured; numbers that are not finite are None."""
        return decoded(self.kinds[0], self.given.get("measured"), finite=True)

    @cached_property
    def expected(self) -> Expected:
        """The expectations of the judge."""
        return decoded(self.kinds[1], self.given.get("expected"), finite=True)

    @cached_property
    def rows(self) -> Sequence[Row]:
        """The runs or points of which the figures were made; empty if the run failed."""
        return [decoded(self.kinds[2], row, finite=True) for row in self.given.get("rows") or ()]

    @property
    def figures(self) -> Mapping[str, Any]:
        """The figures by the names that they have in JSON; empty if nothing could be measured."""
        return self.given.get("measured") or {}

    @property
    def wanted(self) -> Mapping[str, Any]:
        """The expectations of the judge, by the names of JSON."""
        return self.given.get("expected") or {}

    @property
    def counts(self) -> bool:
        """True if the result is one of ours: another program's does not count for us."""
        return self.kind != "peer"

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

        A control that is proven to be no fault is "equivalent".
        """
        if not self.control:
            return self.verdict
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


@dataclass(frozen=True)
class Result:
    """The result of a study, or of several together."""

    given: Mapping[str, Any] = field(repr=False)
    cases: Sequence[Case[Any, Any, Any]]
    study: str = "unnamed"
    verdict: str = "inconclusive"
    command: str = ""
    notes: Sequence[str] = ()
    tables: Sequence[Mapping[str, Any]] = ()
    record: Mapping[str, Any] = field(default_factory=dict)


AnyCase = Case[Any, Any, Any]
_OF_CASE, _OF_RESULT = ({one.name for one in fields(kind)} for kind in (Case, Result))


def case_of(study: str, given: Mapping[str, Any] | AnyCase) -> AnyCase:
    """Return the case of a dictionary of JSON; an unknown verdict counts as inconclusive."""
    if isinstance(given, Case):
        return given
    head = {key: value for key, value in given.items() if key in _HEAD and value is not None}
    view = view_of(study)
    made = decoded(Case, {**head, "study": study, "verdict": _verdict(given)}, finite=True)
    return replace(made, given=given, kinds=(view.measured, view.expected, view.row))


def result_of(given: Mapping[str, Any] | Result) -> Result:
    """Return the result of a dictionary of JSON; its cases may be of several studies."""
    if isinstance(given, Result):
        return given
    study = str(given.get("study") or "unnamed")
    cases = [case_of(str(case.get("study") or study), case) for case in given.get("cases") or ()]
    head = {key: value for key, value in given.items() if key in _OF_RESULT and value is not None}
    return Result(**{**head, "given": given, "cases": cases, "study": study,
                     "verdict": _verdict(given)})  # fmt: skip


def _verdict(given: Mapping[str, Any]) -> str:
    said = given.get("verdict")
    return str(said) if said in VERDICTS else "inconclusive"


_HEAD = _OF_CASE - {"given", "kinds", "study", "verdict"}
