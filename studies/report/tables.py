"""Tables of a study: columns for the page, CSV, JSON, booktabs TeX, and the terminal's table."""

from __future__ import annotations

import csv
import io
import json
import math
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..core.outcome import OF_STEPS, VERDICTS
from ..core.result import NONE, AnyResult, StudyResult, study_result_of
from ..core.study import view_of
from .view import Column
from .wording import whys

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

#: on a terminal
COLOURS = {"pass": "green", "measured": "cyan", "fail": "bold red", "inconclusive": "yellow"}


_TEX = {"\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}"}
_TEX |= {character: "\\" + character for character in "&%$#_{}"}
_TEX |= {"±": r"$\pm$", "≤": r"$\le$", "≥": r"$\ge$", "—": "---", "·": r"$\cdot$", "√": r"$\surd$"}
_TEX |= {"−": "$-$"}
_TEX |= {"|": r"$|$", "‖": r"$\|$", "<": "$<$", ">": "$>$", "–": "--", "×": r"$\times$"}
_TEX |= {"μ": r"$\mu$", "Γ": r"$\Gamma$", "π": r"$\pi$", "ω": r"$\omega$", "ε": r"$\varepsilon$"}
_TEX |= {"ξ": r"$\xi$", "α": r"$\alpha$", "β": r"$\beta$", "γ": r"$\gamma$", "θ": r"$\theta$"}
_LEVELS = re.compile("([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)|([₀₁₂₃₄₅₆₇₈₉]+)")
_FLAT = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹₀₁₂₃₄₅₆₇₈₉", "-01234567890123456789")
#: a letter with an exponent, and a letter with its value
_POWER = re.compile(r"(?<![\w\\$}])([A-Za-z])(?=\$\^)")
_VALUE = re.compile(r"(?<![\w\\$}])([A-Za-z] = \d[\d./]*)(?![\w$])")
_SEAM = re.compile(r"(?<!\\)\$\$")  # one formula ends where the next begins


def columns(study: str) -> list[Column]:
    """Return heading and text function of each column of a study's table."""
    view = view_of(study)
    own = view.columns or [("Got", got)]
    last: Column = ("Verdict", lambda case: case.word)
    if view.whole:
        return [*own, last]
    return [
        ("Scene", lambda case: case.scene or NONE), ("Rule", lambda case: case.rule or NONE),
        ("Retraction", lambda case: case.retraction or NONE),
        ("Digits", lambda case: str(case.digits)), *own, ("Wanted", wanted), last,
    ]  # fmt: skip


def filled(shown: list[Column], cases: Sequence[AnyResult]) -> list[Column]:
    """Return the columns that have an entry for some case, and the verdict."""
    return [column for column in shown[:-1] if any(column[1](case) != NONE for case in cases)] + [
        shown[-1]
    ]


def wanted(case: AnyResult) -> str:
    """Return the expectation of the case."""
    if case.wanted.get("not_demanded") and not case.wanted.get("demanded"):
        return "only measured"  # whatever limits stand beside it
    return view_of(case.study).wanted(case) if case.wanted else NONE


def got(case: AnyResult) -> str:
    """Return the measurement in one line."""
    return view_of(case.study).got(case) if case.figures else NONE


def short(case: AnyResult) -> str:
    """Return the deciding figure of a verdict, or the reason if no figure decides it."""
    if case.verdict == "fail" and case.why and case.why in OF_STEPS:
        return case.why
    view = view_of(case.study)
    return (view.short or view.got)(case) if case.figures else NONE


def plain(value: Any) -> Any:
    """Return the data for strict JSON: no NaN, no infinities, keys as words."""
    if value is None or isinstance(value, bool | int | str):
        return value
    if type(value) is float:
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [plain(entry) for entry in value]
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        return str(value)
    return number if math.isfinite(number) else None


def strict(result: StudyResult) -> tuple[StudyResult, str]:
    """Return a result without numbers that are not finite, which most have not, and its JSON."""
    written = result.to_json()
    try:
        return result, json.dumps(written, ensure_ascii=False, allow_nan=False)
    except (TypeError, ValueError):
        written = plain(written)
        text = json.dumps(written, ensure_ascii=False, allow_nan=False)
        return study_result_of(written), text


