"""The figures of a report: which there are, their captions, the commands that reproduce them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..core.study import view_of
from .canvas import Drawing, render
from .palette import marks
from .view import Titles
from .wording import Case, Result, rule_name


@dataclass(frozen=True)
class Plate:
    """A figure with what stands beside it."""

    name: str
    study: str
    title: str
    caption: str
    command: str
    drawing: Drawing


def plates(results: Sequence[Result], titles: Titles, library: dict[str, str]) -> list[Plate]:
    """Every figure that these results (one a study) allow.

    `library` collects the glyphs and markers that the inline panels refer to; the page has to
    hold them once.
    """
    rules = dict.fromkeys(rule_name(case) for result in results for case in result["cases"])
    known = marks(rules)
    found = []
    for result in results:
        study, cases = str(result["study"]), result["cases"]
        for sketch in view_of(study).sketches(cases, known, titles):
            if sketch.panels:
                drawing = render(sketch.panels, sketch.sheet, library)
                again = command(result, cases, sketch.digits)
                words = (sketch.title, sketch.caption, again)
                found.append(Plate(sketch.name, study, *words, drawing))
    return found


def command(result: Result, cases: Sequence[Case], digits: int | None) -> str:
    """The command that makes these numbers again."""
    same = [case for case in cases if digits is None or int(case.get("digits") or 16) == digits]
    own = next((case["study_command"] for case in same if case.get("study_command")), None)
    base = str(own or result.get("command") or f"discmech {result['study']}")
    return base if digits is None or "--digits" in base else f"{base} --digits {digits}"
