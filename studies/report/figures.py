"""The figures of a report, their captions, and the commands that reproduce them."""

from __future__ import annotations

import json
from base64 import b64decode, b64encode
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from hashlib import sha256
from typing import Any

from ..core.outcome import Made
from ..core.records import encoded
from ..core.result import AnyResult, StudyResult
from ..core.study import view_of
from .canvas import FORMATS, Drawing, render
from .palette import Mark, marks
from .tables import labelled
from .view import Sketch, Titles


@dataclass(frozen=True)
class Plate:
    """A figure with its title, caption and command."""

    name: str
    study: str
    title: str
    caption: str
    command: str
    drawing: Drawing


@dataclass(frozen=True)
class Look:
    """Wishes for figures: labels of rules (name, label), entries of rcParams, formats of files."""

    labels: tuple[tuple[str, str], ...] = ()
    style: tuple[tuple[str, Any], ...] = ()
    formats: tuple[str, ...] = FORMATS

    def of_cases(
        self, cases: Sequence[AnyResult], known: dict[str, Mark]
    ) -> tuple[list[AnyResult], dict[str, Mark]]:
        """Return the cases with labels in place of rules' names, and the marks by label."""
        shown = labelled(cases, dict(self.labels))
        pairs = zip(shown, cases, strict=True)
        return shown, known | {new.method: known[old.method] for new, old in pairs}


#: entries of an expectation that no figure shows: a change there draws nothing anew
_LIMITS = {"local_order", "modified_limit", "multipliers", "residual", "slope_limit", "tolerance"}


@dataclass(frozen=True)
class Task:
    """A figure to draw: the data that it depends on, its size, and a function that makes it."""

    depends_on: Any
    panels: int
    make: Callable[[], Any]


#: figures to draw → the drawings as JSON data, new or stored
Remembered = Callable[[Sequence[Task]], Sequence[Any]]


def anew(tasks: Sequence[Task]) -> list[Any]:
    """Make the drawings without a store."""
    return [task.make() for task in tasks]


def plates(
    results: Sequence[StudyResult],
    titles: Titles,
    definitions: dict[str, str],
    remembered: Remembered = anew,
    look: Look | None = None,
) -> list[Plate]:
    """Return every figure that these results (one per study) allow.

    `definitions` collects the styles and markers to which the inline panels refer; the page must
    contain them once. remembered: returns stored drawings of the same numbers. look: labels and
    style that the user wants.
    """
    look = look or Look()
    known = marks(dict.fromkeys(case.method for result in results for case in result.cases))
    pairs, tasks = list[tuple[StudyResult, Sketch]](), list[Task]()
    for result in results:
        study, cases = result.study, list(map(_drawn, result.cases))
        own = {case.method: known[case.method] for case in cases}
        data = ""
        for sketch in _sketches(study, cases, own, titles, look):
            if not data:
                depends = json.dumps([study, encoded(cases), str(own), str(look)])
                data = sha256(depends.encode()).hexdigest()
            shown = [panel.title for panel in sketch.panels]  # scenes by their titles
            make = partial(_render, study, sketch.name, cases, own, titles, look)
            tasks.append(Task([data, sketch.name, shown], len(shown), make))
            pairs.append((result, sketch))
    made = []
    for (result, sketch), drawn in zip(pairs, remembered(tasks), strict=True):
        definitions |= drawn["definitions"]
        files = {ending: b64decode(file) for ending, file in drawn["files"].items()}
        drawing = Drawing(files, drawn["panels"], drawn["width"], drawn["columns"])
        words = sketch.title, sketch.caption, command(result, sketch.digits)
        made.append(Plate(sketch.name, result.study, *words, drawing))
    return made


def sketches(result: StudyResult, titles: Titles, look: Look | None = None) -> list[Sketch]:
    """Return the figures of a study's result that have something to show, before they are drawn."""
    known = marks(dict.fromkeys(case.method for case in result.cases))
    return _sketches(result.study, result.cases, known, titles, look or Look())


def _sketches(
    study: str, cases: Sequence[AnyResult], known: dict[str, Mark], titles: Titles, look: Look
) -> list[Sketch]:
    cases, known = look.of_cases(cases, known)
    return [s for s in view_of(study).sketches(cases, known, titles) if s.panels]


def _drawn(case: AnyResult) -> AnyResult:
    """Return the part of a case that figures may show: a change of another draws nothing anew."""
    shown = {key: value for key, value in case.wanted.items() if key not in _LIMITS}
    return replace(case, wanted=shown, command="", diagnosis=None, measured_at=Made(),
                   seconds=0.0, smallest=None)  # fmt: skip


def _render(
    study: str,
    name: str,
    cases: Sequence[AnyResult],
    known: dict[str, Mark],
    titles: Titles,
    look: Look,
) -> dict[str, Any]:
    """Return a figure and its definitions for the page, as JSON data."""
    definitions: dict[str, str] = {}
    (sketch,) = (s for s in _sketches(study, cases, known, titles, look) if s.name == name)
    drawing = render(sketch.panels, sketch.sheet, definitions, look.style, look.formats)
    return {
        "definitions": definitions,
        "files": {ending: b64encode(file).decode() for ending, file in drawing.files.items()},
        "panels": drawing.panels, "width": drawing.width, "columns": drawing.columns,
    }  # fmt: skip


def command(result: StudyResult, digits: int | None) -> str:
    """Return the command that makes these numbers again."""
    same = [case for case in result.cases if digits in (None, case.digits)]
    own = next((case.study_command for case in same if case.study_command), "")
    base = own or result.command or f"discmech {result.study}"
    return base if digits is None or "--digits" in base else f"{base} --digits {digits}"
