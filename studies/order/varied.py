"""A number of a rule or a scene that takes several values: order and error constant as curves."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from ..report.canvas import Panel, Sheet
from ..report.palette import MUTED
from ..report.view import Sketch
from ..report.wording import raised, scientific

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: mine:w=1/6 of a rule, mine.w-1_6 of a scene
_NAME = re.compile(r"(.+)[:.]([a-zA-Z]\w*)[=-](-?\d+(?:[/_]\d+)?)")
FEWEST = 3  # values that make a curve
SHEET = Sheet(width=3.2, right=0.3, columns=2)
CAPTION = (
    "Order and error constant against a number of the method or of the scene. The constant C is "
    "that of error ≈ C hᵖ, with p the order that most values have, so it vanishes where the order "
    "is higher; the larger mark is the best value: the highest order, then the least constant."
)


def constant(rows: Sequence[Any], order: float | None) -> float | None:
    """Return C of error ≈ C hᵖ by the smallest step of the fit, p the order as a whole number."""
    used = [row for row in rows if row.used and row.error and row.step]
    if order is None or not used:
        return None
    last = min(used, key=lambda row: abs(row.step))
    return float(last.error / abs(last.step) ** round(order))


@dataclass(frozen=True)
class Curve:
    """The cases with the values of one number, in their order; of: the rule or scene that has it.

    place: the other one of the two.
    """

    of: str
    name: str
    place: str
    digits: int
    cases: Sequence[tuple[Fraction, Any]]

    @property
    def usual(self) -> int:
        """The order that most values have."""
        return Counter(round(case.measured.order) for _, case in self.cases).most_common(1)[0][0]

    @property
    def best(self) -> tuple[Fraction, Any]:
        """The value with the highest order and, of these, the least error constant."""
        return max(self.cases, key=lambda pair: (
            round(pair[1].measured.order),
            -(constant(pair[1].rows, pair[1].measured.order) or 0.0)))  # fmt: skip

    @property
    def sentence(self) -> str:
        """What the curve says, in a sentence."""
        value, case = self.best
        order = round(case.measured.order)
        same = sum(round(each.measured.order) == order for _, each in self.cases)
        rest = len(self.cases) - same
        said = f"has the order {order}"
        if rest:
            said += (
                f", which {same} of them {'has' if same == 1 else 'have'}, and most of the others"
            )
            said += f" {self.usual}" if self.usual != order else " less"
        least = scientific(constant(case.rows, case.measured.order), 2)
        return (
            f"{self.of} on {self.place}, {self.digits} digits: of {len(self.cases)} values of "
            f"{self.name} the best, {self.name} = {value}, {said}; its error constant is {least}."
        )


def curves(cases: Iterable[Any]) -> list[Curve]:
    """Return the curves of an order study's cases, each of at least `FEWEST` values."""
    found: dict[tuple[str, str, str, int], list[tuple[Fraction, Any]]] = {}
    for case in cases:
        for name, place in ((case.rule, case.scene), (case.scene, case.rule)):
            varied = _NAME.fullmatch(str(name))
            if varied and case.measured.order is not None:
                key = (varied[1], varied[2], str(place), case.digits)
                found.setdefault(key, []).append((Fraction(varied[3].replace("_", "/")), case))
    return [Curve(*key, sorted(pairs, key=lambda pair: pair[0]))
            for key, pairs in found.items() if len(pairs) >= FEWEST]  # fmt: skip


def sketches(cases: Sequence[Any]) -> Iterator[Sketch]:
    """Yield the figure of the curves, if there are any."""
    panels = [panel for curve in curves(cases) for panel in _panels(curve)]
    if panels:
        yield Sketch("order-varied", "A number that varies", CAPTION, panels, SHEET)


def _panels(curve: Curve) -> Iterator[Panel]:
    orders = [(float(value), case.measured.order) for value, case in curve.cases]
    sizes = [(float(value), constant(case.rows, curve.usual)) for value, case in curve.cases]
    best = float(curve.best[0])
    title = f"{curve.of} on {curve.place}, {curve.digits} digits"
    for what, points in (("order", orders), (f"C of error ≈ C {raised(curve.usual)}", sizes)):

        def draw(axes: Axes, points: Any = points, zero: bool = points is sizes) -> None:
            axes.plot(*zip(*points, strict=True), "o-", ms=3, lw=0.9, color="C0")
            chosen = [point for point in points if point[0] == best]
            axes.plot(*zip(*chosen, strict=True), "o", ms=7, mfc="none", color="C3")
            if zero:
                axes.axhline(0, lw=0.5, color=MUTED)
            else:  # the digits behind the whole number are those of the fit
                low, high = (edge([size for _, size in points]) for edge in (min, max))
                axes.set_ylim(round(low) - 0.5, round(high) + 0.5)
            axes.set_xlabel(curve.name)

        yield Panel(title, what, curve.name, f"{title}: {what} against {curve.name}.", draw)
