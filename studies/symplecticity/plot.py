"""Plots of symplecticity: the defects of every scheme, and controls against the step."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from ..core.records import number
from ..core.result import Result
from ..report.alike import shares
from ..report.canvas import Panel, Sheet, log_axis, log_limits, note, round_off
from ..report.labels import end_labels
from ..report.palette import BLUE, GRID, INK, MUTED, PAPER, VERMILLION, WORDS, Mark
from ..report.wording import scientific
from .records import Defects, Expected, Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Case = Result[Defects, Expected, Row]
#: name, colour, mark, shift, filling, and the words of the axis
KINDS = (
    ("pullback", BLUE, "o", 0.14, BLUE, "● pullback"),
    ("poisson", VERMILLION, "D", -0.14, PAPER, "◇ Poisson"),
    ("run", VERMILLION, "s", -0.14, VERMILLION, "■ along a run"),
)
LEFT = 0.98
#: decades that an axis may have beyond the defects for the sake of a limit; a limit is less far
#: above round-off, and so it is left out only for defects far below that
BEYOND = 6
RIGHTMOST = 0.8  # share of an axis beyond which words on the right of a line have no room
CONTROL_SHEET = Sheet(right=1.2, width=3.3, height=2.75)


def sheet(cases: Sequence[Case]) -> Sheet:
    """Return a sheet as tall as there are cases and scenes, with two precisions side by side."""
    lines = depth(cases) + 1
    margins: dict[str, Any] = {"left": LEFT, "right": 0.22, "top": 0.44, "bottom": 0.42}
    return Sheet(width=4.1, height=0.95 + 0.158 * max(lines, 3), columns=2, **margins)


def defects(
    title: str, cases: Sequence[Case], titles: dict[str, str], digits: int, deepest: float
) -> Panel:
    """Return a panel of both defects, median to worst, for each scene and rule, with the limit.

    deepest: the last line of the longest panel beside it, so that all have lines as far apart.
    """

    def draw(axes: Axes) -> None:
        limits = [x for case in cases if (x := case.expected.limit)]
        unit = round_off(digits)
        spots = _places(cases)
        ends = [_ends(case, kind[0]) for case in cases for kind in KINDS]
        values = [value for pair in ends for value in pair if value > 0]
        log_axis(axes, "x", _limits(values, [unit, *(3 * limit for limit in limits)]))
        axes.set_ylim(-deepest - 0.8, 0.6)
        axes.set_yticks([])
        axes.spines["left"].set_visible(False)
        floor = axes.get_xlim()[0]
        for kind, colour, marker, shift, fill, _ in KINDS:
            bars = [
                (max(middle, floor), max(worst, floor), shift - spot)
                for case, spot in zip(cases, spots, strict=True)
                if _values(case, kind)
                for middle, worst in (_ends(case, kind),)
            ]
            if bars:
                middles, worsts, heights = zip(*bars, strict=True)
                axes.hlines(heights, middles, worsts, color=colour, lw=0.9)
                style: dict[str, Any] = {"ms": 3.6 if kind == "pullback" else 3.2, "mew": 0.8}
                style |= {"color": colour, "mfc": fill, "clip_on": False}
                axes.plot(worsts, heights, marker, **style)
        _names(axes, cases, spots, titles)
        for limit in sorted(set(limits)):
            axes.axvline(limit, color=INK, lw=0.8, ls=(0, (3, 2)))
            _above(axes, limit, f"limit {scientific(limit)}", "left")
        axes.axvline(unit, color=MUTED, lw=0.6, ls=(0, (1, 1.6)))
        _above(axes, unit, "unit round-off", "right")

    spoken = f"{title}: worst defects of the form of {len(cases)} schemes on a log axis."
    worst = max((v for c in cases for k in KINDS for v in _values(c, k[0])), default=None)
    spoken += f" The worst of all is {scientific(worst)}."
    drawn = [kind[5] for kind in KINDS if any(_values(case, kind[0]) for case in cases)]
    return Panel(title, "", "defect: " + ", ".join(drawn), spoken, draw)


def _limits(defects: Sequence[float], marks: Sequence[float]) -> Any:
    """Return the limits of an axis of defects with these marks, but for marks far above them all.

    So defects have a third of the axis or more, unless marks are below them.
    """
    low, high = min(defects, default=min(marks)), max(defects, default=max(marks))
    far = max(BEYOND, 2 * math.log10(high / low))
    return log_limits([low, *defects, *(m for m in marks if m <= high * 10**far)], 0.03)


def depth(cases: Sequence[Case]) -> float:
    """Return the last line of a panel of these cases."""
    return max(_places(cases), default=-1)


def _places(cases: Sequence[Case]) -> list[float]:
    """Return the line of each case, with one above it for the name of a new scene."""
    lines: list[float] = []
    for index, case in enumerate(cases):
        new = index == 0 or case.scene != cases[index - 1].scene
        lines.append((lines[-1] if lines else -1.25) + (2.25 if new else 1.0))
    return lines


def _names(
    axes: Axes, cases: Sequence[Case], spots: Sequence[float], titles: dict[str, str]
) -> None:
    """Write rule names beside their lines, and the scene's name above its first one."""
    across = axes.get_yaxis_transform()
    lines: dict[str, Any] = {"color": GRID, "lw": 0.4, "zorder": 0, "transform": across}
    axes.hlines([-spot for spot in spots], 0, 1, **lines)
    before = None
    for case, spot in zip(cases, spots, strict=True):
        colour = WORDS[VERMILLION] if case.is_trouble else INK
        name = case.method + ("" if case.passed else f" ({case.verdict})")
        name += " (no form)" if case.expected.demanded else ""
        style: dict[str, Any] = {"fontsize": 7.6, "va": "center_baseline", "transform": across}
        axes.text(-0.02, -spot, name, ha="right", color=colour, **style)
        if case.scene != before:
            before = case.scene
            scene = titles.get(str(before), str(before))
            left: dict[str, Any] = {"xycoords": across, "xytext": (-0.75 * 72 * LEFT, 0)}
            bold: dict[str, Any] = {"fontsize": 7.6, "va": "center_baseline", "fontweight": "bold"}
            bold["bbox"] = {"color": PAPER, "pad": 0.5}  # lines of the grid end at the name
            axes.annotate(scene, (0, 1.0 - spot), textcoords="offset points", **left, **bold)


