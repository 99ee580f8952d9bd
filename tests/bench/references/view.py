"""How the cost of certain digits is shown."""

from __future__ import annotations

from collections.abc import Sequence

from discmech.studies.core.result import AnyResult
from discmech.studies.report.palette import Mark
from discmech.studies.report.view import Sketch, Titles, View, measured_column

from . import plot

COSTS = (
    "Processor seconds of a reference whose digits are proven, against the digits and against the "
    "time. Dotted: the slope over the upper half of the points."
)


def _sketches(cases: Sequence[AnyResult], known: dict[str, Mark], titles: Titles) -> list[Sketch]:
    title = "The cost of certain digits"
    return [Sketch("reference-costs", title, COSTS, plot.panels(cases), plot.SHEET)]


VIEW = View(
    columns=[
        ("t", lambda case: f"{case.figures['time']:g}"),
        measured_column("seconds", "Processor seconds"),
        ("Steps", lambda case: str(case.figures["steps"])),
        ("Order", lambda case: str(case.figures["order"])),
        ("Certain by", lambda case: str(case.figures["certainty"])),
    ],
    short=lambda case: f"{case.figures['proven']} digits",
    wanted=lambda case: f"{case.wanted['digits']} certain digits",
    sketches=_sketches,
)
