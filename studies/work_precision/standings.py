"""The results of a race: costs of accuracies, ratios to the best peer, changes of leader."""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from ..core.outcome import Row
from ..core.records import grouped
from ..core.result import AnyResult
from .contestants import Contestant

#: two runs of one race give ratios within 10 % of each other (docs/notes/races.md)
ALIKE = 1.1
REACHED = (1e-4, 1e-8, 1e-12)  # accuracies whose cost is reported


@dataclass
class Climb:
    """A contestant's runs up to where the budget or round-off ended them."""

    contestant: Contestant
    rows: list[dict[str, Any]] = field(default_factory=list)
    runs: list[tuple[dict[str, Any], Any]] = field(default_factory=list)  # rows that can be timed
    cut: str = ""


def reached(each: Climb, metric: str) -> float:
    """Return the least error of a climb."""
    errors = (row[metric] for row, _ in each.runs)
    return min(errors, default=math.inf)


def summary(each: Climb, axes: tuple[str, str]) -> dict[str, Any]:
    """Return {rows, measured, kind}: the cost of each accuracy.

    cost and its quartiles (`spread`) are read off the line through the runs; see
    `measuring.measure`. What needs all methods is added by `beside_each_other`.
    """
    errors = [row[axes[1]] for row in each.rows if row[axes[1]] is not None]
    return {
        "rows": each.rows,
        "kind": each.contestant.kind,
        "measured": {
            "x": axes[0],
            "y": axes[1],
            "best": min(errors, default=None),
            "cost": cost(each.rows, axes),
            "spread": _spread(each.rows, axes),
            "cut": each.cut,
            "dearest": max((work for work, _ in points(each.rows, axes)), default=None),
            "setup": getattr(each.contestant, "setup", None),
        },
    }


def fastest_peers(kept: Mapping[str, Mapping[str, Any]]) -> set[str]:
    """Return the peers with the least cost of an accuracy, from measurements by name."""
    costs = {name: one["measured"]["cost"] for name, one in kept.items() if one["kind"] == "peer"}
    known = {a: {name: cost[a] for name, cost in costs.items() if cost[a] is not None}
             for a in map(_key, REACHED)}  # fmt: skip
    return {min(table, key=lambda name: table[name]) for table in known.values() if table}


def beside_each_other(cases: Sequence[AnyResult]) -> list[AnyResult]:
    """Return the cases with what is read off all methods of a race, even of several runs.

    crossovers, and standing (`crossovers`); measured: ratio, the cost of each accuracy to the best
    peer's of the same run, `equal_time` of the methods of one run, since times of two runs differ,
    and same_as: the first method with the same step. A method that fails solves another problem,
    and is not ranked: it has neither cost nor ratio.
    """
    timed = (case for case in cases if "race" in case.extras)
    races = grouped(timed, lambda case: (case.scene, case.retraction, case.details.periods))
    replacements = {}
    for race in races.values():
        axes = race[0].figures["x"], race[0].figures["y"]
        out = {str(case.rule) for case in race if case.verdict == "fail"}
        ranked, rows = [case for case in race if case.rule not in out], dict[str, list[Any]]()
        for case in ranked:
            rows.setdefault(case.extras["race"]["run"], []).append(case.data)
        least = {case.extras["race"]["run"]: cost_of_runs(_peers_of(case, out)) for case in race}
        changes, standing = crossovers(ranked, axes, out)
        first: dict[str, str | None] = {}
        for case in race:
            step, run = case.extras["race"]["step"], case.extras["race"]["run"]
            leader = first.setdefault(step, case.rule) if step else case.rule
            costs = cost([] if case.rule in out else case.data, axes)
            ratio = {a: value / best if value is not None and (best := least[run][a]) else None
                     for a, value in costs.items()}  # fmt: skip
            more = {"cost": costs, "ratio": ratio,
                    "equal_time": None if case.rule in out
                    else equal_time(case.data, rows[run], axes[1]),
                    "same_as": None if leader == case.rule else leader}  # fmt: skip
            beside = {"crossovers": changes, "standing": standing}
            replacements[id(case)] = replace(case, figures={**case.figures, **more},
                                             extras={**case.extras, **beside})  # fmt: skip
    return [replacements.get(id(case), case) for case in cases]


def _peers_of(case: AnyResult, out: Collection[str]) -> list[Sequence[Sequence[float]]]:
    """Return (work, error) of the ranked peers in the run of a case."""
    return [runs for name, runs in case.extras["race"]["peers"].items() if name not in out]


def _spread(rows: Sequence[Row], axes: tuple[str, str]) -> dict[str, list[float] | None]:
    """Return per accuracy the cost by the quartiles of all times; {} if it is not a time."""
    if axes[0] != "seconds":
        return {}
    ends = [cost(rows, (f"seconds_{end}", axes[1])) for end in ("low", "high")]
    pairs = {key: [value for end in ends if (value := end[key]) is not None] for key in ends[0]}
    return {key: pair if len(pair) == 2 else None for key, pair in pairs.items()}


