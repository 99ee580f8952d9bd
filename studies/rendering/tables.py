"""Tables of a study: columns for the page, CSV, JSON, booktabs TeX, and the terminal's table."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from discmech.studies.rendering.typeset import tex
from discmech.studies.rendering.wording import (
    NONE,
    VERDICTS,
    Case,
    Result,
    case_name,
    caught,
    duration,
    got,
    is_control,
    mapping,
    number,
    outcome,
    plus_minus,
    rows,
    scientific,
    verdict,
    wanted,
)

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

Column = tuple[str, Callable[[Case], str]]


def columns(study: str) -> list[Column]:
    """Heading and text of each column of a study's table; any study has one."""
    if study == "power":
        return _POWER
    return [
        ("Scene", lambda case: str(case.get("scene") or NONE)),
        ("Rule", lambda case: str(case.get("rule") or NONE)),
        ("Retraction", lambda case: str(case.get("retraction") or NONE)),
        ("Digits", lambda case: str(case.get("digits") or NONE)),
        *_MEASURED.get(study, [("Got", lambda case: got(study, case))]),
        ("Wanted", lambda case: wanted(study, case)),
        ("Verdict", lambda case: caught(case) if is_control(case) else verdict(case)),
    ]


def _measured(key: str) -> Callable[[Case], str]:
    return lambda case: scientific(mapping(case, "measured").get(key))


def _fitted(key: str, interval: str) -> Callable[[Case], str]:
    def text(case: Case) -> str:
        measured = mapping(case, "measured")
        return plus_minus(measured.get(key), measured.get(interval))

    return text


def _edge_slopes(case: Case) -> str:
    return ", ".join(map(scientific, mapping(case, "measured").get("edge_slopes") or ())) or NONE


def _points(case: Case) -> str:
    """Points of the fit, and why others were left out."""
    used = mapping(case, "measured").get("points")
    every = rows(case)
    why: dict[str, int] = {}
    for row in every:
        if not row.get("used"):
            reason = str(row.get("why_not") or "left out")
            why[reason] = why.get(reason, 0) + 1
    if used is None:
        used = len(every) - sum(why.values())
    said = ", ".join(f"{count} {reason}" for reason, count in why.items())
    return f"{used} of {len(every)}" + (f" ({said})" if said else "")


def _drifts(case: Case) -> str:
    """Each with its number of steps where that is less than of the others."""
    drift = mapping(case, "measured").get("drift") or {}
    over = mapping(case, "expected").get("over") or {}
    most = max(over.values(), default=0)
    fewer = {name: f" ({steps} steps)" for name, steps in over.items() if steps < most}
    words = (f"{name} {scientific(value)}{fewer.get(name, '')}" for name, value in drift.items())
    return ", ".join(words) or NONE


def _walk(case: Case) -> str:
    return scientific(mapping(case, "expected").get("random_walk"))


def _span(case: Case) -> str:
    """The time that a race runs over."""
    periods, end = case.get("periods"), number(case.get("duration"))
    return f"{periods} periods" if periods else f"T = {end:g}" if end else NONE


def _cost(accuracy: str) -> Callable[[Case], str]:
    """What an accuracy costs, and how many times the best peer's cost that is."""

    def text(case: Case) -> str:
        measured = mapping(case, "measured")
        value = number(mapping(measured, "cost").get(accuracy))
        if value is None:
            return NONE
        timed = measured.get("x") == "seconds"
        ratio = number(mapping(measured, "ratio").get(accuracy))
        words = duration(value) if timed else f"{value:.3g}"
        return words if ratio is None else f"{words} ({ratio:.2g}×)"

    return text


def _best(case: Case) -> str:
    """The smallest error that was reached, how many settings failed and why, what was cut."""
    measured = mapping(case, "measured")
    causes = [str(row["cause"]) for row in rows(case) if row.get("cause")]
    told = [f"{len(causes)} of {len(rows(case))} settings failed: {causes[-1]}"] if causes else []
    told += [f"cut: {measured['cut']}"] if measured.get("cut") else []
    words = scientific(measured.get("best"))
    return f"{words} ({'; '.join(told)})" if told else words


def _variants(case: Case, key: str, written: Callable[[Any], str]) -> str:
    """A column's entries: the kernel as it is, then without each saving; a line each if it can."""
    return " | ".join(written(row[key]) for row in rows(case)) or NONE


