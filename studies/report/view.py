"""The presentation of a study's numbers: in a table, a line, figures, beside other methods."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ..core.result import NONE
from .wording import pairs, scientific

if TYPE_CHECKING:
    from rich.console import Console

    from ..core.result import AnyResult, StudyResult
    from .canvas import Panel, Sheet
    from .palette import Mark

Words = Callable[[Any], str]
Column = tuple[str, Words]
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
    return head or key.capitalize(), lambda case: scientific(case.figures.get(key))


def decimals(value: float | None, places: int) -> str:
    """Return a number with so many decimals, a dash for None."""
    return NONE if value is None else f"{value:.{places}f}"


def no_figures(cases: Sequence[AnyResult], known: dict[str, Mark], titles: Titles) -> list[Sketch]:
    """Return [], for a study that draws nothing."""
    return []


def figures_in_line(case: Any) -> str:
    """Return what was measured of a case in one line."""
    return pairs(case.figures)


def wanted_in_line(case: Any) -> str:
    """Return what is expected of a case in one line."""
    return pairs(case.wanted)


@dataclass(frozen=True)
class View:
    """A study's own way to show its cases (`Result`); omitted parts have a plain default.

    measured, expected, row: the records that its functions read; without them a case has mappings
    by the names of JSON. columns: those between a case's name and its expectation; if `whole`, all
    columns except the verdict. got, wanted: the measurement and the expectation in one line. short:
    the deciding figure (default: got). line: the text of a case in `verify` (default: got). paper:
    the columns of a scene in a paper's table (default: got, without a heading). sketches: its
    figures. compared: the quantities that `compare` shows side by side. printed: prints the result
    on a terminal in place of its table.
    """

    measured: type[Any] = dict
    expected: type[Any] = dict
    row: type[Any] = dict
    columns: Sequence[Column] | None = None
    whole: bool = False
    got: Words = figures_in_line
    wanted: Words = wanted_in_line
    short: Words | None = None
    line: Words | None = None
    paper: Sequence[Column] | None = None
    sketches: Callable[[Sequence[Any], dict[str, Mark], Titles], list[Sketch]] = no_figures
    compared: Callable[[Any], Mapping[str, Any]] | None = None
    printed: Callable[[Console, StudyResult], None] | None = None
