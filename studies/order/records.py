"""The records of orders: of a ladder of runs, and of single steps."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from discmech.integrators.numbers import exact
from discmech.integrators.numbers.types import Exact

from ..core.records import OPTIONAL
from ..core.single_steps import SingleSteps

#: the cause of a failed run whose end is too far away for a number, or is none
BLEW_UP = "it blew up: its error is no finite number"


@dataclass(frozen=True, slots=True)
class Row:
    """A run of the ladder, with its errors relative to the state; without them it failed.

    why_not: the reason why it is not in the fit. multipliers: their error, not a number if a step
    back fails. round_off: that of the run, if it was measured.
    """

    steps: int = 0
    step: float = 0.0
    error: float | None = None
    error_x: float | None = None
    error_mu: float | None = None
    used: bool = False
    why_not: str = ""
    cause: str | None = field(default=None, metadata=OPTIONAL)
    multipliers: float | None = field(default=None, metadata=OPTIONAL)
    round_off: float | None = field(default=None, metadata=OPTIONAL)

    def with_errors(self, error: float | None, of_x: float | None, of_mu: float | None) -> Row:
        """Return the row with the errors of (x, μ), of x and of μ."""
        if error is not None and not math.isfinite(error):
            return replace(self, why_not="failed", cause=BLEW_UP)
        return replace(self, error=error, error_x=of_x, error_mu=of_mu)


@dataclass(frozen=True, slots=True)
class Measured:
    """The slope of the window with its interval, of so many points.

    multipliers: the slope of their errors, not a number without one. why_not: the reason why no
    other method knows the end, so that errors are against own runs (`held_against`), and the digits
    that are known then. effective: the processed order, which the judge adds.
    """

    order: float | None = None
    interval: Sequence[float] | None = None
    points: int | None = None
    multipliers: float | None = field(default=None, metadata=OPTIONAL)
    held_against: str | None = field(default=None, metadata=OPTIONAL)
    why_not: str | None = field(default=None, metadata=OPTIONAL)
    known: float | None = field(default=None, metadata=OPTIONAL)
    effective: float | None = field(default=None, metadata=OPTIONAL)


@dataclass(frozen=True, slots=True)
class Found:
    """The runs, the digits of the reference that are certain, and single steps.

    agreed: the digits in which two references of a scene in numbers agree. duration: the final
    time of the runs; whole: that of the scene, if it is later. grown: how many times larger the
    motion makes a change of its start up to the last row of recorded runs.
    """

    rows: Sequence[Row] = ()
    measured: Measured = field(default_factory=Measured)
    certain: float = 0.0
    agreed: float | None = field(default=None, metadata=OPTIONAL)
    local: SingleSteps | None = None
    duration: float = 0.0
    grown: float | None = field(default=None, metadata=OPTIONAL)
    whole: float | None = field(default=None, metadata=OPTIONAL)

    @property
    def trusted(self) -> float:
        """The digits of the reference that are certain, and above a program's own floor."""
        share = self.local.share if self.local else 0.0
        return min(self.certain, -math.log10(share)) if share else self.certain


@dataclass(frozen=True, slots=True)
class Expected:
    """The expected order and its tolerance; declared: the order in another chart.

    or_above: True if the order is claimed for all values of a number, and may be higher at one.
    """

    order: float | None = None
    tolerance: float | None = None
    declared: float | None = None
    effective: float | None = None
    or_above: bool | None = field(default=None, metadata=OPTIONAL)


# -- a number that takes several values ------------------------------------------------------------

#: mine:w=1/6 or mine:w=sqrt(3)/6 of a rule, mine.w-1_6 of a scene
_NAME = re.compile(
    r"(.+)[:.]([a-zA-Z]\w*)[=-](-?\d+(?:[./_]\d+)?(?:e[-+]?\d+)?|[^:=,]*sqrt[^:=,]*)"
)
FEWEST = 2  # values that can be compared
FEWEST_DRAWN = 3  # values of which a curve is drawn: two are rules like others


def is_of_a_value(name: str) -> bool:
    """True for the name of a rule or a scene with a value for one of its numbers."""
    return _NAME.fullmatch(name) is not None


def constant(rows: Sequence[Any], order: float | None) -> float | None:
    """Return C of error ≈ C hᵖ by the smallest step of the fit, p the order as a whole number."""
    used = [row for row in rows if row.used and row.error and row.step]
    if order is None or not used:
        return None
    last = min(used, key=lambda row: abs(row.step))
    return float(last.error / abs(last.step) ** round(order))


