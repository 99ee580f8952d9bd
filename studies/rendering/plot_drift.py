"""Pictures of long runs: momentum drift against steps, energy error against time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from studies.rendering.canvas import Panel, Sheet, log_axis, log_limits, note
from studies.rendering.labels import end_labels
from studies.rendering.palette import GRID, INK, MUTED, Mark
from studies.rendering.plot_symplecticity import round_off
from studies.rendering.wording import Case, mapping, number, rows, rule_name, scientific, verdict

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOMENTUM_SHEET = Sheet(right=0.8)
ENERGY_SHEET = Sheet(left=0.16, right=0.95, height=2.35)
BINS = 150


def momenta(cases: Sequence[Case]) -> list[str]:
    """Names of the momentum maps of a scene, in the order in which they are reported."""
    found: dict[str, None] = {}
    for case in cases:
        found |= dict.fromkeys(mapping(case, "measured").get("drift") or {})
        for row in rows(case)[:1]:
            found |= dict.fromkeys(row.get("drift") or {})
    return list(found)


def drift(
    title: str, name: str, cases: Sequence[Case], marks: dict[str, Mark], digits: int
) -> Panel:
    """Drift of one momentum map of one scene, with the random walk of round-off."""

    def draw(axes: Axes) -> None:
        unit = round_off(digits)
        curves = [_drifts(case, name) for case in cases]
        points = [point for curve in curves for point in curve]
        if not points:
            note(axes, f"No points. {cases[0].get('reason') or ''}")
            return
        last = max(step for step, _ in points)
        expected = [mapping(case, "expected") for case in cases]
        walks = [number(e.get("random_walk")) for e in expected]
        factor = max((walk for walk in walks if walk), default=unit * math.sqrt(last))
        limits = sorted({x for e in expected if (x := number(e.get("limit")))})
        floor = unit / 10
        log_axis(axes, "x", log_limits((step for step, _ in points), 0.03))
        values = [max(value, floor) for _, value in points]
        log_axis(axes, "y", log_limits([floor, factor, *limits, *values], 0.05))
        for limit in limits:
            axes.axhline(limit, color=INK, lw=0.7, ls=(0, (3, 2)))
        first = axes.get_xlim()[0]
        ends = [factor * math.sqrt(step / last) for step in (first, last)]
        axes.plot([first, last], ends, color=MUTED, lw=0.9, ls=(0, (1, 1.6)))
        labels = [(last, factor, "ε√N", MUTED)]
        labels += [(last, limit, "limit", MUTED) for limit in limits]
        for case, curve in zip(cases, curves, strict=True):
            mark = marks[rule_name(case)]
            drawn = [(step, max(value, floor)) for step, value in curve]
            if drawn:
                xs, ys = zip(*drawn, strict=True)
                axes.plot(xs, ys, color=mark.colour, lw=0.8, ls=mark.dash)
                # The label stands where the eye sees the end: at the middle of the last few.
                tail = sorted(ys[-9:])
                labels.append((last, tail[len(tail) // 2], _label(case), mark.colour))
        end_labels(axes, labels)

    spoken = f"{title}, {name}: relative drift against steps, {digits} digits. " + "; ".join(
        f"{rule_name(case)} {scientific((mapping(case, 'measured').get('drift') or {}).get(name))}"
        for case in cases
    )
    return Panel(title, f"drift of {name}", "steps N", spoken, draw)


def _label(case: Case) -> str:
    state = verdict(case)
    return rule_name(case) + ("" if state == "pass" else f"\n({state})")


def _drifts(case: Case, name: str) -> list[tuple[float, float]]:
    """Steps and drift; of many rows the worst in each of equal logarithmic bins."""
    worst: dict[int, tuple[float, float]] = {}
    found = []
    for row in rows(case):
        step, value = number(row.get("step")), number((row.get("drift") or {}).get(name))
        if step and step > 0 and value is not None:
            found.append((step, abs(value)))
    if len(found) <= BINS:
        return sorted(found)
    low, high = (math.log(edge) for edge in (min(found)[0], max(found)[0]))
    for step, value in found:
        key = int(BINS * (math.log(step) - low) / (high - low + 1e-12))
        if key not in worst or value > worst[key][1]:
            worst[key] = (step, value)
    return sorted(worst.values())


def energy(title: str, cases: Sequence[Case], marks: dict[str, Mark], digits: int) -> Panel:
    """Energy error of one scene: one strip a rule, each scaled to its own largest error."""

    def draw(axes: Axes) -> None:
        curves = [_envelope(case) for case in cases]
        if not any(curves):
            note(axes, f"No points. {cases[0].get('reason') or ''}")
            return
        end = max(time for curve in curves for time, _ in curve)
        start = min(time for curve in curves for time, _ in curve)
        axes.set_xlim(start, end)
        axes.set_ylim(-len(cases) + 0.45, 0.55)
        axes.set_yticks([])
        axes.spines["left"].set_visible(False)
        axes.locator_params(axis="x", nbins=4)
        labels = []
        for index, (case, curve) in enumerate(zip(cases, curves, strict=True)):
            mark = marks[rule_name(case)]
            size = max((abs(error) for _, error in curve), default=0.0)
            axes.axhspan(-index - 0.42, -index + 0.42, color=GRID, alpha=0.35, lw=0)
            axes.axhline(-index, color=MUTED, lw=0.4)
            shown = [-index + 0.42 * error / size if size else -index for _, error in curve]
            times = [time for time, _ in curve]
            axes.plot(times, shown, color=mark.colour, lw=0.55, solid_joinstyle="round")
            words = f"{_label(case)}\n±{scientific(size)}" if curve else f"{_label(case)}\nno rows"
            labels.append((end, -float(index), words, mark.colour))
        end_labels(axes, labels)

    spoken = f"{title}: relative energy error against time, {digits} digits. " + "; ".join(
        f"{rule_name(case)} band {scientific(mapping(case, 'measured').get('band'))}"
        for case in cases
    )
    return Panel(title, "relative energy error", "time", spoken, draw)


def _envelope(case: Case) -> list[tuple[float, float]]:
    """Time and error; of many rows the smallest and the largest error in each bin."""
    found: list[tuple[float, float]] = []
    for row in rows(case):
        time, error = number(row.get("time")), number(row.get("error"))
        if time is not None and error is not None:
            found.append((time, error))
    found.sort()
    if len(found) <= 2 * BINS:
        return found
    kept: list[Any] = []
    for k in range(BINS):
        part = found[k * len(found) // BINS : (k + 1) * len(found) // BINS]
        ends = {min(part, key=lambda p: p[1]), max(part, key=lambda p: p[1])}
        kept += sorted(ends)
    return kept