def _above(axes: Axes, x: float, words: str, side: str) -> None:
    """Write words over a line, or at the edge of an axis that ends before it.

    Words that would pass the right edge end there, a line higher.
    """
    low, high = axes.get_xlim()
    words = f"{words} →" if x > high else words  # which has no place on this axis
    x = min(x, high)
    beyond = side == "left" and math.log(x / low) > RIGHTMOST * math.log(high / low)
    where: dict[str, Any] = {"xycoords": axes.get_xaxis_transform(), "xytext": (0, 2)}
    if beyond:
        x, side, where["xytext"] = high, "right", (0, 9)
    axes.annotate(words, (x, 1), textcoords="offset points", fontsize=7, color=MUTED,
                  ha=side, **where)  # fmt: skip


def _values(case: Case, kind: str) -> list[float]:
    """Return all defects of a kind, including the measured worst."""
    values = [row.defects.get(kind) for row in case.rows]
    values.append(number(case.measured.get(kind)))
    return [abs(value) for value in values if value is not None]


def _ends(case: Case, kind: str) -> tuple[float, float]:
    """Return the median and the worst defect of a kind; zeros without any."""
    values = sorted(_values(case, kind)) or [0.0]
    return values[len(values) // 2], values[-1]


def against_step(case: Case) -> list[tuple[float, float]]:
    """Return the worst defect of either kind at each step size."""
    worst: dict[float, float] = {}
    for row in case.rows:
        values = [row.defects.get(kind[0]) for kind in KINDS]
        sizes = [abs(value) for value in values if value is not None]
        if row.step and sizes:
            worst[abs(row.step)] = max([worst.get(abs(row.step), 0.0), *sizes])
    return sorted(worst.items())


def controls(
    title: str, cases: Sequence[Case], sound: Sequence[Case], marks: dict[str, Mark], digits: int
) -> Panel:
    """Return a panel of one scene's controls at one precision; sound schemes are grey."""

    def draw(axes: Axes) -> None:
        curves = [against_step(case) for case in cases]
        if not any(curves):
            note(axes, f"No points. {cases[0].reason}")
            return
        grey = [point for case in sound for point in against_step(case)]
        limits = [case.expected.limit for case in sound]
        wanted = [case.expected.at_least for case in cases]
        unit = round_off(digits)
        points = [point for curve in curves for point in curve] + grey
        known = [x for x in (*limits, *wanted) if x]
        log_axis(axes, "x", log_limits([step for step, _ in points], 0.08, 1.0), 4)
        floor = min([unit / 10, *(defect for _, defect in grey if defect > 0)])
        values = [max(defect, floor) for _, defect in points]
        log_axis(axes, "y", log_limits([floor, *known, *values], 0.04))
        axes.axhspan(axes.get_ylim()[0], 10 * unit, color=GRID, alpha=0.55, lw=0)
        edge, labels = axes.get_xlim()[1], []
        lines = [(min((x for x in limits if x), default=None), "limit")]
        lines.append((max((x for x in wanted if x), default=None), "caught above"))
        for value, words in lines:
            if value:
                axes.axhline(value, color=INK, lw=0.7, ls=(0, (3, 2)))
                labels.append((edge, value, f"{words} {scientific(value)}", MUTED))
        for step, defect in grey:
            axes.plot([step], [max(defect, floor)], ".", color=MUTED, ms=4)
        if grey:
            step, defect = max(grey)
            labels.append((step, max(defect, floor), "sound schemes", MUTED))
        for case, curve, share in zip(cases, curves, shares(axes, curves), strict=True):
            mark = marks[case.method]
            drawn = [(step, max(defect, floor)) for step, defect in curve]
            if drawn:
                style: dict[str, Any] = {"color": mark.colour, **share.line(mark, 0.9)}
                style |= {"marker": mark.marker, **share.marks(3.6)}
                axes.plot(*zip(*drawn, strict=True), **style)
                labels.append((*max(drawn), _short(case), mark.colour))
        end_labels(axes, labels)

    spoken = f"{title}, controls, {digits} digits: defect against step size. "
    spoken += "; ".join(f"{_short(case)}, worst {scientific(_worst(case))}" for case in cases)
    return Panel(title, f"symplecticity defect, {digits} digits", "step h", spoken, draw)


def _short(case: Case) -> str:
    name = str(case.rule).replace("classical Runge-Kutta", "Runge–Kutta 4")
    return name if case.passed else f"{name} (missed)"


def _worst(case: Case) -> float | None:
    values = [v for kind in KINDS for v in _values(case, kind[0])]
    return max(values, default=math.nan)
