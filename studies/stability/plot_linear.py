"""Plots of stability: the linear step over hω, and the energy exchange of fpu's stiff springs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from ..report.alike import Curve, shares
from ..report.canvas import Panel, Sheet, log_axis, log_limits, note
from ..report.labels import end_labels
from ..report.palette import GRID, INK, MUTED, VERMILLION, Mark
from .plot_maps import Case
from .records import FARTHEST, Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LINEAR_SHEET = Sheet(width=3.5, right=1.16)
EXCHANGE_SHEET = Sheet(width=3.5, right=1.0)
KEPT = 0.15  # the largest change allowed to an adiabatic invariant
FAR = 4.0  # the largest hω in the linear plots


def radius(cases: Sequence[Case], marks: dict[str, Mark]) -> Panel:
    """Return the panel of every rule's spectral radius."""

    def value(row: Row) -> float | None:
        return row.radius

    def words(case: Case) -> str:
        end = case.measured.stable_to
        if case.control:
            return f"{case.method}\n(control)"
        return f"{case.method}\n" + (f"to {end:.6f}" if end is not None else f"beyond {FARTHEST:g}")

    def draw(axes: Axes) -> None:
        axes.set_ylim(0.6, 3.0)
        _linear(axes, cases, marks, value, words)

    return Panel("Spectral radius", "of one step", "hω", _spoken("Spectral radius", cases), draw)


def phase(cases: Sequence[Case], marks: dict[str, Mark]) -> Panel:
    """Return the panel of a step's phase beside the exact one, hω."""

    def value(row: Row) -> float | None:
        return None if row.phase is None or not row.krein else row.phase / math.pi

    def draw(axes: Axes) -> None:
        axes.set_ylim(0, 1.02)
        axes.plot([0, math.pi], [0, 1], color=MUTED, lw=0.8, ls=(0, (1, 1.6)))
        for name, height in (("1:3", 2 / 3), ("1:4", 1 / 2)):
            axes.axhline(height, color=GRID, lw=0.7)
            axes.text(0.06, height + 0.012, name, fontsize=6.4, color=MUTED)
        sound = [case for case in cases if not case.control]
        _linear(axes, sound, marks, value, _method)

    title = "Phase of a step"
    return Panel(title, "φ/π; dotted: exact", "hω", _spoken(title, cases), draw)


def _spoken(what: str, cases: Sequence[Case]) -> str:
    return f"{what} against step times frequency. " + "; ".join(map(_method, cases))


def _linear(axes: Axes, cases: Sequence[Case], marks: Any, value: Any, words: Any) -> None:
    """Draw one curve per rule over 0 < hω ≤ FAR on linear axes, labelled at its end."""
    axes.set_xlim(0, FAR)
    axes.grid(visible=True, color=GRID, linewidth=0.4)
    curves = []
    for case in cases:
        points = [(row.z, value(row)) for row in case.rows]
        curve = [(z, y) for z, y in points if z and z <= FAR and y is not None]
        curves.append((curve, marks[case.method], words(case)))
    _labelled(axes, curves, 1.0)


def _labelled(
    axes: Axes, curves: Sequence[tuple[Curve, Mark, str]], width: float, size: float | None = None
) -> None:
    """Draw curves with their words at the last point inside the axes; size: that of marks."""
    low, high = axes.get_ylim()
    labels = []
    drawn = shares(axes, [curve for curve, _, _ in curves])
    for (curve, mark, words), share in zip(curves, drawn, strict=True):
        if curve:
            look = {} if size is None else {"marker": mark.marker, **share.marks(size)}
            axes.plot(
                *zip(*curve, strict=True), color=mark.colour, **share.line(mark, width), **look
            )
            inside = [(x, y) for x, y in curve if low <= y <= high]
            labels.append((*(inside or curve)[-1], words, mark.colour))
    end_labels(axes, labels)


#: key of the measurement → title, subtitle, x label, text for a screen reader, further heights
SPRINGS = {
    "exchange": (
        "Energy exchange, ω = 50", "largest error up to T = 100", "hω",
        "Error of the exchange of energy between stiff springs.", (),
    ),
    "stiffer": (
        "Energy exchange, hω = 5", "largest error up to T = 2ω", "ω",
        "Error of the exchange of energy between ever stiffer springs.", (1.0,),
    ),
    "adiabatic": (
        "Oscillatory energy", "largest change up to T = 10⁵ at hω = 10", "ω",
        "Change of the adiabatic invariant over a long time.", (3 * KEPT,),
    ),
}  # fmt: skip


def springs(key: str, cases: Sequence[Case], marks: dict[str, Mark]) -> Panel:
    """Return the panel of one of `SPRINGS` on fpu, on logarithmic axes."""
    title, subtitle, across, spoken, heights = SPRINGS[key]

    def draw(axes: Axes) -> None:
        curves = [(_pairs(case, key), marks[case.method], case.method) for case in cases]
        everything = [point for curve, _, _ in curves for point in curve]
        if not everything:
            note(axes, "No run came to its end: numbers blew up at every step size, or steps were "
                 "not solved.")  # fmt: skip
            return
        failed = _failed(cases) if key == "adiabatic" else []
        log_axis(axes, "x", log_limits([*(x for x, _ in everything), *failed], 0.05), 4)
        log_axis(axes, "y", log_limits([*(y for _, y in everything), *heights], 0.05), 5)
        if key == "adiabatic":
            axes.axhline(KEPT, color=INK, lw=0.7, ls=(0, (3, 2)))
        _labelled(axes, curves, 0.9, 3.4)
        for omega in failed:
            place: dict[str, Any] = {"xycoords": axes.get_xaxis_transform()}
            axes.plot([omega], [1.0], ls="", marker="|", ms=7, mew=1.4, color=VERMILLION,
                      transform=axes.get_xaxis_transform(), clip_on=False)  # fmt: skip
            axes.annotate(f"ω = {omega:g}: blown up", (omega, 1.0), (4, -7),
                          fontsize=6.6, color=MUTED, textcoords="offset points",
                          **place)  # fmt: skip

    return Panel(title, subtitle, across, f"{spoken} {'; '.join(map(_method, cases))}", draw)


def _failed(cases: Sequence[Case]) -> list[float]:
    """Return every ω at which a long run did not reach its end."""
    changes = (case.measured.adiabatic or {} for case in cases)
    return [float(omega) for each in changes for omega, value in each.items() if value is None]


def _pairs(case: Case, key: str) -> list[tuple[float, float]]:
    figures: Mapping[str, float | None] = getattr(case.measured, key) or {}
    return sorted((float(x), y) for x, y in figures.items() if y is not None and y > 0)


def _method(case: Case) -> str:
    return case.method