def flat(value: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Return nested dicts as one: measured.order, measured.interval.low, measured.drift.NAME."""
    entries: dict[str, Any] = {}
    for key, entry in value.items():
        if not isinstance(entry, _NESTED):
            entries[prefix + key] = entry
        elif isinstance(entry, dict):
            entries |= flat(entry, f"{prefix}{key}.")
        elif len(entry) == 2:
            entries |= {f"{prefix}{key}.low": entry[0], f"{prefix}{key}.high": entry[1]}
        else:
            entries[prefix + key] = entry
    return entries


_NESTED = (dict, list, tuple)
_KEYS = ("scene", "rule", "retraction", "digits")
_AFTER = (
    "control", "verdict", "expected", "measured", "seconds", "measured_at", "reason", "command",
)  # fmt: skip


def cases_csv(result: StudyResult) -> str:
    """Return a line per case, with all digits."""
    written = (replace(case, data=()).to_json() for case in result.cases)
    lines = [flat({key: one[key] for key in (*_KEYS, *_AFTER)}) for one in written]
    return csv_of(lines, _KEYS)


def rows_csv(result: StudyResult) -> str:
    """Return a line per row of each case: the data of the figures."""
    lines = []
    for case in result.cases:
        own = {key: getattr(case, key) for key in _KEYS}
        lines += [own | flat(row) for row in case.data]
    return csv_of(lines, _KEYS)


def csv_of(lines: Sequence[Mapping[str, Any]], first: Sequence[str]) -> str:
    """Return lines of named values as CSV, the columns of these names first."""
    names, shapes = dict.fromkeys(first), set[tuple[str, ...]]()
    for line in lines:
        if (shape := (*line,)) not in shapes:
            shapes.add(shape)
            names |= dict.fromkeys(shape)
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(names)
    writer.writerows(map(line.get, names) for line in lines)  # what is missing is an empty cell
    return stream.getvalue()


def tex(text: str) -> str:
    """The words for LaTeX: special characters escaped; indices, Greek, symbols as mathematics."""

    def level(match: re.Match[str]) -> str:
        return f"${'^' if match[1] else '_'}{{{match[0].translate(_FLAT)}}}$"

    text = "".join(_TEX.get(character, character) for character in text)
    text = _LEVELS.sub(level, text)
    for symbol in (_POWER, _VALUE):
        text = symbol.sub(r"$\1$", text)
    return _SEAM.sub("", text)


def labelled(cases: Sequence[AnyResult], labels: Mapping[str, str]) -> list[AnyResult]:
    """Return the cases with labels, {rule: text}, in place of rules' names, for all that a reader
    sees but commands.
    """
    return [replace(case, rule=labels.get(str(case.rule), case.rule), named=case.rule)
            for case in cases]  # fmt: skip


def cases_tex(result: StudyResult, labels: Mapping[str, str] | None = None) -> str:
    """A booktabs tabular; put `\\usepackage{booktabs}` into the preamble. labels: {rule: text}."""
    shown = filled(columns(result.study), result.cases)
    lines = [" & ".join(tex(text(case)) for _, text in shown) + r" \\"
             for case in labelled(result.cases, labels or {})]  # fmt: skip
    heads = " & ".join(tex(head) for head, _ in shown) + r" \\"
    body = [rf"\begin{{tabular}}{{{'l' * len(shown)}}}", r"\toprule", heads, r"\midrule"]
    return "\n".join([*body, *lines, r"\bottomrule", r"\end{tabular}", ""])


def paper_tex(result: StudyResult, labels: Mapping[str, str] | None = None) -> str:
    """For a paper: a booktabs tabular for each precision, a line a rule, a column a scene.

    A cell is the one number of the case with its uncertainty, where it has one; a study may have
    several columns a scene (`View.paper`). What did not pass has an asterisk. Controls are left
    out. labels: {rule: text}.
    """
    lines, parts = [], view_of(result.study).paper or [("", got)]
    cases = labelled([case for case in result.cases if not case.control], labels or {})
    for digits in sorted({case.digits for case in cases}):
        same = [case for case in cases if case.digits == digits]
        scenes = list(dict.fromkeys(map(_raced, same)))
        cells = {(case.method, _raced(case)): _cells(case, parts) for case in same}
        heads = [", ".join(filter(None, (scene, head))) for scene in scenes for head, _ in parts]
        body = [rf"\begin{{tabular}}{{l{'c' * len(heads)}}}", r"\toprule",
                " & ".join(["Rule", *map(tex, heads)]) + r" \\", r"\midrule"]  # fmt: skip
        nothing = [tex(NONE)] * len(parts)
        for rule in dict.fromkeys(rule for rule, _ in cells):
            line = [cell for scene in scenes for cell in cells.get((rule, scene), nothing)]
            body.append(" & ".join([tex(rule), *line]) + r" \\")
        lines += [f"% {result.study}, {digits} digits", *body]
        lines += [r"\bottomrule", r"\end{tabular}", ""]
    return "\n".join(lines)


def _raced(case: AnyResult) -> str:
    """Return the scene, with its periods if it is a race over many."""
    periods = case.details.periods
    return str(case.scene) + (f", {periods} periods" if periods else "")


def _cells(case: AnyResult, parts: Sequence[Column]) -> list[str]:
    star = r"\rlap{$^{*}$}" if case.is_trouble else ""
    return [tex(text(case) or NONE) + star for _, text in parts]


def write_tables(
    result: StudyResult, folder: Path, labels: Mapping[str, str] | None = None
) -> list[str]:
    """Write STUDY.csv, STUDY-rows.csv, STUDY.json, STUDY.tex, STUDY-paper.tex; return names."""
    from discmech.integrators.files import encoded

    result, text = strict(result)
    study = file_name(result.study)
    written = {
        f"{study}.csv": cases_csv(result),
        f"{study}-rows.csv": rows_csv(result),
        f"{study}.json": f"{text}\n",
        f"{study}.tex": cases_tex(result, labels),
        f"{study}-paper.tex": paper_tex(result, labels),
    }
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in written.items():
        (folder / name).write_bytes(encoded(text))
    return list(written)


def file_name(name: str) -> str:
    """Return a name that is safe for a file and in an address."""
    kept = "".join(c if c.isascii() and (c.isalnum() or c in "-_") else "-" for c in name)
    return kept.strip("-") or "study"


def rich_table(
    title: str,
    heads: Sequence[str],
    lines: Iterable[Sequence[str]],
    style: str = "",
    numbers: Collection[str] = (),
) -> Table:
    """Return a table for a terminal, with cells in rich's markup; numbers are aligned right."""
    from rich.table import Table

    table = Table(title=title, title_style=style)
    for head in heads:
        right = head in numbers
        table.add_column(head, overflow="fold", justify="right" if right else "left")
    for line in lines:
        table.add_row(*line)
    return table


def terminal_table(result: StudyResult) -> Table:
    """Return the verdicts of a study for a terminal, failures last, where the reader looks
    first; values of a number that varies in their order.

    A column with one text in all rows is told once, under the title.
    """
    from rich.markup import escape

    cases = list(result.cases)
    if " --vary " not in result.command:
        cases.sort(key=lambda case: -VERDICTS.index(case.verdict))
    said, shown = _once(filled(columns(result.study), cases), cases)
    heads, lines = [head for head, _ in shown], []
    for case in cases:
        texts = [escape(text(case)).replace(" | ", "\n") for _, text in shown]
        colour = COLOURS[case.verdict]
        if case.control and "Rule" in heads:
            texts[heads.index("Rule")] += " [dim](control)[/dim]"
        lines.append([*texts[:-1], f"[{colour}]{texts[-1]}[/{colour}]"])
    title = f"{result.study}: {result.verdict}"
    title += "" if all(case.counts for case in cases) else " (peers do not count)"
    title += f"\n[not bold default]{escape(said)}[/]" if said else ""
    return rich_table(title, heads, lines, COLOURS[result.verdict])


def _once(shown: list[Column], cases: Sequence[AnyResult]) -> tuple[str, list[Column]]:
    """Return what all of several cases have in common, in a sentence, and the other columns."""
    same, others = [], list[Column]()
    for head, text in shown:
        texts = {text(case) for case in cases}
        if len(cases) > 1 and len(texts) == 1 and head not in ("Rule", "Verdict"):
            same.append(f"{head}: {texts.pop()}")
        else:
            others.append((head, text))
    return f"{'; '.join(same)}." if same else "", others


def print_result(screen: Console, result: StudyResult) -> None:
    """Print the table, how far passes reach, and a paragraph per case in trouble.

    A view may have its own way (`View.printed`).
    """
    if (printed := view_of(result.study).printed) is not None:
        printed(screen, result)
        return
    screen.print(terminal_table(result))
    sure = [case for case in result.cases if case.reason and not case.is_trouble]
    for case, reason in zip(sure, whys(sure), strict=True):
        words = f"{case.word}: {case.name}: {reason}"
        screen.print(words, highlight=False, markup=False, soft_wrap=True)
    print_trouble(screen, result.cases)


def print_trouble(screen: Console, cases: Sequence[AnyResult], commands: bool = False) -> None:
    """Print a paragraph per case in trouble, failures last, with its command if asked."""
    bad = sorted((case for case in cases if case.is_trouble),
                 key=lambda case: -VERDICTS.index(case.verdict))  # fmt: skip
    for case, reason in zip(bad, whys(bad), strict=True):
        words = ": ".join(filter(None, [case.word, case.name, reason]))
        if commands and case.command:
            words += f"\n  {case.command}"
        if commands or case.reason:
            screen.print(words, highlight=False, markup=False, soft_wrap=True)
