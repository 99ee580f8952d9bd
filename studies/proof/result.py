"""What a proof of order says: an answer for each class, conditions on open numbers, the error."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from ..core.outcome import said_of_law

WORDS = {True: "proven", False: "disproven", None: "not decided"}


def _least(answers: Iterable[bool | None]) -> bool | None:
    """Return False if one is False, else None if one is None."""
    told = {*answers}
    return False if False in told else None if None in told else True


@dataclass(frozen=True)
class Answer:
    """Of one class of scenes: order, proven (None: not decided), why; it unpacks into these three.

    order: the last power of h up to which a step agrees with the flow, or None. at_least: True if
    the next power was not looked at, or agrees too. power, missed: the first power of h that
    differs, and the components that do; power 0: a step of length 0 is singular. chance: a bound of
    the chance that "proven" is wrong. condition: of a law, for which open numbers it holds further.
    """

    order: int | None
    proven: bool | None
    why: str
    at_least: bool = False
    power: int | None = None
    missed: tuple[str, ...] = ()
    chance: float | None = None
    seconds: float = 0.0
    condition: str = ""

    def __iter__(self) -> Iterator[Any]:
        return iter((self.order, self.proven, self.why))

    @property
    def verdict(self) -> str:
        """The answer as a word."""
        return WORDS[self.proven]


@dataclass(frozen=True)
class Result:
    """What is proven of a rule.

    order: the order that was asked for, or what the rule states, or what was found; classes: name ↦
    `Answer`; conditions: order ↦ the condition on the rule's open numbers under which it has that
    order; leading: name of an elementary term ↦ its coefficient in the leading error
    (docs/proofs.md has the terms); notes: sentences; laws: law ↦ class ↦ `Answer`, whose order is
    the last power of h to which it holds; claimed: the laws that the rule's author claims;
    not_asked: kind ↦ the names of classes that take longer, and were not asked for; late: the names
    of those that were not answered within the seconds of processor time that `prove` had.
    """

    rule: str
    order: int | None
    classes: dict[str, Answer]
    conditions: dict[int, str] = field(default_factory=dict)
    leading: dict[str, Any] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    laws: dict[str, dict[str, Answer]] = field(default_factory=dict)
    claimed: tuple[str, ...] = ()
    not_asked: dict[str, list[str]] = field(default_factory=dict)
    late: list[str] = field(default_factory=list)

    @property
    def proven(self) -> bool | None:
        """True if proven of every class, False if disproven of one, None if one is not decided.

        A law that is claimed has to be proven of one class at least, and disproven of none.
        """
        return _least(self._parts.values())

    @property
    def _parts(self) -> dict[str, bool | None]:
        """For the order and each law that is claimed, whether it is proven."""
        told = [answer.proven for answer in self.classes.values()]
        parts = {f"order {self.order}": _least(told) if told else None}
        for law in self.claimed:
            if law in self.laws:
                answers = {answer.proven for answer in self.laws[law].values()}
                parts[law] = False if False in answers else True in answers or None
        return parts

    @property
    def verdict(self) -> str:
        """The answer as a word."""
        return WORDS[self.proven]

    def to_json(self) -> dict[str, Any]:
        """Return it as JSON can hold it; fractions are text."""
        return {
            "command": "prove", "rule": self.rule, "order": self.order, "verdict": self.verdict,
            "classes": _as_json(self.classes),
            "conditions": {str(order): text for order, text in self.conditions.items()},
            "leading": {name: str(c) for name, c in self.leading.items()}, "notes": self.notes,
            "laws": {law: _as_json(told) for law, told in self.laws.items()},
            "not_asked": self.not_asked, "late": self.late,
        }  # fmt: skip

    def text(self) -> str:
        """Return it as lines for a terminal."""
        told = [f"{part} {WORDS[answer]}" for i, (part, answer) in enumerate(self._parts.items())
                if not (i and answer)]  # fmt: skip
        lines = [f"{self.rule}: {', '.join(told)}"] if self.order else [self.rule]
        width = max(map(len, self.classes), default=0)
        for name, a in self.classes.items():
            order = "" if a.order is None else f"order {'≥ ' * a.at_least}{a.order}"
            lines.append(f"  {name:<{width}}  {a.verdict:<11}  {order:<9}  {a.why}".rstrip())
        for power, condition in self.conditions.items():
            lines.append(f"  would be of order {power}: {condition}")
        if self.leading:
            lines.append("  leading error " + " + ".join(
                f"({c}) {name}" for name, c in self.leading.items()))  # fmt: skip
        lines += [f"  {law}: {e}" for law, told in self.laws.items()
                  for e in said_of_law(_as_json(told))]  # fmt: skip
        every = [a.chance or 0.0 for told in (self.classes, *self.laws.values())
                 for a in told.values()]  # fmt: skip
        if max(every, default=0.0):
            lines.append(
                f'each "proven" has a chance of {max(every):.0e} at most to be wrong, of a rule '
                "that takes from L, or from H, its values and derivatives alone."
            )
        lines += self.notes
        if left := [f"{', '.join(e)} (--groupoid {kind})" for kind, e in self.not_asked.items()]:
            lines.append(f"not asked, since they take longer: {'; '.join(left)}.")
        if self.late:
            lines.append(f"not answered in the time that was given: {'; '.join(self.late)}.")
        return "\n".join(lines)


def _as_json(answers: Mapping[str, Answer]) -> dict[str, Any]:
    return {
        name: {"order": a.order, "at_least": a.at_least, "proven": a.proven, "why": a.why,
               "verdict": a.verdict, "power": a.power, "missed": list(a.missed), "chance": a.chance,
               "seconds": round(a.seconds, 3), "condition": a.condition}
        for name, a in answers.items()
    }  # fmt: skip
