"""How a study's numbers are shown: in a table, in a line, in figures, beside other methods."""

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
    """A figure before it is drawn; `digits` where all of it has one precision."""

    name: str
    title: str
    caption: str
    panels: Sequence[Panel]
    sheet: Sheet
    digits: int | None = None


def measured_column(key: str, head: str = "") -> Column:
    """A number of `measured`, with the key as its heading."""
    return head or key.capitalize(), lambda case: scientific(mapping(case, "measured").get(key))


def no_figures(cases: Sequence[Case], known: dict[str, Mark], titles: Titles) -> list[Sketch]:
    """Of a study that draws nothing."""
    return []


@dataclass(frozen=True)
class View:
    """The parts that a study may have of its own; whatever it leaves out is shown plainly.

    columns: what the table has between a case's name and what was wanted; all of its columns but
    the verdict if `whole`. got, wanted: one line of what was measured and what was expected. short:
    the one figure that a verdict hangs on (default: got). line: what a line of `verify` says of a
    case (default: got). sketches: its figures. compared: what
    `compare` holds side by side. printed: how a terminal shows the result, in place of its table.
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
