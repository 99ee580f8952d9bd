"""Races: fair timing, true errors, costs by interpolation, and wrong methods that are found out."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from discmech.integrators import BadInput, discretisation, scenes
from discmech.integrators import rules as discretisations
from discmech.integrators.rules import BUILT_IN
from discmech.studies import get
from discmech.studies.core.case import Choice, scheme_of
from discmech.studies.core.running import run_study
from discmech.studies.report import tables
from discmech.studies.work_precision import contest, peers, racing, standings
from discmech.studies.work_precision import plot as plot_work
from discmech.studies.work_precision.accuracy import METRICS, UNIT, Yardstick
from discmech.studies.work_precision.contestants import NoEnd, Problem, RuleContestant
from discmech.studies.work_precision.measuring import HIGH_ORDER
from discmech.studies.work_precision.peers.equations import equations_of

SCIPY = ("DOP853", "Radau", "LSODA")


def choice(*names, **more):
    return Choice(scenes=tuple(map(scenes.get, names)), **{"peers": SCIPY, **more})


def held(found):
    return {case["rule"]: case for case in found["cases"]}


# -- timing ---------------------------------------------------------------------------------------


class Machine:
    """A clock that only moves when a run takes its time."""

    def __init__(self):
        self.now, self.calls = 0.0, []

    def run(self, name, seconds, cold=0.0):
        times = itertools.cycle(seconds)

        def call():
            self.now += next(times) + cold * (self.calls[-1:] != [name])
            self.calls.append(name)

        return call


def test_a_steady_run_is_known_after_the_least_rounds():
    machine = Machine()
    (timing,) = racing.race([machine.run("a", [0.25])], 1e9, lambda: machine.now)
    assert (timing.median, timing.low, timing.high) == (0.25, 0.25, 0.25)
    assert (timing.samples, timing.outliers) == (racing.LEAST, 0)


def test_runs_take_turns_and_only_the_unknown_go_on():
    machine = Machine()
    runs = [machine.run("steady", [1.0]), machine.run("rough", [1.0, 3.0])]
    steady, rough = racing.race(runs, 1e9, lambda: machine.now)
    assert (steady.samples, rough.samples) == (racing.LEAST, racing.MOST)
    rounds = machine.calls[2 : 2 + 2 * racing.LEAST]  # after one call each: long runs need no more
    pairs = list(zip(rounds[::2], rounds[1::2], strict=True))
    assert all(set(pair) == {"steady", "rough"} for pair in pairs)
    assert len(set(pairs)) == 2  # not always in the same order


def test_the_budget_ends_it():
    machine = Machine()
    (timing,) = racing.race([machine.run("rough", [1.0, 3.0])], 2.0, lambda: machine.now)
    assert timing.samples == racing.LEAST


def test_short_runs_are_repeated_within_a_sample():
    machine = Machine()
    (timing,) = racing.race([machine.run("a", [1e-6])], 1.0, lambda: machine.now)
    assert timing.median == pytest.approx(1e-6)
    assert len(machine.calls) >= racing.LEAST * racing.SHORTEST / 1e-6


def test_the_first_call_after_another_run_is_not_timed():
    """Else a sample of few repeats is longer than one of many, and the number is set by chance."""
    machine = Machine()
    runs = [machine.run(name, [3e-4], cold=5e-4) for name in "ab"]
    for timing in racing.race(runs, 1.0, lambda: machine.now):
        assert timing.high == pytest.approx(3e-4)
    stretches = [len(list(same)) for _, same in itertools.groupby(machine.calls)]
    assert set(stretches[2:]) <= {5, 10}  # after the plans: one call to warm up, and four of 1.2 ms


def test_a_disturbed_first_call_does_not_set_the_repeats():
    machine = Machine()
    times = [4e-3, *[3e-5] * 1000]
    (timing,) = racing.race([machine.run("a", times)], 1.0, lambda: machine.now)
    assert len(machine.calls) == 3 + racing.LEAST * (1 + 34) and timing.known


def test_close_quartiles_of_few_samples_are_no_knowledge():
    """The median of five samples is anywhere between the first and the last of them."""
    few = [1.0, 1.01, 1.02, 1.03, 1.3]
    assert not racing.Timing.of(few).known
    assert racing.Timing.of([*few[:4], 1.05]).known
    assert racing.Timing.of([*few, 1.0, 1.02, 1.01]).known  # of eight, one may lie apart
    assert not racing.Timing.of([1.0] * 4).known


@pytest.mark.parametrize("samples", range(1, racing.MOST + 1))
def test_the_interval_of_the_median_has_its_confidence(samples):
    """By the definition: fewer than r of n fair coins show heads, or fewer than r tails."""
    rank = racing._rank(samples)

    def sure(r):
        return 1 - 2 * sum(math.comb(samples, k) for k in range(r)) / 2**samples

    assert rank == 0 or sure(rank) >= racing.CONFIDENCE
    assert sure(rank + 1) < racing.CONFIDENCE


def test_an_outlier_is_flagged_and_kept():
    timing = racing.Timing.of([1.0, 1.01, 1.02, 0.99, 1.0, 50.0])
    assert (timing.samples, timing.outliers) == (6, 1)
    assert racing.Timing.of([1.0, 1.01, 1.02, 0.99, 1.0, 1.0]).outliers == 0


def test_nothing_to_time():
    assert racing.race([], 1.0) == []


# -- what an accuracy costs -----------------------------------------------------------------------


def test_costs_lie_on_the_line_between_runs():
    rows = [{"seconds": 10.0**k, "error": 10.0 ** (-2 * k)} for k in range(5)]
    found = standings.cost(rows, ("seconds", "error"))
    assert found == {"1e-04": pytest.approx(100.0), "1e-08": pytest.approx(1e4), "1e-12": None}
    rows = [{"seconds": 3.0, "error": 1e-9}]
    assert standings.cost(rows, ("seconds", "error")) == {"1e-04": 3.0, "1e-08": 3.0, "1e-12": None}
    assert set(standings.cost([], ("seconds", "error")).values()) == {None}


def test_costs_do_not_jump_where_two_runs_take_the_same_time():
    """LSODA on the heavy top: of rtol 1e-9 and 1e-10 now this, now that is a little faster."""

    def cost(ninth, tenth):
        runs = ((0.43, 7e-8), (ninth, 1.3e-8), (tenth, 4e-10), (0.60, 2e-11))
        rows = [{"seconds": seconds, "error": error} for seconds, error in runs]
        return standings.cost(rows, ("seconds", "error"))["1e-08"]

    assert cost(0.5401, 0.54) == pytest.approx(cost(0.54, 0.5401), rel=1e-3)


def test_the_least_work_counts_where_the_line_turns():
    """More work with a larger error, and a looser setting that is slower and right by chance."""
    axes = ("seconds", "error")
    down_and_up = [
        {"seconds": s, "error": e} for s, e in ((1, 1e-3), (2, 1e-5), (4, 1e-3), (8, 1e-9))
    ]
    assert standings.cost(down_and_up, axes)["1e-04"] == pytest.approx(math.sqrt(2))
    slower = [{"seconds": s, "error": e} for s, e in ((3, 1e-5), (1, 1e-3), (2, 1e-5))]
    assert standings.cost(slower, axes)["1e-04"] == pytest.approx(math.sqrt(2))


# -- truth ----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def pendulum():
    return held(run_study(get("work-precision"), choice("pendulum")))


def test_everybody_takes_part_and_comes_to_the_truth(pendulum):
    ours = {"rectangle", "midpoint", "trapezoidal", *HIGH_ORDER}
    assert set(pendulum) == {*ours, *SCIPY}
    for name, case in pendulum.items():
        assert case["verdict"] == "pass", (name, case["reason"])
        assert case["kind"] == ("peer" if name in SCIPY else "rule")
        assert case["command"].startswith("discmech work-precision pendulum --peer DOP853")


def test_rows_hold_every_metric_and_every_count(pendulum):
    for name, case in pendulum.items():
        for row in case["rows"]:
            assert set(row) >= {*METRICS, *contest.WORK, "setting", "samples", "outliers"}
            assert row["seconds_low"] <= row["seconds"] <= row["seconds_high"]
            assert row["samples"] >= racing.LEAST
            assert row["error"] <= row["error-max"] and row["energy"] <= row["energy-max"]
            parts = math.hypot(row["error-x"], row["error-mu"])
            assert row["error"] == pytest.approx(parts, rel=1e-9)
            assert row["evaluations"] > row["steps"]
            assert (row["iterations"] is None) is (name in SCIPY)


def test_errors_sink_with_the_order_of_the_rule(pendulum):
    for name, order in (("rectangle", 1), ("midpoint", 2), ("trapezoidal", 2), (HIGH_ORDER[0], 4)):
        rows = pendulum[name]["rows"]
        good = [(r["step"], r["error"]) for r in rows if 1e-10 < (r["error"] or 0) < 1e-4]
        (h0, e0), (h1, e1) = good[0], good[-1]
        assert math.log(e1 / e0) / math.log(h1 / h0) == pytest.approx(order, abs=0.1)


def test_the_ratio_is_to_the_best_peer(pendulum):
    for accuracy in ("1e-04", "1e-08"):
        costs = {n: c["measured"]["cost"][accuracy] for n, c in pendulum.items()}
        best = min(costs[p] for p in SCIPY if costs[p])
        for name, case in pendulum.items():
            wanted = costs[name] and costs[name] / best
            assert case["measured"]["ratio"][accuracy] == pytest.approx(wanted)


OTHERS = ("harmonic", "charged-particle", "lagrange-top", "fpu")
EVERY = ["rigid-body", *(pytest.param(n, marks=pytest.mark.slow) for n in OTHERS)]


@pytest.mark.parametrize("name", EVERY)
def test_peers_solve_the_same_equations(name):
    """Each of scipy's methods comes to the reference; LSODA on fpu collects 5000 tolerances."""
    scene = scenes.get(name)
    problem = Problem(scene, scheme_of(scene, BUILT_IN["midpoint"]), scene.duration)
    equations = equations_of(problem.scheme)
    yardstick = Yardstick(problem, equations)
    for peer in SCIPY:
        run = peers.peer(peer, problem, equations).prepare(1e-11)
        errors = yardstick.errors(run.states())
        assert all(errors[m] < 1e-6 for m in errors if "max" in m), (peer, errors)


