"""The page of symplecticity: how defects of the form are shown."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..core.records import number
from ..core.result import NONE
from ..report.grouping import by_scene, precisions
from ..report.palette import Mark
from ..report.view import Sketch, Titles, View, measured_column
from ..report.wording import largest, limit, scientific
from . import plot
from .plot import Case
from .records import Expected, Row

DEFECTS = (
    "Defect of the symplectic form under the pullback by the step (filled), and of the Poisson "
    "bracket under the map on the dual (hollow); a square is the defect after many steps of a "
    "program whose single steps keep the form. A mark is the worst point of the trajectory, the "
    "line beside it goes to the median; zero is drawn at the left edge. Dashed: the limit that the "
    "verdict uses; under a force or a nonholonomic constraint no form is demanded, which is said "
    "beside the rule, and its change is only shown (the table says how far it is from what the "
    "force does). Dotted: one unit of round-off. An arrow: it is beyond the axis."
)
CONTROLS = (
    "Controls: maps that are not symplectic, or are tested against a wrong bracket, and have to "
    "be caught above the upper dashed line. Where a Runge–Kutta method is followed to small steps "
    "its defect sinks below the limit of a sound scheme and into round-off (grey band): there it "
    "cannot be told from a symplectic one, so a verdict at small steps alone would prove nothing. "
    "Grey dots: the sound schemes of the scene."
)


NAMES = {"pullback": "pullback", "poisson": "Poisson", "run": "along a run",
         "change": "change less dθ_f", "volume": "volume", "residual": "residual",
         "constraint": "constraint", "hidden": "hidden constraint",
         "contraction": "contraction rate", "jacobian": "its jacobian",
         "gradient": "its gradient"}  # fmt: skip


def _got(case: Case) -> str:
    pairs = ((name, case.measured.get(key)) for key, name in NAMES.items())
    return ", ".join(f"{k} {scientific(v)}" for k, v in pairs if v is not None) or NONE


def _demanded(case: Case) -> dict[str, Any]:
    """Return the defects that are demanded, by their names of JSON; all without a demand.

    A program's resolution is none.
    """
    asked = case.expected.demanded or NAMES
    return {k: v for k, v in case.figures.items() if k in asked and v is not None}


def _short(case: Case) -> str:
    """Return the largest defect; one that is not of the form in a step is named."""
    sizes = {k: v for k, v in _demanded(case).items() if number(v) is not None}
    worst = max(sizes, key=lambda k: sizes[k], default="")
    return (f"{NAMES[worst]} " if worst not in ("", "pullback", "poisson") else "") + largest(sizes)


def _wanted(case: Case) -> str:
    asked = ", ".join(NAMES[k] for k in case.expected.demanded)
    return limit(case) + (f" of {asked} alone" if asked else "")


def _compared(case: Case) -> dict[str, Any]:
    asked, of_form = case.expected.demanded, {"pullback", "poisson", "run", "change", "volume"}
    if asked and not of_form & {*asked}:  # a residual is no form
        return {}
    sizes = [size for name, size in _demanded(case).items() if name in of_form]
    return {"defect": max(sizes, default=None)}


def _sketches(cases: Sequence[Case], known: dict[str, Mark], titles: Titles) -> list[Sketch]:
    sound = precisions([case for case in cases if not case.control])
    longest = max(sound.values(), key=plot.depth, default=[])
    panels = [
        plot.defects(f"Symplectic form, {digits} digits", same, dict(titles), digits,
                     plot.depth(longest))
        for digits, same in sound.items()
    ]  # fmt: skip
    sheet = plot.sheet(longest)
    sketches = [Sketch("symplecticity", "Defects of every scheme", DEFECTS, panels, sheet)]
    panels = [
        plot.controls(titles.get(scene, scene), own, beside.get(scene, []), known, digits)
        for digits, same in precisions([case for case in cases if case.control]).items()
        for beside in [by_scene(sound.get(digits, []))]
        for scene, own in by_scene(same).items()
    ]
    return [*sketches, Sketch("controls", "Controls", CONTROLS, panels, plot.CONTROL_SHEET)]


VIEW = View(
    expected=Expected, row=Row,
    columns=[measured_column(key, head[:1].upper() + head[1:]) for key, head in NAMES.items()],
    got=_got, wanted=_wanted, short=_short, sketches=_sketches, compared=_compared,
)  # fmt: skip
