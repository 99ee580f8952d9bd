"""Optimal control under refinement: sound rules have their order, a wrong one has not."""

import json

import pytest

from discmech.integrators import discretisation, midpoint
from discmech.integrators.extensions.control.scenes import get as problem
from discmech.studies import check, get
from discmech.studies.command.entry import main
from discmech.studies.core import lookup
from discmech.studies.core.case import Case


@pytest.mark.slow
def test_a_cubic_is_exact_by_gauss():
    (case,) = check("optimality", scenes=["double-integrator"], rules=["gauss-2"])["cases"]
    assert case["verdict"] == "pass" and len(case["measured"]["exact"]) == 3


@pytest.mark.slow
def test_every_problem_has_the_order_of_both_rules():
    found = check("optimality")
    assert found["verdict"] == "pass", [c["reason"] for c in found["cases"]]
    assert len(found["cases"]) == 12


PROBLEM = """
from discmech import Control, Scene, pair

cart = Scene(name="cart", groupoid=pair(1), lagrangian=lambda x, v, p: v[0] ** 2 / 2 - x[0] ** 4,
             x0=[0], v0=[0], duration=1)
push = Control(cart, cost=lambda x, v, f, p: f.dot(f) / 2, end=([1], [0]))
"""


@pytest.mark.slow
def test_a_problem_of_one_s_own_is_found_by_its_scene(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    keys = []
    for text in (PROBLEM, PROBLEM.replace("f.dot(f) / 2", "f.dot(f) / 2 + v[0] ** 2")):
        (tmp_path / "mine.py").write_text(text, encoding="utf-8")
        assert main(["optimality", "mine.py:cart", "--rule", "midpoint", "--json", "-"]) == 0
        (case,) = json.loads(capsys.readouterr().out)["cases"]
        keys.append(case["measured"]["cost"])
    assert keys[0] < keys[1]  # another cost is another result, not a remembered one
    case = Case("optimality", lookup.scene("mine.py:cart"), midpoint, 16)
    assert get("optimality").depends_on(case)


def test_a_problem_of_the_bench_is_known_by_its_text(monkeypatch):
    monkeypatch.setattr("discmech.integrators.extensions.control.Control.stages", None)
    scene = problem("double-integrator").scene
    assert get("optimality").depends_on(Case("optimality", scene, midpoint, 16)) == ""


def test_what_has_no_problem_is_refused(capsys, monkeypatch):
    monkeypatch.setattr("discmech.studies.core.userfile._loaded", {})  # files of other tests
    assert main(["optimality", "pendulum"]) == 2
    assert "it needs a problem of optimal control" in capsys.readouterr().err


@pytest.mark.slow
def test_the_scene_of_a_problem_goes_into_other_studies():
    assert lookup.scene("oscillator") is problem("oscillator").scene
    (case,) = check("symplecticity", ["oscillator"], ["midpoint"], [16], steps=24)["cases"]
    assert case["verdict"] == "pass"


def test_a_rule_that_solves_another_problem_is_refused():
    @discretisation(order=2)
    def doubled(L, G, x, u, h):
        return 2 * h * L(G.target(x, u, h / 2), u)

    (case,) = check("optimality", scenes=["oscillator"], rules=[doubled])["cases"]
    assert case["verdict"] == "inconclusive" and "weights of doubled sum to 2" in case["reason"]


def test_two_problems_of_one_scene_are_told_apart(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    far = PROBLEM + "far = Control(cart, cost=lambda x, v, f, p: f.dot(f), end=([2], [0]))\n"
    (tmp_path / "two.py").write_text(far, encoding="utf-8")
    for word, names in (("far", ["far"]), ("cart", ["push", "far"]), ("push", ["push"])):
        asked = ["optimality", f"two.py:{word}", "--rule", "midpoint", "--steps", "16"]
        assert main([*asked, "--json", "-"]) == 0
        cases = json.loads(capsys.readouterr().out)["cases"]
        assert [case["scene"] for case in cases] == names
    (tmp_path / "one.py").write_text(PROBLEM, encoding="utf-8")
    assert main(["optimality", "one.py:push", "--rule", "midpoint", "--json", "-"]) == 0
    assert json.loads(capsys.readouterr().out)["cases"][0]["scene"] == "cart"


def test_what_no_start_decides_is_no_bad_input(tmp_path, monkeypatch, capsys):
    """The cost falls without a bound; so it is for other starts, which are not tried, to tell."""
    monkeypatch.chdir(tmp_path)
    falls = PROBLEM.replace("f.dot(f) / 2", "f[0] ** 2 - 400 * x[0] ** 2")
    (tmp_path / "falls.py").write_text(falls, encoding="utf-8")
    assert main(["control", "falls.py:push", "--steps", "10"]) == 3
    assert main(["optimality", "falls.py:push", "--rule", "midpoint"]) == 3
    assert "no minimum of the cost" in capsys.readouterr().out


def test_a_cost_without_the_control_is_refused_in_words(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "free.py").write_text(PROBLEM.replace("f.dot(f) / 2", "1"), encoding="utf-8")
    assert main(["control", "free.py:push", "--steps", "10"]) == 2
    assert "Traceback" not in capsys.readouterr().err
