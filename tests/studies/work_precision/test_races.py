"""Whole races: true errors, the order of each rule, failures told, wrong methods found out."""

import functools
import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from discmech.integrators import BadInput, Scene, black_box, discretisation, pair, scenes
from discmech.integrators import rules as discretisations
from discmech.integrators.rules import BUILT_IN
from discmech.studies import get
from discmech.studies.core import fingerprint
from discmech.studies.core.case import scheme_of
from discmech.studies.core.store import Store
from discmech.studies.work_precision import contest, peers, racing, standings
from discmech.studies.work_precision.accuracy import UNIT, Yardstick
from discmech.studies.work_precision.contestants import (
    TOLERANCES,
    NoEnd,
    RuleContestant,
    ToleranceContestant,
)
from discmech.studies.work_precision.enough import FEWEST, PATIENT
from discmech.studies.work_precision.measuring import HIGH_ORDER
from discmech.studies.work_precision.peers.equations import Equations, equations_of
from discmech.studies.work_precision.records import ERRORS, WORK
from tests.studies.work_precision.races import SCIPY, choice, race, race_on, shown


@pytest.fixture(scope="module")
def pendulum():
    return race("pendulum")


@pytest.mark.slow
def test_everybody_takes_part_and_comes_to_the_truth(pendulum):
    ours = {"rectangle", "midpoint", "trapezoidal", *HIGH_ORDER}
    assert set(pendulum) == {*ours, *SCIPY}
    for name, case in pendulum.items():
        assert case["verdict"] == "pass", (name, case["reason"])
        assert case["kind"] == ("peer" if name in SCIPY else "rule")
        assert case["command"].startswith("discmech work-precision pendulum --peer DOP853")


@pytest.mark.slow
def test_without_peers_the_same_equations_run_as_python(pendulum):
    """And give the same floors, without compiling."""
    problem, compiled = race_on(scenes.get("pendulum"))
    plain, z = Equations(problem.scheme, timed=False), np.array([0.3, -0.7])
    assert np.abs(plain.f(0.0, z) - compiled.f(0.0, z)).max() < 1e-15
    assert np.abs(plain.df(0.0, z) - compiled.df(0.0, z)).max() < 1e-15
    kepler = Equations(scheme_of(scenes.get("kepler"), BUILT_IN["midpoint"]), timed=False)
    assert not np.isfinite(kepler.f(0.0, np.zeros(4))).all()  # where Python divides by zero
    assert kepler.df(0.0, np.zeros(4)).shape == (4, 4)


def test_rows_hold_every_metric_and_every_count(pendulum):
    for name, case in pendulum.items():
        for row in case["rows"]:
            assert set(row) >= {*ERRORS, *WORK, "setting", "samples", "outliers"}
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
        (h0, e0), (h1, e1) = [(r["step"], r["error"]) for r in rows if r["error"] > 1e-10][-2:]
        assert math.log(e1 / e0) / math.log(h1 / h0) == pytest.approx(order, abs=0.1)


def test_the_ratio_is_to_the_best_peer(pendulum):
    for accuracy in ("1e-04", "1e-08"):
        costs = {n: c["measured"]["cost"][accuracy] for n, c in pendulum.items()}
        best = min(costs[p] for p in SCIPY if costs[p])
        for name, case in pendulum.items():
            wanted = costs[name] and costs[name] / best
            assert case["measured"]["ratio"][accuracy] == pytest.approx(wanted)


