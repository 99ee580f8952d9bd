"""The advice of `compare` in sentences: the recommended method, with its numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ..core.records import grouped, number
from ..core.result import USUAL_RETRACTION
from .wording import duration, scientific

Line = Mapping[str, Any]
FAR = 1e6  # larger ratios are not given exactly
GOALS = {"1e6 periods": "a million periods", "large steps": "large steps",
         "stable steps": "large steps of the oscillator"}  # fmt: skip


def recommended(advice: Sequence[Line]) -> list[str]:
    """Return a line per scene with the recommendation, and a sentence of evidence per goal."""
    return [
        *overall(advice),
        *(
            "\n  ".join([f"{place}: {', '.join(map(short, lines))}.", *map(sentence, lines)])
            for place, lines in grouped(advice, _place).items()
        ),
    ]


def overall(lines: Sequence[Line]) -> list[str]:
    """Return a sentence on the best method for all goals of all scenes; [] for a single goal."""
    asked = [line for line in lines if line["take"]]
    if len(asked) < 2:
        return []
    taken = [rule for rule in asked[0]["take"] if all(rule in line["take"] for line in asked)]
    where = f"at all {len(asked)} aims"
    if not taken:
        return [f"No method is best, or as good as the best, {where}."]
    # equal rules count as one method, so nothing else may have run
    alone = sum(line["told_apart"] and len(line["evidence"]) > 1 for line in asked)
    best = f"{' or '.join(taken)} is best"
    if alone == len(asked):
        return [f"{best} {where}."]
    near = f"; nothing else comes near at {alone}" if alone else ""
    return [f"{best}, or as good as the best within the measurement's error, {where}{near}."]


def recommendation(advice: Sequence[Line]) -> dict[str, Any]:
    """Return the recommendations as plain cells for the page."""
    about = (
        "Methods are compared by the time that they need for an error, by the error of the energy "
        "after equal computing times, and by the share of the stability map that is bounded. The "
        "brackets have the range in which the spread of the times, or the coarseness of the map, "
        "lets a ratio lie; two methods cannot be told apart if this range contains 1."
    )
    return {
        "title": "Which to take",
        "about": " ".join([*overall(advice), about]),
        "heads": ["Scene", "Evidence"],
        "lines": [[_place(line), sentence(line)] for line in advice],
    }


def short(line: Line) -> str:
    """Return a phrase such as: for 10⁻⁴ take midpoint or trapezoidal."""
    goal = line["for"]
    labels = [_label(e) for e in line["evidence"] if e["standing"] in ("best", "tied")]
    said = f"take {' or '.join(labels)}" if labels else "no method came so far"
    return f"for {GOALS.get(goal) or scientific(float(goal))} {said}"


def sentence(line: Line) -> str:
    """Return the phrase with its evidence: figures, ratios to the best and their spread."""
    best = next((e for e in line["evidence"] if e["standing"] == "best"), None)
    figure = "" if best is None else f" ({_figure(line['for'], best)})"
    tied = "" if line["told_apart"] or best is None else ", which cannot be told apart"
    others = [_beside(line["for"], e) for e in line["evidence"] if e is not best]
    said = f"{short(line)}{tied}{figure}" + (f": {', '.join(others)}." if others else ".")
    if line.get("seconds") is None:
        return said
    beyond = (
        "" if line["periods"] >= FAR
        else "; for more periods the errors are extended by the rate at which they grow in that run"
    )  # fmt: skip
    return (
        f"{said} The figures are errors of the energy when every method may compute for "
        f"{duration(line['seconds'])} to cover {line['periods']} periods{beyond}."
    )


def times(ratio: float) -> str:
    """Return a ratio such as 2.3×, or that it is very large."""
    return f"{ratio:.3g}×" if ratio < FAR else "over 10⁶×"


def _place(line: Line) -> str:
    chart = line.get("retraction")
    return str(line["scene"]) + ("" if chart in (None, USUAL_RETRACTION) else f", {chart}")


def _label(entry: Line) -> str:
    return " = ".join(entry["rules"])


def _figure(goal: str, entry: Line) -> str:
    if goal == "large steps":
        spread = 50 * (entry["high"] - entry["low"])
        return f"{100 * (1 - entry['value']):.0f} ± {spread:.0f} % of the map bounded"
    if goal == "stable steps":
        return f"stable to hω = {1 / entry['value']:.4g}"
    if goal == "1e6 periods":
        return f"energy error {scientific(entry['value'])}"
    return duration(entry["value"])


def _beside(goal: str, entry: Line) -> str:
    """Return a phrase that compares another method with the best."""
    ratio, label = number(entry["ratio"]), _label(entry)
    if goal in ("large steps", "stable steps"):
        return f"{label} {_figure(goal, entry)}"
    if ratio is not None:
        low, high = entry["ratios"]
        if low >= FAR:
            return f"{label} {times(ratio)}"
        span = f"{low:.3g} to {high:.3g}" if (number(high) or FAR) < FAR else f"from {low:.3g} on"
        noun = "the error" if goal == "1e6 periods" else "the time"
        return f"{label} {times(ratio)} {noun} ({span})"
    if goal == "1e6 periods":
        return f"{label} does not hold the energy"
    if number(entry["best"]) is None:
        return f"{label} came to no end, or to no finite numbers"
    if entry["standing"] == "out":
        return f"{label} stops at {scientific(entry['best'])}"
    more = f", so more than {times(entry['ratios'][0])}" if entry["standing"] == "behind" else ""
    return f"{label} came to {scientific(entry['best'])} in {duration(entry['followed'])}{more}"
