"""A result in a notebook: the table, the reasons of cases that did not pass, the figures."""

from __future__ import annotations

from html import escape

from .canvas import render
from .figures import sketches
from .tables import columns, filled
from .wording import VERDICTS, Result, case_name, verdict, whys

COLOURS = {"pass": "#00694d", "fail": "#a84a00", "inconclusive": "#855c00"}
MOST_FIGURES = 4


def html_of(result: Result) -> str:
    """Return the table with failures first, their reasons and commands, and the first figures."""
    study = str(result.get("study"))
    cases = sorted(result.get("cases") or [], key=lambda case: VERDICTS.index(verdict(case)))
    shown = filled(columns(study), cases)
    heads = "".join(f"<th style='text-align:left'>{escape(head)}</th>" for head, _ in shown)
    lines = []
    for case in cases:
        colour = COLOURS[verdict(case)]
        cells = [f"<td style='text-align:left'>{escape(text(case))}</td>" for _, text in shown[:-1]]
        last = escape(shown[-1][1](case))
        lines.append(f"<tr>{''.join(cells)}<td style='color:{colour}'><b>{last}</b></td></tr>")
    bad = [case for case in cases if verdict(case) != "pass" and case.get("reason")]
    said = [
        f"<li><b>{escape(case_name(case))}</b>: {escape(reason)}"
        f"<br><code>{escape(str(case.get('command') or ''))}</code></li>"
        for case, reason in zip(bad, whys(bad), strict=True)
    ]
    figures = [
        render(sketch.panels, sketch.sheet, {}).svg.decode()
        for sketch in sketches(result, {})[:MOST_FIGURES]
    ]
    pictures = "".join(f"<div>{svg[svg.index('<svg') :]}</div>" for svg in figures)
    reasons = f"<ul>{''.join(said)}</ul>" if said else ""
    title = f"<p><b>{escape(study)}: {escape(verdict(result))}</b></p>"
    return f"{title}<table><tr>{heads}</tr>{''.join(lines)}</table>{reasons}{pictures}"
