"""The figures of a report, their captions, and the commands that reproduce them."""

from __future__ import annotations

from base64 import b64decode, b64encode
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from ..core.study import view_of
from .canvas import Drawing, render
from .case import AnyCase, Result, result_of
from .palette import Mark, marks
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
    """The user's wishes for figures: labels of rules (name, label), entries of rcParams."""

    labels: tuple[tuple[str, str], ...] = ()
    style: tuple[tuple[str, Any], ...] = ()

    def of_cases(
        self, cases: Sequence[AnyCase], known: dict[str, Mark]
    ) -> tuple[list[AnyCase], dict[str, Mark]]:
        """Return the cases with labels in place of rules' names, and the marks by label."""
        labels = dict(self.labels)
        shown = [replace(case, rule=labels.get(str(case.rule), case.rule)) for case in cases]
        pairs = zip(shown, cases, strict=True)
        return shown, known | {new.method: known[old.method] for new, old in pairs}


#: [(data on which a drawing depends, function that makes it)] → the drawings, new or stored
Remembered = Callable[[Sequence[tuple[Any, Callable[[], Any]]]], Sequence[Any]]


def anew(drawings: Sequence[tuple[Any, Callable[[], Any]]]) -> list[Any]:
    """Make the drawings without a store."""
    return [make() for _, make in drawings]


def plates(
    results: Sequence[Mapping[str, Any] | Result],
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
    look, made = look or Look(), list(map(result_of, results))
    known = marks(dict.fromkeys(case.method for result in made for case in result.cases))
    styles = [str(item) for item in known.items()]
    drawings = [
        ([result.study, [case.given for case in result.cases], styles, dict(titles), str(look)],
         partial(_drawn, result.study, result.cases, known, titles, look))
        for result in made
    ]  # fmt: skip
    found = []
    for result, drawn in zip(made, remembered(drawings), strict=True):
        definitions |= drawn["definitions"]
        for figure in drawn["figures"]:
            drawing = Drawing(
                figure["svg"].encode(), b64decode(figure["pdf"]), b64decode(figure["png"]),
                figure["panels"], figure["width"], figure["columns"],
            )  # fmt: skip
            again = command(result, figure["digits"])
            words = (figure["title"], figure["caption"], again)
            found.append(Plate(figure["name"], result.study, *words, drawing))
    return found


def sketches(given: Mapping[str, Any], titles: Titles, look: Look | None = None) -> list[Sketch]:
    """Return the figures of a study's result that have something to show, before they are drawn."""
    result = result_of(given)
    known = marks(dict.fromkeys(case.method for case in result.cases))
    cases, known = (look or Look()).of_cases(result.cases, known)
    return [s for s in view_of(result.study).sketches(cases, known, titles) if s.panels]


def _drawn(
    study: str, cases: Sequence[AnyCase], known: dict[str, Mark], titles: Titles, look: Look
) -> dict[str, Any]:
    """Return the figures of a study and their definitions for the page, as JSON data."""
    definitions: dict[str, str] = {}
    figures = []
    cases, known = look.of_cases(cases, known)
    for sketch in view_of(study).sketches(cases, known, titles):
        if sketch.panels:
            drawing = render(sketch.panels, sketch.sheet, definitions, look.style)
            figures.append(
                {"name": sketch.name, "title": sketch.title, "caption": sketch.caption,
                 "digits": sketch.digits, "svg": drawing.svg.decode(),
                 "pdf": b64encode(drawing.pdf).decode(), "png": b64encode(drawing.png).decode(),
                 "panels": drawing.panels, "width": drawing.width, "columns": drawing.columns}
            )  # fmt: skip
    return {"definitions": definitions, "figures": figures}


def command(result: Result, digits: int | None) -> str:
    """Return the command that makes these numbers again."""
    same = [case for case in result.cases if digits in (None, case.digits)]
    own = next((case.study_command for case in same if case.study_command), "")
    base = own or result.command or f"discmech {result.study}"
    return base if digits is None or "--digits" in base else f"{base} --digits {digits}"
