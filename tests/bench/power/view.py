"""How the mutation study is shown: its cases are faults, not precisions."""

from __future__ import annotations

from typing import TYPE_CHECKING

from discmech.studies.core.result import NONE, AnyResult, StudyResult
from discmech.studies.report.tables import rich_table
from discmech.studies.report.view import View

if TYPE_CHECKING:
    from rich.console import Console


def _got(case: AnyResult) -> str:
    return ", ".join(case.figures.get("caught") or ()) or NONE


def _of(case: AnyResult, key: str) -> str:
    return str(case.figures.get(key) or NONE)


def _printed(screen: Console, result: StudyResult) -> None:
    """The tables of all, then a line for each fault that nothing caught, and each false alarm."""
    for table in result.tables or ():
        heads = table["heads"]
        screen.print(rich_table(table["title"], heads, table["lines"], numbers=heads[1:]))
    lines = []
    for case in result.cases:
        name = f"{case.scene} {case.rule}: {_of(case, 'site')}, {_of(case, 'what')}"
        if case.figures.get("equivalent"):
            lines.append(f"equivalent: {name}: {case.reason}.")
        elif not case.passed:
            kind = "SURVIVES" if case.control else "FALSE ALARM"
            lines.append(f"{kind}: {name}: {case.reason}")
    found = result.more
    lines.append(
        f"{found['faults']} faults: {found['caught']} caught, {found['equivalent']} proved to "
        f"be none, {len(found['survivors'])} survive; {found['rules']} valid rules: "
        f"{len(found['false_alarms'])} false alarms; {found['seconds']:.0f} s of measuring."
    )
    for line in lines:
        screen.print(line, highlight=False, markup=False, soft_wrap=True)


VIEW = View(
    printed=_printed,
    whole=True,
    columns=[
        ("Scene", lambda case: case.scene or NONE),
        ("Rule", lambda case: case.rule or NONE),
        ("In", lambda case: _of(case, "site")),
        ("What", lambda case: _of(case, "what")),
        ("Caught by", _got),
    ],
    got=_got,
    wanted=lambda case: str(case.wanted["wanted"]),
)
