"""The recommended method for each scene and goal, from the numbers of `compare`'s cases.

Every method has a figure (smaller is better) with an interval. Methods whose interval overlaps the
best one's are tied with it, and all are named. `report.advising` puts it into sentences.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

from ..core.records import Json, grouped
from ..core.result import AnyResult

#: two runs of one race give ratios within 9.2 % of each other (docs/notes/races.md), so a
#: difference below a tenth does not distinguish two methods, however narrow the quartiles of a run
#: are; each of the two gets half of it (of its logarithm)
AGREE = math.sqrt(1.1)
Of = TypeVar("Of")
MANY = 10**6  # periods of the extrapolated long run
BITS = 1e-9  # relative accuracy of a step that bisection found
LOST = 1.0  # an error as large as the quantity itself: the motion is another one


@dataclass(frozen=True)
class Standing:
    """A method's figure with its interval; `rules`: all names of this one method.

    value: None if it is only known to be more than `low`; with low = inf the method does not reach
    the goal. best: its smallest error; followed: seconds of its longest run.
    """

    rules: tuple[str, ...]
    value: float | None
    low: float
    high: float = math.inf
    best: float | None = None
    followed: float | None = None


def ranked(standings: Sequence[Standing]) -> list[tuple[str, Standing]]:
    """Return the standings with a word for each, in any order of input.

    best; tied: cannot be distinguished from the best; behind: certainly worse; open: its runs were
    too short to tell; out: does not reach the goal.
    """
    every = sorted(standings, key=lambda s: (math.inf if s.value is None else s.value, s.rules))
    reach = every[0].high if every and every[0].value is not None else math.inf

    def place(k: int, one: Standing) -> str:
        if one.low == math.inf:
            return "out"
        if one.low > reach:
            return "behind"
        return "open" if one.value is None else "tied" if k else "best"

    pairs = [(place(k, one), one) for k, one in enumerate(every)]
    order = ("best", "tied", "behind", "open", "out")
    return sorted(pairs, key=lambda pair: order.index(pair[0]))


def advice(cases: Sequence[AnyResult], comparison: Sequence[Json]) -> list[dict[str, Any]]:
    """Return lines {"scene", "retraction", "for", "take", "told_apart", "evidence"}.

    for: "1e-04", "1e-08", "1e-12" (the least time to that error), "1e6 periods" (the least energy
    error at equal time, with "seconds" for so many "periods"), "large steps" (the least share of
    the stability map that is not bounded) or "stable steps" (the largest stable step of the
    oscillator, as its inverse). take: the recommended rules, [] if none reaches the goal;
    told_apart: True if they are one method. evidence: a line per method {"rules", "standing" (see
    `ranked`), "value", "low", "high", "ratio", "ratios": [low, high] (to the best one's), "best"
    (its smallest error), "followed" (seconds of its longest run)}.
    """
    timed = (c for c in cases if c.study == "work-precision" and c.figures.get("x") == "seconds")
    races = grouped(timed, lambda case: (case.scene, case.retraction, case.details.periods))
    pairs: list[tuple[Any, dict[str, Any]]] = []
    for (*place, periods), own in races.items():
        if len({case.rule for case in own}) < 2:
            continue  # a single method has no rank
        if periods is not None:
            pairs.append((place, _over_long_times(own)))
        else:
            pairs += [(place, _for_accuracy(own, key)) for key in own[0].figures["cost"]]
    known = (line for line in comparison if line.get("stable") is not None)
    stable = grouped(known, lambda line: (line["scene"], line["retraction"]))
    for (scene, chart), lines in stable.items():
        if len(lines) > 1:
            alike = _leaders(races.get((scene, chart, None), ()))
            pairs.append(([scene, chart], _at_large_steps(lines, alike)))
    places = [place for place, _ in pairs]
    return [
        {"scene": place[0], "retraction": place[1], **line}
        for place, line in sorted(pairs, key=lambda pair: places.index(pair[0]))
    ]


def _for_accuracy(cases: Sequence[AnyResult], accuracy: str) -> dict[str, Any]:
    """Return the line for the least time to an error."""

    def standing(rules: tuple[str, ...], case: AnyResult) -> Standing:
        measured = case.figures
        cost, best, dearest = measured["cost"][accuracy], measured["best"], measured["dearest"]
        if cost is not None:
            low, high = measured["spread"].get(accuracy) or (cost, cost)
            low, high = min(low, cost / AGREE), max(high, cost * AGREE)
            return Standing(rules, cost, low, high, best, dearest)
        cut = measured["cut"] and dearest is not None
        return Standing(rules, None, dearest / AGREE if cut else math.inf, math.inf, best, dearest)

    return _line(accuracy, _standings(_by_rule(cases), _leaders(cases), standing))


def _over_long_times(cases: Sequence[AnyResult]) -> dict[str, Any]:
    """Return the line for the least energy error at equal time, extrapolated to `MANY` periods.

    Its interval: the error stays as it is, or continues to grow as from half the run to the end.
    """
    periods = cases[0].details.periods or 0

    def standing(rules: tuple[str, ...], case: AnyResult) -> Standing:
        figure = case.figures["equal_time"]
        if figure["error"] > LOST:
            return Standing(rules, None, math.inf)
        error, (low, high) = figure["error"], figure["spread"]
        grown = max(1.0, MANY / periods) ** max(0.0, figure["growth"] or 0.0)
        return Standing(rules, error, min(low, error / AGREE), max(high, error * AGREE) * grown)

    # a method with no run of that time has lost nothing: it is left out
    run = [case for case in cases if case.figures["equal_time"]]
    line = _line("1e6 periods", _standings(_by_rule(run), _leaders(run), standing))
    times = [case.figures["equal_time"]["seconds"] for case in run]
    return {**line, "periods": periods, "seconds": min(times, default=None)}


def _at_large_steps(lines: Sequence[Json], alike: Mapping[str, str]) -> dict[str, Any]:
    """Return the line for the least share of the map of steps and stiffness that is not bounded.

    For the oscillator the largest stable step is known to the last bits; its inverse is used.
    """
    mapped = "bounded" in lines[0]

    def standing(rules: tuple[str, ...], line: Json) -> Standing:
        if not mapped:
            inverse = 1 / line["stable"]
            return Standing(rules, inverse, inverse * (1 - BITS), inverse * (1 + BITS))
        wrong, spread = 1 - line["bounded"], line["bounded_spread"]
        return Standing(rules, wrong, wrong - spread, wrong + spread)

    by_rule = [(line["rule"], line) for line in lines]
    return _line("large steps" if mapped else "stable steps", _standings(by_rule, alike, standing))


def _by_rule(cases: Sequence[AnyResult]) -> list[tuple[str, AnyResult]]:
    return [(str(case.rule), case) for case in cases]


def _leaders(cases: Sequence[AnyResult]) -> dict[str, str]:
    """Return for each rule of a race the rule that is the same method."""
    return {rule: case.figures.get("same_as") or rule for rule, case in _by_rule(cases)}


def _standings(
    lines: Sequence[tuple[str, Of]],
    leaders: Mapping[str, str],
    standing: Callable[[tuple[str, ...], Of], Standing],
) -> list[Standing]:
    """Return one standing per method: rules with one leader are the same method."""
    alike = grouped(lines, lambda line: leaders.get(line[0], line[0]))
    return [standing(tuple(sorted(rule for rule, _ in same)), same[0][1])
            for same in alike.values()]  # fmt: skip


def _line(goal: str, standings: Sequence[Standing]) -> dict[str, Any]:
    """Return the line of the advice, without its scene."""
    ranking = ranked(standings)
    best = ranking[0][1] if ranking and ranking[0][0] == "best" else None
    least = best.value if best is not None else None
    taken = [one for said, one in ranking if said in ("best", "tied")]
    return {
        "for": goal,
        "take": [rule for one in taken for rule in one.rules],
        "told_apart": len(taken) == 1,
        "evidence": [
            {
                **vars(one),
                "rules": list(one.rules),
                "standing": said,
                "ratio": one.value / least if least and one.value else None,
                "ratios": [one.low / best.high, one.high / best.low] if best and least else None,
            }
            for said, one in ranking
        ],
    }
