"""The figure of a case over the last runs of the report, as a small line in its row."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from html import escape
from itertools import groupby, pairwise
from typing import TYPE_CHECKING

from ..core.result import AnyResult
from .wording import numbers_in

if TYPE_CHECKING:
    from ..core.history import Found

WIDTH, HEIGHT = 60, 12  # in pixels, with a margin of 2 for the marks
#: largest total bytes of the lines of a page, separately for cases that pass and that do not, so
#: that the former cannot displace the latter. The whole report has some 170,000 of its 3 MB left; a
#: line takes some 270.
ROOM = {True: 100_000, False: 40_000}
Past = Callable[[AnyResult], "Sequence[Found]"]


def unknown_past(case: AnyResult) -> Sequence[Found]:
    """Return an empty past, for a page by itself."""
    return ()


class Sparklines:
    """The lines of a page, while there is room; drawn and left_out count them."""

    def __init__(self, past: Past) -> None:
        self.past, self.room = past, dict(ROOM)
        self.drawn = self.left_out = 0

    def of(self, case: AnyResult) -> str:
        """Return the line of a case, or "" if nothing changed or no room is left."""
        line, passes = sparkline(self.past(case)), case.passed
        size = len(line.encode())
        if size > self.room[passes]:
            self.left_out += 1
            return ""
        self.room[passes] -= size
        self.drawn += bool(line)
        return line


def sparkline(past: Sequence[Found]) -> str:
    """Return the figures of some runs as a line with its words, or "" if all are equal.

    Marks are at the end and wherever the verdict changes, in the verdict's colour.
    """
    if len({(one.figure, one.verdict) for one in past}) < 2:
        return ""
    heights = _heights([(one.figure, one.verdict) for one in past])
    low, high = min(heights), max(heights)
    places = [
        f"{WIDTH * k / (len(past) - 1):.0f} {HEIGHT * (high - height) / (high - low):.0f}"
        for k, height in enumerate(heights)
    ]
    marked = [k for k, (a, b) in enumerate(pairwise(past), 1) if a.verdict != b.verdict]
    marks = {past[k].verdict: "" for k in (*marked, -1)}
    for k in dict.fromkeys((*marked, len(past) - 1)):
        marks[past[k].verdict] += f"M{places[k]}h0"
    drawn = "".join(f'<path class={said} d="{d}"/>' for said, d in marks.items())
    box = f"-2 -2 {WIDTH + 4} {HEIGHT + 4}"
    return (
        f'<svg class=past viewBox="{box}" role=img><title>{escape(words(past))}</title>'
        f'<path d="M{" ".join(places)}"/>{drawn}</svg>'
    )


def words(past: Sequence[Found]) -> str:
    """Return in words the last figure with its runs and first date, then the one before."""
    judged = len({one.verdict for one in past}) > 1
    groups = [list(g) for _, g in groupby(past, lambda one: (one.figure, one.verdict))]

    def told(group: Sequence[Found]) -> str:
        figure = f"{group[0].figure}, {group[0].verdict}," if judged else group[0].figure
        return f"{figure} in {len(group)} run" + "s" * (len(group) > 1)

    first = groups[-1][0]
    since = first.date[:10] + f" (commit {first.commit})" * bool(first.commit)
    same = ": unchanged" if len(groups[-1]) > 1 else ""
    more = f"; {len(groups) - 1} changes in {len(past)} runs" if len(groups) > 2 else ""
    return f"{told(groups[-1])}, since {since}{same}; before: {told(groups[-2])}{more}"


def _heights(figures: Sequence[tuple[str, str]]) -> list[float]:
    """Return heights from the first number that changes, logarithmic beyond one decade.

    If no number changes, or runs have different counts of numbers, each new figure is one higher.
    """
    numbers = [numbers_in(figure) for figure, _ in figures]
    if len(set(map(len, numbers))) == 1:
        for column in zip(*numbers, strict=True):
            if len(set(column)) > 1 and all(map(math.isfinite, column)):
                decades = min(column) > 0 and max(column) > 10 * min(column)
                return [math.log10(value) if decades else value for value in column]
    kinds = list(dict.fromkeys(figures))
    return [float(kinds.index(one)) for one in figures]
