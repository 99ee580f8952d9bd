"""Which method `compare` says to take: standings made by hand, and one real race."""

import itertools
import math
from dataclasses import replace

import pytest

from discmech.integrators import discretisation, midpoint, scenes, trapezoidal
from discmech.studies import get
from discmech.studies.core.case import Choice
from discmech.studies.core.result import Result, result_of
from discmech.studies.core.running import run_study
from discmech.studies.report import advising
from discmech.studies.stability.view import VIEW as STABILITY
from discmech.studies.user.advice import Standing, advice, ranked


def raced(rule, cost=None, low=None, high=None, best=1e-6, cut="", dearest=0.1, **more):
    """A case of a race with one accuracy; long ones have periods and equal_time."""
    spread = None if cost is None else [low or cost, high or cost]
    measured = {"x": "seconds", "cost": {"1e-04": cost}, "spread": {"1e-04": spread}, "best": best,
                "cut": cut, "dearest": dearest, "same_as": more.pop("same_as", None),
                "equal_time": more.pop("equal_time", None)}  # fmt: skip
    extras = {"periods": more.pop("periods", None)}
    of = {"study": "work-precision", "scene": "kepler", "rule": rule, **more}
    return Result(**of, figures=measured, extras=extras)


def long(rule, error, growth=0.0, **more):
    held = {"seconds": 0.02, "error": error, "spread": [error, error], "growth": growth}
    return raced(rule, periods=1000, equal_time=held, **more)


def only(cases, comparison=()):
    (line,) = advice(cases, comparison)
    return line


FAST, SLOW = raced("fast", 1e-3, 0.98e-3, 1.02e-3), raced("slow", 3e-3, 2.9e-3, 3.2e-3)
NEAR = raced("near", 1.08e-3)
CUT = raced("cut", None, best=2e-4, cut="64 steps, about 1 s", dearest=0.9e-3)
LATE = raced("late", None, best=2e-4, cut="64 steps, about 1 s", dearest=9e-3)
STUCK = raced("stuck", None, best=3e-2)
LOST = raced("lost", None, best=None, dearest=None)


def test_a_dominated_method_is_never_taken_whatever_the_order():
    every = [FAST, NEAR, SLOW, CUT, LATE, STUCK, LOST]
    lines = [only(order) for order in itertools.islice(itertools.permutations(every), 0, None, 97)]
    assert all(line == lines[0] for line in lines)
    assert lines[0]["take"] == ["fast", "near"] and not lines[0]["told_apart"]
    assert {e["rules"][0]: e["standing"] for e in lines[0]["evidence"]} == {
        "fast": "best", "near": "tied", "slow": "behind", "late": "behind", "cut": "open",
        "stuck": "out", "lost": "out",
    }  # fmt: skip
    assert advising.sentence(lines[0]) == (
        "for 10⁻⁴ take fast or near, which cannot be told apart (1 ms): "
        "near 1.08× the time (0.982 to 1.19), slow 3× the time (2.73 to 3.36), "
        "late came to 2.0×10⁻⁴ in 9 ms, so more than 8.18×, cut came to 2.0×10⁻⁴ in 900 µs, "
        "lost came to no end, or to no finite numbers, stuck stops at 0.03."
    )


@pytest.mark.parametrize("second, said", [
    (SLOW, "fast is best at all 2 aims."),
    (NEAR, "fast is best, or as good as the best within the measurement's error, at all 2 aims; "
           "nothing else comes near at 1."),
    (raced("faster", 1e-5),
     "No method is best, or as good as the best, at all 2 aims."),
])  # fmt: skip
def test_one_method_may_be_best_at_every_aim(second, said):
    elsewhere = [replace(case, scene="harmonic") for case in (FAST, second)]
    assert advising.overall(advice([FAST, SLOW, *elsewhere], ())) == [said]
    assert advising.overall(advice([FAST, SLOW], ())) == []


def test_wide_quartiles_tell_nothing_apart():
    assert only([FAST, raced("shaky", 3e-3, 1e-3, 9e-3)])["take"] == ["fast", "shaky"]


def test_where_nobody_comes_nobody_is_taken():
    line = only([CUT, STUCK])
    assert line["take"] == [] and not line["told_apart"]
    assert advising.short(line) == "for 10⁻⁴ no method came so far"


def test_one_method_of_two_names_ties_as_one():
    again = raced("again", 1e-3, 0.98e-3, 1.02e-3, same_as="fast")
    line = only([SLOW, FAST, again])
    assert line["take"] == ["again", "fast"] and line["told_apart"]
    assert advising.short(line) == "for 10⁻⁴ take again = fast"