def test_a_changed_rule_is_raced_with_the_fastest_peers_alone(monkeypatch):
    """The others keep their times, and of each ratio it is said from which run it is."""
    rules = tuple(BUILT_IN[name] for name in ("midpoint", "trapezoidal"))
    asked, store = {"rules": rules, "peers": ("DOP853", "LSODA")}, Store()
    before = race("harmonic", store=store, **asked)
    assert {case["race"]["run"] for case in before.values()} == {before["LSODA"]["race"]["run"]}
    assert race("harmonic", store=store, **asked) == before
    text = fingerprint._instructions
    monkeypatch.setattr(fingerprint, "_instructions", lambda f: text(f) + f.__name__)
    again = race("harmonic", store=store, **asked)
    monkeypatch.setattr(
        fingerprint, "_instructions", lambda f: text(f) + f.__name__ * f.__name__.endswith("dal")
    )
    later = race("harmonic", store=store, **asked)
    assert later["midpoint"]["race"] == before["midpoint"]["race"]
    assert later["trapezoidal"]["race"] == again["trapezoidal"]["race"]
    run = again["midpoint"]["race"]
    costs = {n: c["measured"]["cost"] for n, c in before.items() if n in asked["peers"]}
    fastest = min(costs, key=lambda name: costs[name]["1e-04"])
    assert {fastest} == {*run["with"]} - {"midpoint", "trapezoidal"} == {*run["peers"]}
    assert run["run"] != again["LSODA"]["race"]["run"] == before["LSODA"]["race"]["run"]
    own = again["midpoint"]["measured"]
    best = standings.cost_of_runs(run["peers"].values())
    assert own["ratio"]["1e-04"] == pytest.approx(own["cost"]["1e-04"] / best["1e-04"])
    assert f"midpoint, trapezoidal, {fastest}" in shown("Timed", again["midpoint"])
    assert shown("Timed", again["LSODA"]) == shown("Timed", before["LSODA"])


def test_of_some_methods_of_a_race_the_measurements_are_there():
    store = Store()
    some = race("harmonic", store=store, rules=tuple(BUILT_IN.values())[:2], peers=("LSODA",))
    one = race("harmonic", store=store, rules=(BUILT_IN["midpoint"],), peers=("LSODA",))
    assert one["midpoint"]["rows"] == some["midpoint"]["rows"]
    assert one["midpoint"]["command"] != some["midpoint"]["command"]
    alone = race("harmonic", store=store, rules=(BUILT_IN["midpoint"],), peers=("none",))
    assert alone["midpoint"]["measured"]["ratio"]["1e-04"] is None  # it is to peers that were asked


@pytest.mark.slow
def test_a_method_that_solves_other_equations_is_found_out(monkeypatch):
    """Gravity a thousandth stronger: the peer converges, to something else."""
    scene = scenes.get("pendulum").with_values(parameters={"gravity": "1.001"})
    wrong = equations_of(scheme_of(scene, BUILT_IN["midpoint"]))
    right = peers.peer

    def swapped(name, problem, equations):
        return right(name, problem, wrong if name == "DOP853" else equations)

    monkeypatch.setattr(contest, "peer", swapped)
    found = race("pendulum", rules=(BUILT_IN["midpoint"],), peers=("DOP853", "LSODA"))
    assert found["DOP853"]["verdict"] == "fail"
    assert "stop sinking" in found["DOP853"]["reason"]
    assert found["LSODA"]["verdict"] == found["midpoint"]["verdict"] == "pass"


@pytest.mark.slow
def test_a_rule_of_one_s_own_joins_by_being_named():
    @discretisation()
    def third(L, G, x, u, h):
        return h * L(G.target(x, u, h / 3), u) / 2 + h * L(G.target(x, u, 2 * h / 3), u) / 2

    found = race("harmonic", rules=(third,), peers=("LSODA",))
    assert set(found) == {"third", "LSODA"}
    assert {case["verdict"] for case in found.values()} == {"pass"}


@pytest.mark.slow
def test_a_rule_with_stages_runs_by_tolerance_too():
    """Its rows are tolerances, like a peer's: the errors keep them, and the pilot stands apart."""
    rules = tuple(map(discretisations.get, ("midpoint", "gauss-4")))
    found = race("pendulum", rules=rules, peers=("none",))
    assert set(found) == {"midpoint", "gauss-4", "gauss-4, tolerance"}
    case = found["gauss-4, tolerance"]
    assert (case["verdict"], case["kind"]) == ("pass", "rule")
    done = [row for row in case["rows"] if row["error"] is not None]
    assert len(done) > 2 and [row["tolerance"] for row in done] == TOLERANCES[: len(done)]
    for row in done:
        assert row["steps"] * row["step"] == pytest.approx(10) and row["pilot"] > row["seconds"]
        assert row["promised"] <= row["tolerance"] and row["error-max"] < 3 * row["tolerance"]
    assert "of the tolerance" in shown("Best", case)


