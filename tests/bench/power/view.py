"""How the mutation study is shown: its cases are faults, not precisions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from discmech.studies.report.tables import rich_table
from discmech.studies.report.view import View
from discmech.studies.report.wording import NONE, Result, mapping

if TYPE_CHECKING:
    from rich.console import Console


def _got(measured: dict[str, Any]) -> str:
    return ", ".join(measured["caught"]) or NONE


def _printed(screen: Console, result: Result) -> None:
    """The tables of all, then a line for each fault that nothing caught, and each false alarm."""
    for table in result["tables"]:
        heads = table["heads"]
        screen.print(rich_table(table["title"], heads, table["lines"], numbers=heads[1:]))
    lines = []
    for case in result["cases"]:
        measured = case["measured"]
        name = f"{case['scene']} {case['rule']}: {measured.get('site')}, {measured.get('what')}"
        if measured.get("equivalent"):
            lines.append(f"equivalent: {name}: {case['reason']}.")
        elif case["verdict"] != "pass":
            kind = "SURVIVES" if case["control"] else "FALSE ALARM"
            lines.append(f"{kind}: {name}: {case['reason']}")
    lines.append(
        f"{result['faults']} faults: {result['caught']} caught, {result['equivalent']} proved to "
        f"be none, {len(result['survivors'])} survive; {result['rules']} valid rules: "
        f"{len(result['false_alarms'])} false alarms; {result['seconds']:.0f} s of measuring."
    )
    for line in lines:
        screen.print(line, highlight=False, markup=False, soft_wrap=True)


VIEW = View(
    printed=_printed,
    whole=True,
    columns=[
        ("Scene", lambda case: str(case.get("scene") or NONE)),
        ("Rule", lambda case: str(case.get("rule") or NONE)),
        ("In", lambda case: str(mapping(case, "measured").get("site") or NONE)),
        ("What", lambda case: str(mapping(case, "measured").get("what") or NONE)),
        ("Caught by", lambda case: _got(mapping(case, "measured"))),
    ],
    got=_got,
    wanted=lambda expected: str(expected["wanted"]),
)
