"""The report: one self-contained page, its figures and tables as files beside it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from ..core.outcome import VERDICTS
from ..core.records import grouped
from ..core.result import AnyResult, StudyResult
from ..core.study import every_study, known_study
from .formulas import display, spaced, together
from .glossary import met
from .sparkline import Past, Sparklines, unknown_past
from .summary import headline, machine, merged, runs, tally, trouble, when
from .svg import short_names
from .tables import columns, file_name, filled, labelled, write_tables
from .wording import CONSTRAINED, why

if TYPE_CHECKING:
    from jinja2 import Environment

    from .figures import Look, Plate, Remembered

LONGEST_FORMULA = 60_000  # characters of MathML; longer formulas are linked, not shown
FORMULAE = 700_000  # limit of all formulas together
SHORT_FORMULA = 1_000  # shorter formulas are always shown
UNKNOWN = "The page knows no more of this study than its numbers."


@dataclass(frozen=True)
class About:
    """A page's title, its methods (`command.methods`), and if it has all studies and scenes."""

    title: str = "discmech"
    methods: Sequence[Mapping[str, Any]] = ()
    whole: bool = False


def write_report(
    results: Sequence[StudyResult],
    equations: Sequence[Mapping[str, Any]],
    scenes: Sequence[Mapping[str, Any]],
    folder: Path,
    command: str = "discmech report",
    remembered: Remembered | None = None,
    past: Past = unknown_past,
    look: Look | None = None,
    about: About | None = None,
    tables: Sequence[Mapping[str, Any]] = (),
) -> Path:
    """Write index.html, figures/, tables/ (and equations/ for the longest) into a folder.

    An older report in the folder stays complete until this one is finished, and also if this one
    fails. remembered: returns stored figures of the same numbers (`figures.plates`). past: the
    findings of the last runs for a case, newest last. look: labels and style of figures; of a whole
    report they are SVG alone, and a study's own command writes PDF and PNG. tables: those above the
    studies, each {"title", "about", "heads", "lines"}, a line being its cells.
    """
    from discmech.integrators.files import encoded

    from .figures import Look, anew, plates
    from .publish import published

    titles = {str(s.get("name")): str(s.get("title") or s.get("name")) for s in scenes}
    studies = merged(results)
    definitions: dict[str, str] = {}
    if about and about.whole:
        look = replace(look or Look(), formats=("svg",))
    with published(Path(folder), last="index.html") as new:
        drawn = plates(studies, titles, definitions, remembered or anew, look)
        for name, things in (("figures", drawn), ("tables", studies), ("equations", equations)):
            if things:
                (new / name).mkdir()
        for plate in drawn:
            for ending, file in plate.drawing.files.items():
                (new / "figures" / f"{plate.name}.{ending}").write_bytes(file)
        labels = dict(look.labels) if look else {}
        files = {study.study: write_tables(study, new / "tables", labels) for study in studies}
        formulae = _schemes(equations, titles, new / "equations")
        words = (results, studies, drawn, definitions, scenes, command, files, formulae)
        text = _page(*words, tables=tables, past=past, about=about, labels=labels)
        (new / "index.html").write_bytes(encoded(text))
    return Path(folder) / "index.html"


def lone_page(
    results: Sequence[StudyResult],
    scenes: Sequence[Mapping[str, Any]],
    command: str,
    tables: Sequence[Mapping[str, Any]] = (),
    about: About | None = None,
    look: Look | None = None,
) -> str:
    """Return the page of some results by itself, as of `write_report`: figures inside, no files."""
    from .figures import Look, anew, plates

    titles = {str(s.get("name")): str(s.get("title") or s.get("name")) for s in scenes}
    studies = merged(results)
    definitions: dict[str, str] = {}
    inside = replace(look or Look(), formats=("svg",))
    drawn = plates(studies, titles, definitions, anew, inside)
    words = (results, studies, drawn, definitions, scenes, command)
    return _page(*words, tables=tables, about=about, labels=dict(look.labels) if look else {})


