"""A result in a notebook: the table, the reasons of cases in trouble, the figures."""

from __future__ import annotations

from html import escape

from ..core.outcome import VERDICTS
from ..core.result import StudyResult
from .canvas import render
from .figures import sketches
from .tables import columns, filled
from .wording import whys

COLOURS = {"pass": "#00694d", "measured": "#1f5a94", "fail": "#a84a00", "inconclusive": "#855c00"}
MOST_FIGURES = 4


def html_of(result: StudyResult) -> str:
    """Return the table with failures first, their reasons and commands, and the first figures."""
    cases = sorted(result.cases, key=lambda case: VERDICTS.index(case.verdict))
    shown = filled(columns(result.study), cases)
    heads = "".join(f"<th style='text-align:left'>{escape(head)}</th>" for head, _ in shown)
    lines = []
    for case in cases:
        colour = COLOURS[case.verdict]
        cells = [f"<td style='text-align:left'>{escape(text(case))}</td>" for _, text in shown[:-1]]
        last = escape(shown[-1][1](case))
        lines.append(f"<tr>{''.join(cells)}<td style='color:{colour}'><b>{last}</b></td></tr>")
    bad = [case for case in cases if case.is_trouble and case.reason]
    said = [
        f"<li><b>{escape(case.name)}</b>: {escape(reason)}"
        f"<br><code>{escape(case.again)}</code></li>"
        for case, reason in zip(bad, whys(bad), strict=True)
    ]
    figures = [
        render(sketch.panels, sketch.sheet, {}).files["svg"].decode()
        for sketch in sketches(result, {})[:MOST_FIGURES]
    ]
    pictures = "".join(f"<div>{svg[svg.index('<svg') :]}</div>" for svg in figures)
    reasons = f"<ul>{''.join(said)}</ul>" if said else ""
    title = f"<p><b>{escape(result.study)}: {result.verdict}</b></p>"
    return f"{title}<table><tr>{heads}</tr>{''.join(lines)}</table>{reasons}{pictures}"