def _setup(case: Case) -> str:
    """Seconds to derive and compile, apart from every run."""
    seconds = number(mapping(case, "measured").get("setup"))
    return NONE if seconds is None else duration(seconds)


def _translates(case: Case) -> str:
    """How many steps lay in the chart of each translate, e first."""
    counts = mapping(mapping(case, "measured"), "translates")
    return ", ".join(str(count) for count in counts.values()) or NONE


_MEASURED: dict[str, list[Column]] = {
    "order": [("Order", _fitted("order", "interval")), ("Points", _points)],
    "symplecticity": [
        ("Pullback", _measured("pullback")),
        ("Poisson", _measured("poisson")),
        ("Residual", _measured("residual")),
    ],
    "momentum": [("Worst drift", _drifts), ("Random walk", _walk)],
    "energy": [
        ("Band", _measured("band")),
        ("Slope", _fitted("slope", "slope_interval")),
        ("Slopes of the edges", _edge_slopes),
    ],
    "savings": [
        ("Saving not made", lambda case: _variants(case, "variant", str)),
        ("Operations a step", lambda case: _variants(case, "operations", "{:.1f}".format)),
        ("Newton", lambda case: _variants(case, "corrections", "{:.2f}".format)),
        ("Bytes kept", lambda case: _variants(case, "bytes", str)),
        ("Time a step", lambda case: _variants(case, "seconds", duration)),
        ("Times as long", lambda case: _variants(case, "times", "{:.2f}×".format)),
    ],
    "charts": [
        ("Steps by translate", _translates),
        ("Least margin", _measured("margin")),
        ("Got", lambda case: got("charts", case)),
    ],
    "references": [
        ("t", lambda case: f"{case['measured']['time']:g}"),
        ("Processor seconds", _measured("seconds")),
        ("Steps", lambda case: str(case["measured"]["steps"])),
        ("Order", lambda case: str(case["measured"]["order"])),
        ("Certain by", lambda case: str(case["measured"]["certainty"])),
    ],
    "extremes": [
        ("Extreme", lambda case: str(case.get("extreme") or NONE)),
        ("hω = 1/10", lambda case: outcome(mapping(mapping(case, "measured"), "fine"))),
        ("hω = 5", lambda case: outcome(mapping(mapping(case, "measured"), "coarse"))),
    ],
    "stability": [
        ("Part", lambda case: str(case.get("kind") or NONE)),
        ("Got", lambda case: got("stability", case)),
    ],
    "work-precision": [
        ("Over", _span),
        *((f"to {scientific(a)} (× best peer)", _cost(f"{a:.0e}")) for a in (1e-4, 1e-8, 1e-12)),
        ("Best", _best),
        ("Compiling", _setup),
    ],
}


#: of the mutation study a case is a fault, not a precision
_POWER: list[Column] = [
    ("Scene", lambda case: str(case.get("scene") or NONE)),
    ("Rule", lambda case: str(case.get("rule") or NONE)),
    ("In", lambda case: str(mapping(case, "measured").get("site") or NONE)),
    ("What", lambda case: str(mapping(case, "measured").get("what") or NONE)),
    ("Caught by", lambda case: got("power", case)),
    ("Verdict", lambda case: caught(case) if is_control(case) else verdict(case)),
]


def plain(value: Any) -> Any:
    """The same data as strict JSON has it: no NaN, no infinities, keys as words."""
    if value is None or isinstance(value, bool | int | str):
        return value
    if type(value) is float:
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [plain(entry) for entry in value]
    try:
        found = float(value)
    except (TypeError, ValueError, OverflowError):
        return str(value)
    return found if math.isfinite(found) else None


