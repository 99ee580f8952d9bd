"""How the way there and back is shown."""

from __future__ import annotations

from collections.abc import Sequence

from ..report.grouping import by_scene, precisions
from ..report.palette import Mark
from ..report.view import Sketch, Titles, View
from ..report.wording import Case, limit
from . import plot

REVERSIBILITY = (
    "How far a step back, Φ₋ₕ, misses the point that the step forth, Φₕ, has left, relative to the "
    "size of the state. Dashed: the limit that the verdict uses. Dotted: one unit of round-off."
)


def _sketches(cases: Sequence[Case], known: dict[str, Mark], titles: Titles) -> list[Sketch]:
    return [
        Sketch(
            f"reversibility-{digits}", f"Reversibility, {digits} digits", REVERSIBILITY,
            [plot.panel(titles.get(scene, scene), own, known, digits)
             for scene, own in by_scene(same).items()],
            plot.SHEET, digits,
        )
        for digits, same in precisions(cases).items()
    ]  # fmt: skip


VIEW = View(wanted=limit, sketches=_sketches)
