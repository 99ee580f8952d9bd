"""The verdicts of `discmech verify`: a line a case as they come, a table, and what did not pass."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from studies.rendering.wording import (
    NONE,
    VERDICTS,
    Case,
    Result,
    case_name,
    got,
    mapping,
    number,
    rule_name,
    scientific,
    verdict,
    wanted,
)

if TYPE_CHECKING:
    from rich.table import Table

MARKS = {"pass": "✓", "fail": "✗", "inconclusive": "?"}
COLOURS = {"pass": "green", "fail": "bold red", "inconclusive": "yellow"}


def line(study: str, case: Case) -> str:
    """✓ order: kepler, two-thirds, 16 digits: 2.001 ± 0.001 (wanted 2 ± 0.05)."""
    said = f"{MARKS[verdict(case)]} {study}: {case_name(case)}: {got(study, case)}"
    expected = wanted(study, case)
    return said if expected == NONE else f"{said} (wanted {expected})"


def table(result: Result) -> Table:
    """A row a scene and rule, a column a study, a line in it for each precision."""
    from rich.table import Table

    cases = result["cases"]
    names = list(dict.fromkeys(str(case["study"]) for case in cases))
    said = verdict(result)
    found = Table(title=f"{result['study']}: {said}", title_style=COLOURS[said])
    for head in ("Scene", "Rule", *names):
        found.add_column(head, overflow="fold")
    lines: dict[tuple[str, str], list[Case]] = {}
    for case in cases:
        lines.setdefault((str(case.get("scene")), rule_name(case)), []).append(case)
    for (scene, rule), own in lines.items():
        found.add_row(scene, rule, *(_cell([c for c in own if c["study"] == n]) for n in names))
    return found


def _cell(cases: Sequence[Case]) -> str:
    """The verdict and the figure of each precision; many cases of one precision are counted."""
    from rich.markup import escape

    shown = []
    for digits in sorted({int(case.get("digits") or 16) for case in cases}):
        same = [case for case in cases if int(case.get("digits") or 16) == digits]
        worst = min((verdict(case) for case in same), key=VERDICTS.index)
        if len(same) == 1:
            words = short(str(same[0]["study"]), same[0])
        else:
            words = f"{sum(verdict(case) == 'pass' for case in same)} of {len(same)}"
        shown.append(f"[{COLOURS[worst]}]{MARKS[worst]}[/] {escape(words)} [dim]({digits})[/dim]")
    return "\n".join(shown) or f"[dim]{NONE}[/dim]"


def short(study: str, case: Case) -> str:
    """The one figure that a verdict hangs on."""
    measured = mapping(case, "measured")
    writer = _SHORT.get(study)
    return (writer(measured) if writer else got(study, case)) if measured else NONE


def _order(measured: dict[str, Any]) -> str:
    found = number(measured.get("order"))
    return NONE if found is None else f"{found:.4f}"


def _largest(values: dict[str, Any]) -> str:
    return scientific(max((v for v in map(number, values.values()) if v is not None), default=None))


_SHORT: dict[str, Callable[[dict[str, Any]], str]] = {
    "order": _order,
    "symplecticity": _largest,
    "momentum": lambda measured: _largest(mapping(measured, "drift")),
    "energy": lambda measured: f"band {scientific(measured.get('band'))}",
}


def troubles(result: Result) -> list[str]:
    """One paragraph for each case that did not pass, failures first: what, why, how to see it."""
    cases = [case for case in result["cases"] if verdict(case) != "pass"]
    found = []
    for case in sorted(cases, key=lambda case: VERDICTS.index(verdict(case))):
        name = f"{MARKS[verdict(case)]} {case['study']}: {case_name(case)}"
        found.append(f"{name}: {case.get('reason')}\n  again: {case.get('command')}")
    return found


def summary(result: Result) -> str:
    """All 34 cases pass."""
    from studies.rendering.summary import headline

    return headline([result])["text"]