def flat(value: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Nested dicts as one: measured.order, measured.interval.low, measured.drift.NAME."""
    found: dict[str, Any] = {}
    for key, entry in value.items():
        name = f"{prefix}{key}"
        if isinstance(entry, Mapping):
            found |= flat(entry, f"{name}.")
        elif isinstance(entry, list | tuple) and len(entry) == 2:
            found |= {f"{name}.low": entry[0], f"{name}.high": entry[1]}
        else:
            found[name] = entry
    return found


_KEYS = ("scene", "rule", "retraction", "digits")
_AFTER = (
    "control", "verdict", "expected", "measured", "seconds", "measured_at", "reason", "command",
)  # fmt: skip


def cases_csv(result: Result) -> str:
    """One line a case, all digits."""
    lines = [
        flat({key: case[key] for key in (*_KEYS, *_AFTER) if key in case})
        for case in result.get("cases") or []
    ]
    return _csv(lines, _KEYS)


def rows_csv(result: Result) -> str:
    """One line a row of each case: what the figures are drawn from."""
    lines = [
        {**{key: case.get(key) for key in _KEYS}, **flat(row)}
        for case in result.get("cases") or []
        for row in rows(case)
    ]
    return _csv(lines, _KEYS)


def _csv(lines: Sequence[Mapping[str, Any]], first: Sequence[str]) -> str:
    names = dict.fromkeys([*first, *(name for line in lines for name in line)])
    stream = io.StringIO()
    writer = csv.DictWriter(stream, list(names), restval="", lineterminator="\n")
    writer.writeheader()
    for line in lines:
        writer.writerow({key: "" if plain(value) is None else value for key, value in line.items()})
    return stream.getvalue()


def cases_tex(result: Result) -> str:
    """A booktabs tabular; put `\\usepackage{booktabs}` into the preamble."""
    shown = columns(str(result.get("study")))
    cases = result.get("cases") or []
    lines = [" & ".join(tex(text(case)) for _, text in shown) + r" \\" for case in cases]
    heads = " & ".join(tex(head) for head, _ in shown) + r" \\"
    body = [rf"\begin{{tabular}}{{{'l' * len(shown)}}}", r"\toprule", heads, r"\midrule"]
    return "\n".join([*body, *lines, r"\bottomrule", r"\end{tabular}", ""])


def write_tables(result: Result, folder: Path) -> list[str]:
    """STUDY.csv, STUDY-rows.csv, STUDY.json and STUDY.tex in a folder; returns their names."""
    study = file_name(str(result.get("study")))
    written = {
        f"{study}.csv": cases_csv(result),
        f"{study}-rows.csv": rows_csv(result),
        f"{study}.json": json.dumps(plain(result), ensure_ascii=False, allow_nan=False) + "\n",
        f"{study}.tex": cases_tex(result),
    }
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in written.items():
        (folder / name).write_text(text, encoding="utf-8")
    return list(written)


def file_name(name: str) -> str:
    """A name that is safe as a file's and in an address."""
    kept = "".join(c if c.isascii() and (c.isalnum() or c in "-_") else "-" for c in name)
    return kept.strip("-") or "study"


def terminal_table(result: Result) -> Table:
    """The verdicts of a study for a terminal: failures last, where the eye is when it ends."""
    from rich.markup import escape
    from rich.table import Table

    colours = {"pass": "green", "fail": "bold red", "inconclusive": "yellow"}
    study = str(result.get("study"))
    shown = columns(study)
    cases = sorted(result.get("cases") or [], key=lambda c: -VERDICTS.index(verdict(c)))
    if all(not case.get("retraction") for case in cases):
        shown = [column for column in shown if column[0] != "Retraction"]
    table = Table(title=f"{study}: {verdict(result)}", title_style=colours[verdict(result)])
    for head, _ in shown:
        table.add_column(head, overflow="fold")
    for case in cases:
        texts = [escape(text(case)).replace(" | ", "\n") for _, text in shown]
        colour = colours[verdict(case)]
        if is_control(case):
            texts[1] += " [dim](control)[/dim]"
        texts[-1] = f"[{colour}]{texts[-1]}[/{colour}]"
        table.add_row(*texts)
    return table


def print_result(screen: Console, result: Result) -> None:
    """The table, then a paragraph for each case that did not pass: a column has no room for it."""
    screen.print(terminal_table(result))
    cases = [case for case in result.get("cases") or [] if verdict(case) != "pass"]
    for case in sorted(cases, key=lambda case: -VERDICTS.index(verdict(case))):
        if case.get("reason"):
            said = caught(case) if is_control(case) else verdict(case)
            words = f"{said}: {case_name(case)}: {case['reason']}"
            screen.print(words, highlight=False, markup=False, soft_wrap=True)
