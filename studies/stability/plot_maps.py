"""Maps of stability over step and stiffness: the class of each run."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import groupby
from typing import TYPE_CHECKING, Any

from ..core.records import grouped
from ..core.result import Result
from ..report.canvas import Panel, Sheet, log_axis, note
from ..report.palette import BLUE, GREEN, INK, ORANGE, PURPLE, SKY, VERMILLION
from ..report.wording import in_tens
from .records import Expected, Measured, Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Case = Result[Measured, Expected, Row]
SHEET = Sheet(width=2.3, height=1.8, left=0.52, right=0.16)
BAR, CLASS = 0.2, 0.165  # inches of a bar of one stiffness, and of a line of the legend
LEGEND = 1.3  # inches of the legend's width beside a single map
MOST_COLUMNS = 4  # most columns of maps; with more rules the maps follow each other
#: class → (colour, opacity, marker and its size): distinct without colours as well
LOOKS: dict[str, tuple[str, float, tuple[Any, float] | None]] = {
    "bounded": (BLUE, 0.18, None),
    "resonant": (ORANGE, 0.75, None),
    "drifting": (PURPLE, 0.75, ((2, 0, -35), 6)),
    "escaped": (GREEN, 0.55, ("x", 3)),
    "Newton failed": (SKY, 0.9, (".", 2.2)),
    "blown up": (VERMILLION, 0.9, None),
}
EMPTY = Panel("", "", "", "", lambda axes: axes.set_axis_off())


def map_table(cases: Sequence[Case], titles: Mapping[str, str]) -> tuple[list[Panel], Sheet]:
    """Return maps of every case: one line per scene, one column per rule, controls last.

    If no map has more than one stiffness, each scene has one panel, with a bar for each rule.
    """
    if cases and all(len(_stiff(case)) < 2 for case in cases):
        scenes = grouped(cases, lambda case: _title(case, titles))
        panels = [_bars(title, own) for title, own in scenes.items()]
        high = max(BAR * max(map(len, scenes.values())), CLASS * len(_classes(cases)))
        return panels, replace(SHEET, height=SHEET.top + SHEET.bottom + high, columns=3)
    ours = [case for case in cases if not case.control]
    rules = list(dict.fromkeys(case.method for case in ours))
    places: Sequence[Case | None] = cases
    if len(rules) <= MOST_COLUMNS:
        at = {(case.scene, case.method): case for case in ours}
        lines = dict.fromkeys(scene for scene, _ in at)
        places = [at.get((scene, rule)) for scene in lines for rule in rules]
        places = [*places, *(case for case in cases if case.control)]
    panels = [stability_map(_title(case, titles), case) if case else EMPTY for case in places]
    columns = min(len(rules), MOST_COLUMNS) if len(rules) > 1 else 3
    if 1 < len(panels) == columns < MOST_COLUMNS:  # the legend is beside them
        columns += 1
    return panels, replace(SHEET, columns=columns)


def _title(case: Case, titles: Mapping[str, str]) -> str:
    """Return the family's title; the scene's own title has the number that varies here."""
    scene = str(case.scene)
    return case.details.title or titles.get(scene, scene)


def _cells(case: Case) -> list[Row]:
    return [row for row in case.rows if row.z and not row.between]


def _stiff(case: Case) -> list[float]:
    return sorted({row.stiffness for row in _cells(case)})


def stability_map(title: str, case: Case) -> Panel:
    """Return the map of one rule: the class of the run in each cell."""
    cells = _cells(case)
    texts = [f"{v:g}" if 0.001 <= v < 10000 else in_tens(v) for v in _stiff(case)]
    lines = [[row for row in cells if row.stiffness == value] for value in _stiff(case)]
    subtitle = f"{case.method}; upwards: {case.details.label or 'stiffness'}"
    return _lines(title, subtitle, lines, texts, case.reason, _spoken(title, [case]))


def _bars(title: str, cases: Sequence[Case]) -> Panel:
    """Return the panel of a scene of one stiffness: a bar for each rule, the first on top."""
    down = cases[::-1]
    texts = [f"{case.method}{' (control)' * case.control}" for case in down]
    lines = [_cells(case) for case in down]
    subtitle = "what becomes of runs"
    return _lines(title, subtitle, lines, texts, cases[0].reason, _spoken(title, cases), BAR)


def _spoken(title: str, cases: Sequence[Case]) -> str:
    told = (
        f"{case.method}: " + ", ".join(f"{n} cells {k}" for k, n in case.measured.classes.items())
        for case in cases if case.measured.classes
    )  # fmt: skip
    return f"{title}, " + "; ".join(told)


def _lines(
    title: str, subtitle: str, lines: list[list[Row]], texts: list[str], reason: str, spoken: str,
    bar: float = 0.0,
) -> Panel:  # fmt: skip
    """Return a panel with the classes of the cells of each line, upwards.

    bar: inches of a line; by default they fill the panel.
    """

    def draw(axes: Axes) -> None:
        places = sorted({row.z for line in lines for row in line})
        if not places:
            note(axes, f"No cells. {reason}")
            return
        half = math.sqrt(places[1] / places[0]) if len(places) > 1 else 1.1
        log_axis(axes, "x", (places[0] / half, places[-1] * half), 4)
        axes.grid(visible=False)
        room = axes.bbox.height / axes.figure.dpi / bar if bar else len(lines)
        axes.set_ylim(-0.5, room - 0.5)
        for place, line in enumerate(lines):
            row = sorted(line, key=lambda r: r.z)
            for kind, run in groupby(row, key=lambda r: r.outcome):
                zs = [r.z for r in run]
                left, right = zs[0] / half, zs[-1] * half
                strokes = max(1, round(math.log10(right / left) * 10))
                shares = [(k + 0.5) / strokes for k in range(strokes)]
                xs = [left * (right / left) ** share for share in shares]
                _cell(axes, kind, (left, right), place, 0.5, xs)
        for place in range(1, len(lines)):
            axes.axhline(place - 0.5, color="#ffffff", lw=0.6)
        shown = [k for k in range(len(lines)) if len(lines) < 7 or k % 2 == 0 or bar]
        axes.set_yticks(shown, [texts[k] for k in shown])
        axes.tick_params(axis="y", length=0)

    return Panel(title, subtitle, "hω", spoken, draw)


def _cell(
    axes: Axes, kind: str, ends: tuple[float, float], line: int, half: float, xs: list[float]
) -> None:
    """Draw a cell in the look of its class; strokes or dots at xs have their own colours."""
    from matplotlib.patches import Rectangle

    colour, alpha, marks = LOOKS[kind]
    corner, width = (ends[0], line - half), ends[1] - ends[0]
    axes.add_patch(Rectangle(corner, width, 2 * half, lw=0, fc=colour, alpha=alpha))
    if marks is not None:
        marker, size = marks
        axes.plot(xs, [line] * len(xs), ls="", marker=marker, ms=size, mew=0.6, color=INK)


def _classes(cases: Sequence[Case]) -> list[str]:
    met = {row.outcome for case in cases for row in case.rows}
    return [kind for kind in LOOKS if kind in met] or list(LOOKS)


def with_legend(
    panels: Sequence[Panel], sheet: Sheet, cases: Sequence[Case]
) -> tuple[list[Panel], Sheet]:
    """Return maps and the legend of their colours: a cell of its own, or beside a single map."""
    kinds = _classes(cases)
    if len(panels) != 1:
        spoken = "Classes: " + ", ".join(kinds)
        return [*panels, Panel("Classes", "", "", spoken, lambda axes: _legend(axes, kinds))], sheet
    (only,) = panels

    def draw(axes: Axes) -> None:
        only.draw(axes)
        wide = axes.bbox.width / axes.figure.dpi
        _legend(axes.inset_axes((1 + 0.15 / wide, 0, LEGEND / wide, 1)), kinds)

    return [replace(only, draw=draw)], replace(sheet, width=2 * sheet.width - LEGEND)


def _legend(axes: Axes, kinds: Sequence[str]) -> None:
    """Draw a line for each class: its look and its name."""
    axes.axis("off")
    axes.set_xlim(0, 10)
    axes.set_ylim(axes.bbox.height / axes.figure.dpi / CLASS - 0.5, -0.5)
    for line, kind in enumerate(kinds):
        _cell(axes, kind, (0.2, 1.6), line, 0.34, [0.6, 1.2])
        axes.text(2.0, line, kind, va="center", fontsize=8)