def test_a_method_that_solves_other_equations_is_found_out(monkeypatch):
    """Gravity a thousandth stronger: the peer converges, to something else."""
    scene = scenes.get("pendulum").with_values(parameters={"gravity": "1.001"})
    wrong = equations_of(scheme_of(scene, BUILT_IN["midpoint"]))
    right = peers.peer

    def swapped(name, problem, equations):
        return right(name, problem, wrong if name == "DOP853" else equations)

    monkeypatch.setattr(contest, "peer", swapped)
    found = held(
        run_study(
            get("work-precision"),
            choice("pendulum", rules=(BUILT_IN["midpoint"],), peers=("DOP853", "LSODA")),
        )
    )
    assert found["DOP853"]["verdict"] == "fail"
    assert "stop sinking" in found["DOP853"]["reason"]
    assert found["LSODA"]["verdict"] == found["midpoint"]["verdict"] == "pass"


def test_a_rule_of_one_s_own_joins_by_being_named():
    @discretisation()
    def third(L, G, x, u, h):
        return h * L(G.target(x, u, h / 3), u) / 2 + h * L(G.target(x, u, 2 * h / 3), u) / 2

    found = run_study(get("work-precision"), choice("harmonic", rules=(third,), peers=("LSODA",)))
    assert set(held(found)) == {"third", "LSODA"} and found["verdict"] == "pass"