def _page(
    results: Sequence[StudyResult],
    studies: Sequence[StudyResult],
    drawn: Sequence[Plate],
    definitions: Mapping[str, str],
    scenes: Sequence[Mapping[str, Any]],
    command: str,
    files: Mapping[str, Sequence[str]] | None = None,
    equations: Sequence[Mapping[str, Any]] = (),
    tables: Sequence[Mapping[str, Any]] = (),
    past: Past = unknown_past,
    about: About | None = None,
    labels: Mapping[str, str] = MappingProxyType({}),
) -> str:
    beside, lines, about = files or {}, Sparklines(past), about or About()
    cases = [case for study in studies for case in study.cases]
    pairs = zip(cases, labelled(cases, labels), strict=True)
    methods = {case.method: shown.method for case, shown in pairs}
    context = {
        "title": about.title,
        "methods": about.methods,
        "command": command,
        "headline": headline(studies),
        "studies": [_view(s, drawn, beside.get(s.study, ()), lines, labels) for s in studies],
        "absent": [
            name
            for name, study in every_study().items()
            if name not in {s.study for s in studies} and (study.usual or about.whole)
        ],
        "trouble": trouble(studies),
        "controlled": any(case.control for study in studies for case in study.cases),
        "past": lines,
        "definitions": "".join(definitions[key] for key in sorted(definitions)),
        "tables": [_named(table, methods) for table in tables],
        "equations": equations,
        "scenes": [_SCENE | dict(scene) for scene in scenes],
        "record": machine(results),
        "runs": runs(results),
    }
    context["words"] = met(" ".join(_words([context[key] for key in ("studies", "tables")])))
    return short_names(environment().get_template("report.html.j2").render(context))


def _words(thing: Any) -> Iterator[str]:
    """Yield the words in a template's data that a reader sees."""
    if isinstance(thing, str):
        yield thing
    elif hasattr(thing, "caption"):  # a figure
        yield from (thing.title, thing.caption)
    elif isinstance(thing, Mapping | list | tuple):
        for part in thing.values() if isinstance(thing, Mapping) else thing:
            yield from _words(part)


