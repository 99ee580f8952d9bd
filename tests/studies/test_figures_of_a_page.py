"""Figures of the report's page: true curves, their numbers, labels and words."""

from __future__ import annotations

import json
import math
import random
import re
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from matplotlib.axes import Axes

from discmech.studies.report.alike import Share, shares
from discmech.studies.report.canvas import Panel, Sheet, log_axis, render
from discmech.studies.report.labels import spread
from discmech.studies.report.palette import Mark


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


def test_marks_keep_their_numbers_and_ticks_are_no_marks() -> None:
    points = [(0.5, 1e-3), (2.0, 3e-7), (7.25, 1e-9)]

    def draw(axes: Axes) -> None:
        log_axis(axes, "x", (0.1, 10))
        log_axis(axes, "y", (1e-10, 1))
        axes.plot(*zip(*points, strict=True), marker="o", color="#0072b2")

    shown, definitions = panel(draw)
    ends = re.search(r'data-axes="([^"]*)"', shown)
    assert ends and any("var(--blue)" in shape for shape in definitions.values())
    drawn = re.sub("<g class=axis>.*?</g>", "", shown)
    found = [(float(x), float(y)) for x, y in re.findall(r"<use [^>]*x=(\S+) y=(\S+)", drawn)]
    for place, point in zip(found, points, strict=True):
        for at, wanted, (first, last, low, high, log) in zip(
            place, point, json.loads(ends[1]), strict=True
        ):
            assert log
            value = low * (high / low) ** ((at - first) / (last - first))
            assert value == pytest.approx(wanted, rel=2e-3)


def test_lines_are_true_to_a_tenth_of_a_point() -> None:
    chance = random.Random(5)
    x = sorted(chance.random() for _ in range(200))
    y = [chance.random() / 2 + k % 2 / 2 for k in range(len(x))]  # no two steps go one way

    def draw(axes: Axes) -> None:
        axes.set(xlim=(0, 1), ylim=(0, 1))
        axes.plot(x, y, color="#d55e00")

    shown, definitions = panel(draw)
    (name,) = (k for k, style in definitions.items() if "vermillion" in style and "<style" in style)
    (route,) = re.findall(rf'class={name} [^>]*d="M([^"]*)"', shown)
    steps = [[float(n) for n in re.findall(r"-?[\d.]+", step)] for step in route.split("l")]
    ends = re.search(r'data-axes="([^"]*)"', shown)
    assert ends
    (left, right, *_), (low, high, *_) = json.loads(ends[1])
    corners = np.cumsum(steps, axis=0).tolist()
    for a, b in zip(x, y, strict=True):
        wanted = (left + a * (right - left), low + b * (high - low))
        assert min(math.dist(wanted, corner) for corner in corners) < 0.08


def test_words_of_a_figure_reach_the_page_in_one_piece() -> None:
    shown, _ = panel(lambda axes: log_axis(axes, "y", (1e-5, 8e-5)))
    words = re.findall("<text[^>]*>(.*?)</text>", shown)
    assert {"in R⁴", "10⁻⁵ of |μ₃|", "10⁻⁵", "2×10⁻⁵", "$5 to $6"} <= set(words)
    assert "transform" not in shown
