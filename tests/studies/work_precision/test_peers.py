"""Other people's integrators: the same equations, given up in time, absent in a sentence."""

import math
from importlib.util import find_spec

import numpy as np
import pytest

from discmech.integrators import BadInput, scenes
from discmech.studies import get
from discmech.studies.report import summary
from discmech.studies.work_precision import contest, peers
from discmech.studies.work_precision.accuracy import UNIT, Yardstick
from discmech.studies.work_precision.contestants import NoEnd
from discmech.studies.work_precision.peers import rebounds
from tests.studies.as_json import read
from tests.studies.work_precision.races import SCIPY, race_on

OTHERS = ("harmonic", "charged-particle", "lagrange-top", "fpu")
EVERY = ["rigid-body", *(pytest.param(n, marks=pytest.mark.slow) for n in OTHERS)]


@pytest.mark.slow
@pytest.mark.parametrize("name", EVERY)
def test_peers_solve_the_same_equations(name):
    """Each of scipy's methods comes to the reference; LSODA on fpu collects 5000 tolerances."""
    problem, equations = race_on(scenes.get(name))
    yardstick = Yardstick(problem, equations)
    for peer in SCIPY:
        run = peers.peer(peer, problem, equations).prepare(1e-11)
        errors = yardstick.errors(run.states())
        assert all(errors[m] < 1e-6 for m in errors if "max" in m), (peer, errors)


def test_a_peer_that_comes_to_no_end_is_given_up():
    """Its next setting has its chance; and that a peer is too slow speaks against nobody."""
    problem, equations = race_on(scenes.get("pendulum"), patience=0.0)
    yardstick = Yardstick(problem, equations)
    peer = peers.peer("Radau", problem, equations)
    climb = contest.climb(peer, yardstick, "error", 1.0)
    assert len(climb.rows) == contest.GIVEN_UP < len(list(peer.ladder())) and not climb.runs
    assert climb.cut == "rtol 1e-06, since 4 settings failed"
    assert {row["cause"] for row in climb.rows} == {"Radau came to no end within the budget"}
    told = {"periods": None, "floor": {}, "rows": climb.rows, "kind": "peer"}
    for kind in ("peer", "rule"):
        verdict = get("work-precision").judge(None, told | {"kind": kind})
        assert verdict.verdict == "inconclusive" and "no end within the budget" in verdict.reason


def test_no_headline_counts_peers():
    """They are shown with their verdicts, and nothing of ours depends on these."""
    ours, theirs = {"verdict": "pass", "kind": "rule"}, {"verdict": "inconclusive", "kind": "peer"}
    study = {"study": "work-precision", "verdict": "pass", "cases": [ours, theirs]}
    said = summary.headline(summary.merged(read(study)))
    assert said["verdict"] == "pass" and said["text"] == "The only case passes."


@pytest.mark.skipif(not find_spec("heyoka"), reason="heyoka is not installed")
def test_heyoka_takes_powers_of_zero():
    """A chain at rest: its own third power of 0 is not finite."""
    problem, equations = race_on(scenes.get("fpu"))
    run = peers.peer("heyoka", problem, equations).prepare(1e-9)
    run()
    assert np.isfinite(run.made.state).all()


def test_an_absent_peer_is_one_sentence(monkeypatch):
    monkeypatch.setattr(peers, "find_spec", lambda name: None if name == "heyoka" else object())
    present, absent = peers.chosen([])
    assert "heyoka" not in present and "DOP853" in present
    plain = [p for p in present if p not in peers.BODIES]
    assert peers.on(scenes.get("kepler"), present) == plain
    for name in ("rigid-body", "charged-particle", "double-pendulum"):
        assert peers.on(scenes.get(name), present) == [p for p in plain if p not in peers.SPLIT]
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
    problem, equations = race_on(scenes.get("rigid-body"))
    yardstick = Yardstick(problem, equations)
    run = peers.peer(name, problem, equations).prepare(1e-9)
    assert yardstick.errors(run.states())["error"] < 1e-7


