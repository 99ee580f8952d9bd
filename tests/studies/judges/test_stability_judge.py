"""The judge of stability: at its limits and beside them."""

from fractions import Fraction
from types import SimpleNamespace

from discmech.integrators import scenes
from discmech.studies.stability import measuring as stability
from tests.studies.judges.by_hand import ABOVE, case, judged


def linear(control=None, **measured):
    measured = {"off_circle": None, "stable_to": 2.0, "runs": True} | measured
    return judged("stability", case(control=control), kind="linear", measured=measured)


def test_the_interval_of_stability():
    assert linear() == ("pass", "", {"runs": True, "off_circle": None})
    assert linear(off_circle=0.0)[0] == "fail"
    assert linear(off_circle=0.5)[1] == "an eigenvalue leaves the unit circle at hω = 0.5."
    assert linear(runs=False)[:2] == (
        "fail", "runs near hω = 2.000000 contradict the interval that was found."
    )  # fmt: skip
    assert "up to hω = 1000" in linear(runs=False, stable_to=None)[1]
    for measured, verdict in (
        ({}, "fail"), ({"off_circle": 0.0}, "pass"), ({"stable_to": 0}, "pass"),
        ({"stable_to": 1}, "fail"), ({"stable_to": 0.001}, "fail"),
    ):  # fmt: skip
        told = linear("wrong", **measured)
        assert told[0] == verdict and bool(told[1]) == (verdict == "fail")
        assert told[2] == {"off_circle": True}


def test_a_steady_turn_may_move_to_an_unstable_one():
    for turns, verdict in ((True, "inconclusive"), (False, "fail")):
        told = cells("mine", stable_to=0.4, turns=turns)
        assert told[0] == verdict and ("give a start at rest" in told[1]) == turns


def cells(name, *rows, control=None, **measured):
    rows = [dict(zip(("class", "z", "stiffness"), row, strict=True)) for row in rows]
    classes = {row["class"]: 1 for row in rows}
    of = case(control=control)
    of.scene = scenes.get("fpu" if name == "mine" else name).with_values(name=name)
    return judged("stability", of, kind="map", rows=rows, label="ω",
                  measured={"classes": classes} | measured)  # fmt: skip


def test_a_resolved_motion_is_bounded():
    assert cells("fpu", ("bounded", 0.1, 50), ("escaped", 0.502, 50))[0] == "pass"
    verdict, reason, expected = cells("fpu", ("bounded", 0.1, 50), ("escaped", 10**-0.3, 50))
    assert verdict == "fail" and reason.startswith("escaped at hω = 0.501 and ω = 50")
    assert expected == {"bounded_up_to": 10**-0.3, "of": 2, "escapes_not_judged": 0}
    assert cells("fpu", ("a word", 0.5, 50))[0] == "fail"
    own = cells("mine", ("bounded", 0.1, 50), ("escaped", 0.4, 50), frequency=1.0, fastest=2.0)
    assert own[0] == "pass" and own[2]["bounded_up_to"] == 10**-0.3 / 2
    assert "failed at hω = 0.3" in cells("fpu", ("failed", 0.3, 50), ("escaped", 0.2, 50))[1]


def test_an_escape_that_the_error_of_the_energy_can_make_is_none():
    held = stability.FAMILIES["kepler"].held(Fraction("0.5"))
    assert 0 < held < 0.5
    for word in ("escaped", "resonant"):
        assert cells("kepler", (word, ABOVE * held, 0.5))[0] == "pass"
        assert cells("kepler", (word, held, 0.5))[0] == "fail"
    assert cells("kepler", ("failed", ABOVE * held, 0.5))[0] == "fail"
    counted = cells("kepler", ("bounded", held, 0.5), ("escaped", ABOVE * held, 0.5))[2]
    assert counted["of"] == 2 and counted["escapes_not_judged"] == 1


def test_a_control_has_no_bounded_cell():
    caught = cells("fpu", ("escaped", 0.1, 50), control="wrong")
    assert caught == ("pass", "", {"bounded": 0})
    missed = cells("fpu", ("escaped", 0.1, 50), ("bounded", 0.2, 50), control="wrong")
    assert missed[0] == "fail" and "not caught" in missed[1]


def test_the_exchange_of_energy_is_right_to_a_tenth():
    def told(**exchange):
        return cells("fpu", ("bounded", 0.1, 50), exchange=exchange)

    assert told(**{"0.1": 0.1})[0] == "pass" and told(**{"0.1": 0.1})[2]["exchange"] == 0.1
    assert told(**{"0.1": ABOVE * 0.1})[0] == "fail" and told(**{"0.2": 5.0})[0] == "pass"
    assert "hω = 0.1 is wrong by 90 %" in told(**{"0.1": 0.9})[1]
    assert "was not followed to its end" in told(**{"0.1": None})[1]


def test_a_map_whose_every_run_ends_before_its_time_shows_nothing():
    """A program that raises at each step claims nothing, and blows up nowhere."""

    def told(*rows):
        rows = [dict(zip(("class", "z", "steps", "cause"), ("blown up", *row), strict=True))
                for row in rows]  # fmt: skip
        claims = SimpleNamespace(symplectic=None, reversible=None, keeps=())
        rule = SimpleNamespace(name="box", claims=claims)
        return judged("stability", case(scene={"name": "fpu"}, rule=rule), kind="map", rows=rows,
                      label="ω", measured={"classes": {}})  # fmt: skip

    assert told((0.1, 0, "the box raises"), (1.0, 0, ""))[0] == "pass"
    assert told((0.1, 0, "the box raises"), (1.0, 0, "it raises"))[:2] == (
        "fail", "no step was made at any hω from 0.1: the box raises."
    )  # fmt: skip
    assert told((0.1, 7, "the box raises"), (1.0, 0, "it raises"))[:2] == (
        "inconclusive", "no run goes through: at hω = 0.1 the box raises."
    )  # fmt: skip
