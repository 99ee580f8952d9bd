"""The picture of a number that takes several values: its order and its error constant."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

from ..report.canvas import Panel, Sheet
from ..report.palette import MUTED
from ..report.view import Sketch
from ..report.wording import raised
from .records import FEWEST_DRAWN, Curve, constant, curves, to_time

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHEET = Sheet(width=3.2, right=0.3, columns=2)
CAPTION = (
    "Order and error constant against a number of the method or of the scene. The constant C is "
    "that of error ≈ C hᵖ, with p the order that most values have, so it vanishes where the order "
    "is higher, and values of a lower order, which have none, are left out; the larger mark is the "
    "best value: the highest order, then the least constant."
)


def sketches(cases: Sequence[Any]) -> Iterator[Sketch]:
    """Yield the figure of the curves, if there are any."""
    drawn = [curve for curve in curves(cases) if len(curve.cases) >= FEWEST_DRAWN]
    panels = [panel for curve in drawn for panel in _panels(curve)]
    if panels:
        yield Sketch("order-varied", "A number that varies", CAPTION, panels, SHEET)


def _panels(curve: Curve) -> Iterator[Panel]:
    orders = [(float(value), case.measured.order) for value, case in curve.cases]
    sizes = [(float(value), constant(case.rows, curve.usual)) for value, case in curve.cases
             if round(case.measured.order) >= curve.usual]  # fmt: skip
    best = None if curve.is_flat else float(curve.best[0])
    title = f"{curve.of} on {curve.place}, {curve.digits} digits"
    of = f"C of error ≈ C {raised(curve.usual)}{to_time(curve.cases[0][1])}"
    for what, points in (("order", orders), (of, sizes)):

        def draw(axes: Axes, points: Any = points, zero: bool = points is sizes) -> None:
            # an order jumps from value to value, with nothing in between
            line = "o-" if zero else "o"
            axes.plot(*zip(*points, strict=True), line, ms=3, lw=0.9, color="C0")
            for point in (point for point in points if point[0] == best):
                axes.plot(*point, "o", ms=7, mfc="none", color="C1")
            if zero:
                axes.axhline(0, lw=0.5, color=MUTED)
            else:  # the digits behind the whole number are those of the fit
                low, high = (edge([size for _, size in points]) for edge in (min, max))
                axes.set_ylim(round(low) - 0.5, round(high) + 0.5)
            axes.set_xlabel(curve.name)

        yield Panel(title, what, curve.name, f"{title}: {what} against {curve.name}.", draw)