@pytest.mark.parametrize(("name", "setting"), [("IAS15", 1e-6), ("WHFast", 6144)])
@pytest.mark.parametrize("checkpoints", [0, 16])
def test_rebound_solves_the_same_equations(name, setting, checkpoints):
    """What is looked at is the run that is timed, and the map of Wisdom and Holman has order 2."""
    pytest.importorskip("rebound")
    problem, equations = race_on(scenes.get("outer-solar-system"), checkpoints=checkpoints)
    yardstick, peer = Yardstick(problem, equations), peers.peer(name, problem, equations)
    run = peer.prepare(setting)
    states = run.states()
    errors = yardstick.errors(states)
    end = peer.solve(run.made, peer.begun(run.made, problem.start))
    assert np.array_equal(states.path[-1], peer.state(end))
    assert states.path.shape == (states.steps + 1, 36) and errors["energy-max"] < 1e-13
    assert states.checkpoints.shape == (checkpoints, 36)
    assert errors.get("error-max", 0) < 1e-11 and errors["momentum-max"] < 1e-13
    if name == "WHFast":
        looser = yardstick.errors(peer.prepare(setting // 4).states())["energy-max"]
        assert looser / errors["energy-max"] == pytest.approx(16, rel=0.1)


def test_bodies_that_attract_each_other_are_known_by_their_lagrangian():
    """A force that is not Newton's, or masses of other velocities, are no bodies of rebound."""
    outer = scenes.get("outer-solar-system")
    found = rebounds.bodies(outer)
    assert (len(found.masses), found.dim) == (6, 3) and found.G == 0.000295912208286

    def other(x, v, p):
        return outer.lagrangian(x, v, p) + x[0] ** 2

    assert rebounds.bodies(outer.with_values(lagrangian=other)) is None
    assert not peers.on(outer.with_values(lagrangian=other), peers.BODIES)
    assert not any(rebounds.bodies(scenes.get(n)) for n in ("kepler", "fpu", "heavy-top"))


@pytest.mark.parametrize("name", ["heyoka", "diffrax", "diffrax-tsit5"])
def test_an_extra_peer_is_given_up_as_well(name):
    pytest.importorskip(name.partition("-")[0])
    long = {"times": 10_000, "checkpoints": 0, "patience": 1e-5}
    problem, equations = race_on(scenes.get("pendulum"), **long)
    run = peers.peer(name, problem, equations).prepare(1e-9)
    with pytest.raises(NoEnd, match=f"{name} came to no end within the budget"):
        run.states()


def test_over_long_times_heyoka_runs_as_its_documentation_advises():
    """Below round-off, with compensated sums; what is looked at is the run that is timed."""
    pytest.importorskip("heyoka")
    short, equations = race_on(scenes.get("kepler"))
    long, _ = race_on(scenes.get("kepler"), times=100, checkpoints=0)
    assert list(peers.peer("heyoka", short, equations).ladder())[-1] == 2.0**-52
    heyoka = peers.peer("heyoka", long, equations)
    finest = list(heyoka.ladder())[-1]
    run = heyoka.prepare(finest)
    assert finest == 1e-18 and run.made.high_accuracy
    assert heyoka.told(finest)["setting"] == "tol 1e-18, compensated"
    states = run.states()
    heyoka.solve(run.made, long.start)
    assert np.array_equal(run.made.state, states.path[-1])
    assert Yardstick(long, equations).errors(states)["energy-max"] < 100 * UNIT


@pytest.mark.parametrize("checkpoints", [0, 16])
def test_diffrax_shows_its_own_steps(checkpoints):
    """Dense output has other errors than the steps: Dopri8's are ten to forty times as large."""
    pytest.importorskip("diffrax")
    problem, equations = race_on(scenes.get("kepler"), checkpoints=checkpoints)
    states = peers.peer("diffrax", problem, equations).prepare(1e-6).states()
    assert states.path.shape[0] <= states.steps + 2 and np.isfinite(states.path).all()
    assert np.array_equal(states.path[0], problem.start)
    assert states.checkpoints.shape == (checkpoints, 4)
    if checkpoints:
        assert np.array_equal(states.checkpoints[-1], states.path[-1])


def test_the_symplectic_extra_peer_is_symplectic_euler():
    """Order 1, and an energy that does not drift: over 50 times the time it is off by no more."""
    pytest.importorskip("diffrax")
    ends = []
    for times in (1, 50):
        problem, equations = race_on(scenes.get("kepler"), times=times, checkpoints=0)
        yardstick = Yardstick(problem, equations)
        euler = peers.peer("diffrax-symplectic", problem, equations)
        first = next(euler.ladder())
        ends.append([yardstick.errors(euler.prepare(n * first).states())["energy-max"]
                     for n in (4, 8)])  # fmt: skip
    for coarse, fine in ends:
        assert math.log2(coarse / fine) == pytest.approx(1, abs=0.15)
    assert ends[1][0] < 1.5 * ends[0][0]
