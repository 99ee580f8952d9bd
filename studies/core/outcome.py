"""The measurement of a case, its verdict, and both together: frozen records."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from .decisions import Decision
from .records import decoded, encoded

#: the words of a verdict, worst first. What nothing was demanded of is "measured", and no pass.
VERDICTS = ("fail", "inconclusive", "measured", "pass")
#: what decides a verdict, in words that judges after it read: single steps alone, so that the
#: figure of the runs is within its limit (tables show these words in its place), or how errors run.
#: A form, a momentum or an energy that is kept by another motion than the scene's is still kept.
OF_STEPS = NOT_CONSISTENT, KEPT_ELSEWHERE, STEPS_ARE_OFF = (
    "not consistent", "kept, but not consistent", "single steps are off",
)  # fmt: skip
ABOVE, GOING_AWAY, NOT_CONVERGING = "above the expected order", "away from it", "not converging"
ROUND_OFF, MORE_STEPS = "only round-off", "more steps are needed"
#: the drift of the energy that the reason tells, which is among the measured numbers then
OF_DRIFT = "the energy drifts"
Row = Mapping[str, Any]


@dataclass(frozen=True)
class Measurement(Mapping[str, Any]):
    """The numbers of a case, without a verdict.

    measured: figures by name; rows: the runs or points that they were made of; extras: other values
    by name, for the judge or a view. As a mapping it is the dictionary for JSON, {"measured",
    "rows", **extras}.
    """

    measured: Mapping[str, Any] = field(default_factory=dict)
    rows: Sequence[Row] = ()
    extras: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def of(cls, answer: Any) -> Measurement:
        """Return the measurement of a study's own record, or of a dictionary of any values."""
        return answer if isinstance(answer, Measurement) else cls.of_json(encoded(answer))

    @classmethod
    def of_json(cls, entries: Mapping[str, Any]) -> Measurement:
        """Return the measurement of a dictionary from JSON."""
        extras = {key: value for key, value in entries.items() if key not in ("measured", "rows")}
        return cls(entries.get("measured", {}), entries.get("rows", []), extras)

    def __getitem__(self, key: str) -> Any:
        own = {"measured": self.measured, "rows": self.rows}
        return own[key] if key in own else self.extras[key]

    def __iter__(self) -> Iterator[str]:
        yield from ("measured", "rows", *self.extras)

    def __len__(self) -> int:
        return 2 + len(self.extras)


@dataclass(frozen=True)
class Verdict:
    """The answer of `judge`: a verdict, a sentence if it is no pass, and the expected numbers.

    A judge that demands nothing of a property gives the reason in expected["not_demanded"], and
    names in expected["demanded"] what it demands all the same, if there is something.
    unusable: True if the input is bad, so that nothing can be judged. measured: numbers that
    judging adds to those of the measurement; rows: rows that are shown in place of its own. why:
    what decides, in a few fixed words, where judges or tables ask for it.
    """

    verdict: str
    reason: str = ""
    expected: Mapping[str, Any] = field(default_factory=dict)
    unusable: bool = False
    measured: Mapping[str, Any] = field(default_factory=dict)
    rows: Sequence[Row] | None = None
    why: str = ""

    def expecting(self, **more: Any) -> Verdict:
        """Return this verdict with more expected numbers."""
        return replace(self, expected={**self.expected, **more})

    @property
    def is_trouble(self) -> bool:
        """True for a verdict that somebody has to look at: a fail, or an inconclusive one."""
        return is_trouble(self.verdict)

    def settled(self) -> Verdict:
        """Return this verdict, with "measured" in place of a pass that demanded nothing."""
        free = "not_demanded" in self.expected and not self.expected.get("demanded")
        return replace(self, verdict="measured") if free and self.verdict == "pass" else self

    def because(self, reason: str) -> Verdict:
        """Return this verdict with another reason."""
        return replace(self, reason=reason)


def is_trouble(verdict: str) -> bool:
    """Return True for the word of a verdict that somebody has to look at."""
    return verdict in ("fail", "inconclusive")


def of_control(caught: object, otherwise: str, expected: Mapping[str, Any]) -> Verdict:
    """Return the verdict on a control, which passes if it is caught; otherwise: what is seen."""
    said = "" if caught else f"the control was not caught: {otherwise}."
    return Verdict("pass" if caught else "fail", said, expected)


def worst(verdicts: Iterable[str]) -> str:
    """Return the worst of some verdicts; inconclusive without any.

    What is measured says nothing about the others: it counts only where nothing else is there.
    """
    words = list(verdicts)
    judged = [word for word in words if word != "measured"]
    return min(judged or words, key=VERDICTS.index, default="inconclusive")


@dataclass(frozen=True, slots=True)
class Made:
    """The date of a measurement, and the commit of the text that made it.

    clean: True if the checkout is that commit's.
    """

    date: str | None = None
    commit: str | None = None
    clean: bool | None = False


@dataclass(frozen=True)
class Found:
    """The stored part of a case: its measurement, or a verdict on why it cannot be measured.

    order: the rule's order on the scene, if it was asked for (`knows_order`). more: True if
    `Study.measure_more` gave more; declined: the verdict for which it gave nothing. measured_at:
    date and commit. decisions: the answers of judges on which it rests.
    """

    measurement: Measurement | None = None
    failed: Verdict | None = None
    order: int | None = None
    knows_order: bool = False
    more: bool = False
    declined: str = ""
    seconds: float = 0.0
    measured_at: Made = field(default_factory=Made)
    decisions: Sequence[Decision] = ()

    def to_json(self) -> Mapping[str, Any]:
        """Return the dictionary that the store keeps."""
        return dict(encoded(self))

    @classmethod
    def of_json(cls, entries: Mapping[str, Any]) -> Found:
        """Return the object of a dictionary by `to_json`."""
        return decoded(cls, entries)


_NUMBER = re.compile(r"(?<![\w.])[-−]?[0-9]+(?:\.[0-9]+)?(?:e[+-]?[0-9]+)?")
_ENTRIES = re.compile(r"\b(x|mu)\[#\](, (x|mu)\[#\])*")


def without_figures(words: str) -> str:
    """Return a sentence in which all numbers are alike, and all components of a state."""
    return _ENTRIES.sub("x[#]", _NUMBER.sub("#", words))


def named(cause: str, sentence: str, evidence: dict[str, Any]) -> dict[str, Any]:
    """Return the `diagnosis` of a case."""
    return {"cause": cause, "sentence": sentence, "evidence": evidence}


def said_of_law(
    told: Mapping[str, dict[str, Any]], listed: Callable[[Sequence[str]], str] = "; ".join
) -> list[str]:
    """Return a phrase for each answer that classes have to a law, with their names listed.

    told: class ↦ answer, as JSON has it.
    """
    places: dict[str, list[str]] = {}
    for name, a in told.items():
        if a.get("condition"):
            said = f"kept to h^{a['order']} {a['condition']},"
        elif a["proven"] is None:
            said = f"not decided ({a['why']})"
        elif a["order"] is None:
            said = f"proven {a['why']},"
        else:
            said = f"proven to h^{a['order']}" if a["proven"] else f"kept to h^{a['order']} only"
        places.setdefault(said, []).append(name)
    return [f"{said} for {'all of them' if len(names) == len(told) > 3 else listed(names)}"
            for said, names in places.items()]  # fmt: skip