def test_over_many_periods_the_step_is_that_for_the_scene_s_duration():
    problem, _ = race_on(scenes.get("kepler"), times=100, checkpoints=0)
    chosen = ToleranceContestant(RuleContestant(problem, discretisations.get("gauss-4")))
    states = chosen.prepare(1e-8).states()
    flow = scheme_of(problem.scene, discretisations.get("gauss-4")).flow(tolerance=1e-8)
    assert states.steps == 100 * flow.choice.steps and len(states.path) == states.steps + 1
    hurried = replace(problem, patience=0.5)
    chosen.spent = 0.5 * PATIENT + 0.1
    chosen.problem = hurried
    with pytest.raises(NoEnd, match=r"gauss-4, tolerance came to no end .*: choosing steps"):
        chosen.prepare(1e-9)


def test_tolerances_with_one_step_are_one_run():
    """That its error does not sink from one to the next says nothing of the method."""
    rows = [
        {"energy-max": 1e-5, "steps": 64 * k, "promised": 1e-9, "cause": ""}
        for k in (1, 1, 1, 1, 2)
    ]
    told = {"rows": rows, "floor": {"energy-max": UNIT}, "periods": 9, "measured": {"cut": ""}}
    assert get("work-precision").judge(None, told).verdict == "inconclusive"
    fixed = [{**row, "steps": k} for k, row in enumerate(rows)]
    assert get("work-precision").judge(None, told | {"rows": fixed}).verdict == "fail"


def test_methods_are_compared_once_each():
    rules = (discretisations.get("gauss-4"),)
    asked = replace(choice("pendulum", rules=rules), own=(("peer", ("none",)), ("also_periods", 9)))
    assert {case.label for case in get("work-precision").cases(asked)} == {"gauss-4"}


def test_the_floor_is_what_rounding_the_start_makes():
    """On the harmonic oscillator from (1, 0) half a unit stays half a unit."""
    floors = Yardstick(*race_on(scenes.get("harmonic"))).floors
    assert floors["error"] == pytest.approx(UNIT, rel=1e-3)
    assert floors["energy-max"] == UNIT and "momentum" not in floors


def test_the_characteristic_period_of_the_oscillator_is_its_period():
    scene = scenes.get("harmonic").with_values(duration="6.2831853", step="0.01")
    problem, equations = race_on(scene)
    found = contest.characteristic_period(problem, equations)
    assert found == pytest.approx(2 * math.pi, rel=1e-3)


@pytest.mark.slow
def test_rules_of_high_order_begin_at_their_loose_end():
    """Else a race says nothing of what they cost at 10⁻⁴, where peers are slowest to beat."""
    problem, equations = race_on(scenes.get("kepler"))
    yardstick = Yardstick(problem, equations)
    for name in ("midpoint", "suzuki:trapezoidal", "kahan-li-8:trapezoidal", "gauss-2"):
        contestant = RuleContestant(problem, discretisations.get(name))
        first = contestant.prepare(next(contestant.ladder())).states()
        assert yardstick.errors(first)["error"] > 1e-4, name


def test_rules_with_stages_begin_where_these_contract(monkeypatch):
    """Nothing is compiled for Newton's method, unless the number of steps was asked for."""
    monkeypatch.setattr("discmech.integrators.flows.scene_runs.compile", None)
    problem, _ = race_on(scenes.get("rigid-body"))
    contestant = RuleContestant(problem, discretisations.get("gauss-3"))
    first = next(contestant.ladder())
    assert contestant.made(first)[0].trajectory(first).solver == "fixed point"
    with pytest.raises(TypeError, match="not callable"):
        RuleContestant(problem, discretisations.get("gauss-3"), first=4)


@pytest.mark.slow
def test_a_setting_that_fails_is_told_and_the_next_is_tried():
    """It must not end the race of all methods."""
    scene = scenes.get("rigid-body").with_values(duration=100)
    problem, equations = race_on(scene)
    yardstick = Yardstick(problem, equations)
    contestant = RuleContestant(problem, discretisations.get("gauss-2"), first=16)
    rows = contest.climb(contestant, yardstick, "error", 0.5).rows
    assert "did not converge" in rows[0]["cause"] and rows[0]["error"] is None
    assert any(row["error"] is not None for row in rows)


def test_checkpoints_lie_on_steps():
    problem, _ = race_on(scenes.get("kepler"))
    contestant = RuleContestant(problem, BUILT_IN["midpoint"])
    for setting in itertools.islice(contestant.ladder(), 3):
        states = contestant.prepare(setting).states()
        assert states.checkpoints.shape == (problem.checkpoints, 4)
        assert np.array_equal(states.checkpoints[-1], states.path[-1])
        assert states.steps == setting


