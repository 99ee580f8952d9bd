"""What a user meets in passing: where a root stands, what was left out, names of one rule."""

import json
import math

import pytest

from discmech import Scene, midpoint, pair
from discmech.integrators import rules as discretisations
from discmech.integrators import scenes
from discmech.studies import check, get
from discmech.studies.command import main
from discmech.studies.core.case import Case, Choice
from discmech.studies.core.lookup import rules
from discmech.studies.core.outcome import Verdict, worst
from discmech.studies.core.result import result_of
from discmech.studies.core.running import _dropped
from discmech.studies.core.study import every_study
from discmech.studies.report import tables
from tests.studies.as_json import run_case

ROUGH = """
import sympy
from discmech import Scene, discretisation, pair


@discretisation(order=2)
def rooted(L, G, x, u, h):
    size = sympy.sqrt(u[0] ** 2)
    return h * L(G.target(x, u, h / 2), u) + h**3 * size


@discretisation(order=2)
def signed(L, G, x, u, h):
    return h * abs(L(x, u))


named = discretisation(order=2, name="by-its-name")(
    lambda L, G, x, u, h: h * L(G.target(x, u, h / 2), u)
)
bump = Scene(name="bump", groupoid=pair(1), x0=["1"], v0=["0"], duration=1,
             lagrangian=lambda x, v, p: v[0]**2/2 - abs(x[0])**3)
"""


@pytest.fixture
def rough(tmp_path):
    file = tmp_path / "rough.py"
    file.write_text(ROUGH, encoding="utf-8")
    return str(file)


@pytest.mark.parametrize(("words", "wanted"), [
    ("pendulum --rule {}:rooted", "rough.py, line 8: the rule rooted holds Abs"),
    ("pendulum --rule {}:signed", "rough.py, line 14: the rule signed holds Abs"),
    ("pendulum --rule suzuki:{}:rooted", "rough.py, line 8: the rule rooted holds Abs"),
    ("{}:bump --rule midpoint", "rough.py, line 21: the Lagrangian of bump holds Abs"),
])  # fmt: skip
def test_a_root_that_has_no_derivative_is_named_with_its_line(words, wanted, rough, ask):
    code, _, said = ask("run", *words.format(rough).split())
    assert code == 2 and wanted in said


def test_a_rule_is_found_by_its_variable_and_by_its_name(rough):
    found = {rules([f"{rough}:{word}"]) for word in ("named", "by-its-name", "by_its_name")}
    assert len(found) == 1


def test_the_order_study_says_which_rules_it_leaves_out_at_16_digits():
    study, high = get("order"), rules(["midpoint", "gauss-3"])
    assert study.notes(Choice(rules=high))[0].startswith(
        "gauss-3: with an order above 4, 16 digits are left"
    )
    assert not study.notes(Choice(rules=high, digits=(16,))) and not study.notes(Choice())


def test_a_rule_that_a_study_drops_is_said():
    notes = check("order", ["pendulum"], ["imex", "rectangle"], [16], steps=16)["notes"]
    assert "imex is left out of order: it needs a scene that names a fast potential." in notes
    race, choice = get("work-precision"), Choice(
        scenes=(scenes.get("pendulum"),), rules=rules(["midpoint", "trapezoidal"])
    )  # fmt: skip
    assert not _dropped(race, choice, list(race.cases(choice)))


def test_a_band_that_resolves_nothing_is_called_so():
    for band, words in (
        (1.38, "oscillates by 1.38 (too wide to be resolved)"),
        (1e-3, "oscillates by 10⁻³"),
    ):
        assert tables.short(result_of("energy", {"measured": {"band": band}})) == words
    forced = {"measured": {"band": 1e-3, "balance_order": 2.0}}
    assert tables.short(result_of("energy", forced)) == "less its work, oscillates by 10⁻³"