def test_the_floor_is_what_rounding_the_start_makes():
    """On the harmonic oscillator from (1, 0) half a unit stays half a unit."""
    scene = scenes.get("harmonic")
    problem = Problem(scene, scheme_of(scene, BUILT_IN["midpoint"]), scene.duration)
    floors = Yardstick(problem, equations_of(problem.scheme)).floors
    assert floors["error"] == pytest.approx(UNIT, rel=1e-3)
    assert floors["energy-max"] == UNIT and "momentum" not in floors


def test_the_characteristic_period_of_the_oscillator_is_its_period():
    scene = scenes.get("harmonic").with_values(duration="6.2831853", step="0.01")
    problem = Problem(scene, scheme_of(scene, BUILT_IN["midpoint"]), scene.duration)
    found = contest.characteristic_period(problem, equations_of(problem.scheme))
    assert found == pytest.approx(2 * math.pi, rel=1e-3)


def test_rules_of_high_order_begin_at_their_loose_end():
    """Else a race says nothing of what they cost at 10⁻⁴, where peers are slowest to beat."""
    scene = scenes.get("kepler")
    problem = Problem(scene, scheme_of(scene, BUILT_IN["midpoint"]), scene.duration)
    yardstick = Yardstick(problem, equations_of(problem.scheme))
    for name in ("midpoint", "suzuki:trapezoidal", "kahan-li-8:trapezoidal", "gauss-2"):
        contestant = RuleContestant(problem, discretisations.get(name))
        first = contestant.prepare(next(contestant.ladder())).states()
        assert yardstick.errors(first)["error"] > 1e-4, name


