"""The gallery as a page of the documentation, in Markdown."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

HEAD = """# Gallery: integrators that people use

Methods of other people's libraries, run through adapters of a few lines
(`studies/gallery/adapters`) and judged by the same studies as every method here, in double
precision. This page is written by

```sh
discmech gallery --page gallery.md
```

on the machine and with the versions that it names; a job that runs each week measures them anew.
"Form" is the largest defect of the Poisson form that is certain, beyond every error of the
differences, or the size from which on a defect would have been seen. "Energy" is the band of its
relative error over {long} steps of the scene, "there and back" how far a step of −h misses the
start. What is claimed is what the documentation says at the place that is linked, or the docstring
of the version that is named; "agrees" is said where no claim is denied. The time of a step is the
processor's, of one machine on one day, with all that Python adds to it.

| method | claimed | scene | order | form | energy | momentum | there and back | a step | result |
|---|---|---|---|---|---|---|---|---|---|
"""


def page(entries: Sequence[dict[str, Any]], absent: Sequence[str], long: int) -> str:
    """Return the page's text."""
    rows = [_row(e) for e in entries]
    notes = [f"- {e['name']}: {e['note']}." for e in entries if e["note"]]
    versions = dict(sorted({e["package"]: e["version"] for e in entries}.items()))
    told = ", ".join(f"{name} {number}" for name, number in versions.items())
    parts = [
        HEAD.format(long=f"{long:,}".replace(",", " ")) + "\n".join(rows),
        f"Versions: {told}.",
    ]
    if notes:
        parts.append("How they are run:\n\n" + "\n".join(notes))
    if differing := [e for e in entries if e["differs"]]:
        parts.append(
            "What differs, each a line for an issue:\n\n" + "\n".join(map(_line, differing))
        )
    if unknown := [e for e in entries if e["untold"]]:
        lines = [f"- {_named(e)}: {' '.join(e['untold'])}" for e in unknown]
        parts.append("What could not be told:\n\n" + "\n".join(lines))
    if absent:
        parts.append("\n".join(absent))
    return "\n\n".join(parts) + "\n"


def _line(e: dict[str, Any]) -> str:
    """Return the line that its author can paste into an issue."""
    note = f" ({e['note']})" if e["note"] else ""
    return (
        f'- {e["package"]} {e["version"]}, {e["name"]}{note}: "{e["claim"]}" is claimed in '
        f"<{e['place']}>; on {e['scene']}: {' '.join(e['differs'])} "
        f"Measured by `discmech gallery {e['name']}`."
    )


def _named(e: dict[str, Any]) -> str:
    return f"{e['name']} ({e['claim']}{'; ' if e['note'] else ''}{e['note']})"


def _row(e: dict[str, Any]) -> str:
    said = "**differs**" if e["differs"] else "not told" if e["untold"] else "agrees"
    cells = [e["name"], f"[{e['claim']}]({e['place']})", e["scene"], *figures(e), said]
    return f"| {' | '.join(cell.replace('|', '/') for cell in cells)} |"


def figures(e: dict[str, Any]) -> list[str]:
    """Return order, form, energy, momentum, reversibility and the time of a step, in words."""
    of = {name: e["studies"].get(name, {}).get("measured", {}) for name in
          ("order", "symplecticity", "energy", "momentum", "reversibility")}  # fmt: skip
    order, form = of["order"].get("order"), of["symplecticity"]
    certain, resolution = form.get("certain"), form.get("resolution")
    drifts = of["momentum"].get("drift", {})
    return [
        "no order in h" if e["own_steps"] else "–" if order is None else f"{order:.2f}",
        "–" if certain is None else f"{certain:.1e}" if certain else f"< {resolution:.0e}",
        _number(of["energy"].get("band")),
        _number(max(drifts.values(), default=None)),
        _number(of["reversibility"].get("defect")),
        "–" if e["seconds"] is None else f"{e['seconds'] * 1e6:.3g} µs",
    ]


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.1e}"
