"""A badge: the verdict of a result as a small SVG image, for the first page of a repository."""

from __future__ import annotations

from html import escape

from ..core.result import StudyResult

#: white text on these has a contrast of at least 4.5 (WCAG AA); the mark needs no colour
LOOKS = {
    "pass": ("✓", "#2a7d2e"), "measured": ("○", "#1f5f99"),
    "fail": ("✗", "#b3261e"), "inconclusive": ("?", "#8a5a00"),
}  # fmt: skip
GREY = "#4a4a4a"
# in pixels: a letter's width, the margin beside a text, the badge's height
WIDTH, MARGIN, HEIGHT = 6.8, 8, 20


def badge(result: StudyResult, label: str = "discmech") -> str:
    """Return the SVG text: a label and the verdict, with a title that counts cases by verdict."""
    said = result.verdict
    mark, colour = LOOKS[said]
    text = f"{mark} {said}"
    counts = {v: sum(case.verdict == v for case in result.cases) for v in LOOKS}
    told = ", ".join(f"{count} {v}" for v, count in counts.items() if count) or "no case"
    title = escape(f"{label}: {said} ({told})", quote=True)
    left, right = (round(WIDTH * len(t)) + 2 * MARGIN for t in (label, text))
    middle = HEIGHT / 2

    def written(x: float, words: str) -> str:
        return f'<text x="{x:g}" y="{middle:g}" dominant-baseline="central">{escape(words)}</text>'

    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{left + right}" height="{HEIGHT}" '
        f'viewBox="0 0 {left + right} {HEIGHT}" role="img" aria-label="{title}">'
        f"<title>{title}</title>"
        f'<clipPath id="r"><rect width="{left + right}" height="{HEIGHT}" rx="3"/></clipPath>'
        f'<g clip-path="url(#r)"><rect width="{left}" height="{HEIGHT}" fill="{GREY}"/>'
        f'<rect x="{left}" width="{right}" height="{HEIGHT}" fill="{colour}"/></g>'
        f'<g fill="#fff" text-anchor="middle" font-family="Verdana,DejaVu Sans,sans-serif" '
        f'font-size="11">{written(left / 2, label)}{written(left + right / 2, text)}</g></svg>'
    )
