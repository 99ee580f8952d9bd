"""Cases by precision and by scene, for figures."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from ..core.records import grouped
from ..core.result import AnyResult
from .canvas import Panel, Sheet
from .view import Sketch


def precisions(cases: Sequence[AnyResult]) -> dict[int, list[AnyResult]]:
    """Return the cases for each number of digits, fewest digits first."""
    return dict(sorted(grouped(cases, lambda case: case.digits).items()))


def by_scene(cases: Sequence[AnyResult]) -> dict[str, list[AnyResult]]:
    """Return the cases of each scene, in their order."""
    return grouped(cases, lambda case: str(case.scene))


def figures_by_precision(
    name: str, title: str, caption: str, cases: Sequence[AnyResult], sheet: Sheet,
    panels: Callable[[str, Sequence[AnyResult], int], Iterable[Panel]],
) -> list[Sketch]:  # fmt: skip
    """Return one figure per precision, with panels for each scene: its name, cases and digits.

    The caption is at the first figure; the others refer to it.
    """
    sketches: list[Sketch] = []
    for digits, same in precisions(cases).items():
        drawn = [p for scene, own in by_scene(same).items() for p in panels(scene, own, digits)]
        words = f"As above, with {digits} digits." if sketches else caption
        entitled = f"{title}, {digits} digits"
        sketches.append(Sketch(f"{name}-{digits}", entitled, words, drawn, sheet, digits))
    return sketches
