"""What a row of the audit is: a place in the paper, what stands there, and how it is checked."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

#: over what a check runs, as PAPER.md words it
EVERYWHERE = "40 digits, all groupoids"
MATRIX = "40 digits, matrix groups and their actions"
CAYLEY = "40 digits, the same with Cayley"
ACTIONS = "40 digits, actions of matrix groups"
SYMBOLIC = "symbolic"
DEFINITION = "definition"


#: what refutes a claim that no printed formula makes
BROKEN = "broken"


@dataclass(frozen=True)
class Claim:
    """`found` equals `wanted`; where `refuted`, `wanted` is as printed or spoilt, and does not."""

    says: str
    found: Any
    wanted: Any
    refuted: str = ""  # a misprint's tag, or BROKEN


@dataclass(frozen=True)
class Row:
    """One display, or one statement of the text (its place then ends in a word)."""

    place: str
    says: str
    how: str
    check: Callable[..., Iterable[Claim]] | None = None
    misprints: tuple[str, ...] = ()
    #: ingredients that may be anything in this identity: a wrong one is not seen
    free: tuple[str, ...] = ()
    #: whether a claim with something spoilt stands beside the right one
    spoilt: bool = False
    #: second derivatives of compositions: the fast suite takes the witnesses alone
    dear: bool = False

    @property
    def section(self) -> str:
        """Such as 3.6.1."""
        return self.place.partition("-")[0]


ROWS: list[Row] = []


def definition(place: str, says: str, *misprints: str) -> None:
    """A display that introduces notation or a system: nothing in it can be wrong or right."""
    ROWS.append(Row(place, says, DEFINITION, None, misprints))


def checked(
    place: str,
    says: str,
    *misprints: str,
    how: str = EVERYWHERE,
    free: Iterable[str] = (),
    spoilt: bool = False,
    dear: bool = False,
) -> Callable[[Callable[..., Iterable[Claim]]], Callable[..., Iterable[Claim]]]:
    """Decorator: the check of a row, a generator of claims (of a sample, unless symbolic)."""

    def add(check: Callable[..., Iterable[Claim]]) -> Callable[..., Iterable[Claim]]:
        ROWS.append(Row(place, says, how, check, misprints, tuple(free), spoilt, dear))
        return check

    return add


def same(says: str, found: Any, wanted: Any) -> Claim:
    """The claim that two sides agree."""
    return Claim(says, found, wanted)


def printed(tag: str, found: Any, wanted: Any) -> Claim:
    """The claim that the printed side is wrong."""
    return Claim(f"[misprint: {tag}]", found, wanted, tag)


def broken(says: str, found: Any, wanted: Any) -> Claim:
    """The claim of that name with something spoilt, which has to fail."""
    return Claim(says, found, wanted, BROKEN)
