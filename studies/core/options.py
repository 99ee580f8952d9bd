"""Options of a study beside its cases, and readers of a command's words as values."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, NoReturn


@dataclass(frozen=True)
class Option:
    """An option of a study.

    metavar: the name of the value in help; a switch has none. read: text → value; it raises
    `BadInput`. repeated: True if it may be given several times; then its value is the tuple of all.
    """

    flag: str
    help: str
    metavar: str | None = None
    read: Callable[[str], Any] = str
    repeated: bool = False

    @property
    def name(self) -> str:
        """The key of its value in `Choice.own`."""
        return self.flag.strip("-")


def option_words(values: Mapping[str, Any]) -> list[str]:
    """Return the words of a command that give these values to options, by their flags.

    True stands for a switch, a list for an option that is repeated; None, False and an empty word
    leave one out.
    """
    words: list[str] = []
    for flag, value in values.items():
        for each in value if isinstance(value, list | tuple) else [value]:
            if each is True:
                words.append(flag)
            elif each is not None and each is not False and each != "":
                words += [flag, f"{each:g}" if isinstance(each, float) else str(each)]
    return words


def refuse(sentence: str) -> NoReturn:
    """Raise `BadInput`, without loading the mathematics before."""
    from discmech.integrators import BadInput

    raise BadInput(sentence)


def listed(what: str, thing: Any) -> list[Any]:
    """Return the entries of a list; a word or another single object is the only one; () is all."""
    if thing is None:
        refuse(f"{what} is None: give a list.")
    if isinstance(thing, str):
        return [thing]
    try:
        entries = iter(thing)
    except TypeError:  # also for an array without axes, which claims to be iterable
        return [thing]
    members = list(entries)
    if not (members or isinstance(thing, tuple)):  # such as a filter that let nothing through
        refuse(f"{what} is an empty list: leave it out for all of them.")
    return members


def whole(what: str, most: int = 2**53) -> Callable[[str], int]:
    """Return a reader of whole numbers from 1, up to `most`: double precision counts to 2⁵³."""

    def read(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            value = 0
        if not 1 <= value <= most:
            end = f" to {most}" if most < 2**53 or value > most else ""
            from discmech.integrators.errors import shown

            refuse(f"{what} is {shown(text)}: give a whole number from 1{end}.")
        return value

    return read


def digits_in(text: str, single: bool = False) -> int:
    """Return a precision; single: True if 7, single precision, may be asked for."""
    from discmech.integrators.numbers import MOST_DIGITS

    value = whole("--digits")(text)
    if not (16 <= value <= MOST_DIGITS or (single and value == 7)):
        also = ", or 7 (single precision)" * single
        refuse(f"--digits is {value}: give 16 (double precision) up to {MOST_DIGITS}{also}.")
    return value


def values_of(text: str) -> tuple[str, list[str]]:
    """Return (name, values) of w=0:1/2:21, from 0 to 1/2 in 21 values, or of w=0,1/6,1/4.

    Values stand as they were written: 0.1 is no 1/10, and from 0 to 0.5 they are decimals too.
    """
    from discmech.integrators.numbers import exact

    name, equals, rest = text.partition("=")
    try:
        if ":" in rest:
            first, last, count = rest.split(":")
            begin, number = Fraction(first), int(count)
            size = (Fraction(last) - begin) / (number - 1)
            values = [_like(first + last, begin + size * k) for k in range(number)]
        else:
            values = [each.strip() for each in rest.split(",") if exact(each, name) is not None]
    except (ValueError, ZeroDivisionError):  # BadInput is one
        values = []
    if not (name.isidentifier() and equals and values):
        refuse(
            f"--vary {text} names no number with its values: write --vary w=0:1/2:21 for 21 values "
            "from 0 to 1/2, or --vary 'w=0,1/6,sqrt(3)/6'."
        )
    return name, values


def _like(text: str, value: Fraction) -> str:
    """Return the value as a decimal, if it is one and the text has some, or as a fraction."""
    decimal = str(float(value))
    return decimal if "." in text and "/" not in text and Fraction(decimal) == value else str(value)


def seconds(what: str) -> Callable[[str], float]:
    """Return a reader of times in seconds."""

    def read(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = 0.0
        if not 0 < value < math.inf:
            from discmech.integrators.errors import shown

            refuse(f"{what} is {shown(text)}: give seconds, more than 0.")
        return value

    return read


def control_option(what: str, names: Callable[[], Iterable[str]]) -> Option:
    """Return `--control NAME` for a study whose controls are `what` and have these names."""

    def read(text: str) -> str:
        known = tuple(names())
        if text not in known:
            from discmech.integrators.errors import unknown

            raise unknown("control", text, known)
        return text

    about = f"only this control ({what} that must be caught)"
    return Option("--control", about, "NAME", read, repeated=True)


THOROUGH = Option("--thorough", "take minutes to hours, not seconds")