@dataclass(frozen=True)
class Curve:
    """The cases with the values of one number, in their order; of: the rule or scene that has it.

    place: the other one of the two.
    """

    of: str
    name: str
    place: str
    digits: int
    cases: Sequence[tuple[Exact, Any]]

    @property
    def usual(self) -> int:
        """The order that most values have."""
        return Counter(round(case.measured.order) for _, case in self.cases).most_common(1)[0][0]

    @property
    def best(self) -> tuple[Exact, Any]:
        """The value with the highest order and, of these, the least error constant."""
        return max(self.cases, key=lambda pair: (
            round(pair[1].measured.order),
            -(constant(pair[1].rows, pair[1].measured.order) or 0.0)))  # fmt: skip

    @property
    def is_flat(self) -> bool:
        """True if all values have the same order and constant, to the digits that are shown."""
        shown = {(round(case.measured.order), _shown(case)) for _, case in self.cases}
        return len(shown) == 1

    @property
    def end(self) -> float:
        """The final time of the shortest of the runs."""
        return float(min(case.details.duration or 0.0 for _, case in self.cases))

    @property
    def sentence(self) -> str:
        """What the curve says, in a sentence."""
        value, case = self.best
        names = (_NAME.fullmatch(str(name)) for name in (case.named or case.rule, case.scene))
        written = next((name[3].replace("_", "/") for name in names if name), str(value))
        order = round(case.measured.order)
        where = f"{self.of} on {self.place}, {self.digits} digits:"
        if self.is_flat:
            return (f"{where} {self.name} makes no difference, as all of {len(self.cases)} values "
                    f"have the order {order} and the error constant {_shown(case)}"
                    f"{to_time(case)}.")  # fmt: skip
        same = sum(round(each.measured.order) == order for _, each in self.cases)
        rest = len(self.cases) - same
        said = f"has the order {order}"
        if rest:
            said += (
                f", which {same} of them {'has' if same == 1 else 'have'}, and most of the others"
            )
            said += f" {self.usual}" if self.usual != order else " less"
        ends = value in (self.cases[0][0], self.cases[-1][0])
        beyond = "It is an end of the range: beyond it may be a better one." if ends else ""
        if len(self.cases) == 2:
            beyond = "Two values are no range: others may be better."
        if same > 1 and self.digits > 16 and case.details.whole:  # the constant decides
            beyond += (
                f" This is so{to_time(case)}; another may be the best later in the run, which ends "
                f"at t = {case.details.whole:.4g}: ask with --digits 16."
            )
        best = (
            f"of {len(self.cases)} values of {self.name} the best, {self.name} = {written}, {said}"
        )
        size = f"its error constant is {_shown(case)}{to_time(case)}"
        return f"{where} {best}; {size}. {beyond.strip()}".rstrip()


def _shown(case: Any) -> str:
    """Return the error constant of a case as it is shown."""
    return f"{constant(case.rows, case.measured.order):.3g}"


def to_time(case: Any) -> str:
    """Return the final time of the runs, of which an error is, for a text."""
    end = case.details.duration
    return "" if end is None else f" at t = {end:.4g}"


def sentences(cases: Iterable[Any]) -> list[str]:
    """Return what the curves say; of one at several precisions, the one of the longest runs."""
    longest: dict[tuple[str, str, str], Curve] = {}
    for curve in curves(cases):
        key = curve.of, curve.name, curve.place
        if key not in longest or curve.end > longest[key].end:
            longest[key] = curve
    return [curve.sentence for curve in longest.values()]


def curves(cases: Iterable[Any]) -> list[Curve]:
    """Return the curves of an order study's cases, each of at least `FEWEST` values.

    A label of a rule stands in the titles alone: values are read off its name.
    """
    groups: dict[tuple[str, str, str, int], list[tuple[Exact, Any]]] = {}
    titles: dict[str, str] = {}
    for case in cases:
        rule, label = case.named or case.rule, _NAME.fullmatch(str(case.rule))
        for name, place in ((rule, case.scene), (case.scene, case.rule)):
            varied = _NAME.fullmatch(str(name))
            if varied and case.measured.order is not None:
                if name is rule and label:
                    titles[varied[1]] = label[1]
                key = (varied[1], varied[2], str(place), case.digits)
                groups.setdefault(key, []).append((exact(varied[3].replace("_", "/"), name), case))
    return [
        Curve(titles.get(of, of), name, place, digits, sorted(pairs, key=lambda pair: pair[0]))
        for (of, name, place, digits), pairs in groups.items() if len(pairs) >= FEWEST
    ]  # fmt: skip
