"""Figures of the report's page: true curves, their numbers, labels and words."""

from __future__ import annotations

import re
from collections.abc import Callable
from itertools import combinations, pairwise

import pytest
from matplotlib.axes import Axes
from pytest import approx

from discmech.studies.core.result import Result, result_of
from discmech.studies.report.alike import Share, shares
from discmech.studies.report.canvas import Panel, Sheet, figure_of, log_axis, render
from discmech.studies.report.labels import _cross, end_labels, spread, uncrossed
from discmech.studies.report.palette import Mark, marks
from discmech.studies.report.plot_drift import ENERGY_SHEET, MOMENTUM_SHEET, drift, energy


def test_curves_that_coincide_share_a_line() -> None:
    from matplotlib.figure import Figure

    axes = Figure().add_subplot()
    axes.set(xscale="log", yscale="log", xlim=(1, 100), ylim=(1e-9, 1))
    line = [(float(x), x**-2.0) for x in range(1, 50)]
    near = [(x, 1.02 * y) for x, y in line]
    far = [(x, 4 * y) for x, y in line]
    assert shares(axes, [line, far, near, []]) == [Share(0, 2), Share(), Share(1, 2), Share()]
    styles = [share.line(Mark("#000000", "o"), 1.0) for share in (Share(0, 2), Share(1, 2))]
    assert styles[0]["ls"] == "-" and styles[1]["ls"][1][0] < sum(styles[1]["ls"][1])


def test_curves_that_coincide_do_so_whatever_their_points() -> None:
    """Those of phase portraits have no abscissa in common, and go back."""
    from math import cos, sin

    from matplotlib.figure import Figure

    axes = Figure().add_subplot()
    axes.set(xlim=(-2, 2), ylim=(-2, 2))
    turns = [[(cos(k / n), sin(k / n)) for k in range(int(6 * n))] for n in (20, 33.3)]
    other = [(1.1 * x, y) for x, y in turns[0]]
    assert shares(axes, [turns[0], other, turns[1]]) == [Share(0, 2), Share(), Share(1, 2)]
    assert shares(axes, [turns[0], turns[0][:1]]) == [Share(), Share()]
    assert shares(axes, [turns[0][:1], turns[0][:1], []])[:2] == [Share(0, 2), Share(1, 2)]


def test_leader_lines_do_not_cross() -> None:
    """Also where curves end at other abscissae; words then keep apart as before."""
    import random

    dice = random.Random(1)
    met = 0
    for _ in range(60):
        starts = [(100 * dice.random(), 80 * dice.random()) for _ in range(7)]
        heights = [dice.choice([8.0, 16.0]) for _ in starts]
        placed = uncrossed(starts, heights, 110.0, (-4.0, 120.0))
        lines = {k: (starts[k], (110.0, y)) for k, y in placed}
        assert sorted(lines) == list(range(7))
        assert not any(_cross(a, b) for a, b in combinations(lines.values(), 2))
        for (k, low), (j, high) in pairwise(placed):
            assert high - low >= (heights[k] + heights[j]) / 2 - 1e-9
        order = sorted(range(7), key=lambda k: starts[k][1])
        met += [k for k, _ in placed] != order
    assert met > 10  # in the order of their ends some would cross


def test_a_leader_line_crosses_no_curve() -> None:
    """Where a curve ends within others, the words' colour alone tells whose they are."""
    from math import cos, pi, sin

    from matplotlib.figure import Figure

    axes = Figure().add_subplot()
    axes.set(xlim=(-2, 2), ylim=(-2, 2))
    for turns, size in ((0.25, 1.0), (1.0, 1.2), (1.02, 1.9)):
        points = [2 * pi * turns * k / 200 for k in range(201)]
        axes.plot([size * cos(a) for a in points], [size * sin(a) for a in points])
    ends = [tuple(line.get_xydata()[-1]) for line in axes.lines]
    end_labels(axes, [(*end, f"curve {k}", "#0072b2") for k, end in enumerate(ends)])
    leaders = [note.xy[1] for note in axes.texts if not note.get_text()]
    height = (ends[2][1] + 2) / 4 * axes.bbox.height * 72 / axes.figure.dpi
    assert leaders == [approx(height)]  # that of the outermost curve


