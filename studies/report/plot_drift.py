"""Pictures of long runs: momentum drift against steps, energy error against time."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import accumulate
from typing import TYPE_CHECKING, Any

from ..core.result import AnyResult
from .alike import shares
from .canvas import Panel, Sheet, log_axis, log_limits, note, round_off
from .labels import ask_height, end_labels
from .palette import GRID, INK, MUTED, Mark
from .wording import in_tens, scientific

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOMENTUM_SHEET = Sheet(width=3.3, right=1.16)
ENERGY_SHEET = Sheet(width=3.3, left=0.6, right=0.95, height=2.6)
BINS = 100
HALF = 0.36  # half the height of a strip; strips are 1 apart
STRIP = 25.0  # points of type from strip to strip, so that their numbers stand apart
TICK = 7.0  # points that the number of a tick needs


def momenta(cases: Sequence[AnyResult]) -> list[str]:
    """Return the names of the momentum maps of a scene, in the order of the report."""
    names: dict[str, None] = {}
    for case in cases:
        names |= dict.fromkeys(case.measured.drift)
        for row in case.rows[:1]:
            names |= dict.fromkeys(row.drift)
    return list(names)


def drift(
    title: str, name: str, cases: Sequence[AnyResult], marks: dict[str, Mark], digits: int
) -> Panel:
    """Return the panel of the largest drift so far of one momentum map, with the walk of round-off.

    The largest drift so far only grows; that of single rows jumps between 0 and one round-off if a
    run is as exact as its numbers.
    """

    def draw(axes: Axes) -> None:
        unit = round_off(digits)
        curves = [_drifts(case, name) for case in cases]
        points = [point for curve in curves for point in curve]
        if not points:
            note(axes, f"No points. {cases[0].reason}")
            return
        last = max(step for step, _ in points)
        walks = [case.expected.random_walk for case in cases]
        factor = max((walk for walk in walks if walk), default=unit * math.sqrt(last))
        # limits that look like one line count as one
        of_limits: dict[float, list[str]] = {}
        for case in cases:
            if limit := case.expected.limit:
                of_limits.setdefault(float(f"{limit:.2g}"), []).append(case.method)
        limits = sorted(of_limits)
        floor = min([unit / 4, *(value for _, value in points if value > 0)])
        log_axis(axes, "x", log_limits((step for step, _ in points), 0.03))
        values = [max(value, floor) for _, value in points]
        log_axis(axes, "y", log_limits([floor, factor, *limits, *values], 0.05))
        floor = axes.get_ylim()[0]  # zeros are drawn there
        for limit in limits:
            axes.axhline(limit, color=INK, lw=0.7, ls=(0, (3, 2)))
        first = axes.get_xlim()[0]
        ends = [factor * math.sqrt(step / last) for step in (first, last)]
        axes.plot([first, last], ends, color=MUTED, lw=0.9, ls=(0, (1, 1.6)))
        labels = [(last, factor, "ε√N", MUTED)]
        for limit, names in of_limits.items():
            more = f" and {len(names) - 1} more" if len(names) > 1 else ""
            said = "limit" if len(limits) == 1 else f"limit of {names[0]}{more}"
            labels.append((last, limit, said, MUTED))
        drawn = [
            list(zip(steps, accumulate([max(v, floor) for v in values], max), strict=True))
            for steps, values in (
                zip(*curve, strict=True) if curve else ((), ()) for curve in curves
            )
        ]
        for case, curve, share in zip(cases, drawn, shares(axes, drawn), strict=True):
            mark = marks[case.method]
            style = {"color": mark.colour, "clip_on": False, **share.line(mark, 0.8)}
            if len(curve) == 1:  # a line of one point has no length
                style |= {"marker": mark.marker, "markersize": 3.6}
            if curve:
                axes.plot(*zip(*curve, strict=True), zorder=2.5, **style)
            end = curve[-1][1] if curve else floor
            labels.append((last, end, drifted(case, name), mark.colour))
        end_labels(axes, labels)

    spoken = f"{title}, {name}: relative drift against steps, {digits} digits. " + "; ".join(
        f"{case.method} {scientific(case.measured.drift.get(name))}" for case in cases
    )
    return Panel(title, f"largest drift of {name} so far", "steps N", spoken, draw)


def drifted(case: AnyResult, name: str) -> str:
    """Return the rule, its worst drift of this quantity, and the word for one above its limit."""
    worst, limit = case.measured.drift.get(name), case.expected.limit
    if worst is None:
        return f"{case.method}\n({case.verdict})"
    words = f"{case.method}  {scientific(worst, 0)}"
    if limit is None or worst <= limit:
        return words
    return f"{words}\n({'measured' if case.verdict == 'measured' else 'fail'})"


def _drifts(case: AnyResult, name: str) -> list[tuple[float, float]]:
    """Return steps and drift; for many rows the worst in each of equal logarithmic bins."""
    worst: dict[int, tuple[float, float]] = {}
    pairs = []
    for row in case.rows:
        value = row.drift.get(name)
        if row.step > 0 and value is not None:
            pairs.append((float(row.step), abs(value)))
    if len(pairs) <= BINS:
        return sorted(pairs)
    low, high = (math.log(edge) for edge in (min(pairs)[0], max(pairs)[0]))
    for step, value in pairs:
        key = int(BINS * (math.log(step) - low) / (high - low + 1e-12))
        if key not in worst or value > worst[key][1]:
            worst[key] = (step, value)
    return sorted(worst.values())


def energy(
    title: str, cases: Sequence[AnyResult], marks: dict[str, Mark], digits: int,
    drifts: Callable[[Any], bool] = lambda case: False,
) -> Panel:  # fmt: skip
    """Return the panel of one scene's energy error: a strip per rule, on one scale.

    drifts: True for a case of which the drift is told in place of the band. The widest band fills
    its strip, so that bands can be compared, and a narrower one is magnified by the power of ten in
    its label.
    """

    def draw(axes: Axes) -> None:
        curves = [_envelope(case) for case in cases]
        if not any(curves):
            note(axes, f"No points. {cases[0].reason}")
            return
        end = max(time for curve in curves for time, _, _ in curve)
        start = min(time for curve in curves for time, _, _ in curve)
        start = 0.0 if 0 < start < end / 50 else start
        end = max(end, float(f"{end:.2g}"))
        axes.set_xlim(start, end)
        axes.set_ylim(-len(cases) + 0.45, 0.55)
        axes.spines["left"].set_visible(False)
        ask_height(axes, STRIP * len(cases))
        tall = axes.bbox.height * 72 / axes.figure.dpi / len(cases)
        axes.locator_params(axis="x", nbins=4)
        labels, ticks = [], []
        ends = [
            (min([0.0, *(low for _, low, _ in c)]), max([0.0, *(high for _, _, high in c)]))
            for c in curves
        ]
        widest = max(high - low for low, high in ends)
        for index, (case, curve) in enumerate(zip(cases, curves, strict=True)):
            mark = marks[case.method]
            low, high = ends[index]
            larger = math.floor(math.log10(widest / (high - low)) + 1e-9) if high > low else 0
            scale = 10.0**larger * 2 * HALF / widest if high > low else 0.0
            zero = -index - scale * (low + high) / 2
            if not curve:  # an empty strip with its zero would look like an energy that is kept
                labels.append((end, -float(index), _label(case, 0, drifts), mark.colour))
                continue
            axes.axhspan(-index - HALF, -index + HALF, color=GRID, alpha=0.3, lw=0)
            times, below, above = zip(*curve, strict=True)
            lower, upper = ([zero + scale * e for e in errors] for errors in (below, above))
            style: dict[str, Any] = {"fc": (mark.colour, 0.45), "ec": mark.colour, "lw": 0.55}
            style["ls"] = mark.dash  # two rules of one colour differ in it
            axes.fill_between(times, lower, upper, **style)
            axes.plot([start, end], [zero, zero], color=INK, lw=0.7, ls=(0, (2, 1.6)), zorder=3)
            ticks.append((zero, "0"))
            ticks += [
                (zero + scale * error, _signed(error))
                for error in (low, high)
                if scale * abs(error) * tall > TICK
            ]
            words = _label(case, larger, drifts)
            if curve[-1][0] < end / 2:  # a sliver beside longer runs
                words += f"\nto t = {curve[-1][0]:.6g}"
            labels.append((end, -float(index), words, mark.colour))
        axes.set_yticks(*zip(*ticks, strict=True))
        axes.tick_params(axis="y", labelsize=6.6, length=2, pad=1.5)
        end_labels(axes, labels, indent=6)

    spoken = f"{title}: relative energy error against time, {digits} digits. " + "; ".join(
        " ".join((case.method, *_told(case, drifts))) for case in cases
    )
    return Panel(title, "relative energy error", "time", spoken, draw)


def _told(case: AnyResult, drifts: Callable[[Any], bool]) -> tuple[str, ...]:
    """Return ("drift", its size) or ("band", its size), or nothing."""
    if drifts(case):
        return "drift", _signed(case.measured.drift)
    return () if case.measured.band is None else ("band", _two(case.measured.band))


def _label(case: AnyResult, larger: int, drifts: Callable[[Any], bool]) -> str:
    """Return the rule, its band, its magnification, and the verdict unless it is a pass."""
    told = _told(case, drifts)
    words = case.method + (f"\n{' '.join(told)}" if told else "")
    words += f", drawn ×{10 if larger == 1 else in_tens(10.0**larger)}" if larger else ""
    return words if case.passed else f"{words}\n({case.verdict})"


def _signed(value: float) -> str:
    return f"+{_two(value)}" if value > 0 else f"−{_two(-value)}"


def _two(value: float) -> str:
    """Return a number with two significant digits."""
    return f"{value:.2g}" if 0.01 <= value < 99 else scientific(value)


def _envelope(case: AnyResult) -> list[tuple[float, float, float]]:
    """Return time, smallest and largest error of each stretch; with few rows each is a stretch."""
    pairs = sorted((row.time, row.error) for row in case.rows
                   if row.time is not None and row.error is not None)  # fmt: skip
    if len(pairs) <= 2 * BINS:
        return [(time, error, error) for time, error in pairs]
    kept = []
    for k in range(BINS):
        part = pairs[k * len(pairs) // BINS : (k + 1) * len(pairs) // BINS]
        errors = [error for _, error in part]
        # the first and the last stretch reach the ends of the run
        time = part[0 if k == 0 else -1 if k == BINS - 1 else len(part) // 2][0]
        kept.append((time, min(errors), max(errors)))
    return kept