def test_a_setting_that_fails_is_told_and_the_next_is_tried():
    """It must not end the race of all methods."""
    scene = scenes.get("rigid-body").with_values(duration=100)
    problem = Problem(scene, scheme_of(scene, BUILT_IN["midpoint"]), scene.duration)
    yardstick = Yardstick(problem, equations_of(problem.scheme))
    contestant = RuleContestant(problem, discretisations.get("gauss-2"), first=16)
    rows = contest.climb(contestant, yardstick, "error", 0.5).rows
    assert "did not converge" in rows[0]["cause"] and rows[0]["error"] is None
    assert any(row["error"] is not None for row in rows)


def test_checkpoints_lie_on_steps():
    scene = scenes.get("kepler")
    problem = Problem(scene, scheme_of(scene, BUILT_IN["midpoint"]), scene.duration)
    contestant = RuleContestant(problem, BUILT_IN["midpoint"])
    for setting in itertools.islice(contestant.ladder(), 3):
        states = contestant.prepare(setting).states()
        assert states.checkpoints.shape == (problem.checkpoints, 4)
        assert np.array_equal(states.checkpoints[-1], states.path[-1])
        assert states.steps == setting


# -- long races, cuts, absent peers ---------------------------------------------------------------


def test_a_long_race_is_about_invariants():
    asked = choice("kepler", rules=(BUILT_IN["midpoint"],), peers=("LSODA",), periods=20)
    found = held(run_study(get("work-precision"), asked))
    for case in found.values():
        assert case["verdict"] == "pass" and case["periods"] == 20
        assert case["measured"]["y"] == "energy-max"
        assert case["command"].endswith("--periods 20")
        assert all(row["error"] is None for row in case["rows"])
        assert all((row["energy-max"] is None) is bool(row["cause"]) for row in case["rows"])


def test_what_the_budget_cut_is_said():
    scene = scenes.get("pendulum")
    found = contest.hold_race(
        scene, [BUILT_IN["midpoint"]], ["Radau"], axes=("seconds", "error"), budget=0.02,
        periods=None, first=None, progress=lambda *_: None,
    )  # fmt: skip
    for result in found.values():
        assert result["measured"]["cut"], result["measured"]