@pytest.mark.parametrize(("other", "taken"), [
    (long("drift", 1e-8, 1.0), ["drift"]),  # a thousand times, and still below the band
    (long("drift", 1e-6, 1.0), ["band", "drift"]),
    (long("drift", 2e-4, 1.0), ["band"]),
    (long("drift", 2.0), ["band"]),
])  # fmt: skip
def test_long_runs_are_carried_on_by_their_growth(other, taken):
    without = raced("without a run of that time", periods=1000)
    line = only([long("band", 1e-4), other, without])
    assert "without" not in advising.sentence(line)
    assert sorted(line["take"]) == taken
    assert advising.sentence(line).endswith(
        "for 20 ms to cover 1000 periods; for more periods the errors are extended by the rate at "
        "which they grow in that run."
    )


def test_large_steps_are_no_matter_of_one_cell():
    def shown(rule, classes):
        cells = [{"stiffness": 1.0, "z": k, "class": c} for k, c in enumerate(classes)]
        case = {"kind": "map", "measured": {"limits": {"1": 1.0}}, "rows": cells}
        line = {"scene": "kepler", "rule": rule, "retraction": None}
        return line | STABILITY.compared(result_of("stability", case))

    good, bad = ["bounded"] * 8 + ["escaped"] * 2, ["bounded"] * 3 + ["escaped"] * 7
    one_off = ["bounded", "resonant", *["bounded"] * 6, *["escaped"] * 2]
    a, b, c = shown("a", good), shown("b", one_off), shown("c", bad)
    assert (a["bounded"], a["bounded_spread"]) == (0.8, 0.05) and b["bounded_spread"] == 0.15
    line = only([], [c, b, a])
    assert line["take"] == ["a", "b"] and line["evidence"][2]["standing"] == "behind"
    assert advising.sentence(line) == (
        "for large steps take a or b, which cannot be told apart (80 ± 5 % of the map bounded): "
        "b 70 ± 15 % of the map bounded, c 30 ± 5 % of the map bounded."
    )


def test_stable_steps_of_the_oscillator_are_those_of_bisection():
    def shown(rule, end):
        case = {"kind": "linear", "measured": {"stable_to": end}}
        line = {"scene": "harmonic", "rule": rule, "retraction": None}
        return line | STABILITY.compared(result_of("stability", case))

    line = only([], [shown("a", 2.0), shown("b", 2.0 + 1e-12), shown("c", None), shown("d", 1.9)])
    assert (
        line["take"] == ["c"]
        and STABILITY.short(result_of("stability", {"measured": {"stable_to": None}}))
        == "at every hω up to 1000"
    )
    assert only([], [shown("a", 2.0), shown("b", 2.0 + 1e-12), shown("d", 1.9)])["take"] == [
        "b",
        "a",
    ]
    assert advising.sentence(line).startswith(
        "for large steps of the oscillator take c (stable to hω = 1000): b stable to hω = 2"
    )


def test_ratios_too_large_to_mean_anything_are_no_number():
    far = raced("far", 1e26)
    assert "far over 10⁶×" in advising.sentence(only([FAST, far]))
    found = ranked([Standing(("a",), None, math.inf), Standing(("b",), 1.0, 0.9, 1.1)])
    assert [said for said, _ in found] == ["best", "out"]


@discretisation(order=2)
def mine(L, G, x, u, h):
    return h * L(G.target(x, u, h / 2), u)


@discretisation(order=1)
def left(L, G, x, u, h):
    return h * L(x, u)


@pytest.mark.slow
def test_a_race_with_one_method_twice():
    """Its rows are those of one run; and a rule of order 1 is never taken for an accuracy."""
    choice = Choice(
        scenes=(scenes.get("pendulum"),), rules=(midpoint, left, mine, trapezoidal),
        own=(("peer", ("none",)), ("also_periods", 20), ("budget", 0.02)),
    )  # fmt: skip
    cases = run_study(get("work-precision"), choice).cases
    for periods in (None, 20):
        rows = {c.rule: c.data for c in cases if c.details.periods == periods}
        assert rows["mine"] == rows["midpoint"] != rows["trapezoidal"]
    lines = {line["for"]: line for line in advice(cases, ())}
    assert set(lines) == {"1e-04", "1e-08", "1e-12", "1e6 periods"}
    assert all(("mine" in line["take"]) is ("midpoint" in line["take"]) for line in lines.values())
    assert "left" not in [*lines["1e-04"]["take"], *lines["1e6 periods"]["take"]]
