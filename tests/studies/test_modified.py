"""`discmech modified`: formulas, slopes and verdicts, and controls that it has to catch."""

import json
import re

import pytest
from matplotlib.mathtext import MathTextParser
from sympy import sqrt, sympify

from discmech import Scene, pair
from discmech.integrators import Scheme, rules, scenes
from discmech.integrators.extensions.expansions import ModifiedEquation
from discmech.studies.command.entry import main
from discmech.studies.modified.measuring import judge, kept

slow = pytest.mark.slow


def test_the_formulas_are_printed_and_checked(capsys):
    assert main(["modified", "pendulum", "trapezoidal", "--order", "2"]) == 0
    shown = capsys.readouterr().out
    assert "H₃ = gravity·(−gravity·mass·sin(x)² + 2·μ²·cos(x)/(length³·mass))/24" in shown
    assert shown.rstrip().endswith("pass")
    words = ["pendulum", "--rule", "trapezoidal", "--order", "2", "--json", "-"]
    assert main(["modified", *words]) == 0
    found = json.loads(capsys.readouterr().out)
    (case,) = found["cases"]
    assert found["study"] == "modified" and case["verdict"] == "pass"
    assert case["measured"]["through h^0"] == pytest.approx(2, abs=0.1)
    assert case["measured"]["through h^2"] == pytest.approx(4, abs=0.1)
    assert set(case["formulas"]) == {"H_1", "H_3"} and len(case["rows"]) == 5


@pytest.mark.parametrize("words", ["mathews-lakshmanan midpoint", "kepler implicit-midpoint"])
def test_formulas_for_a_paper_compile(words, capsys):
    """Every symbol is one of LaTeX: no name in bare letters, and no product run together."""
    assert main(["modified", *words.split(), "--order", "2", "--latex"]) == 0
    lines = [line for line in capsys.readouterr().out.splitlines() if line[1:3] == "_{"]
    assert len(lines) == (2 if "mathews" in words else 8)
    for line in lines:
        MathTextParser("path").parse(f"${line}$")
        bare = re.sub(r"\\(mathrm\{[a-z]+\}|[a-z]+)", "", line)
        assert not re.search(r"[^\W\d_]{2}|[^\x00-\x7f]", bare)


@slow
def test_a_map_shows_its_field_and_one_that_is_not_symplectic_fails(capsys):
    assert main(["modified", "henon-heiles", "runge-kutta-4", "--order", "5"]) == 1
    shown = capsys.readouterr().out
    assert "f₁[x₁]" in shown and "the steps follow no such Hamiltonian" in shown
    assert main(["modified", "pendulum", "average-vector-field", "--order", "2"]) == 1
    assert "the steps follow no such Hamiltonian" in capsys.readouterr().out


@pytest.mark.parametrize(("words", "said"), [
    ("pendulum", "say one rule"),
    ("pendulum midpoint --rule midpoint", "say one rule"),
    ("pendulum midpoint --order 0", "--order is"),
    ("pendulum midpoint --order 13", "--order is"),
    ("pendulum gauss-2 --order 3", "begins with h^4, so ask for --order 4 or more"),
    ("pendulum midpoints", "did you mean midpoint?"),
    ("cartesian-pendulum midpoint", "has constraints"),
    ("damped-pendulum midpoint", "has a force"),
    ("rigid-body implicit-midpoint", "has no discrete Lagrangian"),
])  # fmt: skip
def test_what_cannot_be_asked_is_said_in_a_sentence(words, said, capsys):
    assert main(["modified", *words.split()]) == 2
    error = capsys.readouterr().err
    assert said in error and error.count("\n") == 1


