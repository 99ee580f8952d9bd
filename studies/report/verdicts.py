"""The verdicts of `discmech verify`: a line per case during the run, a table, and troubles."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from ..core.outcome import VERDICTS, said_of_law, worst
from ..core.records import grouped, number
from ..core.result import NONE, AnyResult, Result, StudyResult
from ..core.study import view_of
from .advising import times
from .tables import COLOURS, got, rich_table, short, wanted
from .wording import duration, order_of, scientific, whys

if TYPE_CHECKING:
    from rich.table import Table

MARKS = {"pass": "✓", "measured": "○", "fail": "✗", "inconclusive": "?"}
ADJOINT = {True: "self-adjoint (a step back undoes a step)", False: "not self-adjoint"}
KNOWN = "its steps are those of {} (order {} by design)"
Cell = list[tuple[str, str, int]]
#: quantities that `compare` shows side by side: heading and format
COMPARED: dict[str, tuple[str, Callable[[float], str]]] = {
    "order": ("Order", order_of),
    "error": ("Error", scientific),
    "defect": ("Form defect", scientific),
    "drift": ("Momentum drift", scientific),
    "band": ("Energy band", scientific),
    "bounded": ("Bounded share", "{:.0%}".format),
    "stable": ("Stable hω", "{:.3g}".format),
    "seconds": ("Time to an error", duration),
}


def line(case: AnyResult, told: Collection[str] = ()) -> str:
    """Return a line such as: ✓ order: kepler, two-thirds, 16 digits: 2.001 ± 0.001 (wanted 2 ±
    0.05).

    It has the reason, if there is one, or a word for one that was printed before. The cause
    and the command come once, at the end (`troubles`).
    """
    written = view_of(case.study).line
    figure = written(case) if written and case.figures else got(case)
    why_not = case.reason.partition(" Cause: ")[0]
    why_not = "as above" if why_not and case.reason in told else why_not
    figure = why_not if figure == NONE and why_not else figure
    expected = wanted(case)
    alone = expected == "only measured"  # which is said of no case that fails for another reason
    unsaid = expected == NONE or (alone and case.is_trouble)
    said = "" if unsaid else f" ({expected if alone else f'wanted {expected}'})"
    said += f": {why_not}" if why_not not in ("", figure) else ""
    return f"{MARKS[case.verdict]} {case.study}: {case.name}: {figure}{said}"


def table(result: StudyResult) -> Table:
    """Return a table: a row per scene and rule, a column per study, a line in it per precision."""
    from rich.markup import escape

    def shown(cell: Cell) -> str:
        return "\n".join(
            f"[{COLOURS[said]}]{MARKS[said]}[/] {escape(words)} [dim]({digits})[/dim]"
            for said, words, digits in cell
        )

    heads, rows = _grid(result.cases)
    lines = [[*names, *(shown(cell) or f"[dim]{NONE}[/dim]" for cell in cells)]
             for names, cells in rows]  # fmt: skip
    title = f"{result.study}: {result.verdict}"
    return rich_table(title, heads, lines, COLOURS[result.verdict])


def overview(result: StudyResult) -> dict[str, Any]:
    """Return the table as plain cells for the page."""
    heads, rows = _grid(result.cases)
    lines = [
        [*names, *(", ".join(f"{MARKS[v]} {words} ({digits})" for v, words, digits in cell) or NONE
                   for cell in cells)]
        for names, cells in rows
    ]  # fmt: skip
    about = "What each study says, with the number of digits in brackets. "
    about += " ".join((*of_schemes(result), *proofs(result)))
    return {"title": "Overview", "about": about, "heads": heads, "lines": lines}


def _grid(cases: Sequence[AnyResult]) -> tuple[list[str], list[tuple[list[str], list[Cell]]]]:
    """Return headings, and for each scene and rule their names and a cell per study."""
    names = list(dict.fromkeys(case.study for case in cases))
    lines = grouped(cases, lambda case: (str(case.scene), case.method))
    rows = [
        ([*key], [_cell([case for case in own if case.study == name]) for name in names])
        for key, own in lines.items()
    ]
    return ["Scene", "Rule", *names], rows


def _cell(cases: Sequence[AnyResult]) -> Cell:
    """Return verdict, figure and digits for each precision; several cases are counted."""
    shown = []
    for digits in sorted({case.digits for case in cases}):
        same = [case for case in cases if case.digits == digits]
        if len(same) == 1:
            words = short(same[0])
        else:
            words = f"{sum(case.passed for case in same)} of {len(same)}"
        shown.append((worst(case.verdict for case in same), words, digits))
    return shown


def of_schemes(result: StudyResult) -> list[str]:
    """Return for each rule where it is self-adjoint and where not, or what known method it is."""
    methods: dict[str, dict[str, list[str]]] = {}
    for scheme in result.schemes or ():
        adjoint, known = ADJOINT.get(scheme["self_adjoint"]), scheme.get("known")
        for words in filter(None, (adjoint, known and KNOWN.format(*known))):
            places = methods.setdefault(_method(scheme), {}).setdefault(words, [])
            places.append(str(scheme["scene"]))
    return [
        f"{name}: "
        + "; ".join(f"{words} on {', '.join(dict.fromkeys(on))}" for words, on in places.items())
        + "."
        for name, places in methods.items()
    ]


def proofs(result: StudyResult) -> list[str]:
    """Return for each rule with a proof, or a disproof, what it says of every Lagrangian."""
    lines = []
    for told in result.proofs or ():
        places: dict[bool | None, list[str]] = {True: [], False: [], None: []}
        for name, answer in told["classes"].items():
            why = "" if answer["proven"] else f" ({answer['why']})"
            places[answer["proven"]].append(f"{name}{why}")
        said = []
        if sure := places[True]:
            of = sure[0] if len(sure) == 1 else _classes(sure)
            said.append(f"proven for every Lagrangian of {of}")
        if wrong := places[False]:
            said.append(f"disproven for {_first(wrong)}: a scene that shows it is an exception")
        if unsure := places[None]:
            said.append(f"not decided for {_first(unsure)}")
        form = said_of_law(told["laws"].get("symplectic", {}), _first)
        said += [f"the form is {e}" for e in form]
        if left := told["not_asked"]:
            names = [name for several in left.values() for name in several]
            kinds = " ".join(f"--groupoid {kind}" for kind in left)
            said.append(f"{_classes(names)} that take longer are asked for by {kinds}")
        if late := told.get("late"):
            said.append(f"not asked of {_first(late)} within {told['seconds']} s")
        order = f"order {told['order']}" if told["order"] else "its order"
        lines.append(f"{told['rule']}: {order} is {'; '.join(said)} ({told['command']}).")
    return lines


def _classes(names: Sequence[str]) -> str:
    return "1 class" if len(names) == 1 else f"{len(names)} classes"


def _first(names: Sequence[str]) -> str:
    return names[0] + (f" and {_classes(names[1:])} more" if names[1:] else "")


def comparison(result: StudyResult) -> dict[str, Any]:
    """Return a line per scene, precision and method; ratios to the best in brackets."""

    def shown(line: Mapping[str, Any], name: str) -> str:
        value = number(line.get(name))
        if name in line.get("not_finite", ()):
            return "not finite"
        # one cell of a map decides its largest step, but not its share
        if value is None or (name == "stable" and "bounded" in line):
            return NONE
        words = COMPARED[name][1](value)
        words += f" to {scientific(line['accuracy'])}" if name == "seconds" else ""
        if name == "error":
            at_end = number(line.get("time"))
            words += f" at h = {scientific(line['step'])}"
            words += "" if at_end is None else f", t = {at_end:.4g}"
        words += f" ± {100 * line['bounded_spread']:.0f}" if name == "bounded" else ""
        ratio = number(line["ratios"].get(name))
        return words if ratio is None else f"{words} ({times(ratio)})"

    lines = sorted(result.comparison or (), key=lambda line: str(line["digits"]))
    names = [n for n in COMPARED if any(shown(line, n) != NONE for line in lines)]
    scenes = list(dict.fromkeys(line["scene"] for line in lines))
    lines.sort(key=lambda line: (scenes.index(line["scene"]), line["digits"]))
    return {
        "title": "Side by side",
        "about": "Errors in (x, μ) at the smallest step that all methods ran and that round-off "
        "does not touch, at the end of the run, which is shorter with more digits; run time to the "
        "smallest error that all of them reach; in brackets, times the best of the scene and "
        "precision.",
        "heads": ["Scene", "Digits", "Rule", *(COMPARED[n][0] for n in names)],
        "lines": [
            [str(line["scene"]), str(line["digits"]), _method(line),
             *(shown(line, n) for n in names)]
            for line in lines
        ],
    }  # fmt: skip


def side_by_side(result: StudyResult) -> Table:
    """Return the comparison for a terminal."""
    from rich.markup import escape

    parts = comparison(result)
    lines = [[escape(cell) for cell in line] for line in parts["lines"]]
    return rich_table(parts["title"], parts["heads"], lines)


def _method(line: Mapping[str, Any]) -> str:
    """Return the rule of a line, with the retraction if it is not the usual one."""
    method: str = Result(rule=line["rule"], retraction=line["retraction"]).method
    return method


def by_study(result: StudyResult, command: Callable[[str], str]) -> list[StudyResult]:
    """Return the cases of each study as its result with its command, for the page and figures."""
    return [
        replace(result, study=study, cases=cases, notes=[], command=command(study),
                verdict=worst(case.verdict for case in cases))
        for study, cases in grouped(result.cases, lambda case: case.study).items()
    ]  # fmt: skip


def troubles(result: StudyResult) -> list[str]:
    """Return a paragraph per case in trouble, failures first: case, reason, command.

    Cases of one scene and rule with the same reason, for example a rule that cannot be used, share
    one paragraph.
    """
    bad = [case for case in result.cases if case.is_trouble]
    alike = grouped(
        sorted(bad, key=lambda case: VERDICTS.index(case.verdict)),
        lambda case: (case.verdict, case.scene, case.rule, case.retraction, case.reason),
    )
    paragraphs = []
    reasons = whys([first for first, *_ in alike.values()])
    for ((said, *_), (first, *more)), reason in zip(alike.items(), reasons, strict=True):
        others = ", ".join(dict.fromkeys(case.study for case in more))
        paragraphs.append(
            f"{MARKS[said]} {first.study}: {first.name}: {reason}"
            + (f"\n  and so {len(more)} more of {others}" if more else "")
            + f"\n  again: {first.again}"
        )
    return paragraphs


def summary(result: StudyResult) -> str:
    """Return a sentence such as: All 34 cases pass."""
    from .summary import headline

    return headline([result])["text"]