def environment() -> Environment:
    """Return Jinja's environment with the templates, which a wheel has at the same place."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    folder = Path(__file__).resolve().parents[2] / "reports" / "templates"
    return Environment(
        loader=FileSystemLoader(folder),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def _named(table: Mapping[str, Any], methods: Mapping[str, str]) -> dict[str, Any]:
    """Return a table of the page with labels in place of methods, in its column of rules."""
    at = table["heads"].index("Rule") if "Rule" in table["heads"] else -1
    lines = [[methods.get(cell, cell) if k == at else cell for k, cell in enumerate(line)]
             for line in table["lines"]]  # fmt: skip
    return {**table, "lines": lines}


def _lines(
    study: str, past: Sparklines, labels: Mapping[str, str], cases: Sequence[AnyResult]
) -> dict[str, Any]:
    """Return a table for the templates: headings, and a line per case."""
    shown = filled(columns(study), cases)
    lines = [
        {"cells": [text(named) for _, text in shown[:-1]], "verdict": case.verdict,
         "word": shown[-1][1](case), "past": past.of(case), "reason": why(case),
         "told": case.counts and case.is_trouble, "command": case.command, "when": when(case)}
        for case, named in zip(cases, labelled(cases, labels), strict=True)
    ]  # fmt: skip
    return {"heads": [head for head, _ in shown], "lines": lines}


def _view(
    study: StudyResult, drawn: Sequence[Plate], files: Sequence[str], past: Sparklines,
    labels: Mapping[str, str],
) -> dict[str, Any]:  # fmt: skip
    """Return the data of one study for the page."""
    name, known = study.study, known_study(study.study)
    rows = partial(_lines, name, past, labels)
    sound = [case for case in study.cases if not case.control]
    ours = [case for case in sound if case.counts]
    parts = {kind: [case for case in ours if case.verdict == kind] for kind in VERDICTS}
    return {
        "name": name,
        "title": known.title if known else name.capitalize(),
        "about": known.with_limits(known.about) if known else UNKNOWN,
        "limits": {
            "title": f"Limits of {name}",
            "heads": ["Limit", "Of what", "Value", "Reason"],
            "lines": known.told_limits() if known else [],
        },
        "anchor": file_name(name),
        "notes": study.notes,
        "tables": study.tables or (),
        "verdict": study.verdict,
        "count": tally(study.cases),
        "bad": rows(parts["fail"] + parts["inconclusive"]),
        "good": rows(parts["pass"]),
        "free": rows(parts["measured"]),
        "others": rows([case for case in sound if not case.counts]),
        "controls": rows([case for case in study.cases if case.control]),
        "plates": [plate for plate in drawn if plate.study == name],
        "files": files,
        "command": study.command or f"discmech {name}",
    }


def _schemes(
    equations: Sequence[Mapping[str, Any]], titles: Mapping[str, str], folder: Path
) -> list[dict[str, Any]]:
    """Return the schemes of each scene; common parts, such as its Lagrangian, come separately."""
    room = _Room(folder, FORMULAE)
    sections = []
    for scene, entries in grouped(equations, lambda e: str(e.get("scene") or "")).items():
        shared = [
            key for _, key in _FORMULAE
            if len(entries) > 1 and all(e.get(key) == entries[0].get(key) for e in entries)
        ]  # fmt: skip
        common = room.formulae(entries[0], [f for f in _FORMULAE if f[1] in shared], [scene])
        schemes = []
        for entry in entries:
            names = [str(entry.get(key) or "") for key in ("scene", "rule", "retraction")]
            facts = ["self-adjoint" if entry.get("self_adjoint") else "not self-adjoint"]
            facts.append("solved without iteration" if entry.get("affine") else "solved by Newton")
            own = [(head, key) for head, key in _FORMULAE if key not in shared]
            schemes.append(
                {"title": ", ".join(filter(None, names[1:])), "facts": facts,
                 "source": str(entry.get("source") or ""),
                 "notation": str(entry.get("notation") or ""),
                 "formulae": room.formulae(entry, own, filter(None, names))}
            )  # fmt: skip
        sections.append({"title": titles.get(scene, scene), "schemes": schemes, "shared": common})
    return sections


@dataclass
class _Room:
    """The room left for formulas on the page; longer ones become files in a folder."""

    folder: Path
    left: int

    def formulae(
        self, entry: Mapping[str, Any], wanted: Iterable[tuple[str, str]], names: Iterable[str]
    ) -> list[dict[str, Any]]:
        """Return for each head of the entry its shown formulas and the file with the rest."""
        groups, before = [], list(names)
        for head, key in wanted:
            formulas = entry.get(key) or []
            long, shown = [], []
            for formula in [formulas] if isinstance(formulas, str) else formulas:
                small = display(spaced(formula))
                if len(small) > max(SHORT_FORMULA, min(LONGEST_FORMULA, self.left)):
                    long.append(formula)
                else:
                    shown.append(small)
                    self.left -= len(small)
            link = file_name("-".join([*before, key])) + ".mml" if long else ""
            if link:
                self.folder.joinpath(link).write_text(together(long), encoding="utf-8")
            if shown or long:
                groups.append({"head": head, "shown": shown, "link": link})
        return groups


_SCENE: dict[str, Any] = dict.fromkeys(
    ("name", "title", "groupoid", "dim_x", "dim_u", "parameters", "source"), "—"
) | {"symmetries": []}

_FORMULAE = (
    ("Lagrangian", "lagrangian_mathml"),
    ("Force", "force_mathml"),
    ("Constraints", "constraints_mathml"),
    ("Discrete Lagrangian", "discrete_lagrangian_mathml"),
    ("Points of a step", "points_mathml"),
    ("Momentum, μ = F⁻(x, u)/h", "momentum_mathml"),
    ("Discrete Euler–Lagrange equations, F⁺(x, u)/h = F⁻(y, v)/h", "residual_mathml"),
    (f"Momentum before the step, {CONSTRAINED[0]}", "constrained_momentum_mathml"),
    (f"Momentum after the step, {CONSTRAINED[1]}", "constrained_residual_mathml"),
)