def equal_time(
    own: Sequence[Row], every: Sequence[Sequence[Row]], metric: str
) -> dict[str, Any] | None:
    """Return {seconds, error, spread, growth}: the least error within the time that all methods
    ran.

    That time is the shortest of the methods' longest runs. spread: the same by the quartiles of the
    times. growth: that of the energy error in the longest run within it. None if no run is as
    short.
    """
    longest = [max((s for s, _ in points(rows, ("seconds", metric))), default=None)
               for rows in every]  # fmt: skip
    ended = [seconds for seconds in longest if seconds is not None]
    if not ended or not own:
        return None
    when = min(ended)
    errors = [
        next(iter(cost(own, (metric, clock), [when]).values()))
        for clock in ("seconds", "seconds_low", "seconds_high")
    ]
    inside = [row for row in own if row.get("seconds") and row["seconds"] <= when]
    if errors[0] is None or not inside:
        return None
    ends = [value for value in errors if value is not None]
    growth = max(inside, key=lambda row: row["seconds"]).get("growth")
    spread = [min(ends), max(ends)]
    return {"seconds": when, "error": errors[0], "spread": spread, "growth": growth}


def points(rows: Sequence[Row], axes: tuple[str, str]) -> list[tuple[float, float]]:
    """Return (work, error) of the finished runs, in the order of the ladder."""
    return [
        (row[axes[0]], max(row[axes[1]], 1e-300))
        for row in rows
        if row.get(axes[0]) and row.get(axes[1]) is not None
    ]


def crossovers(
    race: Sequence[AnyResult], axes: tuple[str, str], out: Collection[str] = ()
) -> tuple[list[dict[str, Any]], dict[str, Any] | None]:
    """Return where the fastest rule and the fastest peer change places, and how they stand.

    [{error, work, tighter}]: `tighter` is the kind that is faster at tighter accuracies. Only
    accuracies that both kinds reach count, and a change only if before and after it one kind is
    faster by more than runs differ (`ALIKE`). A rule is compared with the peers of its own run,
    since times of two runs differ. The second is None if no accuracy is reached by both, else
    {leader, loosest, tightest, sure}: the kind that is faster at the tightest accuracy where that
    is known, the accuracies that were compared, and True if at each of them one kind is faster by
    more than runs differ. out: the names of peers that are not ranked.
    """
    grid = [10.0 ** (-k / 8) for k in range(8 * 15)]
    alike = ALIKE if axes[0] == "seconds" else 1.0
    rules = [case for case in race if case.details.kind == "rule"]
    peers = {case.extras["race"]["run"]: cost_of_runs(_peers_of(case, out), grid)
             for case in rules}  # fmt: skip
    both = [(cost(case.data, axes, grid), peers[case.extras["race"]["run"]]) for case in rules]
    changes, compared, sure, turn = [], list[float](), True, dict[str, float]()
    before = leader = None
    for error, key in zip(grid, map(_key, grid), strict=True):
        known = [(x, y) for own, other in both if (x := own[key]) and (y := other[key])]
        if not known:
            continue
        compared.append(error)
        rule, peer = min(known, key=lambda pair: pair[0] / pair[1])
        faster = "rule" if rule < peer else "peer"
        if faster != before:
            turn = {"error": error, "work": max(rule, peer)}
        before = faster
        if max(rule, peer) < alike * min(rule, peer):
            sure = False
            continue
        if leader not in (None, faster):
            changes.append({**turn, "tighter": faster})
        leader = faster
    if not compared:
        return changes, None
    ends = {"loosest": compared[0], "tightest": compared[-1]}
    return changes, {"leader": leader, **ends, "sure": sure}


def _key(accuracy: float) -> str:
    return f"{accuracy:.0e}" if accuracy in REACHED else f"{accuracy:.3e}"


def cost(
    rows: Sequence[Row], axes: tuple[str, str], accuracies: Sequence[float] = REACHED
) -> dict[str, float | None]:
    """Return per accuracy the least work that reaches it; None if none does."""
    return _cost(points(rows, axes), accuracies)


def _cost(runs: Sequence[Sequence[float]], accuracies: Sequence[float]) -> dict[str, float | None]:
    """Return the least work by (work, error) of each run.

    It is read off the line through the runs in log–log, in the order of the ladder. In the order of
    work two runs of about the same time would change places by chance, and the cost with them.
    """
    costs: dict[str, float | None] = {}
    for accuracy in accuracies:
        works = [work for work, error in runs if error <= accuracy]
        for (w0, e0), (w1, e1) in itertools.pairwise(runs):
            if (e0 <= accuracy) is not (e1 <= accuracy):
                works.append(w0 * (w1 / w0) ** (math.log(e0 / accuracy) / math.log(e0 / e1)))
        costs[_key(accuracy)] = min(works, default=None)
    return costs


def cost_of_runs(
    every: Iterable[Sequence[Sequence[float]]], accuracies: Sequence[float] = REACHED
) -> dict[str, float | None]:
    """Return the least cost of each accuracy for several methods."""
    costs = [_cost(runs, accuracies) for runs in every]
    known = {key: [c[key] for c in costs] for key in map(_key, accuracies)}
    return {key: min(filter(None, values), default=None) for key, values in known.items()}