def long_run(name: str, size: float) -> Result:
    rows = [{"time": t, "error": size * (t % 2)} for t in range(100)]
    return result_of("energy", {"scene": "pendulum", "rule": name, "verdict": "fail", "rows": rows,
                                "measured": {"band": size}})  # fmt: skip


def test_axes_are_as_high_as_the_words_and_numbers_beside_them() -> None:
    """Of nine rules the labels are higher than usual axes, and zeros of strips lie close."""
    cases = [long_run(f"rule-{k}", 10.0 ** (k % 3) * (-1) ** k) for k in range(9)]
    one = energy("Pendulum", cases, marks(case.method for case in cases), 16)
    figure = figure_of([one], ENERGY_SHEET)
    (axes,) = figure.axes
    boxes = [text.get_window_extent() for text in axes.texts if "band" in text.get_text()]
    assert len(boxes) == 9 and min(box.y0 for box in boxes) >= axes.bbox.y0 - 6
    assert max(box.y1 for box in boxes) <= axes.bbox.y1 + 6
    boxes += [text.get_window_extent() for text in axes.get_xticklabels()]
    assert not any(a.overlaps(b) for a, b in combinations(boxes, 2))
    places = sorted(axes.transData.transform((0, y))[1] for y in axes.get_yticks())
    assert min(b - a for a, b in pairwise(places)) * 72 / figure.dpi > 6.6  # their size of type
    lines = {(str(e.get_edgecolor()), str(e.get_linestyle())) for e in axes.collections}
    assert len(lines) == 9


@pytest.mark.parametrize(("limits", "said"), [
    ((1e-13, 1e-13), ["limit"]),
    ((1e-13, 1e-12, 1e-13), ["limit of a and 1 more", "limit of b"]),
])  # fmt: skip
def test_limits_that_differ_are_named(limits: tuple[float, ...], said: list[str]) -> None:
    cases = [
        result_of("momentum", {
            "scene": "kepler", "rule": name, "verdict": "pass", "measured": {"drift": {"J": 1e-15}},
            "expected": {"limit": limit}, "rows": [{"step": 10, "drift": {"J": 1e-15}}],
        }) for name, limit in zip("abc", limits, strict=False)
    ]  # fmt: skip
    one = drift("Kepler", "J", cases, marks(case.method for case in cases), 16)
    (axes,) = figure_of([one], MOMENTUM_SHEET).axes
    assert [text.get_text() for text in axes.texts if "limit" in text.get_text()] == said


def test_labels_keep_apart() -> None:
    found = spread([10, 11, 12, 50], [8] * 4, 0, 60)
    assert found == [3, 11, 19, 50]
    assert spread([10, 10, 58], [8, 16, 8], 0, 60) == [4, 16, 58]
    assert spread([], [], 0, 60) == []
    assert min(b - a for a, b in pairwise(found)) >= 8


def panel(draw: Callable[[Axes], None]) -> tuple[str, dict[str, str]]:
    definitions: dict[str, str] = {}
    drawing = render([Panel("in R⁴", "10⁻⁵ of |μ₃|", "$5 to $6", "a", draw)], Sheet(), definitions)
    return drawing.panels[0], definitions


@pytest.mark.slow
def test_words_of_a_figure_reach_the_page_in_one_piece() -> None:
    shown, _ = panel(lambda axes: log_axis(axes, "y", (1e-5, 8e-5)))
    words = re.findall("<text[^>]*>(.*?)</text>", shown)
    assert {"in R⁴", "10⁻⁵ of |μ₃|", "10⁻⁵", "2×10⁻⁵", "$5 to $6"} <= set(words)
    assert "transform" not in shown
