"""The page of optimal control: convergence is shown as that of trajectories."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..report import plot_convergence
from ..report.grouping import by_scene
from ..report.palette import Mark
from ..report.view import Sketch, Titles, View
from ..report.wording import NONE, Case, mapping, number, plus_minus

REFINEMENT = (
    "How much the optimal motion changes when the steps are halved, against the step: the largest "
    "change of states, costates and controls at the nodes, each over its size; the number beside "
    "a rule is the lowest order of the three. Marks as in the figures of convergence."
)


def _orders(case: Case) -> str:
    """Return the order of each kind of unknown."""
    measured = mapping(case, "measured")
    exact, orders = measured.get("exact") or [], mapping(measured, "orders")
    found = []
    for kind, order in orders.items():
        p = number(order)
        shown = "exact" if kind in exact else NONE if p is None else f"{p:.3f}"
        found.append(f"{kind} {shown}")
    return ", ".join(found)


def _short(measured: dict[str, Any]) -> str:
    found = number(measured.get("order"))
    return NONE if found is None else f"{found:.3f}"


def _sketches(cases: Sequence[Case], known: dict[str, Mark], titles: Titles) -> list[Sketch]:
    panels = [
        plot_convergence.panel(titles.get(scene, scene), own, known, "change of the solution")
        for scene, own in by_scene(cases).items()
    ]
    return [
        Sketch("optimality-16", "Optimal control", REFINEMENT, panels, plot_convergence.SHEET, 16)
    ]


VIEW = View(
    columns=[
        ("Orders", _orders),
        ("Corrections", lambda case: ", ".join(
            map(str, mapping(case, "measured").get("corrections") or []))),
    ],
    got=lambda measured: plus_minus(measured.get("order"), measured.get("interval")),
    wanted=lambda expected: f"{expected['order']:g} ± {expected['tolerance']:g}",
    short=_short, sketches=_sketches,
)  # fmt: skip
