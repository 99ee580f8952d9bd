"""Maps of stability over step and stiffness: the class of each run."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import groupby
from typing import TYPE_CHECKING, Any

from ..report.canvas import Panel, Sheet, log_axis, note
from ..report.case import Case as Shown
from ..report.palette import BLUE, GREEN, INK, ORANGE, PURPLE, SKY, VERMILLION
from ..report.wording import in_tens
from .records import Expected, Measured, Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Case = Shown[Measured, Expected, Row]
SHEET = Sheet(width=2.3, height=1.8, left=0.52, right=0.16)
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
    """Return maps of every case: one line per scene, one column per rule, controls last."""
    ours = [case for case in cases if not case.control]
    rules = list(dict.fromkeys(case.method for case in ours))
    places: Sequence[Case | None] = cases
    if len(rules) <= MOST_COLUMNS:
        at = {(case.scene, case.method): case for case in ours}
        lines = dict.fromkeys(scene for scene, _ in at)
        places = [at.get((scene, rule)) for scene in lines for rule in rules]
        places = [*places, *(case for case in cases if case.control)]
    panels = [stability_map(_title(case, titles), case) if case else EMPTY for case in places]
    columns = min(len(rules) or 1, MOST_COLUMNS)
    if len(panels) < MOST_COLUMNS and len(panels) == columns:  # the legend is beside them
        columns += 1
    return panels, replace(SHEET, columns=columns)


def _title(case: Case, titles: Mapping[str, str]) -> str:
    """Return the family's title; the scene's own title has the number that varies here."""
    scene = str(case.scene)
    return case.title or titles.get(scene, scene)


def stability_map(title: str, case: Case) -> Panel:
    """Return the map of one rule: the class of the run in each cell."""

    def draw(axes: Axes) -> None:
        cells = [row for row in case.rows if row.z and not row.between]
        if not cells:
            note(axes, f"No cells. {case.reason}")
            return
        places = sorted({row.z for row in cells})
        half = math.sqrt(places[1] / places[0]) if len(places) > 1 else 1.1
        stiff = sorted({row.stiffness for row in cells})
        log_axis(axes, "x", (places[0] / half, places[-1] * half), 4)
        axes.grid(visible=False)
        axes.set_ylim(-0.5, len(stiff) - 0.5)
        for line, value in enumerate(stiff):
            row = sorted((r for r in cells if r.stiffness == value), key=lambda r: r.z)
            for kind, run in groupby(row, key=lambda r: r.outcome):
                zs = [r.z for r in run]
                left, right = zs[0] / half, zs[-1] * half
                strokes = max(1, round(math.log10(right / left) * 10))
                shares = [(k + 0.5) / strokes for k in range(strokes)]
                xs = [left * (right / left) ** share for share in shares]
                _cell(axes, kind, (left, right), line, 0.5, xs)
        for line in range(1, len(stiff)):
            axes.axhline(line - 0.5, color="#ffffff", lw=0.6)
        shown = [k for k in range(len(stiff)) if len(stiff) < 7 or k % 2 == 0]
        texts = [f"{v:g}" if 0.001 <= v < 10000 else in_tens(v) for v in stiff]
        axes.set_yticks(shown, [texts[k] for k in shown])
        axes.tick_params(axis="y", length=0)

    found = case.measured.classes or {}
    spoken = f"{title}, {case.method}: " + ", ".join(f"{n} cells {k}" for k, n in found.items())
    subtitle = f"{case.method}; upwards: {case.label or 'stiffness'}"
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


def legend(cases: Sequence[Case]) -> Panel:
    """Return the legend of the maps' colours."""
    met = {row.outcome for case in cases for row in case.rows}
    kinds = [kind for kind in LOOKS if kind in met] or list(LOOKS)

    def draw(axes: Axes) -> None:
        axes.axis("off")
        axes.set_xlim(0, 10)
        axes.set_ylim(len(LOOKS) - 0.4, -0.6)
        for line, kind in enumerate(kinds):
            _cell(axes, kind, (0.2, 1.6), line, 0.34, [0.6, 1.2])
            axes.text(2.0, line, kind, va="center", fontsize=8)

    return Panel("Classes", "", "", "Classes: " + ", ".join(kinds), draw)