@pytest.mark.parametrize(("at", "verdict"), [
    ("1/2", "pass"), (0.5 + 1e-16, "pass"), ("1/2 + 1e-7", "fail"),
    ("1/2 + exp(-((x - 1/2)*40)**2)/20", "fail"),
])  # fmt: skip
def test_a_small_term_below_the_order_is_caught(at, verdict):
    """However small beside the energy's band, or narrow, but for the last bit of a float."""

    @rules.discretisation(order=2)
    def beside_the_middle(L, G, x, u, h):
        return h * L(G.target(x, u, sympify(at, {"x": x[0]}) * h), u)

    answer = judge(kept(Scheme(scenes.get("pendulum"), beside_the_middle), 2))
    assert answer.verdict == verdict
    assert ("H_2 is not 0" in answer.reason) == (verdict == "fail")


def test_a_wrong_term_is_caught(monkeypatch):
    """H₃ that is a hundredth too large, and the H̃ of another rule."""
    right = ModifiedEquation.hamiltonian
    scheme = Scheme(scenes.get("pendulum"), rules.get("midpoint"))
    assert judge(kept(scheme, 2)).verdict == "pass"

    def wrong(self, z):
        H = right(self, z)
        H[2] *= 1.01
        return H

    monkeypatch.setattr(ModifiedEquation, "hamiltonian", wrong)
    told = judge(kept(scheme, 2))
    assert told.verdict == "fail" and "changes along runs as h^2" in told.reason

    other = Scheme(scenes.get("pendulum"), rules.get("trapezoidal")).modified_equation(2)
    monkeypatch.setattr(ModifiedEquation, "hamiltonian", lambda self, z: right(other, z))
    assert judge(kept(scheme, 2)).verdict == "fail"


#: half an orbit ends opposite to its start, with the centre on the straight way
HALF = scenes.get("kepler").with_values(x0=[1, 0], v0=[0, "9/10"], step="16/100")
#: velocities are below 1, and some of the states beside the motion would be faster
BOUNDED = Scene(
    "bounded", pair(1), lambda x, v, p: -sqrt(1 - v[0] ** 2) - x[0] ** 2 / 2,
    x0=[0], v0=["0.9"], duration=10, step="1/20",
)  # fmt: skip


@pytest.mark.parametrize(("scene", "rule"), [(HALF, "stoermer-verlet"), (BOUNDED, "midpoint")])
def test_states_and_ways_go_round_what_the_motion_does_not_reach(scene, rule):
    """A singularity between two states, and states outside the domain of a scene."""
    told = judge(kept(Scheme(scene, rules.get(rule)), 2))
    assert told.verdict == "pass", told.reason


def test_a_rule_that_declares_a_higher_order_fails(monkeypatch):
    scheme = Scheme(scenes.get("pendulum"), rules.get("midpoint"))
    monkeypatch.setattr(Scheme, "order", 4)
    told = judge(kept(scheme, 4))
    assert told.verdict == "fail" and "changes along runs as h^2.00" in told.reason
    assert "a method of order 4 leaves h^4" in told.reason


#: every kind of groupoid, rules with stages and compositions, to the stated order
SCENES = [
    ("kepler", "lobatto-3", 6), ("double-pendulum", "trapezoidal", 4),
    ("henon-heiles", "triple-jump:trapezoidal", 6), ("rigid-body", "rectangle", 4),
    ("heavy-top", "midpoint", 4), ("spherical-pendulum", "trapezoidal", 4),
    ("rotor-body", "midpoint", 3), ("reduced-kepler", "gauss-2", 6), ("wong", "trapezoidal", 2),
    ("outer-solar-system", "midpoint", 2), ("charged-particle", "midpoint", 4),
]  # fmt: skip


@slow
@pytest.mark.parametrize(("scene", "rule", "order"), SCENES)
def test_every_claim_holds_to_the_stated_order(scene, rule, order):
    told = judge(kept(Scheme(scenes.get(scene), rules.get(rule)), order, 16))
    assert told.verdict == "pass", told.reason


def test_terms_that_take_too_long_are_named_with_the_way_to_their_numbers(monkeypatch, capsys):
    monkeypatch.setattr("discmech.integrators.extensions.expansions.laurent.MOST_SECONDS", -1.0)
    assert main(["modified", "pendulum", "midpoint", "--order", "2"]) == 0
    assert "scheme.modified_equation(2).hamiltonian(z)" in capsys.readouterr().out
