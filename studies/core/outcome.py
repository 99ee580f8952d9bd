"""What was measured of a case, what that means, and both together: frozen, and JSON at the edge."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .case import Case

VERDICTS = ("fail", "inconclusive", "pass")  # worst first
#: what a study may say of a case beside `measured` and `rows`, and is shown
DETAILS = (
    "kind", "periods", "duration", "floor", "crossovers", "label", "title", "extreme", "slice",
    "unusable", "diagnosis", "local", "left_out_step",
)  # fmt: skip
Row = Mapping[str, Any]


@dataclass(frozen=True)
class Measurement(Mapping[str, Any]):
    """The numbers of a case, without a verdict.

    measured: figures by name; rows: the runs or points that they were made of; extras: by name what
    else the judge or a view asks for. As a mapping it is what JSON has of it: {"measured", "rows",
    **extras}.
    """

    measured: Mapping[str, Any] = field(default_factory=dict)
    rows: Sequence[Row] = ()
    extras: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def of(cls, given: Mapping[str, Any]) -> Measurement:
        """What JSON has of one."""
        if isinstance(given, Measurement):
            return given
        extras = {key: value for key, value in given.items() if key not in ("measured", "rows")}
        return cls(given.get("measured", {}), given.get("rows", []), extras)

    def with_extras(self, **more: Any) -> Measurement:
        """The same with more, or other, extras."""
        return replace(self, extras={**self.extras, **more})

    def __getitem__(self, key: str) -> Any:
        own = {"measured": self.measured, "rows": self.rows}
        return own[key] if key in own else self.extras[key]

    def __iter__(self) -> Iterator[str]:
        yield from ("measured", "rows", *self.extras)

    def __len__(self) -> int:
        return 2 + len(self.extras)


@dataclass(frozen=True)
class Verdict:
    """What `judge` says: a verdict, one sentence where it is no pass, what was expected.

    unusable: whether nothing can be said because the input is bad. measured, rows: what judging
    adds to the numbers of the measurement, and what is shown in place of its rows.
    """

    verdict: str
    reason: str = ""
    expected: Mapping[str, Any] = field(default_factory=dict)
    unusable: bool = False
    measured: Mapping[str, Any] = field(default_factory=dict)
    rows: Sequence[Row] | None = None

    def expecting(self, **more: Any) -> Verdict:
        """The same with more that was expected."""
        return replace(self, expected={**self.expected, **more})

    def because(self, reason: str) -> Verdict:
        """The same for another reason."""
        return replace(self, reason=reason)


@dataclass(frozen=True)
class Found:
    """What is kept of a case: its measurement, or the verdict of why it cannot be measured.

    order: that of the rule on the scene, where it was asked for (`knows_order`). more: whether
    `Study.measure_more` was asked. measured_at: date and commit.
    """

    measurement: Measurement | None = None
    failed: Verdict | None = None
    order: int | None = None
    knows_order: bool = False
    more: bool = False
    seconds: float = 0.0
    measured_at: Mapping[str, Any] = field(default_factory=dict)

    def to_json(self) -> Mapping[str, Any]:
        """What the store has of it."""
        held = {key: value for key, value in vars(self).items() if key not in _PARTS}
        parts = {"measurement": self.measurement and {**self.measurement},
                 "failed": self.failed and vars(self.failed)}  # fmt: skip
        return {**held, **parts}

    @classmethod
    def of_json(cls, given: Mapping[str, Any]) -> Found:
        """What `to_json` said."""
        made = dict(given)
        if given["measurement"] is not None:
            made["measurement"] = Measurement.of(given["measurement"])
        if given["failed"] is not None:
            made["failed"] = Verdict(**given["failed"])
        return cls(**made)


_PARTS = ("measurement", "failed")


@dataclass(frozen=True)
class Result:
    """A case, what was found of it, its verdict, and its cause where one was told."""

    case: Case
    found: Found
    verdict: Verdict
    cause: Mapping[str, Any] | None = None

    def to_json(self) -> dict[str, Any]:
        """What is shown, written and compared of it."""
        case, verdict, cause = self.case, self.verdict, self.cause
        measurement = self.found.measurement or Measurement()
        told = f" Cause: {cause['cause']}: {cause['sentence']}" if cause else ""
        return {
            "scene": case.scene.name,
            "rule": case.label,
            "retraction": case.scene.groupoid.retraction,
            "digits": case.digits,
            "verdict": verdict.verdict,
            "reason": verdict.reason + told,
            "command": case.command,
            "control": case.control is not None,
            "expected": verdict.expected,
            "measured": {**measurement.measured, **verdict.measured},
            "rows": measurement.rows if verdict.rows is None else verdict.rows,
            **{key: measurement.extras[key] for key in DETAILS if key in measurement.extras},
            **({"diagnosis": cause} if cause else {}),
            **({"unusable": True} if verdict.unusable else {}),
            "seconds": self.found.seconds,
            "measured_at": self.found.measured_at,
        }