@pytest.mark.slow
@pytest.mark.parametrize("digits", [16, 50])
def test_a_scene_at_rest_at_the_origin_is_exact(digits):
    """All of its numbers are 0, which no error is a part of: single steps beside it decide."""
    rest = Scene("at-rest", pair(1), lambda x, v, p: v[0] ** 2 / 2, x0=[0], v0=[0], duration=1)
    found = run_case(get("order"), Case("order", rest, discretisations.get("midpoint"), digits))
    assert found["verdict"] == "pass" and "exact on this scene" in found["reason"]
    assert found["measured"]["order"] is None and {r["error"] for r in found["rows"]} == {0}


def test_the_short_form_of_a_program_is_its_defect_and_not_the_resolution():
    measured = {"pullback": None, "poisson": 3e-16, "certain": 0.0, "resolution": 1e-12,
                "residual": 0.0}  # fmt: skip
    assert tables.short(result_of("symplecticity", {"measured": measured})) == "3.0×10⁻¹⁶"
    measured["residual"] = 1e-3
    assert tables.short(result_of("symplecticity", {"measured": measured})) == "residual 10⁻³"
    assert tables.short(result_of("symplecticity", {"measured": dict.fromkeys(measured)})) == "—"


@pytest.mark.parametrize("study", ["symplecticity", "reversibility"])
def test_the_expectation_of_a_program_is_said_in_words(study):
    asked = {"resolved": 1e-9, "left": 0.05}
    words = tables.wanted(result_of(study, {"expected": asked}))
    assert words == "no defect, seen to 10⁻⁹ of what other methods of its order leave"


@pytest.mark.parametrize("study", ["symplecticity", "momentum", "energy", "stability"])
def test_a_limit_that_nothing_is_held_to_is_not_shown(study):
    """A pass with a drift of 0.1 stood beside a limit of 10⁻¹⁴."""
    free = {"limit": 1e-14, "not_demanded": "it claims to keep none of them: measured only"}
    assert tables.wanted(result_of(study, {"expected": free})) == "only measured"
    some = {"expected": free | {"demanded": ["residual"]}}
    assert tables.wanted(result_of("symplecticity", some)) == "≤ 10⁻¹⁴ of residual alone"


def test_a_step_back_that_ends_at_no_number_is_not_passed(monkeypatch):
    from discmech.studies.reversibility import measuring

    monkeypatch.setattr(measuring, "return_defect", lambda *given: math.nan)
    monkeypatch.setattr(measuring, "single_steps", lambda *given: None)
    case = Case("reversibility", scenes.get("pendulum"), midpoint, 16, 4)
    assert run_case(every_study()["reversibility"], case, causes=False)["verdict"] == "fail"


def test_what_nothing_is_demanded_of_is_measured_and_no_pass(capsys, tmp_path):
    """A Runge-Kutta step without claims once passed the study of the form, 4.8e-3 off."""
    file = tmp_path / "euler.py"
    file.write_text(
        "from discmech import black_box\n\n\n@black_box()\ndef euler(q, p, h, system):\n"
        "    return q + h * system.velocity(q, p), p - h * system.gradient(q, p)\n"
    )
    assert main(["symplecticity", "harmonic", "--rule", f"{file}:euler", "--json", "-"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert [found["verdict"], found["cases"][0]["verdict"]] == ["measured"] * 2
    free = Verdict("pass", expected={"not_demanded": "no claim"})
    assert free.settled().verdict == "measured"
    assert free.expecting(demanded=["volume"]).settled().verdict == "pass"
    assert Verdict("fail", expected=free.expected).settled().verdict == "fail"
    assert [worst(words) for words in (["measured"], ["measured", "pass"], ["fail", "measured"])
            ] == ["measured", "pass", "fail"]  # fmt: skip


@pytest.mark.parametrize("study", ["order", "optimality", "steps"])
def test_a_rule_that_declares_no_order_is_only_measured(study):
    case = {"study": study, "expected": {"order": None, "tolerance": 0.05}, "measured": {}}
    assert tables.wanted(result_of(study, case)) == "only measured"
    case["expected"]["order"] = 2
    assert "2" in tables.wanted(result_of(study, case))
