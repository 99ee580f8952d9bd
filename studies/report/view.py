"""The presentation of a study's numbers: in a table, a line, figures, beside other methods."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from .wording import Case, Result, mapping, pairs, scientific

if TYPE_CHECKING:
    from rich.console import Console

    from .canvas import Panel, Sheet
    from .palette import Mark

Column = tuple[str, Callable[[Case], str]]
Titles = Mapping[str, str]


@dataclass(frozen=True)
class Sketch:
    """A figure before it is drawn; `digits`: its precision, if it has only one."""

    name: str
    title: str
    caption: str
    panels: Sequence[Panel]
    sheet: Sheet
    digits: int | None = None


def measured_column(key: str, head: str = "") -> Column:
    """Return a column for a number of `measured`, with the key as its heading."""
    return head or key.capitalize(), lambda case: scientific(mapping(case, "measured").get(key))


def no_figures(cases: Sequence[Case], known: dict[str, Mark], titles: Titles) -> list[Sketch]:
    """Return [], for a study that draws nothing."""
    return []


@dataclass(frozen=True)
class View:
    """A study's own way to show its numbers; omitted parts have a plain default.

    columns: those between a case's name and its expectation; if `whole`, all columns except the
    verdict. got, wanted: the measurement and the expectation in one line. short: the deciding
    figure (default: got). line: the text of a case in `verify` (default: got). sketches: its
    figures. compared: the quantities that `compare` shows side by side. printed: prints the result
    on a terminal in place of its table.
    """

    columns: Sequence[Column] | None = None
    whole: bool = False
    got: Callable[[dict[str, Any]], str] = pairs
    wanted: Callable[[dict[str, Any]], str] = pairs
    short: Callable[[dict[str, Any]], str] | None = None
    line: Callable[[Case], str] | None = None
    sketches: Callable[[Sequence[Case], dict[str, Mark], Titles], list[Sketch]] = no_figures
    compared: Callable[[Case], dict[str, Any]] | None = None
    printed: Callable[[Console, Result], None] | None = None