@pytest.mark.slow
def test_a_long_race_is_about_invariants():
    found = race("kepler", rules=(BUILT_IN["midpoint"],), peers=("LSODA",), periods=20)
    for case in found.values():
        assert (case["verdict"], case["periods"]) == ("pass", 20)
        assert case["measured"]["y"] == "energy-max"
        assert case["command"].endswith("--periods 20")
        assert all(row["error"] is None for row in case["rows"])
        assert all((row["energy-max"] is None) is bool(row["cause"]) for row in case["rows"])


def test_what_the_budget_cut_is_said():
    scene = scenes.get("pendulum")
    found = contest.hold_race(
        scene, [BUILT_IN["midpoint"]], ["Radau"], axes=("seconds", "error"), budget=0.01,
        periods=None, first=None, progress=lambda *_: None, wanted=("midpoint", "Radau"),
    )  # fmt: skip
    for result in found.values():
        assert result["measured"]["cut"], result["measured"]


def test_a_rule_has_the_runs_that_its_verdict_needs_and_no_more(monkeypatch):
    """Each run takes a second by a made clock, and the budget is that of one."""
    clock = itertools.count()
    monkeypatch.setattr(contest, "fine_clock", lambda: lambda: next(clock))
    problem, equations = race_on(scenes.get("pendulum"))
    yardstick = Yardstick(problem, equations)
    done = {
        one.name: len(contest.climb(one, yardstick, "error", 1.0 * racing.LEAST).runs)
        for one in (RuleContestant(problem, BUILT_IN["midpoint"]),
                    peers.peer("DOP853", problem, equations))
    }  # fmt: skip
    assert done == {"midpoint": FEWEST, "DOP853": 1}
    rule = RuleContestant(problem, BUILT_IN["midpoint"])
    slow = contest.climb(rule, yardstick, "error", 1.0 * racing.LEAST / PATIENT)
    assert len(slow.runs) == 1 and "about" in slow.cut  # and not without end


def test_a_rule_that_fails_from_some_step_on_is_not_asked_without_end(monkeypatch):
    problem, equations = race_on(scenes.get("pendulum"))
    rule, prepared = RuleContestant(problem, BUILT_IN["midpoint"]), RuleContestant.prepare

    def failing(self, setting):
        if setting > 4 * self.first:
            raise BadInput("no more")
        return prepared(self, setting)

    monkeypatch.setattr(RuleContestant, "prepare", failing)
    found = contest.climb(rule, Yardstick(problem, equations), "error", 10.0)
    assert len(found.runs) == 3 and len(found.rows) == 3 + contest.GIVEN_UP


@pytest.mark.parametrize(("every", "verdict"), [(1, "fail"), (2, "inconclusive")])
def test_a_program_that_makes_no_step_fails_as_in_every_study(every, verdict):
    calls = itertools.count(1)

    @black_box(order=2)
    def raising(q, p, h, s):
        if next(calls) % every == 0:
            raise ValueError("no licence")
        return q, p

    problem, equations = race_on(scenes.get("pendulum"))
    rule = RuleContestant(problem, raising)
    rows = contest.climb(rule, Yardstick(problem, equations), "error", 1).rows
    told = {"periods": None, "floor": {}, "rows": rows, "kind": "rule"}
    assert get("work-precision").judge(None, told).verdict == verdict


def test_a_run_that_fails_is_a_row_with_its_cause():
    """Steps of 2.5: Newton gives up on the midpoint rule, and the smaller ones go on."""
    found = race("pendulum", rules=(BUILT_IN["midpoint"],), steps=1, peers=("none",))
    causes = [row["cause"] for row in found["midpoint"]["rows"]]
    assert found["midpoint"]["verdict"] == "pass" and causes[-1] == ""


def test_the_study_needs_double_precision():
    assert get("work-precision").cases(choice("pendulum", digits=(50,))) == []


def test_a_scene_with_time_is_raced_and_its_time_is_no_error():
    """Duffing's drive: peers and rules come to the truth, and from another time they do not."""
    problem, equations = race_on(scenes.get("duffing"))
    yardstick = Yardstick(problem, equations)
    peer = peers.peer("DOP853", problem, equations)
    found = yardstick.errors(peer.prepare(1e-12).states())
    assert found["error"] < 1e-9
    assert found["error"] ** 2 == pytest.approx(found["error-x"] ** 2 + found["error-mu"] ** 2)
    own = yardstick.errors(RuleContestant(problem, BUILT_IN["midpoint"]).prepare(4096).states())
    assert own["error"] < 1e-3
    peer.start = peer.start + np.array([0, 0.5, 0])  # the time is the last entry of x
    assert yardstick.errors(peer.prepare(1e-12).states())["error"] > 1e-2


