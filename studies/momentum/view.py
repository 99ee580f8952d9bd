"""The page of momenta: how drifts are shown."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..core.result import NONE, Result
from ..report import plot_drift
from ..report.canvas import Panel
from ..report.grouping import figures_by_precision
from ..report.palette import Mark
from ..report.view import Sketch, Titles, View
from ..report.wording import largest, limit, pairs, scientific
from .records import Expected, Measured, Row

Case = Result[Measured, Expected, Row]

DRIFT = (
    "The largest drift so far of each momentum map, relative to the sum of the absolute values of "
    "its terms, against the number of steps; beside a rule that of the whole run. Dotted: the "
    "random walk that round-off alone makes, ε√N. A line that rises faster than it is a systematic "
    "drift. Zero is drawn on the lower axis; a line in several colours is "
    "several curves that coincide."
)


def _drifts(case: Case) -> str:
    """Return each drift, with its number of steps if that is less than for the others."""
    over = case.expected.over
    most = max(over.values(), default=0)
    fewer = {name: f" ({steps} steps)" for name, steps in over.items() if steps < most}
    drift = case.measured.drift.items()
    return ", ".join(f"{k} {scientific(v)}{fewer.get(k, '')}" for k, v in drift) or NONE


def _compared(case: Case) -> dict[str, Any]:
    drifts = case.figures.get("drift") or {}
    return {"drift": max(drifts.values(), default=None), "drifts": drifts}


def _sketches(cases: Sequence[Case], known: dict[str, Mark], titles: Titles) -> list[Sketch]:
    def panels(scene: str, own: Sequence[Case], digits: int) -> list[Panel]:
        title = titles.get(scene, scene)
        return [plot_drift.drift(title, name, own, known, digits)
                for name in plot_drift.momenta(own)]  # fmt: skip

    sheet = plot_drift.MOMENTUM_SHEET
    return figures_by_precision("momentum", "Momentum drift", DRIFT, cases, sheet, panels)


VIEW = View(
    measured=Measured, expected=Expected, row=Row,
    columns=[
        ("Largest drift", _drifts),
        ("Random walk", lambda case: scientific(case.expected.random_walk)),
    ],
    got=lambda case: pairs(case.measured.drift), wanted=limit,
    short=lambda case: largest(case.measured.drift),
    sketches=_sketches, compared=_compared,
)  # fmt: skip
