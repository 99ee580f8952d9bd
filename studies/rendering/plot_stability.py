"""Pictures of stability: the linear step over hω, maps over step and stiffness, fpu's exchange."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import groupby
from typing import TYPE_CHECKING, Any

from studies.rendering.alike import shares
from studies.rendering.canvas import Panel, Sheet, log_axis, log_limits, note, tick_text
from studies.rendering.labels import end_labels
from studies.rendering.palette import BLUE, GRID, INK, MUTED, ORANGE, PURPLE, SKY, VERMILLION, Mark
from studies.rendering.typeset import figure_text
from studies.rendering.wording import Case, mapping, number, rows, rule_name

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LINEAR_SHEET = Sheet(width=3.5, right=1.16)
MAP_SHEET = Sheet(width=3.0, height=1.95, left=0.55, right=0.2)
EXCHANGE_SHEET = Sheet(width=3.5, right=1.0)
#: class → (colour, opacity, hatching): told apart without colours as well
LOOKS: dict[str, tuple[str, float, str]] = {
    "bounded": (BLUE, 0.18, ""),
    "resonant": (ORANGE, 0.75, ""),
    "drifting": (PURPLE, 0.75, "///"),
    "Newton failed": (SKY, 0.9, "..."),
    "blown up": (VERMILLION, 0.9, ""),
}
KEPT = 0.15  # of an adiabatic invariant: as much may it change
FAR = 4.0  # of hω in the linear pictures


def radius(cases: Sequence[Case], marks: dict[str, Mark]) -> Panel:
    """Spectral radius of every rule."""

    def value(row: dict[str, Any]) -> float | None:
        return number(row.get("radius"))

    def words(case: Case) -> str:
        end = number(mapping(case, "measured").get("stable_to"))
        if case.get("control"):
            return f"{rule_name(case)}\n(control)"
        return f"{rule_name(case)}\n" + (f"to {end:.6f}" if end is not None else "no end")

    def draw(axes: Axes) -> None:
        axes.set_ylim(0.6, 3.0)
        _linear(axes, cases, marks, value, words)

    return Panel("Spectral radius", "of one step", "hω", _spoken("Spectral radius", cases), draw)


def phase(cases: Sequence[Case], marks: dict[str, Mark]) -> Panel:
    """Phase of a step beside the exact one, hω."""

    def value(row: dict[str, Any]) -> float | None:
        angle = number(row.get("phase"))
        return None if angle is None or not row.get("krein") else angle / math.pi

    def draw(axes: Axes) -> None:
        axes.set_ylim(0, 1.02)
        axes.plot([0, math.pi], [0, 1], color=MUTED, lw=0.8, ls=(0, (1, 1.6)))
        for name, height in (("1:3", 2 / 3), ("1:4", 1 / 2)):
            axes.axhline(height, color=GRID, lw=0.7)
            axes.text(0.06, height + 0.012, name, fontsize=6.4, color=MUTED)
        sound = [case for case in cases if not case.get("control")]
        _linear(axes, sound, marks, value, rule_name)

    title = "Phase of a step"
    return Panel(title, "φ/π; dotted: exact", "hω", _spoken(title, cases), draw)


def _spoken(what: str, cases: Sequence[Case]) -> str:
    return f"{what} against step times frequency. " + "; ".join(map(rule_name, cases))


def _linear(axes: Axes, cases: Sequence[Case], marks: Any, value: Any, words: Any) -> None:
    """A curve a rule over 0 < hω ≤ FAR on linear axes, labelled at its end."""
    axes.set_xlim(0, FAR)
    low, high = axes.get_ylim()
    curves = []
    for case in cases:
        points = [(number(row.get("z")), value(row)) for row in rows(case)]
        curves.append([(z, y) for z, y in points if z and z <= FAR and y is not None])
    axes.grid(visible=True, color=GRID, linewidth=0.4)
    labels = []
    for case, curve, share in zip(cases, curves, shares(axes, curves), strict=True):
        if not curve:
            continue
        mark = marks[rule_name(case)]
        axes.plot(*zip(*curve, strict=True), color=mark.colour, **share.line(mark, 1.0))
        inside = [(z, y) for z, y in curve if low <= y <= high]
        labels.append((*(inside or curve)[-1], words(case), mark.colour))
    end_labels(axes, labels)


def stability_map(title: str, case: Case) -> Panel:
    """What becomes of the runs of one rule, cell by cell."""

    def draw(axes: Axes) -> None:
        cells = [row for row in rows(case) if number(row.get("z"))]
        if not cells:
            note(axes, f"No cells. {case.get('reason') or ''}")
            return
        from matplotlib.patches import Rectangle

        places = sorted({float(row["z"]) for row in cells})
        half = math.sqrt(places[1] / places[0]) if len(places) > 1 else 1.1
        stiff = sorted({float(row["stiffness"]) for row in cells})
        log_axis(axes, "x", (places[0] / half, places[-1] * half), 4)
        axes.grid(visible=False)
        axes.set_ylim(-0.5, len(stiff) - 0.5)
        for line, value in enumerate(stiff):
            row = sorted((r for r in cells if r["stiffness"] == value), key=lambda r: r["z"])
            for kind, run in groupby(row, key=lambda r: str(r["class"])):
                zs = [float(r["z"]) for r in run]
                colour, alpha, hatch = LOOKS[kind]
                left, right = zs[0] / half, zs[-1] * half
                axes.add_patch(Rectangle((left, line - 0.5), right - left, 1, lw=0, fc=colour,
                                         alpha=alpha))  # fmt: skip
                if hatch:
                    _hatch(axes, left, right, line, hatch)
        for line in range(1, len(stiff)):
            axes.axhline(line - 0.5, color="#ffffff", lw=0.6)
        shown = [k for k in range(len(stiff)) if len(stiff) < 7 or k % 2 == 0]
        texts = [f"{v:g}" if 0.001 <= v < 10000 else tick_text(v) for v in stiff]
        axes.set_yticks(shown, [texts[k] for k in shown])
        axes.tick_params(axis="y", length=0)

    found = mapping(mapping(case, "measured"), "classes")
    spoken = f"{title}, {rule_name(case)}: " + ", ".join(f"{n} cells {k}" for k, n in found.items())
    subtitle = f"{rule_name(case)}; upwards: {case.get('label') or 'stiffness'}"
    return Panel(title, subtitle, "hω", spoken, draw)


def _hatch(axes: Axes, left: float, right: float, line: int, hatch: str) -> None:
    """Strokes or dots within a cell, drawn as marks: they keep the page's colours."""
    steps = max(1, round(math.log10(right / left) * 10))
    xs = [left * (right / left) ** ((k + 0.5) / steps) for k in range(steps)]
    marker: Any = "." if hatch == "..." else (2, 0, -35)
    axes.plot(xs, [line] * steps, ls="", marker=marker, ms=2.2 if hatch == "..." else 6,
              mew=0.6, color=INK)  # fmt: skip


