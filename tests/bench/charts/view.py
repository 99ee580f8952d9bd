"""The page of charts: how runs through several charts are shown."""

from __future__ import annotations

from collections.abc import Sequence

from discmech.studies.core.result import NONE, AnyResult
from discmech.studies.report.palette import Mark
from discmech.studies.report.view import Sketch, Titles, View, measured_column
from discmech.studies.report.wording import scientific

from . import plot
from .records import Row

CHARTS = (
    "Runs from first steps of 0.01 to 0.99 of a turn about six axes. On the group the step makes "
    "the rotation that is asked for; the method that is bound to one Cayley chart, started with "
    "the same spin, makes another one (dots), since no u has half a turn (dotted: τ(hu) of the "
    "spin itself). The ball: starts (points), the translate that holds each rotation best (tints: "
    "e, or the axis of a half-turn), half a turn (dotted), and the lines on which FL is singular."
)


def _got(case: AnyResult) -> str:
    measured = case.figures
    if not measured:
        return NONE
    said = [f"{measured['steps']} steps", f"{measured['changes']} changes of chart"]
    said += [f"{measured['stopped']} stopped"] if measured["stopped"] else []
    names = ("residual", "pullback", "poisson", "momentum", "factorisation", "distance", "operator")
    said += [f"{k} {scientific(measured[k])}" for k in names if measured.get(k) is not None]
    return ", ".join(said)


def _translates(case: AnyResult) -> str:
    """Return the numbers of steps in the chart of each translate, e first."""
    counts = case.figures.get("translates") or {}
    return ", ".join(str(count) for count in counts.values()) or NONE


def _sketches(cases: Sequence[AnyResult], known: dict[str, Mark], titles: Titles) -> list[Sketch]:
    panels = [
        panel
        for case in cases
        for panel in plot.panels(titles.get(str(case.scene), str(case.scene)), case)
    ]
    return [Sketch("charts", "Steps of every size", CHARTS, panels, plot.SHEET)]


VIEW = View(
    row=Row,
    columns=[
        ("Steps by translate", _translates),
        measured_column("margin", "Least margin"),
        ("Got", _got),
    ],
    got=_got, wanted=lambda case: "right, or a clear error", sketches=_sketches,
)  # fmt: skip
