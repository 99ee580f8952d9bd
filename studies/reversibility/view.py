"""The page of reversibility: how the defect of a step forth and back is shown."""

from __future__ import annotations

from collections.abc import Sequence

from ..core.records import AtMost
from ..report.canvas import Panel
from ..report.grouping import figures_by_precision
from ..report.palette import Mark
from ..report.view import Sketch, Titles, View
from ..report.wording import limit
from . import plot
from .plot import Case
from .records import Measured, Row

REVERSIBILITY = (
    "How far a step back, Φ₋ₕ, misses the point that the step forth, Φₕ, has left: the worst "
    "component, each relative to the terms it is made of. "
    "Dashed: the limit that the verdict uses. Dotted: one unit of round-off."
)


def _sketches(cases: Sequence[Case], known: dict[str, Mark], titles: Titles) -> list[Sketch]:
    def panels(scene: str, own: Sequence[Case], digits: int) -> list[Panel]:
        return [plot.panel(titles.get(scene, scene), own, known, digits)]

    words = ("reversibility", "Reversibility", REVERSIBILITY)
    return figures_by_precision(*words, cases, plot.SHEET, panels)


VIEW = View(measured=Measured, expected=AtMost, row=Row, wanted=limit, sketches=_sketches)
