"""The results of a race: costs of accuracies, ratios to the best peer, changes of leader."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from .contestants import Contestant

REACHED = (1e-4, 1e-8, 1e-12)  # accuracies whose cost is reported


@dataclass
class Climb:
    """A contestant's runs up to where the budget or round-off ended them."""

    contestant: Contestant
    rows: list[dict[str, Any]] = field(default_factory=list)
    runs: list[tuple[dict[str, Any], Any]] = field(default_factory=list)  # rows that can be timed
    cut: str = ""


def summary(each: Climb, climbs: Sequence[Climb], axes: tuple[str, str]) -> dict[str, Any]:
    """Return {rows, measured, kind}: the cost of each accuracy, beside the best peer's cost.

    cost, its quartiles (`spread`) and `equal_time` are read off the line through the runs; see
    `measuring.measure`.
    """
    costs = cost(each.rows, axes)
    others = [cost(c.rows, axes) for c in climbs if c.contestant.kind == "peer"]
    ratio = {}
    for accuracy, value in costs.items():
        best = min((c for o in others if (c := o[accuracy]) is not None), default=None)
        ratio[accuracy] = value / best if value is not None and best else None
    errors = [row[axes[1]] for row in each.rows if row[axes[1]] is not None]
    return {
        "rows": each.rows,
        "kind": each.contestant.kind,
        "measured": {
            "x": axes[0],
            "y": axes[1],
            "best": min(errors, default=None),
            "cost": costs,
            "spread": _spread(each.rows, axes),
            "ratio": ratio,
            "cut": each.cut,
            "dearest": max((work for work, _ in _points(each.rows, axes)), default=None),
            "equal_time": equal_time(each.rows, [c.rows for c in climbs], axes[1]),
            "same_as": None,
            "setup": getattr(each.contestant, "setup", None),
        },
    }


def _spread(rows: Sequence[dict[str, Any]], axes: tuple[str, str]) -> dict[str, list[float] | None]:
    """Return per accuracy the cost by the quartiles of all times; {} if it is not a time."""
    if axes[0] != "seconds":
        return {}
    ends = [cost(rows, (f"seconds_{end}", axes[1])) for end in ("low", "high")]
    pairs = {key: [value for end in ends if (value := end[key]) is not None] for key in ends[0]}
    return {key: pair if len(pair) == 2 else None for key, pair in pairs.items()}


def equal_time(
    own: Sequence[dict[str, Any]], every: Sequence[Sequence[dict[str, Any]]], metric: str
) -> dict[str, Any] | None:
    """Return {seconds, error, spread, growth}: the least error within the time that all methods
    ran.

    That time is the shortest of the methods' longest runs. spread: the same by the quartiles of the
    times. growth: that of the energy error in the longest run within it. None if no run is as
    short.
    """
    longest = [max((s for s, _ in _points(rows, ("seconds", metric))), default=None)
               for rows in every]  # fmt: skip
    ended = [seconds for seconds in longest if seconds is not None]
    if not ended or not own:
        return None
    when = min(ended)
    found = [
        next(iter(cost(own, (metric, clock), [when]).values()))
        for clock in ("seconds", "seconds_low", "seconds_high")
    ]
    inside = [row for row in own if row.get("seconds") and row["seconds"] <= when]
    if found[0] is None or not inside:
        return None
    ends = [value for value in found if value is not None]
    growth = max(inside, key=lambda row: row["seconds"]).get("growth")
    spread = [min(ends), max(ends)]
    return {"seconds": when, "error": found[0], "spread": spread, "growth": growth}


def _points(rows: Sequence[dict[str, Any]], axes: tuple[str, str]) -> list[tuple[float, float]]:
    """Return (work, error) of the finished runs, in the order of the ladder."""
    return [
        (row[axes[0]], max(row[axes[1]], 1e-300))
        for row in rows
        if row.get(axes[0]) and row.get(axes[1]) is not None
    ]


def crossovers(climbs: Sequence[Climb], axes: tuple[str, str]) -> list[dict[str, Any]]:
    """Return where the fastest rule and the fastest peer change places: [{error, work, tighter}].

    `tighter` is the kind that is faster at tighter accuracies. Only accuracies that both kinds
    reach count.
    """
    grid = [10.0 ** (-k / 8) for k in range(8 * 15)]
    best: dict[str, list[float]] = {}
    for kind in ("rule", "peer"):
        curves = [cost(c.rows, axes, grid) for c in climbs if c.contestant.kind == kind]
        best[kind] = [
            min((v for curve in curves if (v := curve[accuracy]) is not None), default=math.inf)
            for accuracy in map(_key, grid)
        ]
    found, before = [], None
    for error, rule, other in zip(grid, best["rule"], best["peer"], strict=True):
        if math.isinf(rule) or math.isinf(other):
            continue
        faster = "rule" if rule < other else "peer"
        if before not in (None, faster):
            found.append({"error": error, "work": max(rule, other), "tighter": faster})
        before = faster
    return found


def _key(accuracy: float) -> str:
    return f"{accuracy:.0e}" if accuracy in REACHED else f"{accuracy:.3e}"


def cost(
    rows: Sequence[dict[str, Any]], axes: tuple[str, str], accuracies: Sequence[float] = REACHED
) -> dict[str, float | None]:
    """Return per accuracy the least work that reaches it; None if none does.

    It is read off the line through the runs in log–log, in the order of the ladder. In the order of
    work two runs of about the same time would change places by chance, and the cost with them.
    """
    points = _points(rows, axes)
    found: dict[str, float | None] = {}
    for accuracy in accuracies:
        works = [work for work, error in points if error <= accuracy]
        for (w0, e0), (w1, e1) in itertools.pairwise(points):
            if (e0 <= accuracy) is not (e1 <= accuracy):
                works.append(w0 * (w1 / w0) ** (math.log(e0 / accuracy) / math.log(e0 / e1)))
        found[_key(accuracy)] = min(works, default=None)
    return found