def test_a_peer_that_comes_to_no_end_is_given_up():
    """Its next setting has its chance; and that a peer is too slow speaks against nobody."""
    scene = scenes.get("pendulum")
    scheme = scheme_of(scene, BUILT_IN["midpoint"])
    problem = Problem(scene, scheme, scene.duration, patience=0.0)
    equations = equations_of(scheme)
    peer = peers.peer("Radau", problem, equations)
    climb = contest.climb(peer, Yardstick(problem, equations), "error", 1.0)
    assert len(climb.rows) == contest.GIVEN_UP < len(list(peer.ladder())) and not climb.runs
    assert climb.cut == "rtol 1e-06, since 4 settings came to no end"
    assert {row["cause"] for row in climb.rows} == {"Radau came to no end within the budget"}
    told = {"periods": None, "floor": {}, "rows": climb.rows, "kind": "peer"}
    verdict = get("work-precision").judge(None, told)
    assert verdict.verdict == "pass" and "no end within the budget" in verdict.reason
    verdict = get("work-precision").judge(None, told | {"kind": "rule"})
    assert verdict.verdict == "inconclusive"


def test_a_run_that_fails_is_a_row_with_its_cause():
    """Steps of 2.5: Newton gives up on the midpoint rule, and the smaller ones go on."""
    asked = choice("pendulum", rules=(BUILT_IN["midpoint"],), steps=1, peers=("none",))
    found = held(run_study(get("work-precision"), asked))
    causes = [row["cause"] for row in found["midpoint"]["rows"]]
    assert found["midpoint"]["verdict"] == "pass" and causes[-1] == ""


def test_an_absent_peer_is_one_sentence(monkeypatch):
    monkeypatch.setattr(peers, "find_spec", lambda name: None if name == "heyoka" else object())
    present, absent = peers.chosen([])
    assert "heyoka" not in present and "DOP853" in present
    assert peers.on(scenes.get("kepler"), present) == present
    for name in ("rigid-body", "charged-particle", "double-pendulum"):
        assert peers.on(scenes.get(name), present) == [p for p in present if p not in peers.SPLIT]
    assert absent == ["heyoka did not take part: it is not installed "
                      "(pip install 'discmech[peers]')."]  # fmt: skip
    with pytest.raises(BadInput, match="heyoka is not installed"):
        peers.chosen(["heyoka"])
    with pytest.raises(BadInput, match='no peer "rk4"'):
        peers.chosen(["rk4"])
    assert peers.chosen(["none"]) == ([], [])


@pytest.mark.parametrize("name", ["heyoka", "diffrax", "diffrax-tsit5"])
def test_an_extra_peer_solves_the_same_equations(name):
    pytest.importorskip(name.partition("-")[0])
    scene = scenes.get("rigid-body")
    problem = Problem(scene, scheme_of(scene, BUILT_IN["midpoint"]), scene.duration)
    equations = equations_of(problem.scheme)
    run = peers.peer(name, problem, equations).prepare(1e-9)
    assert Yardstick(problem, equations).errors(run.states())["error"] < 1e-7


@pytest.mark.parametrize("name", ["heyoka", "diffrax", "diffrax-tsit5"])
def test_an_extra_peer_is_given_up_as_well(name):
    pytest.importorskip(name.partition("-")[0])
    scene = scenes.get("pendulum")
    scheme = scheme_of(scene, BUILT_IN["midpoint"])
    problem = Problem(scene, scheme, 10_000 * scene.duration, checkpoints=0, patience=1e-5)
    run = peers.peer(name, problem, equations_of(scheme)).prepare(1e-9)
    with pytest.raises(NoEnd, match=f"{name} came to no end within the budget"):
        run.states()


