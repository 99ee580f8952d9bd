"""Decisions: what measuring asks a judge, kept with the measurement and asked again later.

A run gets longer until the energy is clear, and limits say when it is. So a measurement may rest on
a judge, and on limits. It does so by answers of functions of plain numbers alone, marked as
`decision`, which are kept with their arguments. The measurement is what would be measured now as
long as all the answers are the same (`same_answers`), however judges and limits have changed.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import wraps
from inspect import signature
from operator import methodcaller
from pkgutil import resolve_name
from typing import Any, TypeVar, get_type_hints

from .records import encoded, read

Judge = TypeVar("Judge", bound=Callable[..., Any])
#: lists of the measurements under way: one that measures others rests on their decisions too
_UNDER_WAY: list[list[Decision]] = []
_PLAIN = methodcaller("item")  # of a number of numpy


@dataclass(frozen=True, slots=True)
class Decision:
    """The answer of a function, named as module:function, to arguments as JSON has them."""

    judge: str = ""
    arguments: Sequence[Any] = ()
    answer: Any = None


def decision(judge: Judge) -> Judge:
    """Decorator of a function of numbers, or records of them, whose answer JSON can hold.

    Its answer depends on nothing else than its arguments, its text and limits. It must not be asked
    by a function that remembers its results: the next measurement would not note it.
    """
    name = f"{judge.__module__}:{judge.__qualname__}"

    @wraps(judge)
    def asked(*arguments: Any) -> Any:
        noting, _UNDER_WAY[:] = [*_UNDER_WAY], []  # what it asks itself is no other decision
        try:
            answer = judge(*arguments)
        finally:
            _UNDER_WAY[:] = noting
        if noting:
            text = json.dumps(encoded((arguments, answer)), default=_PLAIN)
            made = Decision(name, *json.loads(text))
            for kept in noting:
                kept.append(made)
        return answer

    asked.decides = True  # type: ignore[attr-defined]
    return asked  # type: ignore[return-value]


@contextmanager
def decisions() -> Iterator[list[Decision]]:
    """Give the list to which all decisions are added that are made in the context."""
    made: list[Decision] = []
    _UNDER_WAY.append(made)
    try:
        yield made
    finally:
        _UNDER_WAY[:] = [kept for kept in _UNDER_WAY if kept is not made]


def same_answers(made: Sequence[Decision]) -> bool:
    """True if each function gives the kept answer; False also where one cannot be asked again."""
    return all(map(_is_same, made))


def _is_same(made: Decision) -> bool:
    try:
        judge = resolve_name(made.judge)
        if not getattr(judge, "decides", False):
            return False
        hints = get_type_hints(judge)
        kinds = [hints[name] for name in signature(judge).parameters]
        pairs = zip(kinds, made.arguments, strict=True)
        answer = encoded(judge(*(read(kind, argument) for kind, argument in pairs)))
    except Exception:  # of another text: it is no longer there, or asks something else
        return False
    text = json.dumps(answer, default=_PLAIN)
    return text == json.dumps(made.answer)  # so is a number that is none