def legend() -> Panel:
    """What the colours of the maps mean."""

    def draw(axes: Axes) -> None:
        from matplotlib.patches import Rectangle

        axes.axis("off")
        axes.set_xlim(0, 10)
        axes.set_ylim(len(LOOKS) - 0.4, -0.6)
        for line, (kind, (colour, alpha, hatch)) in enumerate(LOOKS.items()):
            axes.add_patch(Rectangle((0.2, line - 0.34), 1.4, 0.68, lw=0, fc=colour, alpha=alpha))
            if hatch:
                marker: Any = "." if hatch == "..." else (2, 0, -35)
                axes.plot([0.6, 1.2], [line, line], ls="", marker=marker, color=INK, mew=0.6,
                          ms=2.2 if hatch == "..." else 6)  # fmt: skip
            axes.text(2.0, line, figure_text(kind), va="center", fontsize=8)

    return Panel("Classes", "", "", "Classes: " + ", ".join(LOOKS), draw)


def exchange(cases: Sequence[Case], marks: dict[str, Mark]) -> Panel:
    """Error of the energy exchange on fpu against hω."""

    def draw(axes: Axes) -> None:
        curves = {rule_name(case): _pairs(case, "exchange") for case in cases}
        everything = [point for curve in curves.values() for point in curve]
        if not everything:
            note(axes, "No runs.")
            return
        log_axis(axes, "x", log_limits((z for z, _ in everything), 0.05), 4)
        log_axis(axes, "y", log_limits((e for _, e in everything), 0.05), 5)
        _marked(axes, curves, marks)

    spoken = "Error of the exchange of energy between stiff springs. " + "; ".join(
        map(rule_name, cases)
    )
    return Panel("Energy exchange, ω = 50", "largest error up to T = 100", "hω", spoken, draw)


def adiabatic(cases: Sequence[Case], marks: dict[str, Mark]) -> Panel:
    """Change of fpu's adiabatic invariant over a long time against ω."""

    def draw(axes: Axes) -> None:
        curves = {rule_name(case): _pairs(case, "adiabatic") for case in cases}
        everything = [point for curve in curves.values() for point in curve]
        if not everything:
            note(axes, "No run came to its end.")
            return
        failed = [
            float(key)
            for case in cases
            for key, value in mapping(mapping(case, "measured"), "adiabatic").items()
            if value is None
        ]
        log_axis(axes, "x", log_limits([*(w for w, _ in everything), *failed], 0.05), 4)
        log_axis(axes, "y", log_limits([*(e for _, e in everything), 3 * KEPT], 0.1), 4)
        axes.axhline(KEPT, color=INK, lw=0.7, ls=(0, (3, 2)))
        _marked(axes, curves, marks)
        for omega in failed:
            axes.plot([omega], [1.0], ls="", marker="|", ms=7, mew=1.4, color=VERMILLION,
                      transform=axes.get_xaxis_transform(), clip_on=False)  # fmt: skip
            words = figure_text(f"ω = {omega:g}: blown up")
            axes.annotate(words, (omega, 1.0), (4, -7), fontsize=6.6, color=MUTED,
                          xycoords=axes.get_xaxis_transform(),
                          textcoords="offset points")  # fmt: skip

    spoken = "Change of the adiabatic invariant over a long time. " + "; ".join(
        map(rule_name, cases)
    )
    title, subtitle = "Oscillatory energy", "largest change up to T = 10⁵ at hω = 10"
    return Panel(title, subtitle, "ω", spoken, draw)


def _pairs(case: Case, key: str) -> list[tuple[float, float]]:
    found = mapping(mapping(case, "measured"), key)
    points = [(float(x), number(y)) for x, y in found.items()]
    return sorted((x, y) for x, y in points if y is not None and y > 0)


def _marked(axes: Axes, curves: dict[str, list[tuple[float, float]]], marks: Any) -> None:
    labels = []
    for name, curve in curves.items():
        if curve:
            mark = marks[name]
            axes.plot(*zip(*curve, strict=True), color=mark.colour, ls=mark.dash, lw=0.9,
                      marker=mark.marker, ms=3.4)  # fmt: skip
            labels.append((*curve[-1], name, mark.colour))
    end_labels(axes, labels)