def test_over_long_times_heyoka_runs_as_its_documentation_advises():
    """Below round-off, with compensated sums; what is looked at is the run that is timed."""
    pytest.importorskip("heyoka")
    scene = scenes.get("kepler")
    scheme = scheme_of(scene, BUILT_IN["midpoint"])
    short = Problem(scene, scheme, scene.duration)
    long = Problem(scene, scheme, 100 * scene.duration, checkpoints=0)
    equations = equations_of(scheme)
    assert list(peers.peer("heyoka", short, equations).ladder())[-1] == 2.0**-52
    heyoka = peers.peer("heyoka", long, equations)
    finest = list(heyoka.ladder())[-1]
    run = heyoka.prepare(finest)
    assert finest == 1e-18 and run.integrator.high_accuracy
    assert heyoka.told(finest)["setting"] == "tol 1e-18, compensated"
    states = run.states()
    run()
    assert np.array_equal(run.integrator.state, states.path[-1])
    assert Yardstick(long, equations).errors(states)["energy-max"] < 100 * UNIT


@pytest.mark.parametrize("checkpoints", [0, 16])
def test_diffrax_shows_its_own_steps(checkpoints):
    """Dense output has other errors than the steps: Dopri8's are ten to forty times as large."""
    pytest.importorskip("diffrax")
    scene = scenes.get("kepler")
    scheme = scheme_of(scene, BUILT_IN["midpoint"])
    problem = Problem(scene, scheme, scene.duration, checkpoints=checkpoints)
    states = peers.peer("diffrax", problem, equations_of(scheme)).prepare(1e-6).states()
    assert states.path.shape[0] <= states.steps + 2 and np.isfinite(states.path).all()
    assert np.array_equal(states.path[0], problem.start)
    assert states.checkpoints.shape == (checkpoints, 4)
    if checkpoints:
        assert np.array_equal(states.checkpoints[-1], states.path[-1])


def test_the_symplectic_extra_peer_is_symplectic_euler():
    """Order 1, and an energy that does not drift: over 50 times the time it is off by no more."""
    pytest.importorskip("diffrax")
    scene = scenes.get("kepler")
    ends = []
    for duration in (scene.duration, 50 * scene.duration):
        problem = Problem(scene, scheme_of(scene, BUILT_IN["midpoint"]), duration, checkpoints=0)
        equations = equations_of(problem.scheme)
        yardstick = Yardstick(problem, equations)
        euler = peers.peer("diffrax-symplectic", problem, equations)
        first = next(euler.ladder())
        ends.append([yardstick.errors(euler.prepare(n * first).states())["energy-max"]
                     for n in (4, 8)])  # fmt: skip
    for coarse, fine in ends:
        assert math.log2(coarse / fine) == pytest.approx(1, abs=0.15)
    assert ends[1][0] < 1.5 * ends[0][0]


def test_the_table_says_what_failed_and_what_was_cut():
    rows = [{"cause": "LSODA came to no end within the budget"}] * 2
    case = {
        "measured": {"best": None, "cut": "rtol 1e-04, about 3 s"},
        "rows": [*rows, {"cause": ""}],
    }
    assert dict(tables.columns("work-precision"))["Best"](case) == (
        "— (2 of 3 settings failed: LSODA came to no end within the budget; "
        "cut: rtol 1e-04, about 3 s)"
    )


# -- the picture ----------------------------------------------------------------------------------


def test_the_picture_and_the_study_name_the_same_axes():
    assert set(plot_work.ERRORS) == set(METRICS) and set(plot_work.WORK) == set(contest.WORK)


def test_a_point_without_error_is_not_drawn():
    rows = [{"seconds": 1.0, "error": 0.0}, {"seconds": 1.0, "error": None},
            {"seconds": 2.0, "error": 1e-3}]  # fmt: skip
    assert [p[:2] for p in plot_work._points({"rows": rows}, "seconds", "error")] == [(2.0, 1e-3)]


def test_the_study_needs_double_precision():
    assert get("work-precision").cases(choice("pendulum", digits=(50,))) == []
