"""The page of optimal control: convergence is shown as that of trajectories."""

from __future__ import annotations

from collections.abc import Sequence

from ..core.result import NONE, Result
from ..report import plot_convergence
from ..report.grouping import by_scene
from ..report.palette import Mark
from ..report.plot_convergence import Line, Point
from ..report.view import Sketch, Titles, View, decimals
from ..report.wording import plus_minus, scientific
from .records import Expected, Measured, Row

Case = Result[Measured, Expected, Row]

REFINEMENT = (
    "How much the optimal motion changes when the steps are halved, against the step: the largest "
    "change of states, costates and controls at the nodes, each over its size; the number beside "
    "a rule is the lowest order of the three. Marks as in the figures of convergence."
)


WHAT = "change of the solution"


def _orders(case: Case) -> str:
    """Return the order of each kind of unknown."""
    return ", ".join(
        f"{kind} {'exact' if kind in case.measured.exact else decimals(p, 3)}"
        for kind, p in case.measured.orders.items()
    )


def _figure(cost: float | None) -> str:
    return NONE if cost is None else f"{cost:.6g}"


def _line(case: Case) -> Line:
    points = [Point(row.step, row.error, row.used, row.why_not) for row in case.rows]
    return Line(case, points, case.measured.order, case.expected.order)


def _sketches(cases: Sequence[Case], known: dict[str, Mark], titles: Titles) -> list[Sketch]:
    panels = [
        plot_convergence.panel(titles.get(scene, scene), list(map(_line, own)), known, WHAT)
        for scene, own in by_scene(cases).items()
    ]
    return [
        Sketch("optimality-16", "Optimal control", REFINEMENT, panels, plot_convergence.SHEET, 16)
    ]


def _wanted(case: Case) -> str:
    expected = case.expected
    if expected.order is None:
        return "only measured"
    return f"{expected.order:g} ± {scientific(expected.tolerance)}"


VIEW = View(
    measured=Measured, expected=Expected, row=Row,
    columns=[
        ("Orders", _orders),
        ("Cost (a local minimum)", lambda case: _figure(case.measured.cost)),
        ("Corrections", lambda case: ", ".join(map(str, case.measured.corrections))),
    ],
    got=lambda case: plus_minus(case.measured.order, case.measured.interval),
    wanted=_wanted, short=lambda case: decimals(case.measured.order, 3), sketches=_sketches,
)  # fmt: skip