def test_constraints_are_left_out_with_a_sentence():
    study = get("work-precision")
    assert not study.cases(choice("suslov")) and study.cases(choice("duffing"))
    assert any("follow no constraints" in note for note in study.notes(choice("suslov")))
    assert not any("left out" in note for note in study.notes(choice("duffing")))


@pytest.mark.parametrize("kind", ["formula", "program", "peer"])
@pytest.mark.parametrize("scene", ["kepler", "duffing"])
def test_no_two_timed_calls_begin_at_the_same_state(scene, kind):
    """Else a memory of the first call answers all others, and its method wins the race."""
    problem, equations = race_on(scenes.get(scene))
    method = Remembers(problem) if kind == "program" else (
        RuleContestant(problem, BUILT_IN["trapezoidal"]) if kind == "formula"
        else peers.peer("DOP853", problem, equations)
    )  # fmt: skip
    run = method.prepare(16 if kind != "peer" else 1e-2)
    run.ready(5)
    ends = [run() for _ in range(9)]
    assert len({(e.y if kind == "peer" else np.hstack(e)).tobytes() for e in ends}) > 5
    if kind == "program":
        assert method.memory.cache_info().hits == 0
    starts = problem.starts
    assert len({start.tobytes() for start in starts}) == len(starts)
    assert np.abs(starts - problem.start).max() < 1e-11 * np.abs(problem.start).max()
    assert np.ptp(np.delete(starts, problem.places, axis=1)) == 0 if scene == "duffing" else True


class Remembers(RuleContestant):
    """Störmer and Verlet's method that remembers every step, with its memory."""

    def __init__(self, problem):
        @functools.cache
        def step(q, p, h, force):
            p = tuple(a + h / 2 * b for a, b in zip(p, force, strict=True))
            return tuple(a + h * b for a, b in zip(q, p, strict=True)), p

        @black_box(order=2)
        def remembers(q, p, h, system):
            q, p = step(tuple(q), tuple(p), h, tuple(-system.gradient(q, p)))
            q, p = np.array(q), np.array(p)
            return q, p - h / 2 * system.gradient(q, p)

        self.memory = step
        super().__init__(problem, remembers)


def test_a_start_of_zeros_is_moved_too():
    scene = Scene(
        name="falls", groupoid=pair(1), lagrangian=lambda x, v, p: v[0] ** 2 / 2 - x[0],
        x0=[0], v0=[0], duration=1,
    )  # fmt: skip
    problem, _ = race_on(scene)
    assert len({start.tobytes() for start in problem.starts}) == len(problem.starts)


@pytest.mark.slow
def test_a_rule_that_is_not_consistent_is_not_ranked():
    """V too large by 10⁻¹⁰: its errors sink to that, below every limit of a race."""

    @discretisation(order=2)
    def heavy(L, G, x, u, h):
        m = G.target(x, u, h / 2)
        return h * L(m, u) + h * L(m, 0 * u) / 10**10

    found = race("harmonic", rules=(heavy, BUILT_IN["midpoint"]), peers=("LSODA",))
    case = found["heavy"]
    assert case["verdict"] == "fail" and "not consistent" in case["reason"]
    assert set(case["measured"]["cost"].values()) == {None}
    assert found["midpoint"]["verdict"] == "pass" and "local" not in found["midpoint"]


def test_a_peer_climbs_as_high_as_a_rule(monkeypatch):
    """Each run takes a second by a made clock, and the budget is that of one run."""
    clock = itertools.count()
    monkeypatch.setattr(contest, "fine_clock", lambda: lambda: next(clock))
    problem, equations = race_on(scenes.get("pendulum"))
    yardstick = Yardstick(problem, equations)

    def least(height):
        peer = peers.peer("DOP853", problem, equations)
        found = contest.climb(peer, yardstick, "error", 1.0 * racing.LEAST, height)
        return standings.reached(found, "error")

    assert least(math.inf) > 1e-3 and least(1e-4) <= 1e-4
